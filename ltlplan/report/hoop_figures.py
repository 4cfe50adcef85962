"""Pictures in the spirit of the 2019 paper's Figs. 2 to 7, as figures: hoops, primitives, sampled and optimised paths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from flight.figures import Figure, Trace
from flight.pictures import region_colours, scene_layout
from flight.shapes import line, obstacle_shapes, points, region_shapes
from ltlplan.paths.hoops.hoop_frame import control_points
from ltlplan.paths.hoops.primitives import Kind
from ltlplan.paths.hoops.sequencer import segments
from ltlplan.paths.sampling.least_snap_spline import LeastSnapSpline
from verify.data import BadInput, Mission, RobotPlan

Floats = NDArray[np.float64]

_COLOURS: Mapping[Kind, str] = {"STRAIGHT": "#1b9e77", "S_CURVE": "#7570b3", "U_TURN": "#d95f02", "TURN": "#e7298a"}
_ROLES: Mapping[str, tuple[str, str]] = {
    "rear": ("#3f78d8", "circle"),
    "centre": ("#8a8f99", "circle-open"),
    "front": ("#1b9e77", "circle"),
    "avoid": ("#c62828", "diamond"),
}
"""Colour and symbol of a hoop's control points."""
_PREFIX, _CYCLE, _BEST = "#3f78d8", "#c62828", "#f08c00"
_MOST_PATHS = 200


def control_point_figure(mission: Mission) -> Figure:
    """Return the mission's regions and rings with the five control points of each hoop (Fig. 2)."""
    return _figure(mission, [*_regions(mission), *_control_points(mission)], "Hoops and their control points")


def primitives_figure(mission: Mission, plan: RobotPlan) -> Figure:
    """Return one robot's nominal path, each segment in the colour of its primitive, with its waypoints (Figs. 3 and 4)."""
    traces = [*_regions(mission), *_control_points(mission)]
    if len(plan.waypoints) > 1:
        seen: set[str] = set()
        for index, primitive in enumerate(segments(mission, plan)):
            kind = primitive.kind
            segment = line(_piece(plan, index), kind, _COLOURS[kind], width=6, shown=kind not in seen)
            traces.append(segment | {"hovertemplate": f"{kind} {primitive.length:.2f} m<extra></extra>"})
            seen.add(kind)
    traces.append(_waypoints(plan))
    return _figure(mission, traces, "Motion primitives along the nominal path")


def path_figure(mission: Mission, plan: RobotPlan, *, nominal: RobotPlan | None = None) -> Figure:
    """Return one robot's path, prefix and cycle in two colours, with the path it was made from where given (Figs. 5, 7).

    Args:
        mission: The hoops.
        plan: The path.
        nominal: The path that it was made from.
    """
    traces = _regions(mission)
    if nominal is not None and len(nominal.waypoints) > 1:
        traces.append(line(path_points(nominal), "nominal path", "#888888", dash="dash", width=5))
    if len(plan.waypoints) > 1:
        spline = LeastSnapSpline(plan.times, plan.cycle_waypoint)
        path, at = path_points(plan), _times(plan)
        split = len(at) if spline.cycle is None else int(np.searchsorted(at, spline.times[spline.cycle]))
        if split > 1:
            traces.append(line(path[: split + 1], "path" if spline.cycle is None else "prefix", _PREFIX, width=5))
        if spline.cycle is not None:
            traces.append(line(path[split:], "cycle", _CYCLE, width=5))
    traces.append(_waypoints(plan))
    return _figure(mission, traces, "Path through the hoops" if nominal is None else "Optimised path")


