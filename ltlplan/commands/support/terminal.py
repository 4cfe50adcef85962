"""Output that all commands share: errors, JSON."""

from __future__ import annotations

import json
import os
import sys
import traceback
from pathlib import Path

from verify.data.errors import BadInput, InternalError, LtlplanError


def print_json(data: object) -> None:
    """Print one JSON document on standard output."""
    sys.stdout.write(json.dumps(data, indent=1, allow_nan=False) + "\n")


_DESKTOP = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
"""Of these one is set where pages can be opened on Linux."""


def open_page(page: Path) -> None:
    """Open a page on the desktop; where there is none, as on a server, say so on standard error."""
    import typer

    if sys.platform == "linux" and not any(os.environ.get(name) for name in _DESKTOP):
        typer.echo(f"There is no desktop here to open it on; take {page} to one.", err=True)
    else:
        typer.launch(str(page.absolute()))


def report(error: Exception, *, as_json: bool) -> int:
    """Tell an error in its own way, a bug of ours alone with a traceback; return the exit code."""
    if isinstance(error, LtlplanError):
        return _report_error(error, as_json=as_json)
    if isinstance(error, OSError):
        return _report_os_error(error, as_json=as_json)
    if hasattr(error, "format_message"):
        return _report_usage(error, as_json=as_json)
    return _report_bug(error)


def _report_error(error: LtlplanError, *, as_json: bool) -> int:
    """Tell a user's mistake or an honest refusal, without a traceback; return the exit code."""
    return _report(type(error).__name__, kind(error.exit_code), str(error), error.exit_code, as_json=as_json)


def _report_os_error(error: OSError, *, as_json: bool) -> int:
    """Return what the system refused, such as a full disk; return the exit code."""
    what = f"{error.filename}" if error.filename else "The output"
    sentence = f"{what} cannot be read or written: {error.strerror or error}."
    close_output()
    return _report(type(error).__name__, "bad input", sentence, BadInput.exit_code, as_json=as_json and bool(error.filename))


def _report_usage(error: Exception, *, as_json: bool) -> int:
    """Return what is wrong with the command's words (an error of typer's); return the exit code."""
    code = getattr(error, "exit_code", BadInput.exit_code)
    if as_json:
        return _report("BadInput", "bad input", error.format_message(), code, as_json=True)  # type: ignore[attr-defined]
    error.show()  # type: ignore[attr-defined]
    return code


def _report_bug(error: Exception) -> int:
    """Tell a bug of ours, with its traceback; return the exit code."""
    traceback.print_exception(error, file=sys.stderr)
    sys.stderr.write(f"This is a bug of ltlplan ({type(error).__name__}); please report it with the text above.\n")
    return InternalError.exit_code


def close_output() -> None:
    """Let go of an output that cannot be written, so that Python does not try again, and complain, at its end."""
    sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123, SIM115  # for the rest of the process


def _report(name: str, kind: str, sentence: str, code: int, *, as_json: bool) -> int:
    if as_json:
        print_json({"error": name, "exit_code": code, "message": sentence})
    else:
        sys.stderr.write(f"{kind}: {sentence}\n")
    return code


def kind(exit_code: int) -> str:
    """Return what an exit code means, in words."""
    return {
        1: "bug of ours",
        2: "bad input",
        3: "unsatisfiable",
        4: "no trajectory found",
        5: "not certified",
        6: "does not fit the vehicle",
    }.get(exit_code, "error")
