"""Pictures of an audit's instants: all drones, or those about two of them, with what they fly just before and after."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import NDArray

from flight.figures import Figure
from flight.pictures import CAMERA, CLEAR
from flight.shapes import Floats, line, points

if TYPE_CHECKING:
    from verify import Audit
    from verify.third_party.instants import Instant

AROUND = 5.0
"""s before and after an instant whose paths are drawn."""

NEAR = 4.0
"""Times the distance of a pair, or of what is asked, that a picture of it reaches, and 5 m at the least."""

FAR = 3.0
"""Times the width of all drones that a border may be wide to be in the picture of them."""

_SIZE = 1.75
_ONE, _OTHER, _REST, _BORDER = "#d62728", "#1f77e0", "#9aa3af", "#7b818c"


def overview(found: Audit, instant: Instant) -> Figure:
    """Draw all drones at an instant, those of the instant marked, and the workspace's and the geofence's outlines."""
    places = _places(found, instant.time)
    own = _own(found, instant)
    rest = np.setdiff1d(np.arange(len(places)), own)
    figure = Figure([points(places[rest], "other drones", {"size": 2, "color": _REST}, texts=_names(found, rest))])
    for index, colour in zip(own, (_ONE, _OTHER), strict=False):
        figure.add_trace(points(places[[index]], found.fleet.names[index], {"size": 7, "color": colour}))
    drawn, span = [places], max(float(np.ptp(places, axis=0).max()), 1.0)
    for outline in _outlines(found, float(places[:, 2].min())):
        figure.add_trace(line(outline, "border", _BORDER, dash="dash", width=2, shown=False))
        if np.ptp(outline, axis=0).max() <= FAR * span:  # a border far around them would make them a dot
            drawn.append(outline)
    return figure.update_layout(_layout(np.concatenate(drawn)))


def pair_or_drone(found: Audit, instant: Instant) -> Figure:
    """Draw the drones of an instant, their paths about it, and the others that are near them then."""
    places, own = _places(found, instant.time), _own(found, instant)
    middle = places[own].mean(axis=0)
    apart = float(np.linalg.norm(places[own[0]] - places[own[-1]]))
    reach = max(5.0, NEAR * apart)
    near = np.flatnonzero(np.abs(places - middle).max(-1) <= reach)
    times = np.linspace(max(instant.time - AROUND, 0.0), min(instant.time + AROUND, found.duration), 101)
    figure = Figure()
    for index, colour in zip(own, (_ONE, _OTHER), strict=False):
        path = found.fleet.along(np.full(len(times), index), times)
        seen = np.abs(path - middle).max(-1) <= reach
        name = found.fleet.names[index]
        figure.add_trace(line(path[seen], name, colour, width=4))
        figure.add_trace(points(places[[index]], name, {"size": 8, "color": colour}, group=name))
    if len(own) > 1:
        figure.add_trace(line(places[own], f"{apart:.4g} m", "#f07800", dash="dash", width=5))
    others = np.setdiff1d(near, own)
    if len(others):
        figure.add_trace(points(places[others], "other drones", {"size": 4, "color": _REST}, texts=_names(found, others)))
    if len(own) == 1:
        for outline in _outlines(found, float(middle[2])):
            figure.add_trace(line(outline, "border", _BORDER, dash="dash", width=3, shown=False))
    corners = np.stack([middle - reach, middle + reach])
    return figure.update_layout(_layout(corners))


def _names(found: Audit, drones: NDArray[np.intp]) -> list[str]:
    return [found.fleet.names[drone] for drone in drones.tolist()]


def _own(found: Audit, instant: Instant) -> list[int]:
    names = [instant.robot] if instant.other is None else [instant.robot, instant.other]
    return [found.fleet.names.index(name) for name in names]


def _places(found: Audit, time: float) -> Floats:
    """Return where all drones are at a time. Shape (drones, 3)."""
    drones = np.arange(found.drones)
    return found.fleet.along(drones, np.full(len(drones), time))


def _outlines(found: Audit, height: float) -> list[Floats]:
    """Return closed lines around the workspace's floor and ceiling, and the geofence's polygons at a height. Shapes (points, 3)."""
    outlines: list[Floats] = []
    for fence in cast("list[Mapping[str, object]]", found.asked["geofence"]):
        corners = np.array(fence["corners"], dtype=float)
        outlines.append(np.column_stack([np.vstack([corners, corners[:1]]), np.full(len(corners) + 1, height)]))
    if (box := cast("list[list[float]] | None", found.asked["workspace"])) is not None:
        (x0, y0, z0), (x1, y1, z1) = box
        for z in (z0, z1):
            outlines.append(np.array([[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z], [x0, y0, z]]))
    return outlines


def _layout(shown: Floats) -> dict[str, object]:
    """Return the layout of a scene to scale that has all these points in it."""
    low, high = shown.min(axis=0), shown.max(axis=0)
    room = 0.05 * float((high - low).max()) + 0.5
    low, high = low - room, high + room
    spans = high - low
    axes = {
        f"{axis}axis": {
            "title": {"text": f"{axis} (m)"},
            "range": [float(low[i]), float(high[i])],
            "backgroundcolor": CLEAR,
            "nticks": 6,
        }
        for i, axis in enumerate("xyz")
    }
    ratio = {axis: _SIZE * float(spans[i] / np.linalg.norm(spans)) for i, axis in enumerate("xyz")}
    return {
        "scene": {**axes, "aspectmode": "manual", "aspectratio": ratio, "camera": CAMERA},
        "margin": {"l": 0, "r": 0, "t": 0, "b": 0},
        "legend": {"orientation": "h", "x": 0.0, "y": 1.0, "yanchor": "bottom", "font": {"size": 12}, "bgcolor": CLEAR},
        "paper_bgcolor": CLEAR,
    }
