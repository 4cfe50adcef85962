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
from verify.data.mission import Region

Floats = NDArray[np.float64]

_COLOURS: Mapping[Kind, str] = {"STRAIGHT": "#1b9e77", "S_CURVE": "#7570b3", "U_TURN": "#d95f02", "TURN": "#e7298a"}
_PREFIX, _CYCLE = "#1f4e9c", "#c62828"
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
    traces = _regions(mission)
    for name, chosen, colour in (("does not count", ~good, "#bbbbbb"), ("satisfies the specification", good, _PREFIX)):
        lines = positions[chosen][: _MOST_PATHS // 2]
        gap = np.full((len(lines), 1, 3), np.nan)  # one trace for all paths: a gap between two
        flat = np.concatenate([lines, gap], axis=1).reshape(-1, 3)
        if len(lines):
            traces.append(_line(flat, f"{name} ({int(chosen.sum())})", colour, width=1))
    if best is not None and len(best.waypoints) > 1:
        traces.append(_line(_path(best), "best", _CYCLE))
    return _figure(mission, traces, "Sampled paths of one round")


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
    return traces


def _control_points(mission: Mission) -> list[BaseTraceType]:
    traces: list[BaseTraceType] = []
    for index, (name, hoop) in enumerate(mission.hoops.items()):
        points = control_points(hoop)
        places = np.stack([points.rear, points.centre, points.front, *points.avoid])
        traces.append(
            go.Scatter3d(
                x=places[:, 0],
                y=places[:, 1],
                z=places[:, 2],
                mode="markers+text",
                name="control points",
                legendgroup="control points",
                showlegend=index == 0,
                marker={"size": 4, "color": "#c62828"},
                text=[f"{name} {role}" for role in ("rear", "centre", "front", "avoid", "avoid")],
                textfont={"size": 9},
            )
        )
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
    figure.update_layout(title={"text": f"{mission.name}: {title}"}, scene={**axes, "aspectmode": "data"})
    return figure
