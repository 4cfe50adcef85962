"""`ltlplan serve`: what it refuses before it starts, how it stops, and services that need tokens."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
from pathlib import Path

import httpx
import pytest
from typer.testing import CliRunner

import ltlplan
from ltlplan.cli import app
from ltlplan.service.security.tokens import Tokens
from ltlplan.service.storage.data_folder import default_data
from tests.helpers.serving.services import ONE_HOOP, serving, start
from verify.data import BadInput


def refused(*words: str) -> str:
    """Return what the command refuses with."""
    told = CliRunner().invoke(app, ["serve", *words])
    assert isinstance(told.exception, BadInput), told.output
    return str(told.exception)


def test_a_port_that_is_in_use(tmp_path: Path) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        said = refused("--data", str(tmp_path / "data"), "--port", str(port))
    assert said.startswith(f"Port {port} of 127.0.0.1 is in use")


def test_an_address_that_is_not_this_machine_s(tmp_path: Path) -> None:
    assert "192.0.2.1" in refused("--data", str(tmp_path), "--host", "192.0.2.1", "--port", "0")
    assert "--host no such" in refused("--data", str(tmp_path), "--host", "no such", "--port", "0")


def test_a_data_folder_that_cannot_be_one(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    assert "is no folder" in refused("--data", str(tmp_path / "file"))
    assert "cannot be made" in refused("--data", str(tmp_path / "file" / "below"))
    assert "cannot be made" in refused("--data", "/proc/nothing/here")
    assert (tmp_path / "file").read_text() == "mine"


@pytest.mark.slow
def test_a_database_that_cannot_be_used_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "jobs.sqlite").write_text("no database, but long enough to be taken for one " * 20)
    command = [sys.executable, "-m", "ltlplan", "serve", "--port", "0", "--no-page", "--data", str(tmp_path)]
    refused = subprocess.run(command, capture_output=True, text=True, check=False, timeout=240)
    assert refused.returncode == 2
    assert refused.stdout == ""
    assert re.fullmatch(r"bad input: The database .*jobs\.sqlite cannot be used: .*\n", refused.stderr), refused.stderr


def test_a_password_on_the_command_line_is_noted(tmp_path: Path) -> None:
    url = "postgresql://alice:s3cret@127.0.0.1:1/jobs"
    told = CliRunner().invoke(app, ["serve", "--data", str(tmp_path / "data"), "--port", "0", "--no-page", "--db", url])
    assert isinstance(told.exception, BadInput)
    assert "LTLPLAN_DB" in told.stderr
    assert "s3cret" not in f"{told.output}{told.stderr}{told.exception}"


def test_a_network_is_served_with_tokens_only(tmp_path: Path) -> None:
    for words in (("--host", "0.0.0.0"), ("--name", "plan.lab")):
        assert "ltlplan serve --new-token NAME" in refused("--data", str(tmp_path), "--port", "0", *words)


def test_a_token_is_printed_once(tmp_path: Path) -> None:
    made = CliRunner().invoke(app, ["serve", "--data", str(tmp_path), "--new-token", "alice"])
    assert Tokens(tmp_path).owner(made.stdout.strip()) == "alice"
    assert "already" in refused("--data", str(tmp_path), "--new-token", "alice")
    as_json = CliRunner().invoke(app, ["serve", "--data", str(tmp_path), "--revoke-token", "alice", "--json"])
    assert '"names": []' in as_json.stdout
    assert "There is no token" in refused("--data", str(tmp_path), "--revoke-token", "alice")


def test_data_lies_where_programs_keep_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", "/somewhere")
    monkeypatch.setattr(sys, "platform", "linux")
    assert default_data() == Path("/somewhere/ltlplan")


@pytest.mark.slow
def test_a_service_with_tokens_stops_in_order_and_goes_on(tmp_path: Path) -> None:
    token = Tokens(_made(tmp_path / "data")).new("alice")
    process, served = start(tmp_path / "data", names=["plan.lab"])
    with httpx.Client(base_url=served.url, timeout=60) as http:
        assert http.get("/api/jobs").status_code == 401
        assert http.get("/health").json() == {"ok": True}
        assert http.get("/docs").status_code == 200
        assert http.get("/", headers={"accept": "text/html"}).headers["location"] == "/login"
        assert http.post("/login", data={"token": "wrong"}).status_code == 401
        told = http.post("/login", data={"token": token})
        cookie = told.headers["set-cookie"]
        assert told.status_code == 303
        assert {"HttpOnly", "SameSite=strict"} <= set(re.split("; ?", cookie))
        assert token not in cookie
        assert http.get("/api/jobs").status_code == 200
        assert http.post("/api/jobs", content=ONE_HOOP, headers={"origin": "http://evil.example"}).status_code == 403
        assert http.get("/api/jobs", headers={"host": "plan.lab"}).status_code == 200
        assert http.get("/api/jobs", headers={"host": "evil.example"}).status_code == 421
        http.post("/logout")
        http.cookies.clear()
        assert http.get("/api/jobs").status_code == 401
    with ltlplan.Client(served.url, token=token) as client:
        job = client.submit_text(ONE_HOOP)
        second = refused("--data", str(served.data), "--port", "0")
        assert f"is in use by another `ltlplan serve` (process {served.pid})" in second
    process.send_signal(signal.SIGINT)
    assert process.wait(30) == 0
    log = (tmp_path / "data.log").read_text()
    assert token not in log
    assert "Traceback" not in log
    assert all(line.startswith("{") for line in log.splitlines())
    with serving(tmp_path / "data", names=["plan.lab"]) as again, ltlplan.Client(again.url, token=token) as client:
        assert client.job(job.id).wait().state == "done"


def _made(folder: Path) -> Path:
    folder.mkdir(mode=0o700)
    return folder


def test_without_the_extra_it_says_what_to_install(tmp_path: Path) -> None:
    hide = "import sys; sys.modules['fastapi'] = None; sys.argv[1:] = sys.argv[1:]; from ltlplan.start import main; main()"
    told = subprocess.run(
        [sys.executable, "-c", hide, "serve", "--data", str(tmp_path), "--port", "0"],
        capture_output=True,
        text=True,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
    )
    assert told.returncode == 2
    assert "pip install 'ltlplan[service]'" in told.stderr
