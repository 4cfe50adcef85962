"""Charts of the reproduction: lines or bars over two axes, and clouds of points in space."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from flight.figures import Figure, Trace, trace
from flight.pictures import CAMERA, CLEAR, LEGEND, robot_colour
from ltlplan.report.over_time import GRID
from ltlplan.reproduction.element import Chart
from verify.data.arrays import Floats


def lines(label: str, x: Sequence[float], rows: Mapping[str, Sequence[float]], axes: tuple[str, str]) -> Chart:
    """Return lines over a common axis.

    Args:
        label: What they show, in a sentence.
        x: Their places.
        rows: Values by name.
        axes: Words at the axes, with units.
    """
    drawn = [
        trace("scatter", mode="lines", name=name, x=list(x), y=[round(value, 5) for value in values], line={"color": robot_colour(index)})
        for index, (name, values) in enumerate(rows.items())
    ]  # fmt: skip
    return Chart(label, _plane(drawn, axes))


def bars(label: str, x: Sequence[str], rows: Mapping[str, Sequence[float]], axes: tuple[str, str]) -> Chart:
    """Return groups of bars.

    Args:
        label: What they show, in a sentence.
        x: Names of the groups.
        rows: Values by name, one for each group.
        axes: Words at the axes, with units.
    """
    drawn = [
        trace("bar", name=name, x=list(x), y=[round(value, 4) for value in values], marker={"color": robot_colour(index)})
        for index, (name, values) in enumerate(rows.items())
    ]
    return Chart(label, _plane(drawn, axes).update_layout(barmode="group"))


def clouds(label: str, points: Mapping[str, Floats]) -> Chart:
    """Return clouds of points in space.

    Args:
        label: What they show, in a sentence.
        points: m, by name. Shapes (n, 3).
    """
    drawn = [
        trace("scatter3d", mode="markers", name=name, **{axis: at[:, i].round(4).tolist() for i, axis in enumerate("xyz")},
              marker={"size": 2, "color": robot_colour(index)}, hoverinfo="skip")
        for index, (name, at) in enumerate(points.items())
    ]  # fmt: skip
    axes = {f"{axis}axis": {"title": {"text": f"{axis} (m)"}, "backgroundcolor": CLEAR, "nticks": 6} for axis in "xyz"}
    figure = Figure(drawn).update_layout(
        scene={**axes, "aspectmode": "data", "camera": CAMERA},
        margin={"l": 0, "r": 0, "t": 0, "b": 0},
        legend={**LEGEND, "itemsizing": "constant"},
        paper_bgcolor=CLEAR,
    )
    return Chart(label, figure, scene=True)


def _plane(drawn: list[Trace], axes: tuple[str, str]) -> Figure:
    """Return traces over two axes, in the manner of the other pages."""
    across, up = ({"title": {"text": words}, "gridcolor": GRID, "zeroline": False} for words in axes)
    return Figure(drawn).update_layout(
        xaxis=across, yaxis={**up, "rangemode": "tozero"}, legend=LEGEND, margin={"l": 60, "r": 16, "t": 28, "b": 45},
        plot_bgcolor=CLEAR, paper_bgcolor=CLEAR,
    )  # fmt: skip
