"""A question to a process of our own that bounds itself: what it ends of by itself is its answer, a kill from outside is none."""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Mapping, Sequence

from verify.data.errors import InternalError

TRIES = 3
"""How often a process that is killed from outside is started."""


def ask_process(
    command: Sequence[str], question: bytes, *, environment: Mapping[str, str] | None = None, seconds: float | None = None
) -> subprocess.CompletedProcess[bytes]:
    """Return how a process ended and what it answered. It is started again where somebody else has killed it.

    Args:
        command: Program and arguments. It must not end by SIGKILL or SIGTERM of its own limits.
        question: What its standard input gives.
        environment: Its variables; those of this process by default.
        seconds: s on the clock that it may take each time.

    Raises:
        InternalError: It was killed each time.
        subprocess.TimeoutExpired: It took longer.
    """
    for _ in range(TRIES):
        done = subprocess.run(command, input=question, env=environment, capture_output=True, timeout=seconds, check=False)
        if done.returncode not in (-signal.SIGKILL, -signal.SIGTERM):
            return done
    raise InternalError(f"A helper process was ended from outside {TRIES} times ({command[-1]}); repeat this.")
