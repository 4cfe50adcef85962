"""From an optimised path back to a robot's plan: waypoints with their roles, judged for all times.

The points of the search say nothing of hoops. Here the path is cut where it comes to a region that it visits, where it
crosses the hoop's plane and where it is clear again; these become the visit's waypoints. A spline of least snap through
more points of itself at the same times is the same spline, so the path does not change; points that stand close
to others are then left out where that changes nothing that matters.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from ltlplan.paths.costs import Sampling
from ltlplan.paths.hoops.clearance import conflicts
from ltlplan.paths.hoops.keep_out import KeptRegion, Room, room
from ltlplan.paths.sampling.least_snap_spline import LeastSnapSpline
from ltlplan.paths.sampling.path_problem import PathProblem
from verify.data import Mission, RobotPlan, Waypoint
from verify.data.arrays import Floats
from verify.data.plan import Role
from verify.data.shapes.inequalities import point_of
from verify.data.trajectory import PIECES

_STEP = 0.01  # m between the instants at which entries and exits are looked for
_CLOSE = (
    1.0,
    0.7,
    0.5,
    0.35,
    0.25,
    0.15,
    1e-3,
)  # m along the path; points of the search this near to another waypoint are left out


@dataclass(frozen=True, slots=True)
class _Cut:
    """A waypoint at a time of the path."""

    time: float
    role: Role
    region: str | None = None
    visit: int | None = None
    permitted: frozenset[str] | None = None  # what the path up to here may enter; None: as for the next waypoint


def candidate_plans(mission: Mission, plan: RobotPlan, problem: PathProblem, points: Floats, length: float) -> list[RobotPlan]:
    """Return plans along the spline through `points`, sparse waypoints first; none where the path does not keep the plan.

    Args:
        mission: What must be kept, for all times.
        plan: The nominal plan, for its word, its visits and where its cycle begins.
        problem: The search: times of the points, what counts, and what is kept beyond the margin.
        points: m. Shape (points, 3).
        length: Of the path, m.
    """
    where, spline = room(mission, problem.slack), problem.spline
    cuts = _cuts(where, plan, spline, points, length)
    if cuts is None:
        return []
    dense = np.linspace(spline.times[0], spline.times[-1], 1000)
    place = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(spline.evaluate(points, dense), axis=0), axis=1))])
    cycle = None if spline.cycle is None else float(spline.times[spline.cycle])
    visits = [(a.time, b.time) for a, b in itertools.pairwise(cuts) if b.permitted]  # there are only their own waypoints inside
    free = [float(time) for time in spline.times if not any(a < time < b for a, b in visits)]
    found = []
    for close in _CLOSE:
        taken, kept = [float(x) for x in np.interp([cut.time for cut in cuts], dense, place)], []
        for time, at in zip(free, np.interp(free, dense, place).tolist(), strict=True):
            if time == cycle or min(abs(other - at) for other in taken) > close:
                kept.append(_Cut(time, "via"))
                taken.append(at)
        candidate = _plan(where, plan, spline, points, sorted([*cuts, *kept], key=lambda cut: cut.time))
        if candidate is not None and keeps(problem, candidate):
            found.append(candidate)
    return found


def keeps(problem: PathProblem, plan: RobotPlan) -> bool:
    """Tell whether a plan's own spline counts, at dense samples.

    Args:
        problem: What is kept.
        plan: Waypoints and times of one robot.
    """
    sampling = Sampling(LeastSnapSpline(plan.times, plan.cycle_waypoint), max(600, int(problem.length / _STEP)))
    return bool(problem.keeps.keeps(sampling.paths([w.position for w in plan.waypoints]).axes(0))[0])


def has_room_for_waits(mission: Mission, plan: RobotPlan, nominal: RobotPlan) -> bool:
    """Tell whether a plan with its laps is held by a vehicle's memory, with a piece left for a wait, or needs no more than the nominal one.

    Args:
        mission: Says how many laps are flown.
        plan: The one that is asked about.
        nominal: Where it came from.
    """
    return flown_pieces(mission, plan) <= max(PIECES - 1, flown_pieces(mission, nominal))


def flown_pieces(mission: Mission, plan: RobotPlan) -> int:
    """Return how many pieces the plan has when its laps are flown one after another."""
    cycle = len(plan.waypoints) - 1 if plan.cycle_waypoint is None else plan.cycle_waypoint
    return cycle + mission.spec.repeat * (len(plan.waypoints) - 1 - cycle)


def _plan(where: Room, plan: RobotPlan, spline: LeastSnapSpline, points: Floats, cuts: list[_Cut]) -> RobotPlan | None:
    times = np.array([cut.time for cut in cuts])
    positions = spline.evaluate(points, times)
    positions[0], positions[-1] = points[0], points[-1]
    cycle = None
    if spline.cycle is not None:
        cycle = int(np.argmin(np.abs(times - spline.times[spline.cycle])))
        positions[-1] = positions[cycle]
    path = LeastSnapSpline(times, cycle)
    permitted = [next(cut.permitted for cut in cuts[i:] if cut.permitted is not None) for i in range(1, len(cuts))]
    if conflicts(path.through(positions), path.durations, where, permitted):
        return None
    waypoints = tuple(
        Waypoint(position=point_of(p), role=cut.role, region=cut.region, visit=cut.visit)
        for cut, p in zip(cuts, positions, strict=True)
    )
    return plan.model_copy(
        update={"waypoints": waypoints, "times": tuple(float(t) for t in times - times[0]), "cycle_waypoint": cycle}
    )


def _cuts(where: Room, plan: RobotPlan, spline: LeastSnapSpline, points: Floats, length: float) -> list[_Cut] | None:
    """Return the places at which the path comes to its visits, in order; None where they are not the planned ones."""
    at = np.linspace(spline.times[0], spline.times[-1], max(200, int(length / _STEP)))
    path = spline.evaluate(points, at)
    stays: list[tuple[int, int, str]] = []
    for name, obstacle in where.regions.items():
        edges = np.flatnonzero(
            np.diff(np.concatenate([[False], obstacle.levels(path - obstacle.centre) <= obstacle.level, [False]]).astype(int))
        )
        stays += [(int(a), int(b), name) for a, b in edges.reshape(-1, 2)]
    stays.sort()
    if [name for _, _, name in stays] != [visit.region for visit in plan.visits]:
        return None
    if any(later[0] < earlier[1] for earlier, later in itertools.pairwise(stays)):
        return None  # in regions that overlap the nominal path's waypoints say where each visit is made
    led = _led_past_regions(where, plan)
    nothing: frozenset[str] = frozenset()
    cuts = [_Cut(float(at[0]), "start", None, 0 if stays and stays[0][0] == 0 else None, nothing)]
    for index, ((first, last, name), visit) in enumerate(zip(stays, plan.visits, strict=True)):
        if spline.cycle is not None and index == plan.cycle_visit and at[first] <= spline.times[spline.cycle]:
            return None  # the lap would begin after the visit that it begins with
        through = visit.direction is not None
        if through and not 0 < first < last < len(at):
            return None
        inside, straight = frozenset({name}), (first - 1, last)
        if index in led and (straight := _straight(where.regions[name], path, first - 1, last)) is None:
            return None
        entry: Role = "via" if not through else "rear" if visit.direction == "F" else "front"
        leave: Role = "via" if not through else "front" if visit.direction == "F" else "rear"
        if first > 0 and at[first - 1] > cuts[-1].time:  # not where the path turns about between two visits
            if straight[0] > first - 1:
                cuts.append(_Cut(float(at[first - 1]), "via", None, None, nothing))
            permitted = nothing if straight[0] == first - 1 else inside
            cuts.append(_Cut(float(at[straight[0]]), entry, name, index, permitted))
        if first > 0 and last < len(at):
            middle = _middle(where.regions[name], at[first - 1 : last + 1], path[first - 1 : last + 1], through=through)
            cuts.append(_Cut(middle, "centre", name, index, inside))
        if last < len(at):
            cuts.append(_Cut(float(at[straight[1]]), leave, name, index, inside))
            if straight[1] < last:
                cuts.append(_Cut(float(at[last]), "via", None, None, inside))
    ends_inside = bool(stays) and stays[-1][1] == len(at)
    last_role: Role = "end" if plan.waypoints[-1].role == "end" else "centre" if ends_inside else "via"
    region, visit_index = (stays[-1][2], len(stays) - 1) if ends_inside else (None, None)
    if cuts[-1].time < at[-1]:  # a lap may close where its last visit ends
        cuts.append(_Cut(float(at[-1]), last_role, region, visit_index, frozenset({region}) if region else nothing))
    return cuts


def _led_past_regions(where: Room, plan: RobotPlan) -> frozenset[int | None]:
    """Return the visits whose passages begin or end within the hoop's region, as other regions stand where they would (`passage_ends`)."""
    return frozenset(
        waypoint.visit
        for waypoint in plan.waypoints
        if waypoint.role in ("rear", "front")
        and waypoint.region is not None
        and where.regions[waypoint.region].holds(np.array(waypoint.position))
    )


