"""What a run leaves behind when it is interrupted, killed, piped into `head`, or has nowhere to write."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from verify.data import BadInput
from verify.data.folders import write_folder

ROOT = Path(__file__).parents[2]
SLOW_WRITER = """
import sys, time
from pathlib import Path
from ltlplan.cli import _end_cleanly_on_sigterm
from verify.data.folders import write_folder
_end_cleanly_on_sigterm()
def write(folder):
    (folder / "mission.yaml").write_text("half")
    print("writing", flush=True)
    time.sleep(60)
write_folder(Path(sys.argv[1]), write)
"""


def write_mark(folder: Path) -> None:
    (folder / "mission.yaml").write_text("whole")


def start(target: Path) -> subprocess.Popen[str]:
    """Return a process that is in the middle of writing `target`."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    writer = subprocess.Popen(
        [sys.executable, "-c", SLOW_WRITER, str(target)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
    )
    assert writer.stdout is not None
    assert writer.stdout.readline() == "writing\n"
    return writer


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_writer_clears_up(how: signal.Signals, tmp_path: Path) -> None:
    writer = start(tmp_path / "run")
    writer.send_signal(how)
    writer.communicate(timeout=60)
    assert writer.returncode != 0
    assert list(tmp_path.iterdir()) == []


def test_the_next_writer_clears_up_after_a_killed_one_and_leaves_a_living_one_alone(tmp_path: Path) -> None:
    killed, living = start(tmp_path / "run"), start(tmp_path / "run")
    try:
        killed.kill()
        killed.communicate(timeout=60)
        assert len(list(tmp_path.iterdir())) == 2, "each writes beside the target"
        assert write_folder(tmp_path / "run", write_mark) == (
            tmp_path / "run" / "mission.yaml",
            tmp_path / "run" / "manifest.json",
        )
        assert len([path for path in tmp_path.iterdir() if path.name != "run"]) == 1, "only the dead one's is gone"
        assert living.poll() is None
    finally:
        living.terminate()
        living.communicate(timeout=60)
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def test_a_folder_that_a_killed_writer_had_moved_away_comes_back(tmp_path: Path) -> None:
    left = tmp_path / ".run.ltlplan-abc"
    (left / "old").mkdir(parents=True)
    (left / "lock").touch()
    (left / "old" / "mission.yaml").write_text("the last run")
    (left / "old" / "notes.txt").write_text("mine")

    def fail(_folder: Path) -> None:
        raise BadInput("no")

    with pytest.raises(BadInput, match="no"):
        write_folder(tmp_path / "run", fail)
    assert (tmp_path / "run" / "mission.yaml").read_text() == "the last run"
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def ltlplan(*arguments: str, cwd: Path, **options: object) -> subprocess.Popen[str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.Popen([sys.executable, "-m", "ltlplan.cli", *arguments], cwd=cwd, env=environment, text=True, **options)  # type: ignore[call-overload]


@pytest.mark.parametrize("delay", [0.0, 0.1, 0.38, 0.6])
def test_ctrl_c_is_no_bug(delay: float, tmp_path: Path) -> None:
    """Neither in the work nor while a library is being loaded, which may make of it an ImportError or a death by signal."""
    running = ltlplan("run", "firefighting", cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert running.stderr is not None
    assert "searching" in running.stderr.readline()
    time.sleep(delay)
    running.send_signal(signal.SIGINT)
    _, said = running.communicate(timeout=60)
    assert running.returncode == 130
    assert said.endswith("interrupted; no file was left half-written.\n")
    assert "Traceback" not in said
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


@pytest.mark.parametrize("arguments", [("automaton", "F a"), ("plan", "nowhere", "--json"), ("check", "G !b", "b")])
def test_a_reader_that_has_gone(arguments: tuple[str, ...], tmp_path: Path) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    running = ltlplan(*arguments, cwd=tmp_path, stdout=writing, stderr=subprocess.PIPE)
    os.close(writing)
    _, said = running.communicate(timeout=60)
    assert (running.returncode, said) == (141, "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full, a disk without room")
def test_an_output_without_room(tmp_path: Path) -> None:
    with Path("/dev/full").open("w") as full:
        running = ltlplan("automaton", "F a", "--json", cwd=tmp_path, stdout=full, stderr=subprocess.PIPE)
        _, said = running.communicate(timeout=60)
    assert (running.returncode, said) == (2, "bad input: The output cannot be read or written: No space left on device.\n")
