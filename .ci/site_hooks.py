"""Hooks of the site's builder: pages that are made from the code, names of files over blocks, links that leave `docs`.

The pages read as plain Markdown too; commands and library are looked up with `--help` and `help()` there.
"""

from __future__ import annotations

import importlib
import inspect
import re
import sys
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files
from typer.testing import CliRunner

DOCS = Path(__file__).resolve().parents[1] / "docs"
sys.path.insert(0, str(DOCS.parent))  # the builder is started by its own script, which does not look there

from gallery.entries import ENTRIES, NUMBERS  # noqa: E402
from gallery.pages import accepted, entry_page  # noqa: E402
from ltlplan.cli import COMMANDS, app  # noqa: E402

GALLERY = DOCS.parent / "out" / "gallery"
"""Where `python -m gallery` puts the pages that play; the site has those that are there."""
PACKAGES = {
    "ltlplan": "After this page you can plan from Python: from a mission to a certified flight.",
    "refine": "After this page you can refine from Python: from waypoints to polynomials within every limit.",
    "verify": "After this page you can check from Python: flights, recordings, words, flights of others.",
    "flight": "After this page you can fly from Python: simulation, campaigns, exports, links.",
}


def on_files(files: Files, config: Any, **_: Any) -> Files:
    """Add the pages that are made from the code."""
    files.append(File.generated(config, "reference/commands.md", content=_commands()))
    for package, sentence in PACKAGES.items():
        files.append(File.generated(config, f"reference/{package}.md", content=_names(package, sentence)))
    found = accepted()
    for entry in ENTRIES:
        folder = GALLERY / f"{NUMBERS[entry.name]}-{entry.name}"
        files.append(File.generated(config, f"gallery/{folder.name}.md", content=entry_page(entry, found[entry.name], folder)))
        for made in folder.glob("*.*") if folder.exists() else ():
            files.append(File.generated(config, f"gallery/{folder.name}/{made.name}", abs_src_path=str(made)))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Return a page as the builder reads it."""
    if page.file.src_uri == "gallery.md":
        for entry in ENTRIES:
            number = NUMBERS[entry.name]
            markdown = markdown.replace(
                f"| {number} | {entry.question} |", f"| {number} | [{entry.question}](gallery/{number}-{entry.name}.md) |"
            )
    titled = re.sub(r"^```(\w+) ([\w./-]+)$", r'```\1 title="\2"', markdown, flags=re.MULTILINE)
    folder = (DOCS / page.file.src_uri).parent
    return re.sub(r"\[([^\]]+)\]\((?!https?:|#|mailto:)([^)#\s]+)(#[^)]*)?\)", lambda link: _inside(link, folder), titled)


def _inside(link: re.Match[str], folder: Path) -> str:
    """Return a link as it is; one that leaves `docs` as the name of the file that the repository has there."""
    target = (folder / link[2]).resolve()
    if target.is_relative_to(DOCS):
        return link[0]
    name = str(target.relative_to(DOCS.parent))
    return f"`{name}`" if link[1].strip("`") == name else f"{link[1]} (`{name}`)"


def _commands() -> str:
    """Return a page with the help of every command."""
    parts = [
        "# Commands",
        "After this page you know each command's options: `ltlplan COMMAND --help` prints them. Those that answer take `--json`.",
    ]
    for name in COMMANDS:
        helped = CliRunner().invoke(app, [name, "--help"], env={"COLUMNS": "100", "TERM": "dumb"}, prog_name="ltlplan")
        parts += [f"## {name}", f"```text\n{helped.output.strip()}\n```"]
    return "\n\n".join(parts) + "\n"


def _names(package: str, sentence: str) -> str:
    """Return a page with every public function and class of a package; numbers and types that only have a name are left out."""
    module = importlib.import_module(package)
    found = [(name, getattr(module, name)) for name in module.__all__]
    described = [(name, value) for name, value in found if inspect.isclass(value) or inspect.isfunction(value)]
    entries = [
        f'::: {value.__module__}.{value.__qualname__}\n    options: {{heading_level: 2, heading: "{package}.{name}", toc_label: "{name}"}}'
        for name, value in described
    ]
    return "\n\n".join([f"# {package}", sentence, *entries]) + "\n"
