"""Pictures of a mission: hoops, regions, paths and flights as one 3-D plotly figure, and charts over time.

Axis labels carry units. Figures are data: they hold no clock and no random names, so that pages made of them are
the same bytes each time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from verify.data import Mission, Trajectory
from verify.data.mission import Hoop, Region

CLEAR = "rgba(0,0,0,0)"
"""Background of every figure, so that the page's own shows through, dark or light."""

GRID = "rgba(128,136,150,0.25)"
_MARK = "#7d8594"
"""Grey of limit lines: three to one against white and against black."""

COLOURS = ("#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e", "#17becf", "#8c564b", "#e377c2", "#7f7f7f", "#bcbd22")
"""Colour of each robot, in the mission's order."""

_REGION_COLOURS = ("#4c9be8", "#9aa0a6", "#f2a541", "#5cb85c", "#c678dd", "#e06c75", "#56b6c2", "#d19a66")

Floats = NDArray[np.float64]

CAMERA = {"eye": {"x": 0.8, "y": -1.7, "z": 1.0}, "center": {"x": 0.0, "y": 0.0, "z": -0.2}}
"""Where a scene is looked at from at first, so that the whole workspace and its axes are in the picture."""


def robot_colour(index: int) -> str:
    """Return the colour of the robot with this place in the mission."""
    return COLOURS[index % len(COLOURS)]


def region_colours(mission: Mission) -> dict[str, str]:
    """Return one colour for each region."""
    return {name: _REGION_COLOURS[i % len(_REGION_COLOURS)] for i, name in enumerate(mission.all_regions)}


def sample_paths(team: Mapping[str, Trajectory], step: float = 0.05, laps: int = 1) -> tuple[Floats, dict[str, Floats]]:
    """Sample a team's flight for drawing.

    Args:
        team: One trajectory a robot.
        step: Time between samples, s.
        laps: Laps of the cycle, for infinite flights.

    Returns:
        Times in s, shape (times,), and for each robot x, y, z in m and yaw in rad, shape (times, 4).
    """
    flown = {name: trajectory.flattened(laps) for name, trajectory in team.items()}
    end = max(trajectory.duration for trajectory in flown.values())
    times = np.linspace(0.0, end, max(2, math.ceil(end / step) + 1))
    return times, {name: trajectory.evaluate(times) for name, trajectory in flown.items()}


def scene(
    mission: Mission,
    paths: Mapping[str, Floats],
    *,
    flown: Mapping[str, Floats] | None = None,
    waypoints: Mapping[str, Sequence[Sequence[float]]] | None = None,
    tube: float | None = None,
) -> go.Figure:
    """Draw hoops, regions, starts, planned and flown paths.

    Args:
        mission: Gives hoops, regions, workspace and the robots' order.
        paths: For each robot, positions in m. Shape (points, 3 or more); further columns are not drawn.
        flown: Likewise, for what was flown, drawn dotted.
        waypoints: For each robot, points in m to mark.
        tube: Radius in m of a translucent tube around each path: the certificate's margin.

    Returns:
        A figure whose last traces, one a robot in the mission's order, are markers that a player may move.
    """
    figure = go.Figure()
    colours = region_colours(mission)
    for name, region in mission.all_regions.items():
        figure.add_trace(_ellipsoid(name, region, colours[name]))
        figure.add_trace(_name(name, region))
        if isinstance(region, Hoop):
            figure.add_trace(_ring(name, region, colours[name]))
            figure.add_trace(_normal(name, region, colours[name]))
    for index, name in enumerate(mission.agents):
        colour = robot_colour(index)
        if name in paths:
            path = paths[name]
            figure.add_trace(_line(path, name, colour, dash="solid", shown=True))
            if tube:
                figure.add_trace(_tube(path[:, :3], tube, name, colour))
        if flown and name in flown:
            figure.add_trace(_line(flown[name], name, colour, dash="dot", shown=False))
        if waypoints and name in waypoints:
            points = np.array(waypoints[name], dtype=float)
            marker = {"size": 3, "color": colour, "symbol": "diamond"}
            figure.add_trace(_points(points, f"{name}: waypoints", marker, name))
    for index, name in enumerate(mission.agents):
        start = np.array([mission.agents[name].start])
        marker = {"size": 8, "color": robot_colour(index), "line": {"color": "#222", "width": 1}}
        figure.add_trace(_points(start, name, marker, name))
    low, high = mission.workspace.min, mission.workspace.max
    axes = {
        f"{axis}axis": {"title": f"{axis} (m)", "range": [low[i], high[i]], "backgroundcolor": CLEAR, "gridcolor": "#d5d9e2"}
        for i, axis in enumerate("xyz")
    }
    spans = [high[i] - low[i] for i in range(3)]
    ratio = {axis: spans[i] / max(spans) * 1.5 for i, axis in enumerate("xyz")}
    figure.update_layout(
        scene={
            **axes,
            "aspectmode": "manual",
            "aspectratio": ratio,
            "camera": CAMERA,
        },
        margin={"l": 0, "r": 0, "t": 0, "b": 0},
        legend={"orientation": "v", "x": 0.01, "y": 0.99, "font": {"size": 12}, "bgcolor": CLEAR},
        uirevision="keep",
        paper_bgcolor=CLEAR,
    )
    return figure


