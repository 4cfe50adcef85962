"""`ltlplan missions`: list the shipped missions, or write a commented one to start from."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import typer

from ltlplan.commands.support.options import JsonOption


def command(
    new: Annotated[str | None, typer.Option("--new", help="Write NAME.yaml, a commented mission to start from.")] = None,
    show: Annotated[str | None, typer.Option("--show", help="Print the file of a shipped mission.")] = None,
    resolved: Annotated[
        str | None,
        typer.Option("--resolved", help="Print a mission as one file, with its rooms and every default written out."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """List the shipped missions."""
    from ltlplan.commands.support.terminal import print_json
    from ltlplan.missions import load_mission, shipped_mission_text, shipped_missions

    if new is not None:
        path = write_template(new)
        if json:
            print_json({"files": [str(path)]})
        else:
            typer.echo(f"wrote {path}; fly it with: ltlplan run {shlex.quote(str(path))}")
        return
    if show is not None:
        text = shipped_mission_text(show)
        if json:
            print_json({"name": show, "text": text})
        else:
            typer.echo(text, nl=False)
        return
    if resolved is not None:
        from verify.data import mission_to_yaml

        whole = load_mission(resolved)
        if json:
            print_json(whole.resolved())
        else:
            typer.echo(mission_to_yaml(whole), nl=False)
        return
    rows = []
    for name in shipped_missions():
        mission = load_mission(name)
        what = mission.spec.formula or mission.sequence or ""
        rows.append({"name": name, "agents": len(mission.agents), "trace": mission.spec.trace, "asks": what})
    if json:
        print_json(rows)
        return
    width = max(len(row["name"]) for row in rows)
    for row in rows:
        robots = "1 robot " if row["agents"] == 1 else f"{row['agents']} robots"
        typer.echo(f"{row['name']:<{width}}  {robots}  {row['trace']:<8}  {row['asks']}")


def write_template(name: str) -> Path:
    """Write NAME.yaml from the template beside the shipped missions.

    Raises:
        BadInput: The name is no name for a mission, or the file exists.
    """
    import re

    from ltlplan.missions import template_text
    from verify.data import BadInput
    from verify.data.storage.file_names import name_fault

    stem = name.removesuffix(".yaml").removesuffix(".yml")
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]*", Path(stem).name):
        raise BadInput(f"'{stem}' cannot name a mission; use letters, digits, '-', '_' and '.'.")
    if (fault := name_fault(Path(stem).name)) is not None:
        raise BadInput(fault)
    path = Path(f"{stem}.yaml")
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(template_text(Path(stem).name))
    except FileExistsError:
        raise BadInput(f"{path} exists already; nothing was written.") from None
    except OSError as error:
        raise BadInput(f"{path} cannot be written: {error.strerror}.") from None
    return path
