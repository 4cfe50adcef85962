"""Processes that are asked: what they end of by themselves is theirs, a kill from outside is tried again and then said."""

from __future__ import annotations

import signal
import sys
from pathlib import Path

import pytest

from verify.data import InternalError
from verify.data.helper_process import TRIES, ask_process

_KILLED = """
import os, pathlib, sys
place = pathlib.Path(sys.argv[1])
place.write_text(place.read_text() + "x")
if len(place.read_text()) <= int(sys.argv[2]):
    os.kill(os.getpid(), int(sys.argv[3]))
sys.stdout.write(sys.stdin.read() + " answered")
"""


def asked(place: Path, deaths: int, by: int) -> tuple[int, bytes]:
    place.write_text("")
    done = ask_process([sys.executable, "-I", "-c", _KILLED, str(place), str(deaths), str(int(by))], b"question", seconds=600)
    return done.returncode, done.stdout


@pytest.mark.parametrize("by", [signal.SIGKILL, signal.SIGTERM])
def test_a_process_that_is_killed_is_asked_again(tmp_path: Path, by: int) -> None:
    assert asked(tmp_path / "starts", TRIES - 1, by) == (0, b"question answered")
    with pytest.raises(InternalError, match="ended from outside 3 times"):
        asked(tmp_path / "starts", TRIES, by)
    assert (tmp_path / "starts").read_text() == "x" * TRIES


def test_a_process_that_ends_by_its_own_limit_is_not_asked_again(tmp_path: Path) -> None:
    assert asked(tmp_path / "starts", TRIES, signal.SIGXCPU) == (-signal.SIGXCPU, b"")
    assert (tmp_path / "starts").read_text() == "x"
