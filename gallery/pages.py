"""The gallery as Markdown: the list of all entries with what was found, and a page of each for the site."""

from __future__ import annotations

import html
import json
from collections.abc import Mapping
from itertools import groupby
from pathlib import Path
from typing import Any

import ltlplan.missions
from gallery.building import HERE, RESULTS, Found
from gallery.entries import ENTRIES, NUMBERS, Entry

INDEX = HERE.parent / "docs" / "gallery.md"


def accepted() -> dict[str, Found]:
    """Return the figures of all entries as they were accepted."""
    return json.loads(RESULTS.read_text(encoding="utf-8"))


def index_page(found: Mapping[str, Found]) -> str:
    """Return the list of all entries, as `docs/gallery.md` has it.

    Args:
        found: Figures of all entries.
    """
    lines = [
        "# Gallery",
        "",
        "After this page you have seen what can be asked, and what is answered. `python -m gallery`, from the repository's root, builds every page",
        "with the report that plays, and lists which words, costs and durations changed since they were written down. It computes with",
        "[kernels that all x86-64 processors have](reproduction.md#kernels-and-how-figures-are-held); by those of yours words and verdicts are the same,",
        "costs and durations may be others by a few percent.",
    ]
    for group, entries in groupby(ENTRIES, key=lambda entry: entry.group):
        lines += ["", f"## {group}", "", "| | question | answer | |", "|---|---|---|---|"]
        lines += [
            f"| {NUMBERS[entry.name]} | {entry.question} | {answer(found[entry.name])} | `ltlplan {_shown(entry.commands[-1])}` |"
            for entry in entries
        ]
    return "\n".join(lines) + "\n"


def entry_page(entry: Entry, found: Found, built: Path) -> str:
    """Return the page of an entry.

    Args:
        entry: What is shown.
        found: Its figures.
        built: Its folder in the gallery; what is there is shown.
    """
    number = NUMBERS[entry.name]
    lines = [f"# {number} {entry.question}", "", *([f"*{entry.source}*", ""] if entry.source else [])]
    lines += [
        "```console",
        *(
            f"$ ltlplan {command}" if " " in command else f"# python -m gallery --only {entry.name} writes the folder show"
            for command in entry.commands
        ),
        "```",
        "",
    ]
    lines += [answer(found), ""]
    lines += [f"* `{robot}` reads {_word(word)}" for robot, word in _words(found).items()]
    if (built / "seconds.json").exists():
        lines += ["", f"It took {json.loads((built / 'seconds.json').read_text())} s when this page was built."]
    if (built / "page.html").exists():
        address = f"../{built.name}/page.html"
        lines += [
            "",
            f'<iframe src="{address}" title="{html.escape(entry.question)}" loading="lazy" style="width: 100%; height: 44rem; border: 0"></iframe>',
            "",
            f"[The page by itself]({address}){{ target=_blank }}",
        ]
    for name, what in (("certificate.json", "The certificate"), ("mission.yaml", "The mission with all its defaults")):
        if (built / name).exists():
            lines += ["", f'<a href="../{built.name}/{name}">{what}</a>']
    if file := mission_of(entry):
        lines += ["", f"```yaml {file.name}", file.read_text(encoding="utf-8").rstrip(), "```"]
    lines += ["", "[All pages of the gallery](../gallery.md)"]
    return "\n".join(lines) + "\n"


def mission_of(entry: Entry) -> Path | None:
    """Return the file of an entry's mission: the gallery's own or a shipped one; None where it has none.

    Args:
        entry: What is shown.
    """
    named = [word.removesuffix(".yaml") for command in entry.commands for word in command.split()[1:2]]
    folders = (HERE / "missions", Path(ltlplan.missions.__file__).parent)
    return next((file for name in named for folder in folders if (file := folder / f"{name}.yaml").exists()), None)


def answer(found: Found) -> str:
    """Return what was found in one line: the message of a refusal, or cost, duration and claims.

    Args:
        found: Figures of an entry.
    """
    if "message" in found:
        return found["message"]
    parts = [found["sentence"].rstrip(".")] if "sentence" in found else []
    parts += [f"cost {found['cost']:.2f}"] if "cost" in found else []
    parts += [f"{found['duration']:.2f} s of flight"] if "duration" in found else []
    if "claims" in found:
        checked = f", {found['checked']} checked by the kernel" if found["checked"] else ""
        parts.append(f"{found['proved']} of {found['claims']} claims hold{checked}")
    if "share_inside" in found:
        inside, kept = found["share_inside"], found["share_satisfied"]
        parts.append(f"inside the tube in {inside['count']} of {inside['of']} flights, formula kept in {kept['count']}")
    return ", ".join(parts)


def _shown(command: str) -> str:
    return command.replace("|", "\\|")


def _words(found: Found) -> dict[str, Any]:
    words = found.get("words", {})
    return words if len(words) <= 10 else {}


def _word(word: Any) -> str:
    """Return a word as it is printed; of online flights letters are lists."""
    return f"`{word}`" if isinstance(word, str) else "`" + " ".join("{" + ", ".join(letter) + "}" for letter in word) + "`"