def round_figure(
    mission: Mission,
    positions: Floats,
    counts: Sequence[bool] | NDArray[np.bool_],
    *,
    best: RobotPlan | None = None,
    most_points: int | None = None,
) -> Figure:
    """Return the sampled paths of one round of cross-entropy: those that count in colour, the others in grey (Fig. 6).

    Args:
        mission: The hoops.
        positions: m, as `SampledPaths.position` has them; at most 200 paths are drawn. Shape (paths, instants, 3).
        counts: Which of them satisfy the specification. Shape (paths,).
        best: A path to draw on top.
        most_points: Draw fewer paths where they would have more points than this together, two of either kind at the least; None for
            no limit.

    Raises:
        BadInput: The shapes do not fit.
    """
    good = np.asarray(counts, dtype=np.bool_)
    if positions.ndim != 3 or positions.shape[2] != 3 or good.shape != (len(positions),):
        raise BadInput(
            f"positions must have shape (paths, instants, 3) and counts (paths,), not {positions.shape}, {good.shape}."
        )
    split = _cycle_begins(best, positions.shape[1])
    each = _MOST_PATHS // 2
    if most_points is not None:
        each = min(each, max(most_points // (2 * positions.shape[1]), 2))
    traces = _regions(mission)
    for name, chosen in (("does not count", ~good), ("satisfies the specification", good)):
        lines = positions[chosen][:each]
        parts = [(f"{name} ({int(chosen.sum())})", lines[:, : split + 1], _PREFIX if chosen is good else "#bbbbbb")]
        if split < positions.shape[1] - 1:
            parts.append((f"{name}, its cycle", lines[:, split:], _CYCLE if chosen is good else "#bbbbbb"))
        for label, part, colour in parts if len(lines) else []:
            gap = np.full((len(lines), 1, 3), np.nan)  # one trace for all paths: a gap between two
            flat = np.concatenate([part, gap], axis=1).reshape(-1, 3)
            traces.append(line(flat, label, colour, width=1, shown=chosen is good or label == parts[0][0]))
    if best is not None and len(best.waypoints) > 1:
        traces.append(line(path_points(best), "the path in the end", _BEST, width=5))
    return _figure(mission, traces, "Sampled paths of one round")


def _cycle_begins(plan: RobotPlan | None, instants: int) -> int:
    """Return the sampled instant at which the paths' cycle begins; the last one where there is none."""
    if plan is None or plan.cycle_waypoint is None or plan.hovers:  # what is sampled ends where a hover begins
        return instants - 1
    share = (plan.times[plan.cycle_waypoint] - plan.times[0]) / (plan.times[-1] - plan.times[0])
    return round(share * (instants - 1))


def _regions(mission: Mission) -> list[Trace]:
    colours = region_colours(mission)
    solid = [shape for name, obstacle in mission.obstacles.items() for shape in obstacle_shapes(name, obstacle)]
    return [
        *solid,
        *(shape for name, region in mission.all_regions.items() for shape in region_shapes(name, region, colours[name])),
    ]


def _control_points(mission: Mission) -> list[Trace]:
    traces: list[Trace] = []
    found = {name: control_points(hoop) for name, hoop in mission.hoops.items()}
    for role, (colour, symbol) in _ROLES.items():
        places = [(name, place) for name, own in found.items() for place in np.atleast_2d(getattr(own, role))]
        if places:
            at = np.array([place for _, place in places])
            marker: dict[str, object] = {"size": 4, "color": colour, "symbol": symbol}
            traces.append(points(at, role, marker, shown=True, texts=[f"{name} {role}" for name, _ in places]))
    for name, own in found.items():
        traces.append(line(np.stack([own.rear, own.front]), f"{name}: rear to front", "#1b9e77", width=2, shown=False))
        traces.append(line(own.avoid, f"{name}: from side to side", "#c62828", width=1, dash="dot", shown=False))
    return traces


def _waypoints(plan: RobotPlan) -> Trace:
    places = np.array([w.position for w in plan.waypoints])
    texts = [f"{i}: {w.role}{f' of {w.region}' if w.region else ''}" for i, w in enumerate(plan.waypoints)]
    return points(places, "waypoints", {"size": 3, "color": "#7d8594"}, shown=True, texts=texts)


def _times(plan: RobotPlan) -> Floats:
    return np.linspace(plan.times[0], plan.times[-1], 40 * len(plan.times))


def path_points(plan: RobotPlan) -> Floats:
    """Return points of the plan's spline, m. Shape (n, 3)."""
    return LeastSnapSpline(plan.times, plan.cycle_waypoint).evaluate([w.position for w in plan.waypoints], _times(plan))


def _piece(plan: RobotPlan, index: int) -> Floats:
    at = np.linspace(plan.times[index], plan.times[index + 1], 24)
    return LeastSnapSpline(plan.times, plan.cycle_waypoint).evaluate([w.position for w in plan.waypoints], at)


def _figure(mission: Mission, traces: Sequence[Trace], title: str) -> Figure:
    figure = Figure(list(traces))
    return figure.update_layout(scene_layout(mission), title={"text": f"{mission.name}: {title}"})