def over_time(
    lines: Mapping[str, tuple[Floats, Floats]],
    title: str,
    *,
    limits: Mapping[str, float] | None = None,
    colours: Mapping[str, str],
    dashes: Mapping[str, str] | None = None,
) -> go.Figure:
    """Draw quantities over mission time, with horizontal limit lines.

    Args:
        lines: Name: times in s and values. Shapes (samples,).
        title: Axis label, with its unit.
        limits: Name: value of a limit in the same unit.
        colours: Colour of each line by name.
        dashes: Plotly's dash of a line by name; solid where there is none.
    """
    figure = go.Figure()
    for name, (times, values) in lines.items():
        figure.add_trace(
            go.Scatter(
                x=_short(times),
                y=_short(values),
                name=name,
                mode="lines",
                line={"color": colours.get(name), "width": 1.5, "dash": (dashes or {}).get(name, "solid")},
            )
        )
    for name, value in (limits or {}).items():
        figure.add_hline(y=value, line={"dash": "dash", "color": _MARK}, annotation={"text": name, "font": {"size": 11}})
    figure.update_layout(
        xaxis={"title": "time (s)", "gridcolor": GRID, "zeroline": False},
        yaxis={"title": title, "gridcolor": GRID, "rangemode": "tozero", "zeroline": False},
        margin={"l": 60, "r": 20, "t": 10, "b": 40},
        legend={"orientation": "h", "y": 1.12},
        showlegend=True,
        plot_bgcolor=CLEAR,
        paper_bgcolor=CLEAR,
    )
    return figure


def spells(rows: Sequence[tuple[str, float, float, str, str]], order: Sequence[str], *, height_each: int = 22) -> go.Figure:
    """Draw spells of time as horizontal bars.

    Args:
        rows: (row name, start in s, end in s, colour, text shown on hovering).
        order: Row names from top to bottom.
        height_each: Pixels for one row.
    """
    figure = go.Figure()
    figure.add_trace(
        go.Bar(
            y=[row for row, *_ in rows],
            x=[round(end - start, 4) for _, start, end, _, _ in rows],
            base=[round(start, 4) for _, start, *_ in rows],
            orientation="h",
            marker={"color": [colour for *_, colour, _ in rows], "line": {"width": 0}},
            hovertext=[text for *_, text in rows],
            hoverinfo="text",
            showlegend=False,
        )
    )
    figure.update_layout(
        barmode="overlay",
        bargap=0.25,
        xaxis={"title": "time (s)", "gridcolor": GRID, "rangemode": "tozero", "zeroline": False},
        yaxis={"categoryorder": "array", "categoryarray": list(reversed(order)), "type": "category", "automargin": True},
        margin={"l": 10, "r": 20, "t": 10, "b": 40},
        height=60 + height_each * max(len(order), 1),
        plot_bgcolor=CLEAR,
        paper_bgcolor=CLEAR,
    )
    return figure


def _ellipsoid(name: str, region: Region, colour: str) -> go.Mesh3d:
    """A translucent ellipsoid, drawn from its radii and yaw."""
    azimuth, polar = np.meshgrid(np.linspace(0, 2 * np.pi, 25)[:-1], np.linspace(0, np.pi, 13))
    a, b, c = region.radii
    own = np.stack([a * np.sin(polar) * np.cos(azimuth), b * np.sin(polar) * np.sin(azimuth), c * np.cos(polar)], axis=-1)
    points = own.reshape(-1, 3) @ _turn_z(region.yaw).T + np.array(region.center)
    i, j, k = _grid_faces(13, 24)
    x, y, z = _columns(points)
    return go.Mesh3d(
        x=x, y=y, z=z, i=i, j=j, k=k, color=colour, opacity=0.28, name=name, hovertext=name, hoverinfo="text",
        showlegend=False, legendgroup=name, flatshading=False,
    )  # fmt: skip


def _name(name: str, region: Region) -> go.Scatter3d:
    """The region's name above it, in the page's own text colour."""
    x, y, z = region.center
    above = max(region.radii[2], region.opening + region.rim if isinstance(region, Hoop) else 0.0) + 0.06
    return go.Scatter3d(
        x=[x], y=[y], z=[round(z + above, 4)], mode="text", text=[name], hoverinfo="skip", showlegend=False, name=name,
    )  # fmt: skip


