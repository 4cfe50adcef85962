"""A PostgreSQL server of a test's own, from the system's package; tests that need one are skipped, with the reason, where there is none."""

from __future__ import annotations

import os
import pwd
import shutil
import socket
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.helpers.serving.process_trees import children, command_line

USER = "postgres"


@dataclass(frozen=True)
class Server:
    """A server that is running.

    Attributes:
        folder: Its data.
        port: Where it listens, on the loopback address.
    """

    folder: Path
    port: int

    def url(self, name: str) -> str:
        return f"postgresql://{USER}@127.0.0.1:{self.port}/{name}"

    def create(self, name: str) -> str:
        """Make a database, and return its URL."""
        _run("psql", "-h", "127.0.0.1", "-p", str(self.port), "-U", USER, "-c", f'CREATE DATABASE "{name}"', "postgres")
        return self.url(name)

    def sql(self, name: str, statement: str) -> None:
        _run("psql", "-h", "127.0.0.1", "-p", str(self.port), "-U", USER, "-c", statement, name)

    def with_password(self, password: str) -> str:
        """Have a user who must give a password, and return the name."""
        rules = self.folder / "data" / "pg_hba.conf"
        if "alice" not in rules.read_text():
            rules.write_text(f"host all alice 127.0.0.1/32 scram-sha-256\n{rules.read_text()}")
            self.sql("postgres", f"CREATE ROLE alice SUPERUSER LOGIN PASSWORD '{password}'")
            self.sql("postgres", "SELECT pg_reload_conf()")
        return "alice"

    def backends(self) -> list[int]:
        """Return the processes that answer its clients; a kill of one has all of them end, and the server recover."""
        postmaster = int((self.folder / "data" / "postmaster.pid").read_text().splitlines()[0])
        return [pid for pid in children(postmaster) if "127.0.0.1(" in command_line(pid)]

    def start(self) -> None:
        options = f"-p {self.port} -k {self.folder} -c listen_addresses=127.0.0.1 -c fsync=off"
        _run("pg_ctl", "-D", str(self.folder / "data"), "-l", str(self.folder / "log"), "-w", "-o", options, "start")

    def stop(self) -> None:
        _run("pg_ctl", "-D", str(self.folder / "data"), "-m", "immediate", "-w", "stop")


@contextmanager
def postgres_server() -> Iterator[Server]:
    """Start a server in a folder of its own, and stop it."""
    if _program("initdb") is None:
        pytest.skip("there is no PostgreSQL server (Debian's package `postgresql`)")
    if os.getuid() == 0:
        try:
            pwd.getpwnam(USER)
        except KeyError:
            pytest.skip("PostgreSQL does not run as root, and there is no user `postgres`")
        if shutil.which("runuser") is None:
            pytest.skip("PostgreSQL does not run as root, and there is no `runuser`")
    with tempfile.TemporaryDirectory(prefix="postgres-") as place, socket.socket() as free:
        if os.getuid() == 0:
            shutil.chown(place, USER)
        free.bind(("127.0.0.1", 0))
        server = Server(Path(place), free.getsockname()[1])
        free.close()
        _run("initdb", "-D", f"{place}/data", "-A", "trust", "-U", USER, "-N")
        server.start()
        try:
            yield server
        finally:
            server.stop()


def _program(name: str) -> str | None:
    versions = sorted(Path("/usr/lib/postgresql").glob(f"*/bin/{name}"), key=lambda path: float(path.parts[4]))
    return str(versions[-1]) if versions else shutil.which(name)


def _run(program: str, *arguments: str) -> None:
    as_user = ["runuser", "-u", USER, "--"] if os.getuid() == 0 else []
    done = subprocess.run(
        [*as_user, _program(program) or program, *arguments],
        cwd="/",
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert done.returncode == 0, done.stderr
