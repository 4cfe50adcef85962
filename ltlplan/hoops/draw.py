"""Pictures in the spirit of the 2019 paper's Figs. 2 to 7, as plotly figures: hoops, primitives, sampled and optimised paths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.basedatatypes import BaseTraceType

from ltlplan.hoops.control_points import control_points, ring
from ltlplan.hoops.primitives import Kind
from ltlplan.hoops.sequencer import segments
from ltlplan.splines import Spline
from verify.data import BadInput, Mission, RobotPlan
from verify.data.mission import Hoop, Region

Floats = NDArray[np.float64]

_COLOURS: Mapping[Kind, str] = {"STRAIGHT": "#1b9e77", "S_CURVE": "#7570b3", "U_TURN": "#d95f02", "TURN": "#e7298a"}
_ROLES: Mapping[str, tuple[str, str]] = {
    "rear": ("#1f4e9c", "circle"),
    "centre": ("#777777", "circle-open"),
    "front": ("#1b9e77", "circle"),
    "avoid": ("#c62828", "diamond"),
}
"""Colour and symbol of a hoop's control points."""
_PREFIX, _CYCLE, _BEST = "#1f4e9c", "#c62828", "#f08c00"
_MOST_PATHS = 200


def control_point_figure(mission: Mission) -> go.Figure:
    """Return the mission's regions and rings with the five control points of each hoop (Fig. 2)."""
    return _figure(mission, [*_regions(mission), *_control_points(mission)], "Hoops and their control points")


def primitives_figure(mission: Mission, plan: RobotPlan) -> go.Figure:
    """Return one robot's nominal path, each segment in the colour of its primitive, with its waypoints (Figs. 3 and 4)."""
    traces = [*_regions(mission), *_control_points(mission)]
    if len(plan.waypoints) > 1:
        shown: set[str] = set()
        for index, primitive in enumerate(segments(mission, plan)):
            line = _piece(plan, index)
            traces.append(
                go.Scatter3d(
                    x=line[:, 0],
                    y=line[:, 1],
                    z=line[:, 2],
                    mode="lines",
                    name=primitive.kind,
                    legendgroup=primitive.kind,
                    showlegend=primitive.kind not in shown,
                    line={"color": _COLOURS[primitive.kind], "width": 6},
                    hovertemplate=f"{primitive.kind} {primitive.length:.2f} m<extra></extra>",
                )
            )
            shown.add(primitive.kind)
    traces.append(_waypoints(plan))
    return _figure(mission, traces, "Motion primitives along the nominal path")


def path_figure(mission: Mission, plan: RobotPlan, *, nominal: RobotPlan | None = None) -> go.Figure:
    """Return one robot's path, prefix and cycle in two colours, with the path it was made from where given (Figs. 5, 7)."""
    traces = _regions(mission)
    if nominal is not None and len(nominal.waypoints) > 1:
        line = _path(nominal)
        traces.append(_line(line, "nominal path", "#888888", dash="dash"))
    if len(plan.waypoints) > 1:
        spline = Spline(plan.times, plan.cycle_waypoint)
        line, at = _path(plan), _times(plan)
        split = len(at) if spline.cycle is None else int(np.searchsorted(at, spline.times[spline.cycle]))
        if split > 1:
            traces.append(_line(line[: split + 1], "path" if spline.cycle is None else "prefix", _PREFIX))
        if spline.cycle is not None:
            traces.append(_line(line[split:], "cycle", _CYCLE))
    traces.append(_waypoints(plan))
    return _figure(mission, traces, "Path through the hoops" if nominal is None else "Optimised path")


