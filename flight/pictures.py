"""Pictures of a mission: hoops, regions, paths and flights as one 3-D figure, to scale.

Axis labels carry units. Figures are data: they hold no clock and no random names, so that pages made of them are
the same bytes each time. Robots have vivid colours, regions pale ones, so that neither is taken for the other.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from flight.figures import Figure, Trace
from flight.shapes import AROUND, Floats, bends, line, obstacle_shapes, passage, points, region_shapes, tube
from verify.data import Mission, Trajectory
from verify.data.shapes.obstacle import Obstacle
from verify.data.shapes.region import Hoop, Region

CLEAR = "rgba(0,0,0,0)"
"""Background of every figure, so that the page's own shows through, dark or light."""

COLOURS = ("#1f77e0", "#d62728", "#1a9a2f", "#9b45d6", "#f07800", "#00a8c8", "#e33fa6", "#925f1c", "#9aa500", "#4a4fd0")
"""Colour of each robot, in the mission's order: vivid."""

REGION_COLOURS = ("#80a5c3", "#c7ac8e", "#7a987c", "#bd9cb8", "#b9bdc6", "#b48580", "#a1a37f", "#8689ac")
"""Colour of each region, in the mission's order: pale, and seen on white and on black."""

CAMERA = {"eye": {"x": 0.8, "y": -1.7, "z": 1.0}, "center": {"x": 0.0, "y": 0.0, "z": -0.2}}
"""Where a scene is looked at from at first, so that the whole workspace and its axes are in the picture."""

LEGEND = {"orientation": "h", "x": 0.0, "y": 1.0, "yanchor": "bottom", "font": {"size": 12}, "bgcolor": CLEAR}
"""Above every figure: inside it, it would cover words, and beside it, it would take a phone's width."""

MANY = 20
"""Names up to which a figure has a legend; more would cover it, and are told beside it."""

_SEEN = 5e-4
"""m; points of a line are left out where the line without them is as near as that, so that pages stay small."""
_NAMED = 8
"""Solid bodies up to which each has its name above it; more would hide what is flown."""
_COARSE = 8
"""Corners around ellipsoids where robots and bodies are many: a browser draws each corner of all of them in each frame."""
_SIZE = 1.4
"""The longest side of a scene, in plotly's own unit."""


def robot_colour(index: int) -> str:
    """Return the colour of the robot with this place in the mission."""
    return COLOURS[index % len(COLOURS)]


def region_colours(mission: Mission) -> dict[str, str]:
    """Return one colour for each region."""
    return {name: REGION_COLOURS[i % len(REGION_COLOURS)] for i, name in enumerate(mission.all_regions)}


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
    margin: float | None = None,
    earlier: Sequence[tuple[float, Mission]] = (),
) -> Figure:
    """Draw hoops, regions, obstacles, starts, planned and flown paths.

    Args:
        mission: Gives hoops, regions, obstacles, workspace and the robots' order.
        paths: For each robot, positions in m. Shape (points, 3 or more); further columns are not drawn.
        flown: Likewise, for what was flown, drawn dotted.
        waypoints: For each robot, points in m to mark.
        margin: Radius in m of a translucent tube around each path.
        earlier: The world as it was: missions, each with the time in s until which it was so, in order.

    Returns:
        A figure whose last traces, one a robot in the mission's order, are markers that a player may move. Traces of what
        was there for a time only carry that time in s as `meta`: `since`, and `until` where it ended. Markers of robots are rings, as
        large on all screens; pages draw in them each robot to scale, by `meta`: `robots` and their `radii` in m.
    """
    figure = Figure(_world(mission, earlier))
    for index, name in enumerate(mission.agents):
        colour = robot_colour(index)
        if name in paths:
            path = paths[name][:, :3]
            figure.add_trace(line(path[bends(path, _SEEN)], name, colour))
            if margin:
                figure.add_trace(tube(path, margin, name, colour))
        if flown and name in flown:
            path = flown[name][:, :3]
            dots = line(path[bends(path, _SEEN)], f"{name}, flown", colour, dash="dot", width=3, shown=False)
            figure.add_trace(dots | {"legendgroup": name})
        if waypoints and name in waypoints:
            marker = {"size": 3, "color": colour, "symbol": "diamond"}
            figure.add_trace(points(np.array(waypoints[name], dtype=float), f"{name}: waypoints", marker, group=name))
    for index, name in enumerate(mission.agents):
        marker = {"size": 5, "color": robot_colour(index), "symbol": "circle-open", "line": {"width": 2}}
        said = {"robots": [name], "radii": [mission.vehicle_of(name).radius]}
        figure.add_trace(points(np.array([mission.agents[name].start]), name, marker) | {"meta": said})
    layout = scene_layout(mission, [*paths.values(), *(flown or {}).values()])
    return figure.update_layout(layout, showlegend=len(mission.agents) <= MANY)


