"""The page of a campaign: errors over time and the spread of the runs' worst errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import plotly.graph_objects as go

from flight.draw import over_time
from ltlplan.report.figures_page import figures_page

if TYPE_CHECKING:
    from flight.campaign import Campaign


def campaign_html(found: Campaign) -> str:
    """Return one self-contained page for a campaign."""
    colours = {"median of runs": "#2f7d4f", "95th percentile": "#f2a541", "worst run": "#b3261e"}
    lines = {name: (found.times, 1000 * found.error_over_time[:, i]) for i, name in enumerate(colours)}
    limits = {} if found.margin is None else {f"margin {1000 * found.margin:g} mm": 1000 * found.margin}
    errors = over_time(lines, "worst robot's distance from the certified path (mm)", limits=limits, colours=colours)
    spread = go.Figure(
        go.Histogram(x=[round(1000 * float(e), 3) for e in found.worst_error], nbinsx=40, marker={"color": "#4c9be8"})
    )
    spread.update_layout(xaxis={"title": "worst error of a run (mm)"}, yaxis={"title": "runs"}, plot_bgcolor="#fff")
    for name, value in limits.items():
        spread.add_vline(x=value, line={"dash": "dash", "color": "#444"}, annotation={"text": name})
    title = f"{found.mission}: {len(found.seeds)} flights"
    return figures_page(title, found.sentences, {"Error over time": errors, "Worst error of each run": spread}, height=360)
