"""A plain self-contained page: a title, a few sentences, figures one below the other."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from typing import Any

import plotly.graph_objects as go

from flight.draw import CAMERA, CLEAR
from ltlplan.report.inline import figure_data, package_text, plotly_script, script_data


def figures_page(
    title: str,
    sentences: Sequence[str],
    figures: Mapping[str, go.Figure],
    *,
    notes: Mapping[str, str] | None = None,
    height: int = 520,
    warning: str | None = None,
) -> str:
    """Return the page. The keys of `figures` are their headings; nothing is fetched when the page is opened.

    Args:
        title: Of the page.
        sentences: Listed above the figures.
        figures: Heading: figure, in order.
        notes: Heading: a sentence that says what the figure shows.
        height: Of each figure, in pixels.
        warning: What a reader must know before anything else.
    """
    parts: list[str] = []
    shown: dict[str, dict[str, Any]] = {}
    for index, (heading, figure) in enumerate(figures.items()):
        figure.update_layout(
            height=height, title=None, margin={"l": 60, "r": 20, "t": 10, "b": 45}, paper_bgcolor=CLEAR, plot_bgcolor=CLEAR
        )
        figure.update_scenes(camera=CAMERA)
        shown[f"figure{index}"] = figure_data(figure)
        note = (notes or {}).get(heading)
        label = html.escape(f"{heading}. {note or ''}".strip())
        parts.append(
            f"<section><h2>{html.escape(heading)}</h2>"
            + (f'<p class="note">{html.escape(note)}</p>' if note else "")
            + f'<div id="figure{index}" class="figure" role="img" aria-label="{label}"></div></section>'
        )
    first = f'<p class="warning" role="note">{html.escape(warning)}</p>' if warning else ""
    listed = "".join(f"<li>{html.escape(sentence)}</li>" for sentence in sentences)
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1"><meta name="color-scheme" content="light dark">'
        f"<title>{html.escape(title)}</title><style>{package_text('style.css')}</style></head><body>"
        f"<header><h1>{html.escape(title)}</h1>{first}<ul>{listed}</ul></header><main>"
        '<noscript><p class="warning">The pictures need JavaScript, which is switched off.</p></noscript>'
        f"{''.join(parts)}</main><script>{plotly_script()}</script>"
        f'<script id="data" type="application/json">{script_data({"figures": shown})}</script>'
        f"<script>{package_text('figures.js')}</script></body></html>\n"
    )