def _straight(hoop: KeptRegion, path: Floats, first: int, last: int) -> tuple[int, int] | None:
    """Return between which samples of a stay a passage is made: all of it, or what of it is within the hoop's opening and goes past its ring.

    Args:
        hoop: What is flown through.
        path: Samples, m. Shape (samples, 3).
        first: The last sample before the stay.
        last: The first one after it.

    Returns:
        None where the path veers off before it is past the ring.
    """
    if hoop.normal is None:
        return first, last
    offset = path[first : last + 1] - hoop.centre
    along = offset @ hoop.normal
    wide = np.linalg.norm(offset - along[:, None] * hoop.normal, axis=1) > hoop.inner
    crossed = np.flatnonzero(along[1:] * along[:-1] <= 0.0)
    if not len(crossed) or not wide.any():
        return first, last
    before, after = np.flatnonzero(wide[: crossed[0] + 1]), np.flatnonzero(wide[crossed[-1] + 1 :])
    begin = int(before[-1]) + 1 if len(before) else 0
    end = int(crossed[-1] + after[0]) if len(after) else last - first
    return (first + begin, first + end) if min(abs(along[begin]), abs(along[end])) > hoop.height else None


def _middle(obstacle: KeptRegion, times: Floats, path: Floats, *, through: bool) -> float:
    """Time at which the hoop's plane is crossed, or at which a region is entered deepest."""
    if not through or obstacle.normal is None:
        return float(times[int(np.argmin(obstacle.levels(path - obstacle.centre)))])
    along = (path - obstacle.centre) @ obstacle.normal
    k = int(np.flatnonzero(np.sign(along[1:]) != np.sign(along[:-1]))[-1]) if np.any(along[0] * along[-1] <= 0) else 0
    share = along[k] / (along[k] - along[k + 1]) if along[k] != along[k + 1] else 0.5
    return float(times[k] + np.clip(share, 0.01, 0.99) * (times[k + 1] - times[k]))
