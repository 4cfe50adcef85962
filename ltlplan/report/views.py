"""A mission as it is seen from above and from two sides, to scale: what is solid, what vehicles keep from it, regions, rings, paths.

Plain drawings that need no script: they are on pages beside the scene that turns, and say what it cannot, how wide a way is.
"""

from __future__ import annotations

import html
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flight.pictures import region_colours, robot_colour
from flight.shapes import bends, hoop_axes
from verify.data import Mission
from verify.data.shapes.convex_parts import outline
from verify.data.shapes.placed_body import PlacedBody
from verify.data.shapes.region import Hoop

Floats = NDArray[np.float64]

VIEWS = (
    "Grey: solid. Dashed: what no vehicle's centre may cross, a radius and the margin from solid bodies, the margin from the workspace's "
    "walls. Discs: starts, as large as the vehicle; rings in orange."
)
"""How the views are read."""

_UNIT = 100.0
"""Of the drawing, to a metre."""
_TICKS = 8
"""No more than so many on an axis, about."""
_SEEN = 0.005
"""m; points of a path are left out where the line without them is as near as that."""
_CIRCLE = np.stack([np.cos(np.arange(48) * np.pi / 24), np.sin(np.arange(48) * np.pi / 24)], axis=1)


@dataclass(frozen=True, slots=True)
class _View:
    """A direction to look along.

    Attributes:
        title: What it is called.
        right: The axis that points to the right, 0 to 2.
        up: The axis that points up.
    """

    title: str
    right: int
    up: int


_VIEWS = (_View("From above", 0, 1), _View("From the front", 0, 2), _View("From the right", 1, 2))


def views_html(mission: Mission, paths: Mapping[str, Floats] | None = None) -> str:
    """Return a mission from above, from the front and from the right, as markup that scales.

    Args:
        mission: What is drawn.
        paths: For some robots, positions in m. Shape (points, 3 or more).
    """
    drawn = "".join(_Drawing(mission, view).html(paths or {}) for view in _VIEWS)
    return f'<div class="views">{drawn}</div>'


def clearance_sentences(mission: Mission) -> list[str]:
    """Return what is kept from solid bodies and walls, and what is left of each opening in them, in words."""
    if not mission.obstacles:
        return []
    keeps: dict[float, list[str]] = {}
    for name in mission.agents:
        keeps.setdefault(mission.vehicle_of(name).radius + mission.margin, []).append(name)
    sentences = [
        f"{', '.join(names)}: the vehicle's centre keeps {keep:.3g} m from solid bodies (radius and margin)."
        for keep, names in sorted(keeps.items())
    ]
    for name, obstacle in mission.obstacles.items():
        for opening in obstacle.openings:
            width = mission.hoops[opening].opening
            left = ", ".join(f"{width - keep:.3g} m" for keep in sorted(keeps))
            sentences.append(f"'{opening}' in '{name}' is {2 * width:.3g} m wide; centres may be {left} off its axis.")
    return sentences


