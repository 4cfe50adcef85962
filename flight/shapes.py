"""Shapes of a mission as plotly's traces: regions, hoops' rims, tubes around paths, lines, points.

A region's traces share its name as their group. Coordinates are in m, rounded to a tenth of a millimetre: pictures need no more,
and pages stay small.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flight.figures import Trace, trace
from verify.data.shapes.convex_parts import outline
from verify.data.shapes.inequalities import Inequality
from verify.data.shapes.obstacle import Obstacle
from verify.data.shapes.placed_body import PlacedBody
from verify.data.shapes.region import Hoop, Region

Floats = NDArray[np.float64]
_Faces = tuple[list[int], list[int], list[int]]

SOLID = "#7b818c"
"""Colour of obstacles: none of a region's or a robot's."""
_THINNEST = 0.01
"""m; a rim of less is drawn with this, to be seen at all."""

_WITH_TWO = 10.0
"""Values as great as this have two digits after the point."""
AROUND = 24
"""Corners of an ellipsoid's widest outline, where few are drawn."""


def region_shapes(name: str, region: Region, colour: str, *, around: int = AROUND) -> list[Trace]:
    """Return a region as it is seen: its body, its name, and a hoop's rim.

    Args:
        name: The region's.
        region: The region.
        colour: As CSS has it.
        around: Corners of an ellipsoid's widest outline.
    """
    rim: list[Trace] = [_ring(name, region, colour)] if isinstance(region, Hoop) else []
    bodies = [_body(name, region, colour, around=around)] if region.is_ellipsoid else _parts(name, region, colour)
    return [*bodies, _name_above(name, region), *rim]


def obstacle_shapes(name: str, obstacle: Obstacle, *, named: bool = True, around: int = AROUND) -> list[Trace]:
    """Return a solid body as it is seen, with its name.

    Args:
        name: The obstacle's.
        obstacle: The body; where it has openings, their hoops are drawn as regions are.
        named: Whether its name stands above it; it is said on hovering in any case.
        around: Corners of an ellipsoid's widest outline.
    """
    if obstacle.is_ellipsoid:
        bodies: list[Trace] = [_body(name, obstacle, SOLID, opacity=0.5, around=around)]
    else:
        bodies = _parts(name, obstacle, SOLID, opacity=0.5)
    return [*bodies, _name_above(name, obstacle)] if named else bodies


def _parts(name: str, body: PlacedBody, colour: str, *, opacity: float = 0.28) -> list[Trace]:
    """A translucent body for each convex part of a region or obstacle of another shape than an ellipsoid."""
    from scipy.spatial import ConvexHull  # here: it takes long to load, and most regions are ellipsoids

    drawn: list[Trace] = []
    for part in body.measures.parts:
        corners = outline(part)
        hull = ConvexHull(corners, qhull_options="QJ")
        i, j, k = (column.tolist() for column in hull.simplices.T)
        drawn.append(_mesh(_Surface(corners + np.array(body.center), (i, j, k)), name, colour, group=name, opacity=opacity))
    return drawn


