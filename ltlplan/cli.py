"""The command line: parse, call the same functions as the library, show the result.

`ltlplan.start` calls it and ends the process. Each command is a module of `ltlplan/commands` of its name, loaded when that command
is asked for, so that `--help` is quick and choices are read from the registries by those who offer them. Exit codes come from the
exception classes in `verify.data.errors`; a user's mistake is a sentence, not a traceback.
"""

from __future__ import annotations

from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

import ltlplan
from ltlplan.commands.support.old_spellings import spelled_now

COMMANDS = {
    "run": "Plan, refine, certify, fly in simulation and export a mission.",
    "batch": "Run every mission of a folder, each into a folder of its own.",
    "plan": "Plan a mission: each robot's word, visits and cost.",
    "certify": "Prove a folder's trajectories, or check a recorded flight.",
    "recheck": "Prove a folder's certificate again, from its files alone.",
    "audit": "Check, for all times, flights that others planned.",
    "fly": "Fly a certified mission once: in simulation, or live over a link.",
    "campaign": "Fly a certified mission many times in simulation.",
    "rehearse": "Fly it by several controllers, in combinations of conditions.",
    "identify": "Tell a vehicle's thrust, drag and latency from a recorded flight.",
    "online": "Reassign tasks in flight: in simulation, or certified over a link.",
    "export": "Write a certified flight for a real vehicle.",
    "show": "Draw hoops, primitives, sampled and optimised paths.",
    "automaton": "Show a formula's automaton, or a mission's systems.",
    "check": "Check words of a robot or a team against a formula.",
    "serve": "Serve planning over HTTP, with a page for the browser.",
    "submit": "Submit a mission to a service, and wait for it.",
    "accounts": "List and change accounts of the service; who did what.",
    "backup": "Back up a service's data, while it runs.",
    "restore": "Restore a service's data from a backup.",
    "reproduce": "Compute both papers, and published problems, anew.",
    "doctor": "Say what is installed, what is missing, and which links answer.",
    "missions": "List the shipped missions, show one, or start your own.",
}
"""Each command with a sentence for the list; its own help is the docstring of its function."""


class _Commands(TyperGroup):
    """The commands, of which one is loaded."""

    # context and command are of typer's own types, which differ between its versions
    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
        """Load the command that is asked for; take old spellings, with a note."""
        args, note = spelled_now(args)
        if note is not None and not ctx.resilient_parsing:
            typer.echo(f"note: {note}", err=True)
        if args and args[0] in COMMANDS:
            self.commands[args[0]] = load(args[0])
        return super().resolve_command(ctx, args)


def load(name: str) -> Any:  # a command of typer's own type
    """Return a command with its options."""
    alone = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)
    alone.command(name, short_help=COMMANDS[name])(import_module(f"ltlplan.commands.{name}").command)
    return typer.main.get_command(alone)


app = typer.Typer(name="ltlplan", cls=_Commands, no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode=None)
for _name, _sentence in COMMANDS.items():
    app.command(_name, short_help=_sentence)(lambda: None)


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