def round_figure(
    mission: Mission, positions: Floats, counts: Sequence[bool] | NDArray[np.bool_], *, best: RobotPlan | None = None
) -> go.Figure:
    """Return the sampled paths of one round of cross-entropy: those that count in colour, the others in grey (Fig. 6).

    Args:
        mission: The hoops.
        positions: m, as `SampledPaths.position` has them; at most 200 paths are drawn. Shape (paths, instants, 3).
        counts: Which of them satisfy the specification. Shape (paths,).
        best: A path to draw on top.
    """
    good = np.asarray(counts, dtype=np.bool_)
    if positions.ndim != 3 or positions.shape[2] != 3 or good.shape != (len(positions),):
        raise BadInput(
            f"positions must have shape (paths, instants, 3) and counts (paths,), not {positions.shape}, {good.shape}."
        )
    split = _cycle_begins(best, positions.shape[1])
    traces = _regions(mission)
    for name, chosen in (("does not count", ~good), ("satisfies the specification", good)):
        lines = positions[chosen][: _MOST_PATHS // 2]
        parts = [(f"{name} ({int(chosen.sum())})", lines[:, : split + 1], _PREFIX if chosen is good else "#bbbbbb")]
        if split < positions.shape[1] - 1:
            parts.append((f"{name}, its cycle", lines[:, split:], _CYCLE if chosen is good else "#bbbbbb"))
        for label, part, colour in parts if len(lines) else []:
            gap = np.full((len(lines), 1, 3), np.nan)  # one trace for all paths: a gap between two
            flat = np.concatenate([part, gap], axis=1).reshape(-1, 3)
            traces.append(_line(flat, label, colour, width=1, legend=chosen is good or label == parts[0][0]))
    if best is not None and len(best.waypoints) > 1:
        traces.append(_line(_path(best), "the path in the end", _BEST))
    return _figure(mission, traces, "Sampled paths of one round")


def _cycle_begins(plan: RobotPlan | None, instants: int) -> int:
    """Return the sampled instant at which the paths' cycle begins; the last one where there is none."""
    if plan is None or plan.cycle_waypoint is None or plan.hovers:  # what is sampled ends where a hover begins
        return instants - 1
    share = (plan.times[plan.cycle_waypoint] - plan.times[0]) / (plan.times[-1] - plan.times[0])
    return round(share * (instants - 1))


def _regions(mission: Mission) -> list[BaseTraceType]:
    traces: list[BaseTraceType] = []
    for name, region in mission.all_regions.items():
        x, y, z = _ellipsoid(region)
        traces.append(
            go.Surface(
                x=x,
                y=y,
                z=z,
                opacity=0.25,
                showscale=False,
                name=name,
                colorscale=[[0, "#f2b134"], [1, "#f2b134"]],
                hovertemplate=f"{name}<extra></extra>",
            )
        )
    for name, hoop in mission.hoops.items():
        points = ring(hoop)
        traces.append(_line(points, name, "#444444", width=8, legend=False))
    if mission.all_regions:
        tops = np.array([_top(region) for region in mission.all_regions.values()])
        traces.append(
            go.Scatter3d(
                x=tops[:, 0],
                y=tops[:, 1],
                z=tops[:, 2],
                mode="text",
                name="names",
                showlegend=False,
                text=list(mission.all_regions),
                hoverinfo="skip",
            )
        )
    return traces


def _top(region: Region) -> tuple[float, float, float]:
    """Where a region's name is written: above it, and above its ring."""
    x, y, z = region.center
    height = region.opening + region.rim if isinstance(region, Hoop) else 0.0
    return x, y, z + max(height, region.radii[2]) + 0.08


def _control_points(mission: Mission) -> list[BaseTraceType]:
    traces: list[BaseTraceType] = []
    points = {name: control_points(hoop) for name, hoop in mission.hoops.items()}
    for role, (colour, symbol) in _ROLES.items():
        places = [(name, place) for name, own in points.items() for place in np.atleast_2d(getattr(own, role))]
        if places:
            at = np.array([place for _, place in places])
            traces.append(
                go.Scatter3d(
                    x=at[:, 0],
                    y=at[:, 1],
                    z=at[:, 2],
                    mode="markers",
                    name=role,
                    marker={"size": 4, "color": colour, "symbol": symbol},
                    text=[f"{name} {role}" for name, _ in places],
                    hovertemplate="%{text}<extra></extra>",
                )
            )
    for name, own in points.items():
        traces.append(_line(np.stack([own.rear, own.front]), f"{name}: rear to front", "#1b9e77", width=2, legend=False))
        traces.append(_line(own.avoid, f"{name}: from side to side", "#c62828", width=1, dash="dot", legend=False))
    return traces


def _waypoints(plan: RobotPlan) -> go.Scatter3d:
    places = np.array([w.position for w in plan.waypoints])
    labels = [f"{i}: {w.role}{f' of {w.region}' if w.region else ''}" for i, w in enumerate(plan.waypoints)]
    return go.Scatter3d(
        x=places[:, 0],
        y=places[:, 1],
        z=places[:, 2],
        mode="markers",
        name="waypoints",
        marker={"size": 3, "color": "#222222"},
        text=labels,
        hovertemplate="%{text}<extra></extra>",
    )


def _line(points: Floats, name: str, colour: str, *, width: int = 5, dash: str = "solid", legend: bool = True) -> go.Scatter3d:
    return go.Scatter3d(
        x=points[:, 0],
        y=points[:, 1],
        z=points[:, 2],
        mode="lines",
        name=name,
        showlegend=legend,
        line={"color": colour, "width": width, "dash": dash},
        hovertemplate=f"{name}<extra></extra>",
    )


def _times(plan: RobotPlan) -> Floats:
    return np.linspace(plan.times[0], plan.times[-1], 40 * len(plan.times))


def _path(plan: RobotPlan) -> Floats:
    """Points of the plan's spline. Shape (n, 3)."""
    return Spline(plan.times, plan.cycle_waypoint).evaluate([w.position for w in plan.waypoints], _times(plan))


def _piece(plan: RobotPlan, index: int) -> Floats:
    at = np.linspace(plan.times[index], plan.times[index + 1], 24)
    return Spline(plan.times, plan.cycle_waypoint).evaluate([w.position for w in plan.waypoints], at)


def _ellipsoid(region: Region) -> tuple[Floats, Floats, Floats]:
    across, around = np.meshgrid(np.linspace(0, np.pi, 13), np.linspace(0, 2 * np.pi, 25))
    a, b, c = region.radii
    own = np.stack([a * np.sin(across) * np.cos(around), b * np.sin(across) * np.sin(around), c * np.cos(across)])
    cos, sin = np.cos(region.yaw), np.sin(region.yaw)
    x, y, z = region.center
    return x + cos * own[0] - sin * own[1], y + sin * own[0] + cos * own[1], z + own[2]


def _figure(mission: Mission, traces: Sequence[BaseTraceType], title: str) -> go.Figure:
    low, high = mission.workspace.min, mission.workspace.max
    axes = {
        f"{axis}axis": {"title": {"text": f"{axis} (m)"}, "range": [low[i], high[i]]} for i, axis in enumerate(("x", "y", "z"))
    }
    figure = go.Figure(data=list(traces))
    figure.update_layout(
        title={"text": f"{mission.name}: {title}"},
        scene={**axes, "aspectmode": "data"},
        legend={"orientation": "h", "x": 0.0, "y": 1.0, "yanchor": "bottom"},  # beside the scene it would take its width
    )
    return figure