def _body(name: str, region: PlacedBody, colour: str, *, opacity: float = 0.28, around: int = AROUND) -> Trace:
    """A translucent ellipsoid, by its radii and yaw or by where rays from its centre leave it."""
    azimuth, polar = np.meshgrid(np.linspace(0, 2 * np.pi, around + 1)[:-1], np.linspace(0, np.pi, around // 2 + 1))
    ways = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=-1).reshape(-1, 3)
    own = surface_points(region.body, ways) if region.radii is None else (ways * region.radii) @ _turn_z(region.yaw).T
    corners = own + np.array(region.center)
    return _mesh(_Surface(corners, _grid_faces(around // 2 + 1, around)), name, colour, group=name, opacity=opacity)


def _name_above(name: str, region: PlacedBody) -> Trace:
    """The region's name above it, in the page's own text colour."""
    x, y, z = region.center
    above = max(region.half_lengths[2], region.opening + region.rim if isinstance(region, Hoop) else 0.0) + 0.06
    return trace(
        "scatter3d", x=[x], y=[y], z=[round(z + above, 4)], mode="text", text=[name], hoverinfo="skip", showlegend=False, name=name,
    )  # fmt: skip


def _ring(name: str, hoop: Hoop, colour: str) -> Trace:
    """The hoop's solid rim: a torus, or a thin one where the rim has no thickness."""
    normal, across, up = hoop_axes(hoop)
    around, tube = np.meshgrid(np.linspace(0, 2 * np.pi, 37), np.linspace(0, 2 * np.pi, 7)[:-1], indexing="ij")
    thick = max(hoop.rim, _THINNEST) / 2
    radius = hoop.opening + hoop.rim / 2 + thick * np.cos(tube)
    corners = (
        np.array(hoop.center)
        + (radius * np.cos(around))[..., None] * across
        + (radius * np.sin(around))[..., None] * up
        + (thick * np.sin(tube))[..., None] * normal
    ).reshape(-1, 3)
    return _mesh(_Surface(corners, _grid_faces(37, 6)), f"{name} rim", colour, group=name)


def passage(name: str, hoop: Hoop, colour: str) -> Trace:
    """Return an arrow-like line from the rear to the front control point.

    Args:
        name: The hoop's.
        hoop: The hoop.
        colour: As CSS has it.
    """
    normal, _, _ = hoop_axes(hoop)
    centre = np.array(hoop.center)
    reach = hoop.reach or 0.0
    x, y, z = _columns(np.stack([centre - reach * normal, centre, centre + reach * normal]))
    return trace(
        "scatter3d", x=x, y=y, z=z, mode="lines+markers", line={"color": colour, "width": 2, "dash": "dash"},
        marker={"size": [2, 2, 4], "color": colour}, hovertext=[f"{name} rear", f"{name} centre", f"{name} front"],
        hoverinfo="text", legendgroup=name, showlegend=False, name=f"{name} normal",
    )  # fmt: skip


def hoop_axes(hoop: Hoop) -> tuple[Floats, Floats, Floats]:
    """Return the hoop's normal and two unit vectors in its plane (the first is horizontal)."""
    normal = np.array(hoop.normal, dtype=float)
    across = np.array([-math.sin(hoop.yaw), math.cos(hoop.yaw), 0.0])
    return normal, across, np.cross(normal, across)


def line(path: Floats, name: str, colour: str, *, dash: str = "solid", width: float = 4, shown: bool = True) -> Trace:
    """Return a line through points; it is broken where a point is NaN.

    Args:
        path: m. Shape (points, 3 or more).
        name: Shown on hovering and in the legend.
        colour: Of the line.
        dash: Plotly's word.
        width: In pixels.
        shown: Whether it has a place of its own in the legend.
    """
    x, y, z = _columns(path[:, :3])
    return trace(
        "scatter3d", x=x, y=y, z=z, mode="lines", line={"color": colour, "width": width, "dash": dash}, name=name,
        hovertemplate=f"{name}<extra></extra>", legendgroup=name, showlegend=shown,
    )  # fmt: skip


def bends(path: Floats, tolerance: float) -> list[int]:
    """Return which points of a path to keep, so that lines between them pass all others (the Ramer-Douglas-Peucker algorithm).

    Args:
        path: m. Shape (points, 3).
        tolerance: How far from its line a point that is left out may be, m.

    Returns:
        Indices in order; the last point is left out where all are as near as that to the first. All where some are NaN.
    """
    if not np.isfinite(path).all():
        return list(range(len(path)))
    kept, spans = {0}, [(0, len(path) - 1)]
    while spans:
        first, last = spans.pop()
        along, steps = path[last] - path[first], path[first : last + 1] - path[first]
        share = np.clip(steps @ along / max(float(along @ along), 1e-18), 0.0, 1.0)
        off = np.linalg.norm(steps - share[:, None] * along, axis=1)
        farthest = int(np.argmax(off))
        if off[farthest] > tolerance:
            spans += [(first, first + farthest), (first + farthest, last)]
        elif np.linalg.norm(along) > tolerance:
            kept |= {first, last}
    return sorted(kept)


def tube(path: Floats, radius: float, group: str, colour: str) -> Trace:
    """Return a translucent tube around a path; where the path rests it is a ball's outline at most.

    Args:
        path: m. Shape (points, 3).
        radius: m.
        group: What is hidden together with it.
        colour: Of the tube.
    """
    kept = bends(path, radius / 10)
    centres = path[kept] if len(kept) > 1 else np.stack([path[0] - [0, 0, radius / 2], path[0] + [0, 0, radius / 2]])
    ahead = np.gradient(centres, axis=0)
    ahead /= np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-12)
    helper = np.where(np.abs(ahead[:, 2:3]) > 0.9, np.array([[1.0, 0.0, 0.0]]), np.array([[0.0, 0.0, 1.0]]))
    first = np.cross(ahead, helper)
    first /= np.maximum(np.linalg.norm(first, axis=1, keepdims=True), 1e-12)
    second = np.cross(ahead, first)
    around = np.linspace(0, 2 * np.pi, 9)[:-1]
    circles = np.cos(around)[None, :, None] * first[:, None] + np.sin(around)[None, :, None] * second[:, None]
    surface = _Surface((centres[:, None] + radius * circles).reshape(-1, 3), _grid_faces(len(centres), len(around)))
    return _mesh(surface, f"{group}: tube", colour, group=group, opacity=0.12, hover="skip")


def points(
    places: Floats,
    name: str,
    marker: Mapping[str, object],
    *,
    group: str | None = None,
    shown: bool = False,
    texts: Sequence[str] = (),
) -> Trace:
    """Return marks at points.

    Args:
        places: m. Shape (points, 3).
        name: In the legend, and shown on hovering where there are no texts.
        marker: Plotly's words for size, colour and symbol.
        group: What is hidden together with them; their own name where none is given.
        shown: Whether they have a place of their own in the legend.
        texts: Shown on hovering, one a point.
    """
    x, y, z = _columns(places)
    return trace(
        "scatter3d", x=x, y=y, z=z, mode="markers", marker=marker, name=name, hovertext=list(texts) or [name] * len(places), hoverinfo="text",
        legendgroup=group or name, showlegend=shown,
    )  # fmt: skip


def _turn_z(yaw: float) -> Floats:
    cos, sin = math.cos(yaw), math.sin(yaw)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])


@dataclass(frozen=True, eq=False, slots=True)
class _Surface:
    """Surface of triangles: corners in m, shape (n, 3), and the indices of each triangle's corners."""

    corners: Floats
    faces: _Faces


def _grid_faces(rows: int, columns: int) -> _Faces:
    """Triangles of a grid that closes around its columns."""
    faces: list[tuple[int, int, int]] = []
    for row in range(rows - 1):
        for column in range(columns):
            right = (column + 1) % columns
            a, b = row * columns + column, row * columns + right
            c, d = (row + 1) * columns + right, (row + 1) * columns + column
            faces += [(a, b, c), (a, c, d)]
    i, j, k = (list(part) for part in zip(*faces, strict=True))
    return i, j, k


def _mesh(surface: _Surface, name: str, colour: str, *, group: str, opacity: float = 1.0, hover: str = "text") -> Trace:
    """A body of triangles that says its name on hovering."""
    x, y, z = _columns(surface.corners)
    i, j, k = surface.faces
    return trace(
        "mesh3d", x=x, y=y, z=z, i=i, j=j, k=k, color=colour, opacity=opacity, name=name, hovertext=name,
        hoverinfo=hover, legendgroup=group, showlegend=False, flatshading=False,
    )  # fmt: skip


def _columns(points: Floats) -> tuple[list[float | None], list[float | None], list[float | None]]:
    x, y, z = (rounded(points[:, axis]) for axis in range(3))
    return x, y, z


def rounded(values: Floats) -> list[float | None]:
    """Return numbers with four digits after the point, two where the greatest has two before it; None where there is none, which ends a line."""
    digits = 2 if np.nanmax(np.abs(values), initial=0.0) >= _WITH_TWO else 4
    return [None if math.isnan(value) else round(float(value), digits) for value in values]


def surface_points(parts: Sequence[Sequence[Inequality]], ways: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return where rays from the centre leave a convex body that holds its centre.

    Args:
        parts: The body; of several parts the first.
        ways: Directions. Shape (n, 3).

    Returns:
        Points relative to the centre, m. Shape (n, 3).
    """
    reach = np.full(len(ways), np.inf)
    for inequality in parts[0]:
        square = np.einsum("ni,ij,nj->n", ways, np.array(inequality.quadratic), ways)
        slope = ways @ np.array(inequality.linear)
        with np.errstate(all="ignore"):  # 2 b / (slope + root) is the positive root for half-spaces too
            far = 2 * inequality.bound / (slope + np.sqrt(slope**2 + 4 * square * inequality.bound))
        reach = np.minimum(reach, np.where(far > 0, far, np.inf))
    return reach[:, None] * ways
