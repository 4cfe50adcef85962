"""Splines that keep clear of what is in the way: where one cuts a corner too closely, a point is added on the leg itself.

Legs lead along clear lines; a point in the middle of a leg pulls the spline back to its line. A spline without room is a `SplineBlocked`:
it says what the spline comes too near to, where, and how wide it is there.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from ltlplan.free_space.bottlenecks import Gap, narrowest
from ltlplan.free_space.free_space import FreeSpace
from ltlplan.paths.hoops.clearance import Conflict, conflicts
from ltlplan.paths.hoops.keep_out import Room
from ltlplan.paths.hoops.stops import Stop, primitives_between
from ltlplan.paths.sampling.least_snap_spline import LeastSnapSpline
from ltlplan.systems.unreachable import joined_names
from verify.data import Infeasible, Mission

_REPAIRS = 24
_RAMPS = 1.0
"""s, at most, that the first and last segment take longer, from and to rest."""
_POINT = 1e-6
"""m; a way so long is a point."""


class SplineBlocked(Infeasible):
    """The spline through the control points still comes too near; carries the first place where it does.

    Attributes:
        conflict: What, on which piece and where.
    """

    def __init__(self, conflict: Conflict, stops: Sequence[Stop], gap: Gap | None = None) -> None:
        """Say what is in the way.

        Args:
            conflict: What, on which piece and where.
            stops: The control points.
            gap: How wide it is between obstacles there.
        """
        self.conflict, self.stops = conflict, tuple(stops)
        what = {
            "workspace": "leaves the workspace, margin included,",
            "again": f"comes twice to '{conflict.name}' in one visit",
            "plane": f"turns back within '{conflict.name}'",
            "ring": f"comes too near the ring of '{conflict.name}'",
            "region": f"touches '{conflict.name}', which it may not enter there,",
            "obstacle": f"comes too near the obstacle '{conflict.name}'",
        }[conflict.obstacle]
        after, before = stops[conflict.piece], stops[conflict.piece + 1]
        hoops = any(stop.axes is not None for stop in stops)
        mend = (
            "Move the hoop, or change its `reach` or `clearance`." if hoops else f"Widen '{conflict.name}', or lower `margin`."
        )
        if conflict.obstacle == "obstacle":
            x, y, z = after.position + conflict.share * (before.position - after.position)
            mend = f"That is near ({x:.2f}, {y:.2f}, {z:.2f})"
            if gap is not None and gap.width < 2.0 * gap.needed:
                sides = joined_names([f"'{name}'" for name in dict.fromkeys(gap.between)])
                mend += (
                    f", where it is {gap.width:.3f} m wide between {sides}, and a "
                    f"straight flight needs {gap.needed:.3f} m (radius and margin on both sides), one that turns more"
                )
            mend += ". Widen it, or lower `margin`."
        super().__init__(
            f"The spline through the control points {what} between {_name(after)} and {_name(before)}, "
            f"whichever points are added. {mend}"
        )

    def beside(self, mission: Mission, radius: float) -> SplineBlocked:
        """Return the error with how wide it is where the spline has no room.

        Args:
            mission: Gives the obstacles.
            radius: Of the vehicle, m.
        """
        conflict = self.conflict
        if conflict.obstacle != "obstacle":
            return self
        a, b = (self.stops[conflict.piece + k].position for k in (0, 1))
        at = a + conflict.share * (b - a)
        return SplineBlocked(conflict, self.stops, narrowest(FreeSpace.of(mission, radius), np.stack([at, at + _POINT])))


def _name(stop: Stop) -> str:
    return f"the {stop.role}{f' of {stop.region!r}' if stop.region else ''}"


def _times(stops: Sequence[Stop], speed: float, ramp: float, *, lasso: bool) -> list[float]:
    """Return nominal times: each segment takes its primitive's length over the speed; `ramp` s more from and to rest."""
    spans = [primitive.time(speed) for primitive in primitives_between(stops)]
    spans[0] += ramp
    spans[-1] += 0.0 if lasso else ramp
    return [0.0, *(float(t) for t in np.cumsum(spans))]


def repaired(
    stops: list[Stop], cycle: int | None, where: Room, speed: float, visits: Mapping[str, int], shortest: float
) -> tuple[list[Stop], list[float], int | None]:
    """Add points on legs until the spline keeps clear; the points lie on lines that do.

    A spline that leaves rest within length / v can overshoot so far that it turns back in the first hoop, or comes to a
    region twice; where it does, its first and last segment are given more time.

    Args:
        stops: Where the legs lead.
        cycle: Index of the stop where the cycle begins.
        where: What the spline keeps clear of.
        speed: m/s.
        visits: How often it comes to each region.
        shortest: m; a shorter segment is not divided.

    Returns:
        Stops, times, and the index of the stop where the cycle begins.

    Raises:
        SplineBlocked: It does not help.
    """
    if len(stops) == 1:
        return stops, [0.0], cycle
    ramp = 0.0
    found: list[Conflict] = []
    for _ in range(_REPAIRS):
        times = _times(stops, speed, ramp, lasso=cycle is not None)
        spline = LeastSnapSpline(times, cycle)
        coefficients = spline.through([stop.position for stop in stops])
        found = conflicts(coefficients, spline.durations, where, [stop.permitted for stop in stops[1:]])
        found = found or _visited_again(stops, spline, where, visits)
        if not found:
            return stops, times, cycle
        if ramp < _RAMPS and any(conflict.obstacle in ("plane", "again") for conflict in found):
            ramp += 0.25
            continue
        lengths = [float(np.linalg.norm(b.position - a.position)) for a, b in itertools.pairwise(stops)]
        pieces = {conflict.piece for conflict in found if lengths[conflict.piece] > 2 * shortest}
        if not pieces:
            break
        cycle = None if cycle is None else cycle + sum(piece < cycle for piece in pieces)
        stops = _divided(stops, pieces)
    raise SplineBlocked(found[0], stops)


def _visited_again(stops: Sequence[Stop], spline: LeastSnapSpline, where: Room, visits: Mapping[str, int]) -> list[Conflict]:
    """Find pieces on which a region that they may enter is left and entered once more, by dense samples."""
    at = np.linspace(spline.times[0], spline.times[-1], max(400, 40 * len(stops)))
    path = spline.evaluate([stop.position for stop in stops], at)
    found = []
    for name, count in visits.items():
        obstacle = where.regions[name]
        level = obstacle.levels(path - obstacle.centre)
        for bound in (1.0, obstacle.level):
            inside = level <= bound
            if int(inside[0]) + int(np.sum(inside[1:] & ~inside[:-1])) > count:
                entering = [i for i, stop in enumerate(stops[1:]) if name in stop.permitted]
                found += [Conflict(i, 0.5, "again", name) for i in entering]
    return found


def _divided(stops: Sequence[Stop], pieces: Collection[int]) -> list[Stop]:
    """Return stops with one more in the middle of some pieces."""
    result = [stops[0]]
    for piece, (a, b) in enumerate(itertools.pairwise(stops)):
        if piece in pieces:
            visit = b.visit if b.permitted else None
            result.append(Stop((a.position + b.position) / 2, "via", None, visit, b.permitted, b.axes))
        result.append(b)
    return result