def scene_layout(mission: Mission, paths: Sequence[Floats] = ()) -> dict[str, object]:
    """Return the layout of every scene: the workspace's axes, to scale, and the legend above.

    Args:
        mission: Gives the workspace.
        paths: Positions in m that must be seen too, such as those of a robot that landed below it. Shapes (points, 3 or more).
    """
    corners = np.concatenate([[mission.workspace.min, mission.workspace.max], *(path[:, :3] for path in paths)])
    low, high = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    spans = {axis: high[i] - low[i] for i, axis in enumerate("xyz")}
    largest = max(spans.values())
    axes = {
        f"{axis}axis": {"title": {"text": f"{axis} (m)"}, "range": [low[i], high[i]], "backgroundcolor": CLEAR, "nticks": 6}
        for i, axis in enumerate("xyz")
    }
    return {
        # plotly's own "data" measures what is drawn and not the axes' ranges: where these are given it is not to scale
        "scene": {
            **axes,
            "aspectmode": "manual",
            "aspectratio": {axis: _SIZE * span / largest for axis, span in spans.items()},
            "camera": CAMERA,
        },
        "margin": {"l": 0, "r": 0, "t": 0, "b": 0},
        "legend": LEGEND,
        "uirevision": "keep",
        "paper_bgcolor": CLEAR,
    }


def _world(mission: Mission, earlier: Sequence[tuple[float, Mission]]) -> list[Trace]:
    """Return regions, hoops and obstacles as they are, and before them as they were."""
    traces: list[Trace] = []
    colours = region_colours(mission)
    worlds = [*(_bodies(world) for _, world in earlier), _bodies(mission)]
    ends = [*(until for until, _ in earlier), None]
    around = AROUND if min(len(mission.agents), len(worlds[-1])) <= MANY else _COARSE
    for name in dict.fromkeys(name for world in reversed(worlds) for name in world):
        since = 0.0
        for index, until in enumerate(ends):
            body = worlds[index].get(name)
            if until is not None and body == worlds[index + 1].get(name):
                continue
            lasts = {**({"since": since} if since else {}), **({} if until is None else {"since": since, "until": until})}
            if body is not None:
                named = len(mission.obstacles) <= _NAMED
                traces += _shapes(name, body, colours.get(name, ""), lasts or None, named=named, around=around)
            since = until or since
    return traces


def _bodies(mission: Mission) -> dict[str, Region | Obstacle]:
    return {**mission.all_regions, **mission.obstacles}


def _shapes(
    name: str, body: Region | Obstacle, colour: str, lasts: dict[str, float] | None, *, named: bool, around: int
) -> list[Trace]:
    if isinstance(body, Obstacle):
        shapes = obstacle_shapes(name, body, named=named, around=around)
    else:
        shapes = region_shapes(name, body, colour, around=around)
    if isinstance(body, Hoop):
        shapes.append(passage(name, body, colour))
    for shape in shapes:
        shape["visible"] = lasts is None or "until" not in lasts
        if lasts is not None:
            shape["meta"] = lasts
    return shapes
