"""`ltlplan reproduce`: both papers and published problems, element by element, computed anew."""

from __future__ import annotations

import json as json_text
from pathlib import Path
from typing import Annotated

import typer

from ltlplan.commands.support.options import JsonOption
from ltlplan.commands.support.processors import processors

FILES = ("reproduction.html", "reproduction.md", "reproduction.json")


def ids_like(incomplete: str) -> list[str]:
    """Return the elements that a shell may complete to."""
    from ltlplan.reproduction.elements import ELEMENTS

    return [element.id for element in ELEMENTS if element.id.startswith(incomplete)]


def command(
    only: Annotated[
        list[str] | None,
        typer.Option(
            "--only",
            help="Element, such as fig-14, or a publication (2019, 2022, published); several times.",
            autocompletion=ids_like,
        ),
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", help="Folder to write (default: out/reproduction).")] = None,
    workers: Annotated[
        int | None, typer.Option("--workers", min=1, help="Processes (default: one for each processor).")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Compute definitions, algorithms, figures, scenarios and numbers of both papers and of published problems anew.

    Each stands beside what was published, with what differs and why, on one page. The exit code is 1 where a quantity left its
    reviewed interval.
    """
    from flight.storage.folders import check_folder, write_files
    from ltlplan.commands.support.progress import progress_bar
    from ltlplan.commands.support.terminal import print_json
    from ltlplan.reproduction.documents import data, lines, markdown, verdict
    from ltlplan.reproduction.elements import chosen
    from ltlplan.reproduction.page import reproduction_html
    from ltlplan.reproduction.running import rerun
    from verify.data import InternalError

    elements = chosen(only or ())
    target = check_folder(out or Path("out") / "reproduction", FILES)
    with progress_bar(quiet=json) as progress:
        found = rerun(elements, workers=workers or processors(), progress=progress)
    whole = data(found)
    texts = (reproduction_html(found), markdown(found), json_text.dumps(whole, indent=1, allow_nan=False) + "\n")
    files = write_files(target, dict(zip(FILES, (text.encode() for text in texts), strict=True)))
    if json:
        print_json({**whole, "files": [str(path) for path in files]})
    else:
        for line in lines(found):
            typer.echo(line)
        typer.echo(f"{verdict(found)} The page is {target / FILES[0]}.")
    if not all(each.fine for each in found):
        raise typer.Exit(InternalError.exit_code)
