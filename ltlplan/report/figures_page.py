"""A plain self-contained page: a title, a few sentences, figures one below the other."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence

import plotly.graph_objects as go
from plotly.offline import get_plotlyjs

_STYLE = (
    "body{font:15px/1.5 system-ui,sans-serif;max-width:1100px;margin:20px auto;padding:0 20px;color:#1d2330}h2{font-size:18px}"
)


def figures_page(title: str, sentences: Sequence[str], figures: Mapping[str, go.Figure], *, height: int = 520) -> str:
    """Return the page. The keys of `figures` are their headings; nothing is fetched when the page is opened.

    Args:
        title: Of the page.
        sentences: Listed above the figures.
        figures: Heading: figure, in order.
        height: Of each figure, in pixels.
    """
    parts: list[str] = []
    for index, (heading, figure) in enumerate(figures.items()):
        figure.update_layout(template=None, height=height, title=None, margin={"l": 60, "r": 20, "t": 10, "b": 45})
        figure.update_scenes(camera={"eye": {"x": 0.7, "y": -1.15, "z": 0.75}, "center": {"x": 0, "y": 0, "z": -0.1}})
        drawn = figure.to_html(
            full_html=False, include_plotlyjs=False, div_id=f"figure{index}", config={"displayModeBar": False}
        )
        parts.append(f"<h2>{html.escape(heading)}</h2>{drawn}")
    script = get_plotlyjs().replace("</script", "<\\/script")
    listed = "".join(f"<li>{html.escape(sentence)}</li>" for sentence in sentences)
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{html.escape(title)}</title>'
        f"<style>{_STYLE}</style></head><body><h1>{html.escape(title)}</h1><ul>{listed}</ul>"
        f"<script>{script}</script>{''.join(parts)}</body></html>\n"
    )
