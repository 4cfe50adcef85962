"""The unit of docs/how-to/lab-server.md, and what systemd is told."""

from __future__ import annotations

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from ltlplan.service.systemd import Manager

ROOT = Path(__file__).parents[3]
PAGE = ROOT / "docs" / "how-to" / "lab-server.md"


def test_systemd_accepts_the_unit(tmp_path: Path) -> None:
    analyze = shutil.which("systemd-analyze")
    if analyze is None:
        pytest.skip("there is no systemd-analyze (Debian's package `systemd`)")
    (unit,) = re.findall(r"```\n(\[Unit\].*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    place = tmp_path / "ltlplan.service"
    place.write_text(unit.replace("/opt/ltlplan/bin/ltlplan", "/bin/true"))  # it looks whether there is such a program
    done = subprocess.run([analyze, "verify", "--recursive-errors=no", str(place)], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_service_says_that_it_is_ready_alive_and_stops(tmp_path: Path) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as heard:
        heard.bind(str(tmp_path / "notify"))
        heard.settimeout(60.0)
        unit = {"NOTIFY_SOCKET": str(tmp_path / "notify"), "WATCHDOG_USEC": "150000", "PYTHONPATH": str(ROOT)}
        command = [sys.executable, "-m", "ltlplan", "serve", "--data", str(tmp_path / "data"), "--port", "0", "--no-page"]
        serving = subprocess.Popen(command, env={**os.environ, **unit}, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            said = [heard.recv(1000).decode() for _ in range(6)]
            assert f"READY=1\nSTATUS=serves {tmp_path / 'data'}" in said
            assert said.count("WATCHDOG=1") >= 4
            began = time.monotonic()
            assert [heard.recv(1000) for _ in range(10)] == [b"WATCHDOG=1"] * 10
            assert time.monotonic() - began > 0.25
            serving.send_signal(signal.SIGTERM)
            while heard.recv(1000) != b"STOPPING=1":
                pass
            assert serving.wait(60) == 0
        finally:
            serving.kill()
            serving.wait(60)


def test_nobody_is_told_where_no_unit_started_it() -> None:
    environment = {"NOTIFY_SOCKET": "/nowhere", "WATCHDOG_USEC": "1000000", "WATCHDOG_PID": "1", "HOME": "/"}
    manager = Manager.of(environment)
    assert (manager, environment) == (Manager("/nowhere", 0.0), {"HOME": "/"})
    manager.notify("READY=1")
    Manager.of({}).notify("READY=1")
