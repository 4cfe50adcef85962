"""A self-contained page: a heading, words, sections one below the other, figures, and where asked a player.

Every page of the project is made here, so that all of them look, fetch nothing, fit a phone and speak to those who cannot see
the pictures in the same way.
"""

from __future__ import annotations

import html
import re
from collections.abc import Mapping, Sequence
from string import Template

from flight.figures import Figure
from ltlplan.report.inline import figures_data, package_text, plotly_script, script_data

_SCRIPTS = ("scene_names.js", "plotly_names.js", "overlay.js", "player.js", "figures.js")
_OF_PLAYERS = ("overlay.js", "player.js")


def _script(name: str) -> str:
    """Return a script of this package without comments and indents, for a page where all are one; the service's page has some of them as modules."""
    lines = (line.strip().removeprefix("export ") for line in package_text(name).splitlines())
    return "".join(f"{line}\n" for line in lines if line and not line.startswith("//"))


def _style() -> str:
    """Return the style sheet without spaces that say nothing."""
    return re.sub(r"\s+(?=[{}])|(?<=[{};,:])\s+", "", package_text("style.css"))


def page_html(
    heading: str,
    *,
    header: str,
    sections: Sequence[str],
    figures: Mapping[str, Figure],
    player: Mapping[str, object] | None = None,
    footer: str = "",
) -> str:
    """Return the page. The same arguments give the same bytes.

    Args:
        heading: Of the page.
        header: Markup below the heading.
        sections: Markup, one below the other.
        figures: By the `id` that their places in the sections have.
        player: What the player shows, as `player.player_data` returns it.
        footer: A sentence at the end.
    """
    data = figures_data(figures)
    if player is not None:
        data["player"] = dict(player)
    return Template(package_text("page.html")).substitute(
        title=html.escape(f"{heading}: ltlplan"),
        heading=html.escape(heading),
        style=_style(),
        header=header,
        sections="\n".join(sections),
        footer=html.escape(footer),
        plotly=plotly_script(),
        data=script_data(data),
        script="".join(_script(name) for name in _SCRIPTS if player is not None or name not in _OF_PLAYERS),
    )


def section(heading: str, content: str, *, note: str | None = None) -> str:
    """Return a section of a page.

    Args:
        heading: Text.
        content: Markup.
        note: What it shows in a sentence or two, as text.
    """
    said = f'<p class="note">{html.escape(note)}</p>' if note else ""
    return f"<section><h2>{html.escape(heading)}</h2>{said}{content}</section>"


def figure_place(name: str, label: str, *, scene: bool = False) -> str:
    """Return the place of a figure, with words for those who cannot see it.

    Args:
        name: Its key among the page's figures.
        label: What it shows.
        scene: Whether it is a 3-D scene rather than a chart.
    """
    kind = "figure scene" if scene else "figure"
    return f'<div id="{name}" class="{kind}" role="{"group" if scene else "img"}" aria-label="{html.escape(label)}"></div>'


def listed(sentences: Sequence[str]) -> str:
    """Return sentences as a list; nothing where there are none."""
    return "<ul>" + "".join(f"<li>{html.escape(sentence)}</li>" for sentence in sentences) + "</ul>" if sentences else ""


def warning(sentence: str) -> str:
    """Return what a reader must know before anything else."""
    return f'<p class="warning" role="note">{html.escape(sentence)}</p>'


MOST_ROWS = 40
"""Rows that are shown at once; more are folded."""


def folded(content: str, count: int, what: str) -> str:
    """Return markup that a reader opens where it has many rows, and as it is where it has few.

    Args:
        content: The markup.
        count: Its rows.
        what: The rows' name, in the plural.
    """
    return content if count <= MOST_ROWS else f"<details><summary>All {count} {html.escape(what)}</summary>{content}</details>"


def table(
    header: Sequence[str], rows: Sequence[Sequence[str]], *, numbers: Sequence[int] = (), verdict: int | None = None
) -> str:
    """Return a table.

    Args:
        header: Words over the columns.
        rows: Cells.
        numbers: Which columns hold numbers.
        verdict: Which column holds verdicts, shown in their colours.
    """
    head = "".join(f'<th scope="col">{html.escape(cell)}</th>' for cell in header)
    body = ""
    for row in rows:
        cells = ""
        for index, cell in enumerate(row):
            kind = "number" if index in numbers else cell if index == verdict else ""
            cells += f'<td class="{kind}">{html.escape(cell)}</td>' if kind and cell else f"<td>{html.escape(cell)}</td>"
        body += f"<tr>{cells}</tr>"
    return f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'
