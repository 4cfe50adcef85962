"""The command line called often: a process for each call, as a user's shell makes one, but loaded only once.

A server has loaded all that commands need and forks for each call, so that a call takes what its work takes and not the second in
which the libraries are loaded. How a command begins in a fresh interpreter is tested in `test_interruptions` and `test_end_to_end`.
"""

from __future__ import annotations

import json
import os
import select
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol

ROOT = Path(__file__).parents[2]
PATIENCE = 600
"""s."""
_SERVER = """
import gc, json, os, sys
import ltlplan.cli, ltlplan.online.simulated_online_flight, ltlplan.service.execution.forkserver_preload  # a worker's libraries are those of commands
from ltlplan.start import main

gc.freeze()  # what is loaded stays shared
for line in sys.stdin:
    asked = json.loads(line)
    child = os.fork()
    if child:
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
        continue
    os.chdir(asked["cwd"])
    for number, path in enumerate((os.devnull, asked["stdout"], asked["stderr"])):
        stream = os.open(path, os.O_WRONLY if number else os.O_RDONLY)
        os.dup2(stream, number)
        os.close(stream)
    sys.argv[1:] = asked["arguments"]
    main()
"""


class Command(Protocol):
    """A call of the command line."""

    def __call__(self, *arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
        """Run `ltlplan ARGUMENTS` in a folder to its end."""
        ...


@contextmanager
def command_server(scratch: Path) -> Iterator[Command]:
    """Give a way to call the command line; `scratch` is an empty folder for what the calls print."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONWARNINGS": "ignore::DeprecationWarning"}
    server = subprocess.Popen(
        [sys.executable, "-c", _SERVER], env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
    )
    assert server.stdin is not None
    assert server.stdout is not None
    told = {name: scratch / name for name in ("stdout", "stderr")}

    def call(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
        for path in told.values():
            path.write_text("")
        asked = {"arguments": arguments, "cwd": str(cwd), **{name: str(path) for name, path in told.items()}}
        server.stdin.write(json.dumps(asked) + "\n")
        assert select.select([server.stdout], [], [], PATIENCE)[0], f"no answer within {PATIENCE} s: {arguments}"
        code = int(server.stdout.readline())
        return subprocess.CompletedProcess(arguments, code, *(path.read_text(encoding="utf-8") for path in told.values()))

    try:
        yield call
    finally:
        server.stdin.close()
        server.wait(timeout=PATIENCE)
        server.stdout.close()