class _Drawing:
    """One view, as it is put together; coordinates are those of the drawing."""

    def __init__(self, mission: Mission, view: _View) -> None:
        self._mission, self._view = mission, view
        self._axes = [view.right, view.up]
        self._low = np.array(mission.workspace.min)[self._axes]
        self._high = np.array(mission.workspace.max)[self._axes]
        self._text = 0.032 * _UNIT * float(max(self._high - self._low))
        self._keep = max(mission.vehicle_of(name).radius for name in mission.agents) + mission.margin

    def html(self, paths: Mapping[str, Floats]) -> str:
        """Return the drawing with its title."""
        mission, colours = self._mission, region_colours(self._mission)
        parts = [self._grid()]
        width, height = _UNIT * (self._high - self._low)
        parts.append(f'<svg width="{width:.1f}" height="{height:.1f}">')  # what reaches out of the workspace is cut off
        for name, region in mission.regions.items():
            parts += self._body(name, region, f'class="region" fill="{colours[name]}"')
        for name, hoop in mission.hoops.items():
            parts += self._body(name, hoop, f'class="region" fill="{colours[name]}"')
        solid = [part for obstacle in mission.obstacles.values() for part in self._parts(obstacle)]
        parts += dict.fromkeys(
            self._outline(part, 'class="keep"', grown=self._keep) for part in solid
        )  # many alike, seen from aside
        for name, obstacle in mission.obstacles.items():
            parts += self._body(name, obstacle, 'class="solid"')
            parts += [self._opening(obstacle, mission.hoops[opening]) for opening in obstacle.openings]
        parts += [self._ring(name, hoop) for name, hoop in mission.hoops.items()]
        parts += [self._path(index, paths[name]) for index, name in enumerate(mission.agents) if name in paths]
        parts += self._robots()
        parts += self._names()
        parts.append("</svg>")
        left, below, edge = 2.6 * self._text, 2.6 * self._text, 0.6 * self._text
        box = f"{-left:.1f} {-edge:.1f} {width + left + edge:.1f} {height + below + edge:.1f}"
        what = f"{self._view.title}: {_listed('solid', mission.obstacles)}{_listed('regions', mission.all_regions)}"
        return (
            f'<figure><figcaption>{self._view.title}</figcaption><svg viewBox="{box}" role="img" '
            f'aria-label="{html.escape(what.rstrip())}" font-size="{self._text:.1f}">{"".join(parts)}</svg></figure>'
        )

    def _at(self, points: Floats) -> Floats:
        """Return where points in the view's plane are drawn. Shape (n, 2)."""
        return np.stack([points[:, 0] - self._low[0], self._high[1] - points[:, 1]], axis=1) * _UNIT

    def _parts(self, body: PlacedBody) -> list[Floats]:
        """Return the outline of each convex part, m, in the view's plane."""
        centre = np.array(body.center)[self._axes]
        if body.is_ellipsoid:
            across = np.linalg.inv(body.shape)[np.ix_(self._axes, self._axes)]
            edge: Floats = np.array(_CIRCLE @ np.linalg.cholesky(across).T, dtype=np.float64)
            return [centre + edge]
        return [_hull(centre + outline(part)[:, self._axes]) for part in body.measures.parts]

    def _body(self, name: str, body: PlacedBody, how: str) -> list[str]:
        return [self._outline(part, how, name) for part in self._parts(body)]

    def _outline(self, points: Floats, how: str, name: str = "", *, grown: float = 0.0) -> str:
        if grown:
            points = _hull((points[:, None] + grown * _CIRCLE[::3]).reshape(-1, 2))
        said = f"<title>{html.escape(name)}</title>" if name else ""
        return f'<path {how} d="{_lines(self._at(points))}Z">{said}</path>'

    def _opening(self, obstacle: PlacedBody, hoop: Hoop) -> str:
        """The hole of a wall, through all of it, and within it where the vehicle's centre may be."""
        normal, across, up = hoop_axes(hoop)
        centre = np.array(hoop.center)
        offset = centre - np.array(obstacle.center)
        reach = min(obstacle.outer_radius, hoop.opening)
        if not obstacle.is_ellipsoid:
            holding = [part for part in obstacle.measures.parts if part.depths(offset[None])[0] > 0]
            far = [np.abs((outline(part) - offset) @ normal).max() for part in holding]
            reach = float(max(far, default=reach))
        drawn = ""
        for radius, how in ((hoop.opening, 'class="hole"'), (hoop.opening - self._keep, 'class="keep"')):
            if radius > 0:
                ring = centre + radius * (_CIRCLE[:, :1] * across + _CIRCLE[:, 1:] * up)
                both = np.concatenate([ring - reach * normal, ring + reach * normal])[:, self._axes]
                drawn += self._outline(_hull(both), how)
        return drawn

    def _ring(self, name: str, hoop: Hoop) -> str:
        _, across, up = hoop_axes(hoop)
        ring = (hoop.opening + hoop.rim / 2) * (_CIRCLE[:, :1] * across + _CIRCLE[:, 1:] * up)
        at = self._at((np.array(hoop.center) + ring)[:, self._axes])
        return f'<path class="ring" d="{_lines(at)}Z"><title>{html.escape(name)}: ring</title></path>'

    def _path(self, index: int, path: Floats) -> str:
        whole = path[~np.isnan(path[:, :3]).any(axis=1)]
        kept = whole[bends(whole[:, :3], _SEEN)]
        return f'<path class="path" stroke="{robot_colour(index)}" d="{_lines(self._at(kept[:, self._axes]))}"/>'

    def _robots(self) -> Iterable[str]:
        for index, (name, agent) in enumerate(self._mission.agents.items()):
            radius = self._mission.vehicle_of(name).radius * _UNIT
            for what, point in (("starts", agent.start), ("ends", agent.end)):
                if point is not None:
                    (x, y), colour = self._at(np.array([point])[:, self._axes])[0], robot_colour(index)
                    yield (
                        f'<circle class="{what}" cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}" stroke="{colour}" fill="{colour}">'
                        f"<title>{html.escape(name)} {what} here</title></circle>"
                    )

    def _names(self) -> Iterable[str]:
        """Names of regions, and of obstacles that are as wide as their names, where no other name stands; all are told on hovering."""
        mission, taken = self._mission, [np.zeros((0, 4))]
        width, height = _UNIT * (self._high - self._low)
        for name, body in {**mission.all_regions, **mission.obstacles}.items():
            (x, y), half = self._at(np.array([body.center])[:, self._axes])[0], 0.28 * self._text * len(name)
            x = float(np.clip(x, half, max(half, width - half)))
            y = float(np.clip(y, self._text / 2, max(self._text / 2, height - self._text / 2)))
            if name in mission.obstacles and half > _UNIT * body.half_lengths[self._view.right]:
                continue
            box = np.array([[x - half, y - self._text / 2, x + half, y + self._text / 2]])
            others = np.concatenate(taken)
            if not np.any(np.all((others[:, :2] < box[:, 2:]) & (box[:, :2] < others[:, 2:]), axis=1)):
                taken.append(box)
                yield f'<text class="name" x="{x:.1f}" y="{y + 0.35 * self._text:.1f}">{html.escape(name)}</text>'

    def _grid(self) -> str:
        """The workspace, its inner edge a margin away, and ticks with numbers."""
        width, height = _UNIT * (self._high - self._low)
        margin = _UNIT * self._mission.margin
        drawn = f'<rect class="workspace" width="{width:.1f}" height="{height:.1f}"/>'
        drawn += (
            f'<rect class="keep" x="{margin:.1f}" y="{margin:.1f}" width="{width - 2 * margin:.1f}" '
            f'height="{height - 2 * margin:.1f}"/>'
        )
        step = _step(float(max(self._high - self._low)))
        right, up = ("xyz"[axis] for axis in self._axes)
        for value in _ticks(self._low[0], self._high[0], step):
            x = _UNIT * (value - self._low[0])
            drawn += f'<path class="grid" d="M{x:.1f} 0V{height:.1f}"/>'
            drawn += f'<text class="tick" x="{x:.1f}" y="{height + 1.1 * self._text:.1f}">{value:g}</text>'
        for value in _ticks(self._low[1], self._high[1], step):
            y = _UNIT * (self._high[1] - value)
            drawn += f'<path class="grid" d="M0 {y:.1f}H{width:.1f}"/>'
            drawn += f'<text class="tick up" x="{-0.3 * self._text:.1f}" y="{y + 0.35 * self._text:.1f}">{value:g}</text>'
        drawn += f'<text class="tick" x="{width / 2:.1f}" y="{height + 2.1 * self._text:.1f}">{right} (m)</text>'
        turned = f'transform="translate({-2.0 * self._text:.1f} {height / 2:.1f}) rotate(-90)"'
        return drawn + f'<text class="tick" {turned}>{up} (m)</text>'


