"""Quantities over mission time, with limits; where a limit lies far above them the axis is broken, so that both can be read."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from flight.figures import Figure, trace
from flight.pictures import CLEAR, LEGEND, MANY
from flight.shapes import Floats, rounded

GRID = "rgba(128,136,150,0.25)"

MARK = "#7d8594"
"""Grey of limit lines: three to one against white and against black."""

FAR = 2.5
"""A limit is far where it is this many times the greatest value: below that, both are seen well on one axis."""

MOST_SAMPLES = 2000
"""More than a screen has columns for a chart."""

NO_LIMITS: Mapping[str, float] = MappingProxyType({})

_STRIP = (0.86, 1.0)
_BELOW = (0.0, 0.78)
"""Shares of a chart's height: what lies above the break of the axis, and below it."""
_GAP = 0.12
"""Share of a panel's height that is left free below it."""


@dataclass(frozen=True, eq=False, slots=True)
class Line:
    """One quantity, and how it is drawn.

    Attributes:
        times: s, evenly apart. Shape (samples,).
        values: Shape (samples,). Of very many samples each is drawn as the greatest of a few one after another.
        colour: As CSS has it; None leaves it to the chart.
        dash: Plotly's.
        group: Name in the legend, where lines of one group are shown once; empty takes the line's own.
        least: Draw the least of a few samples instead of the greatest.
    """

    times: Floats
    values: Floats
    colour: str | None = None
    dash: str = "solid"
    group: str = ""
    least: bool = False


def over_time(lines: Mapping[str, Line], title: str, limits: Mapping[str, float] = NO_LIMITS) -> Figure:
    """Draw quantities over mission time, with horizontal limit lines.

    Args:
        lines: By name.
        title: Axis label, with its unit.
        limits: Name: value of a limit in the same unit.
    """
    figure = Figure()
    seen: set[str] = set()
    for name, line in lines.items():
        group = line.group or name
        few = math.ceil(len(line.values) / MOST_SAMPLES)
        drawn = (np.fmin if line.least else np.fmax).reduceat(line.values, np.arange(0, len(line.values), few))
        style = {"color": line.colour, "width": 1.5, "dash": line.dash}
        figure.add_trace(
            trace(
                "scatter", x0=float(line.times[0]), dx=few * _step(line.times), y=rounded(drawn), name=group, legendgroup=group,
                showlegend=group not in seen, mode="lines", line=style, hovertemplate=f"{name}: %{{y:.4g}} at %{{x:.2f}} s<extra></extra>",
            )
        )  # fmt: skip
        seen.add(group)
    axis = {"gridcolor": GRID, "zeroline": False}
    end = max((float(line.times[-1]) for line in lines.values()), default=1.0)
    figure.update_layout(
        xaxis={"title": {"text": "time (s)"}, "range": [0, end], **axis},
        yaxis={"title": {"text": title}, "rangemode": "tozero", **axis},
        margin={"l": 60, "r": 16, "t": 10, "b": 45},
        legend=LEGEND,
        showlegend=len(seen) <= MANY,
        plot_bgcolor=CLEAR,
        paper_bgcolor=CLEAR,
    )
    greatest = max((float(np.nanmax(line.values)) for line in lines.values()), default=0.0)
    far = {name: value for name, value in limits.items() if value > FAR * greatest > 0.0}
    for name, value in limits.items():
        _limit(figure, name, value, end, "y2" if name in far else "y")
    if far:
        _break(figure, greatest, sorted(far.values()))
    return figure


def stacked(panels: Mapping[str, Mapping[str, Line]], limit: float, name: str) -> Figure:
    """Draw quantities above each other over one mission time, each with the same limit.

    Args:
        panels: By axis label: lines by name. A line's name stands for the same thing in each panel, and once in the legend.
        limit: Horizontal line in every panel, in the unit of all values.
        name: The limit's.
    """
    figure = Figure()
    for index, (title, lines) in enumerate(panels.items()):
        axis, drawn = f"y{index + 1 if index else ''}", over_time(lines, title)
        if not index:
            figure.update_layout(drawn.layout)
        for each in drawn.data:
            figure.add_trace({**each, "yaxis": axis, "showlegend": each["showlegend"] and not index})
        _limit(figure, name, limit, drawn.layout["xaxis"]["range"][1], axis)
        greatest = max((float(np.nanmax(line.values)) for line in lines.values()), default=0.0)
        domain = [1.0 - (index + 1 - _GAP) / len(panels), 1.0 - index / len(panels)]
        words = {
            "title": {"text": title, "font": {"size": 11}},
            "domain": domain,
            "range": [0, max(1.25 * limit, 1.1 * greatest)],
            "tickvals": [0, limit / 2, limit],
        }
        figure.update_layout({f"yaxis{axis[1:]}": {**drawn.layout["yaxis"], **words}})
    figure.layout["xaxis"]["anchor"] = f"y{len(panels)}"
    return figure


def _step(times: Floats) -> float:
    """Return the distance of times that are evenly apart, which is all that a page needs to carry of them."""
    return round((float(times[-1]) - float(times[0])) / (len(times) - 1), 9) if len(times) > 1 else 1.0


def _limit(figure: Figure, name: str, value: float, end: float, axis: str) -> None:
    figure.add_trace(
        trace(
            "scatter", x=[0, end], y=[value, value], yaxis=axis, mode="lines", line={"dash": "dash", "color": MARK, "width": 1.5}, name=name,
            showlegend=False, hovertemplate=f"{name}<extra></extra>",
        )
    )  # fmt: skip
    figure.add_annotation(
        text=name, x=1, xref="paper", xanchor="right", y=value, yref=axis, yanchor="bottom", showarrow=False, font={"size": 11}
    )


def _break(figure: Figure, greatest: float, far: list[float]) -> None:
    """Show the values on an axis of their own, and the far limits in a strip above a break."""
    room = max(far[-1] - far[0], 0.1 * far[-1])
    figure.update_layout(
        yaxis={"domain": _BELOW, "range": [0, 1.1 * greatest]},
        yaxis2={
            "domain": _STRIP, "range": [far[0] - 0.3 * room, far[-1] + 1.5 * room], "tickvals": far, "anchor": "x", "showgrid": False,
            "zeroline": False,
        },
    )  # fmt: skip
    middle = (_BELOW[1] + _STRIP[0]) / 2
    for x in (0, 1):
        figure.add_annotation(
            text="<b>≈</b>", x=x, xref="paper", xanchor="center", y=middle, yref="paper", yanchor="middle", showarrow=False,
            font={"size": 15, "color": MARK},
        )  # fmt: skip
