"""The page of a campaign: errors over time and the spread of the runs' worst errors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from flight.figures import Figure, trace
from flight.pictures import CLEAR
from ltlplan.report.over_time import FAR, GRID, MARK, Line, over_time
from ltlplan.report.page import figure_place, listed, page_html, section

if TYPE_CHECKING:
    from flight.campaigns import Campaign


_NOTES = {
    "errors": (
        "Error over time",
        "At each time the worst robot of a run: the median, the 95th percentile and the worst of all runs.",
    ),
    "spread": (
        "Worst error of each run",
        "How many runs came how far from the certified path; left of the margin the certificate covers them.",
    ),
}
"""Heading of each figure, and what it shows."""


def campaign_html(found: Campaign) -> str:
    """Return one self-contained page for a campaign."""
    colours = {"median of runs": "#2f9a5f", "95th percentile": "#f2a541", "worst run": "#d6453d"}
    lines = {
        name: Line(found.times, 1000 * found.error_over_time[:, i], colour) for i, (name, colour) in enumerate(colours.items())
    }
    limits = {} if found.margin is None else {f"margin {1000 * found.margin:g} mm": 1000 * found.margin}
    figures = {
        "errors": over_time(lines, "error (mm)", limits),
        "spread": _spread([1000 * float(error) for error in found.worst_error], limits),
    }
    sentences = [sentence[:1].upper() + sentence[1:] for sentence in found.sentences]
    return page_html(
        f"{found.mission}: {len(found.seeds)} flight{'s' * (len(found.seeds) != 1)}",
        header=listed(sentences),
        sections=[
            section(heading, figure_place(name, f"{heading}. {note}"), note=note) for name, (heading, note) in _NOTES.items()
        ],
        figures=figures,
    )


def _spread(worst: list[float], limits: Mapping[str, float]) -> Figure:
    """Draw how many runs had which worst error, in mm; a limit that lies far beyond them is named, not drawn to scale."""
    greatest = max(worst, default=0.0)
    far = {name: value for name, value in limits.items() if value > FAR * greatest > 0.0}
    shown = {name: value for name, value in limits.items() if name not in far}
    end = 1.08 * max([greatest, *shown.values()]) or 1.0
    bars = trace(
        "histogram", x=[round(error, 4) for error in worst], xbins={"start": 0.0, "end": end, "size": end / 40}, autobinx=False,
        marker={"color": "#4c8fd6"}, hovertemplate="%{y} runs at %{x} mm<extra></extra>",
    )  # fmt: skip
    figure = Figure([bars])
    figure.update_layout(
        xaxis={"title": {"text": "worst error of a run (mm)"}, "range": [0, end], "gridcolor": GRID},
        yaxis={"title": {"text": "runs"}, "dtick": max(1, len(worst) // 8), "gridcolor": GRID},
        bargap=0.02,
        margin={"l": 60, "r": 16, "t": 28, "b": 45},
        plot_bgcolor=CLEAR,
        paper_bgcolor=CLEAR,
        shapes=[
            {
                "type": "line", "x0": value, "x1": value, "xref": "x", "y0": 0, "y1": 1, "yref": "y domain",
                "line": {"dash": "dash", "color": MARK},
            }
            for value in shown.values()
        ],
    )  # fmt: skip
    said = {"y": 1, "yref": "paper", "yanchor": "bottom", "xanchor": "right", "showarrow": False, "font": {"size": 11}}
    for name, value in shown.items():
        figure.add_annotation(text=name, x=value, **said)
    for name, value in far.items():
        figure.add_annotation(
            text=f"{name}: {value / greatest:.0f} times the worst run, far to the right →", x=1, xref="paper", **said
        )
    return figure
