"""The page of a campaign: errors over time and the spread of the runs' worst errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import plotly.graph_objects as go

from flight.draw import GRID, over_time
from ltlplan.report.figures_page import figures_page

if TYPE_CHECKING:
    from flight.campaign import Campaign


def campaign_html(found: Campaign) -> str:
    """Return one self-contained page for a campaign."""
    colours = {"median of runs": "#2f7d4f", "95th percentile": "#f2a541", "worst run": "#b3261e"}
    lines = {name: (found.times, 1000 * found.error_over_time[:, i]) for i, name in enumerate(colours)}
    limits = {} if found.margin is None else {f"margin {1000 * found.margin:g} mm": 1000 * found.margin}
    errors = over_time(lines, "worst robot's distance from the certified path (mm)", limits=limits, colours=colours)
    worst = [round(1000 * float(e), 3) for e in found.worst_error]
    furthest = 1.08 * max([*worst, *limits.values()], default=1.0)
    spread = go.Figure(
        go.Histogram(
            x=worst, xbins={"start": 0.0, "end": furthest, "size": furthest / 40}, autobinx=False, marker={"color": "#4c9be8"}
        )
    )
    spread.update_layout(
        xaxis={"title": "worst error of a run (mm)", "range": [0, furthest], "gridcolor": GRID},
        yaxis={"title": "runs", "dtick": max(1, len(worst) // 8), "gridcolor": GRID},
        bargap=0.02,
    )
    for name, value in limits.items():
        spread.add_vline(x=value, line={"dash": "dash", "color": "#7d8594"}, annotation={"text": name})
    title = f"{found.mission}: {len(found.seeds)} flights"
    figures = {"Error over time": errors, "Worst error of each run": spread}
    sentences = [sentence[:1].upper() + sentence[1:] for sentence in found.sentences]
    notes = {
        "Error over time": "At each time the worst robot of a run: the median, the 95th percentile and the worst of all runs.",
        "Worst error of each run": "How many runs came how far from the certified path; left of the margin the certificate covers them.",
    }
    return figures_page(title, sentences, figures, notes=notes, height=360)
