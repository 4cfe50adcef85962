"""`python -m gallery`: build the pages, and list what changed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from gallery.building import ANY, RESULTS, build_all, changes
from gallery.entries import ENTRIES, NUMBERS
from gallery.pages import INDEX, index_page


def main(
    only: Annotated[
        list[str] | None, typer.Option("--only", help="Number or name of an entry; may be given several times.")
    ] = None,
    out: Annotated[Path, typer.Option("--out", help="Folder of the gallery.")] = Path("out/gallery"),
    processes: Annotated[int, typer.Option("--processes", min=1, help="Entries that are built at once.")] = 2,
    accept: Annotated[bool, typer.Option("--accept", help="Write what was found down as the new results.")] = False,
) -> None:
    """Build the gallery; exit code 1 where words, verdicts or claims changed; costs and durations are only listed."""
    known_by = {text: entry.name for entry in ENTRIES for text in (entry.name, NUMBERS[entry.name])}
    if unknown := [text for text in only or () if text not in known_by]:
        raise typer.BadParameter(f"no entry is called {', '.join(unknown)}; there are {', '.join(known_by)}.")
    chosen = {known_by[text] for text in only or known_by}
    names = tuple(entry.name for entry in ENTRIES if entry.name in chosen)
    known = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}
    found = build_all(names, out, processes)
    changed = changes(known, found)
    for line in changed:
        typer.echo(line)
    typer.echo(f"{len(found)} pages in {out}; {len(changed)} figures changed")
    if accept:
        both = {**known, **found}
        listed = {entry.name: both[entry.name] for entry in ENTRIES if entry.name in both}
        RESULTS.write_text(json.dumps(listed, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
        if len(listed) == len(ENTRIES):
            INDEX.write_text(index_page(listed), encoding="utf-8")
    elif changes(known, found, ANY):
        raise typer.Exit(1)


if __name__ == "__main__":
    app = typer.Typer(pretty_exceptions_enable=False)
    app.command()(main)
    app()
