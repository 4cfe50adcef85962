"""The command line: parse, call the same functions as the library, show the result.

Each command is a module of `ltlplan/commands`; heavy imports happen inside the commands, so that `--help` is
quick. Exit codes come from the exception classes in `verify.data.errors`.
"""

from __future__ import annotations

import sys

import typer

from ltlplan.commands import automaton, certify, check, export, fly, missions, plan, recheck, run, show

app = typer.Typer(
    name="ltlplan",
    help="From a sentence in temporal logic to certified quadcopter flights.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
app.command("run")(run.command)
app.command("plan")(plan.command)
app.command("certify")(certify.command)
app.command("recheck")(recheck.command)
app.command("fly")(fly.command)
app.command("export")(export.command)
app.command("show")(show.command)
app.command("automaton")(automaton.command)
app.command("check")(check.command)
app.command("missions")(missions.command)


def main() -> None:
    """Run the command line; end with the exit code of the error, if any, and without a traceback for mistakes."""
    try:
        app()
    except Exception as error:  # the outermost door: every error becomes a message and an exit code
        from ltlplan.commands.terminal import report_bug, report_error
        from verify.data.errors import LtlplanError

        if isinstance(error, LtlplanError):
            report_error(error, as_json="--json" in sys.argv)
            sys.exit(error.exit_code)
        report_bug(error)
        sys.exit(1)


if __name__ == "__main__":
    main()
