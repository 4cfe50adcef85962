"""The command line: parse, call the same functions as the library, show the result.

Each command is a module of `ltlplan/commands`; heavy imports happen inside the commands, so that `--help` is
quick. Exit codes come from the exception classes in `verify.data.errors`; a user's mistake is a sentence, not a
traceback.
"""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType
from typing import Annotated

import typer

import ltlplan
from ltlplan.commands import automaton, certify, check, export, fly, missions, plan, recheck, run, show

app = typer.Typer(name="ltlplan", no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode=None)
app.command("run")(run.command)
app.command("plan")(plan.command)
app.command("certify", short_help="Prove a folder's trajectories, or judge a recorded flight.")(certify.command)
app.command("recheck", short_help="Prove a folder's certificate again, from its files alone.")(recheck.command)
app.command("fly", short_help="Fly in simulation: once, a campaign, or sharing tasks online.")(fly.command)
app.command("export", short_help="Write a certified flight for a real vehicle.")(export.command)
app.command("show", short_help="Draw hoops, primitives, sampled and optimised paths.")(show.command)
app.command("automaton", short_help="Show a formula's automaton, or a mission's systems.")(automaton.command)
app.command("check", short_help="Hold words of a robot or a team against a formula.")(check.command)
app.command("missions", short_help="List the shipped missions, show one, or start your own.")(missions.command)

BROKEN_PIPE = 128 + 13
"""Exit code where the reader of our output has gone, as in `ltlplan plan firefighting | head -1`: a shell's for SIGPIPE."""
INTERRUPTED = 128 + 2


def _show_version(asked: bool) -> None:
    if asked:
        typer.echo(f"ltlplan {ltlplan.__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[  # its callback does the work
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """From a sentence in temporal logic to certified quadcopter flights."""


def main() -> None:
    """Run the command line; end with the exit code of the error, if any, and without a traceback for mistakes."""
    _end_cleanly_on_sigterm()
    interrupts = _told_of_interrupts()
    try:
        code = _outcome(as_json="--json" in sys.argv, interrupts=interrupts)
        sys.stdout.flush()
    except BrokenPipeError:
        from ltlplan.commands.terminal import close_output

        close_output()
        code = BROKEN_PIPE
    if code == INTERRUPTED:
        sys.stderr.write("interrupted; no file was left half-written.\n")
        sys.stderr.flush()
        os._exit(INTERRUPTED)  # the interpreter's own end may turn it into a death by signal, if a library was being loaded
    sys.exit(code)


def _outcome(*, as_json: bool, interrupts: list[int]) -> int | str | None:
    """Run the command and return its exit code; errors have been told by then."""
    try:
        code = app(standalone_mode=False)
        sys.stdout.flush()
        return code
    except SystemExit as ended:  # typer's own word for a reader that has gone is 1, which is ours for a bug
        if ended.code == 1 and not any(name.endswith("_COMPLETE") for name in os.environ):
            raise BrokenPipeError from None
        return ended.code
    except BrokenPipeError:
        raise
    except Exception as error:  # the outermost door: every error becomes a message and an exit code
        if interrupts:  # whatever the interrupt became on its way here, such as an ImportError of a library
            return INTERRUPTED
        from ltlplan.commands.terminal import report

        return report(error, as_json=as_json)


def _told_of_interrupts() -> list[int]:
    """Return a list that Ctrl-C will be entered in, besides raising KeyboardInterrupt; where it is ignored it stays ignored."""
    interrupts: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        interrupts.append(number)
        signal.default_int_handler(number, frame)

    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, note)
    return interrupts


def _end_cleanly_on_sigterm() -> None:
    """Let SIGTERM unwind the stack, as Ctrl-C does, so that unfinished folders go; only in this process, not in its workers."""
    mine = os.getpid()

    def end(number: int, _frame: object) -> None:
        if os.getpid() != mine:
            os._exit(128 + number)
        raise SystemExit(128 + number)

    signal.signal(signal.SIGTERM, end)


if __name__ == "__main__":
    main()
