"""`ltlplan doctor`: what is installed, what each missing extra would add, which engines work, and who answers on links."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING

import typer

from ltlplan.commands.support.options import JsonOption

if TYPE_CHECKING:
    from ltlplan.commands.support.installation import Library, Probe


def command(json: JsonOption = False) -> None:
    """Say what is installed, what each missing extra would add, whether planning works, and which links answer."""
    import ltlplan
    from ltlplan.commands.support import installation
    from ltlplan.commands.support.terminal import print_json
    from verify.data import MissingEngine

    core = installation.libraries()
    extras = {} if core is None else {name: installation.libraries(name) or () for name in installation.EXTRAS}
    engines, links = installation.engines(), installation.links()
    faults = [str(item) for item in core or () if item.state != "ok"]
    faults += [f"{probe.name}: {probe.sentence}" for probe in engines if not probe.answers]
    if json:
        print_json(
            {
                "version": ltlplan.__version__,
                "machine": installation.machine(),
                "core": [{**asdict(item), "state": item.state} for item in core or ()],
                "extras": {name: [{**asdict(item), "state": item.state} for item in items] for name, items in extras.items()},
                "engines": [asdict(probe) for probe in engines],
                "links": [asdict(probe) for probe in links],
                "faults": faults,
            }
        )
    else:
        for line in _lines(core, extras, engines, links):
            typer.echo(line)
    if faults:
        if json:
            raise typer.Exit(MissingEngine.exit_code)
        raise MissingEngine(f"{'; '.join(faults)}. Install ltlplan again: pip install ltlplan")


def _lines(
    core: Sequence[Library] | None, extras: Mapping[str, Sequence[Library]], engines: Sequence[Probe], links: Sequence[Probe]
) -> Iterator[str]:
    """Yield what was found, a line for each thing."""
    import ltlplan
    from ltlplan.commands.support import installation

    yield f"ltlplan     {ltlplan.__version__}; {installation.machine()}"
    if core is None:
        yield "libraries   not known: ltlplan runs from its sources and is not installed; pip install ."
    else:
        yield f"libraries   {', '.join(str(item) for item in core)}"
    for probe in engines:
        yield f"{probe.name:<11} {probe.sentence}" if probe.answers else f"{probe.name:<11} DOES NOT WORK: {probe.sentence}"
    for number, (name, items) in enumerate(extras.items()):
        absent = ", ".join(str(item) for item in items if item.state != "ok")
        found = f"{absent}; pip install 'ltlplan[{name}]' to" if absent else "installed:"
        yield f"{'' if number else 'extras':<11} {name:<10} {found} {installation.EXTRAS[name]}"
    for number, probe in enumerate(links):
        yield f"{'' if number else 'links':<11} {probe.name}: {probe.sentence}"
