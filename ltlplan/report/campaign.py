"""The page of a campaign: errors over time and the spread of the runs' worst errors."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING

import plotly.graph_objects as go
from plotly.offline import get_plotlyjs

from flight.draw import over_time

if TYPE_CHECKING:
    from flight.campaign import Campaign


def campaign_html(found: Campaign) -> str:
    """Return one self-contained page for a campaign."""
    names = ("median of runs", "95th percentile", "worst run")
    colours = {"median of runs": "#2f7d4f", "95th percentile": "#f2a541", "worst run": "#b3261e"}
    lines = {name: (found.times, 1000 * found.error_over_time[:, i]) for i, name in enumerate(names)}
    limits = {} if found.margin is None else {f"margin {1000 * found.margin:g} mm": 1000 * found.margin}
    errors = over_time(lines, "worst robot's distance from the certified path (mm)", limits=limits, colours=colours)
    spread = go.Figure(
        go.Histogram(x=[round(1000 * float(e), 3) for e in found.worst_error], nbinsx=40, marker={"color": "#4c9be8"})
    )
    spread.update_layout(
        xaxis={"title": "worst error of a run (mm)"},
        yaxis={"title": "runs"},
        margin={"l": 60, "r": 20, "t": 10, "b": 40},
        plot_bgcolor="#fff",
    )
    for name, value in limits.items():
        spread.add_vline(x=value, line={"dash": "dash", "color": "#444"}, annotation={"text": name})
    for figure in (errors, spread):
        figure.update_layout(template=None, height=360)
    sentences = "".join(f"<li>{html.escape(sentence)}</li>" for sentence in found.sentences)
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        f"<title>{html.escape(found.mission)}: campaign</title>"
        "<style>body{font:15px/1.5 system-ui,sans-serif;max-width:1100px;margin:20px auto;padding:0 20px;color:#1d2330}</style></head>"
        f"<body><h1>{html.escape(found.mission)}: {len(found.seeds)} flights</h1><ul>{sentences}</ul>"
        f"<script>{get_plotlyjs().replace('</script', '<' + chr(92) + '/script')}</script>"
        + errors.to_html(full_html=False, include_plotlyjs=False, div_id="errors")
        + spread.to_html(full_html=False, include_plotlyjs=False, div_id="spread")
        + "</body></html>\n"
    )
