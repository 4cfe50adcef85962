"""What every command shows in the same way: progress, errors, JSON."""

from __future__ import annotations

import json
import re
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from verify.data.errors import LtlplanError

Progress = Callable[[str, float], None]

ISSUES = "the project's issue tracker"


@contextmanager
def progress_bar(*, quiet: bool) -> Iterator[Progress]:
    """Show a live bar on standard error; yields the function that moves it (sentence, share 0 to 1)."""
    if quiet:
        yield lambda _sentence, _share: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(bar_width=24), TimeElapsedColumn())
    with Bar(*columns, console=console, transient=True) as bar:
        task = bar.add_task("starting", total=1.0)
        printed: set[str] = set()

        def move(sentence: str, share: float) -> None:
            kind = re.sub(r"[0-9.]+", "", sentence)  # a counter in it makes no new line
            if not console.is_terminal and kind not in printed:
                printed.add(kind)
                console.print(f"[{share:4.0%}] {sentence}", markup=False, highlight=False)
            bar.update(task, description=f"{sentence:<44.44}", completed=min(max(share, 0.0), 1.0))

        yield move


def print_json(data: Any) -> None:
    """Print one JSON document on standard output."""
    sys.stdout.write(json.dumps(data, indent=1, allow_nan=False) + "\n")


def report_error(error: LtlplanError, *, as_json: bool) -> None:
    """Tell a user's mistake or an honest refusal, without a traceback."""
    if as_json:
        print_json({"error": type(error).__name__, "exit_code": error.exit_code, "message": str(error)})
    else:
        sys.stderr.write(f"{_kind(error)}: {error}\n")


def report_bug(error: Exception) -> None:
    """Tell a bug of ours, with its traceback."""
    traceback.print_exception(error, file=sys.stderr)
    sys.stderr.write(f"This is a bug of ltlplan ({type(error).__name__}); please report it with the text above.\n")


def _kind(error: LtlplanError) -> str:
    return {
        1: "bug of ours",
        2: "bad input",
        3: "unsatisfiable",
        4: "no feasible trajectory",
        5: "not certified",
        6: "does not fit the vehicle",
    }.get(error.exit_code, "error")
