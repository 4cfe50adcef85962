"""The page of the reproduction: each publication's elements, with tables and pictures of what was computed."""

from __future__ import annotations

import html
import re
from collections.abc import Sequence

from flight.figures import Figure
from ltlplan.report.page import figure_place, page_html, section, table, warning
from ltlplan.reproduction.documents import HEADER, row, verdict
from ltlplan.reproduction.element import HEADINGS
from ltlplan.reproduction.running import Rerun

_NOTE = (
    "Each element stands with what its publication says and what differs here. Its quantities were computed anew for this page, "
    "and lie in reviewed intervals; checks must hold. Positions of hoops and places are ours, where publications give none."
)


def reproduction_html(reruns: Sequence[Rerun]) -> str:
    """Return one self-contained page of elements that were computed anew."""
    figures: dict[str, Figure] = {}
    sections: list[str] = []
    for publication, heading in HEADINGS.items():
        own = [each for each in reruns if each.element.publication == publication]
        if own:
            sections.append(section(heading, _contents(own) + "".join(_element(each, figures) for each in own)))
    found = verdict(reruns)
    header = f'<p class="verdict {"holds" if all(each.fine for each in reruns) else "fails"}">{html.escape(found)}</p>'
    return page_html(
        "Two papers and published problems, computed anew",
        header=f'{header}<p class="note">{html.escape(_NOTE)}</p>',
        sections=sections,
        figures=figures,
        footer=f"Processor time of all elements: {sum(each.seconds for each in reruns):.0f} s.",
    )


def _words(text: str) -> str:
    """Return a sentence as markup, what stands in backquotes as code."""
    return re.sub(r"`([^`]*)`", r"<code>\1</code>", html.escape(text))


def _contents(reruns: Sequence[Rerun]) -> str:
    links = "".join(
        f'<li><a href="#{each.element.id}">{html.escape(each.element.title)}</a>{"" if each.fine else " (not as expected)"}</li>'
        for each in reruns
    )
    return f"<details><summary>{len(reruns)} elements</summary><ul>{links}</ul></details>"


def _element(each: Rerun, figures: dict[str, Figure]) -> str:
    """Return an element's part of the page, and add its pictures to the page's figures."""
    element = each.element
    parts = [f'<h3 id="{element.id}">{html.escape(element.title)}</h3><p>{_words(element.says)}</p>']
    if element.differs:
        parts.append(f"<p><strong>Differs:</strong> {_words(element.differs)}</p>")
    if each.fault:
        parts.append(warning(each.fault))
    parts.append(table(HEADER, [row(judged) for judged in each.judged], numbers=(3,), verdict=4))
    for chart in each.findings.charts:
        name = f"figure{len(figures)}"
        chart.figure.layout.pop("title", None)  # the note has it
        figures[name] = chart.figure
        parts.append(f'<p class="note">{html.escape(chart.label)}</p>{figure_place(name, chart.label, scene=chart.scene)}')
    also = f" Also {', '.join(element.also)}." if element.also else ""
    by = ", ".join(f"<code>{html.escape(name)}</code>" for name in element.by)
    parts.append(f'<p class="note"><code>{element.id}</code> by {by}.{also} {each.seconds:.1f} s of processor time.</p>')
    return "".join(parts)