def _ring(name: str, hoop: Hoop, colour: str) -> go.Mesh3d:
    """The hoop's solid rim as a torus-like band."""
    normal, across, up = hoop_axes(hoop)
    around, tube = np.meshgrid(np.linspace(0, 2 * np.pi, 41)[:-1], np.linspace(0, 2 * np.pi, 9)[:-1], indexing="ij")
    radius = hoop.opening + hoop.rim / 2 + hoop.rim / 2 * np.cos(tube)
    offset = hoop.rim / 2 * np.sin(tube)
    points = (
        np.array(hoop.center)
        + (radius * np.cos(around))[..., None] * across
        + (radius * np.sin(around))[..., None] * up
        + offset[..., None] * normal
    ).reshape(-1, 3)
    faces: list[tuple[int, int, int]] = []
    for p in range(40):
        for q in range(8):
            corner = [p * 8 + q, ((p + 1) % 40) * 8 + q, ((p + 1) % 40) * 8 + (q + 1) % 8, p * 8 + (q + 1) % 8]
            faces += [(corner[0], corner[1], corner[2]), (corner[0], corner[2], corner[3])]
    i, j, k = (list(column) for column in zip(*faces, strict=True))
    x, y, z = _columns(points)
    return go.Mesh3d(
        x=x, y=y, z=z, i=i, j=j, k=k, color=colour, opacity=1.0, name=f"{name} rim", hovertext=f"rim of {name}",
        hoverinfo="text", legendgroup=name, showlegend=False,
    )  # fmt: skip


def _normal(name: str, hoop: Hoop, colour: str) -> go.Scatter3d:
    """An arrow-like line from the rear to the front control point."""
    normal, _, _ = hoop_axes(hoop)
    centre = np.array(hoop.center)
    reach = hoop.reach or 0.0
    x, y, z = _columns(np.stack([centre - reach * normal, centre, centre + reach * normal]))
    return go.Scatter3d(
        x=x, y=y, z=z, mode="lines+markers", line={"color": colour, "width": 2, "dash": "dash"},
        marker={"size": [2, 2, 4], "color": colour}, hovertext=[f"{name} rear", f"{name} centre", f"{name} front"],
        hoverinfo="text", legendgroup=name, showlegend=False, name=f"{name} normal",
    )  # fmt: skip


def hoop_axes(hoop: Hoop) -> tuple[Floats, Floats, Floats]:
    """Return the hoop's normal and two unit vectors in its plane (the first is horizontal)."""
    normal = np.array(hoop.normal, dtype=float)
    across = np.array([-math.sin(hoop.yaw), math.cos(hoop.yaw), 0.0])
    return normal, across, np.cross(normal, across)


def _line(path: Floats, group: str, colour: str, *, dash: str, shown: bool) -> go.Scatter3d:
    x, y, z = _columns(path[:, :3])
    return go.Scatter3d(
        x=x, y=y, z=z, mode="lines", line={"color": colour, "width": 4 if dash == "solid" else 3, "dash": dash},
        name=group, hoverinfo="name", legendgroup=group, showlegend=shown,
    )  # fmt: skip


def _tube(path: Floats, radius: float, group: str, colour: str) -> go.Mesh3d:
    """A translucent tube around a path; where the path rests it is a ball's outline at most."""
    kept = [0]
    for index in range(1, len(path)):  # rings a tube's radius apart, so that slow parts cost nothing
        if np.linalg.norm(path[index] - path[kept[-1]]) >= radius / 2:
            kept.append(index)
    points = path[kept] if len(kept) > 1 else np.stack([path[0] - [0, 0, radius / 2], path[0] + [0, 0, radius / 2]])
    ahead = np.gradient(points, axis=0)
    ahead /= np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-12)
    helper = np.where(np.abs(ahead[:, 2:3]) > 0.9, np.array([[1.0, 0.0, 0.0]]), np.array([[0.0, 0.0, 1.0]]))
    first = np.cross(ahead, helper)
    first /= np.maximum(np.linalg.norm(first, axis=1, keepdims=True), 1e-12)
    second = np.cross(ahead, first)
    around = np.linspace(0, 2 * np.pi, 11)[:-1]
    ring = np.cos(around)[None, :, None] * first[:, None] + np.sin(around)[None, :, None] * second[:, None]
    corners = (points[:, None] + radius * ring).reshape(-1, 3)
    i, j, k = _grid_faces(len(points), len(around))
    x, y, z = _columns(corners)
    return go.Mesh3d(
        x=x, y=y, z=z, i=i, j=j, k=k, color=colour, opacity=0.12, name=f"{group}: tube", hoverinfo="skip", legendgroup=group,
        showlegend=False,
    )  # fmt: skip


def _points(points: Floats, name: str, marker: dict[str, object], group: str) -> go.Scatter3d:
    x, y, z = _columns(points)
    return go.Scatter3d(
        x=x, y=y, z=z, mode="markers", marker=marker, name=name, hoverinfo="name", legendgroup=group, showlegend=False
    )


def _turn_z(yaw: float) -> Floats:
    cos, sin = math.cos(yaw), math.sin(yaw)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])


def _grid_faces(rows: int, columns: int) -> tuple[list[int], list[int], list[int]]:
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


def _columns(points: Floats) -> tuple[list[float], list[float], list[float]]:
    x, y, z = (_short(points[:, axis]) for axis in range(3))
    return x, y, z


def _short(values: Floats) -> list[float]:
    """Round to a tenth of a millimetre or so: pictures need no more, and pages stay small."""
    return [round(float(value), 4) for value in values]