def _hull(points: Floats) -> Floats:
    """Return the corners of the convex hull in order. Shape (n, 2) to (m, 2)."""
    if np.ptp(points, axis=0).min() < 1e-9:
        return points[np.lexsort(points.T)][[0, -1]]
    from scipy.spatial import ConvexHull  # here: it takes long to load, and few pages need it

    return points[ConvexHull(points, qhull_options="QJ").vertices]


def _lines(points: Floats) -> str:
    """Return lines from point to point, each told from the one before, which is shorter. Shape (n, 2), to a tenth of a unit."""
    tenths = np.round(10.0 * points).astype(int)
    (x, y), steps = tenths[0], np.diff(tenths, axis=0)
    return f"M{x / 10:g} {y / 10:g}" + "".join(f"l{dx / 10:g} {dy / 10:g}" for dx, dy in steps if dx or dy)


def _step(span: float) -> float:
    """Return a round distance between ticks."""
    least = span / _TICKS
    power = 10.0 ** math.floor(math.log10(least))
    return next(power * part for part in (1.0, 2.0, 5.0, 10.0) if power * part >= least)


def _ticks(low: float, high: float, step: float) -> list[float]:
    return [round(k * step, 9) for k in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)]


def _listed(what: str, names: Iterable[str]) -> str:
    listed = ", ".join(names)
    return f"{what} {listed}. " if listed else ""
