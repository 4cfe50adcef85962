"""Benchmarks as commands: with arguments of one's own, or each at its smallest size, as the slow tests run them all."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from importlib.util import find_spec

SMALLEST = "--smallest"
"""The option that every benchmark takes."""
LEFT_OUT = "left out: "
"""How a line begins that names a peer which is not installed."""

_small = False


def run_benchmark(main: Callable[[], int | None], *smallest: Sequence[str]) -> None:
    """Run a benchmark with the arguments of the command line, or with `--smallest` once for each of its smallest sizes.

    Args:
        main: The benchmark; it reads `sys.argv`. What it returns is the exit code.
        smallest: Arguments of each of its smallest sizes, so that all that it measures is run once.
    """
    global _small  # for the whole of a process that runs one benchmark
    if SMALLEST not in sys.argv[1:]:
        sys.exit(main())
    _small = True
    for arguments in smallest or ((),):
        sys.argv[1:] = arguments
        if code := main():
            sys.exit(code)


def is_smallest() -> bool:
    """Tell whether this process runs a benchmark at its smallest size."""
    return _small


def require_time(seconds: float, most: float) -> None:
    """Refuse a time, or what is computed from times, above what is asked; not at the smallest size, which says nothing of times.

    Args:
        seconds: As it was measured.
        most: As it is asked.
    """
    assert _small or seconds <= most, f"{seconds:g} where at most {most:g} is asked"


def installed(module: str, package: str) -> bool:
    """Tell whether a peer is installed, and print a line where it is left out.

    Args:
        module: What is imported.
        package: Its name on the package index.
    """
    if find_spec(module) is not None:
        return True
    print(f"{LEFT_OUT}{package} is not installed", flush=True)
    return False
