"""Departures of a team one after another, or all at once with waits on the way; paths keep clear of where others hover, as far as that helps."""

from __future__ import annotations

from collections.abc import Mapping

from refine.coordination.alternative_ways import waits_anywhere
from refine.coordination.avoidance.conflict_resolution import departures_of
from refine.coordination.departures import DepartureConflict
from refine.coordination.midway_waits import Halt, with_waits
from refine.coordination.spacing import hovers_of, idle_others
from refine.obstacles.keep_out_bodies import Ball
from refine.single_robot.flight import robot_flight
from refine.single_robot.task import Problem, RobotFlight
from verify.data import Infeasible

_LONGER_WAIT, _LONGEST_WAIT = 0.5, 4.0
"""s by which a robot waits longer, and at most, where it would meet another one on its way on."""
_MEETINGS = 40
"""Times that one robot's path is laid around where another one waits."""


def depart(
    problem: Problem, robots: dict[str, RobotFlight]
) -> tuple[dict[str, RobotFlight], dict[str, float] | DepartureConflict]:
    """Return the team and departures at which robots keep their distance, or who cannot be kept apart.

    Where no departures help, the two robots in conflict get paths that also keep clear of where the other one starts and ends,
    for as long as that changes anything.

    Args:
        problem: What is refined.
        robots: The team's flights.
    """
    clear_of: dict[str, tuple[str, ...]] = dict.fromkeys(robots, ())
    if problem.plan.meetings or waits_anywhere(problem.plan):
        return fly_to_meetings(problem, robots)
    waiting = False
    while True:
        found = departures_of(problem, robots)
        if not isinstance(found, DepartureConflict):
            return robots, found
        if found.pair[0] == found.pair[1] and not waiting:
            robots, waiting = with_waits(problem, robots), True
            continue
        changed = False
        for name, other in (found.pair, found.pair[::-1]):
            if name == other or other in clear_of[name]:
                continue
            clear_of[name] = (*clear_of[name], other)
            places = [
                place for who in clear_of[name] for place in hovers_of(robots[who], problem.spacing, problem.plan.meetings)
            ]
            try:
                robots = {**robots, name: robot_flight(problem, name, (*idle_others(problem, name), *places))}
                changed, waiting = True, False
            except Infeasible:
                continue  # its own path stays; the other robot's may still move
        if not changed:
            return robots, found


def fly_to_meetings(
    problem: Problem, robots: dict[str, RobotFlight], *, patient: bool = False
) -> tuple[dict[str, RobotFlight], dict[str, float] | DepartureConflict]:
    """Return a team that waits for its meetings in flight, everyone departing at once, or who cannot be kept apart.

    Of two robots that come too near each other one gets a path that keeps clear of where the other one starts, waits and ends.

    Args:
        problem: What is refined.
        robots: The team's flights.
        patient: Let the one that waited last wait longer, too.
    """
    together = dict(robots)
    clear_of: dict[str, tuple[str, ...]] = dict.fromkeys(robots, ())
    given = dict.fromkeys(robots, 0.0)
    kept_clear: dict[str, tuple[Ball, ...]] = {}
    anywhere = waits_anywhere(problem.plan)
    tried: set[tuple[str, str, bytes]] = set()
    longer: dict[Halt, float] = {}

    while True:
        held = with_waits(problem, together, kept_clear, longer)
        found = departures_of(problem, held, given)
        if not isinstance(found, DepartureConflict):
            return held, found
        changed = False
        for name, other in (found.pair, found.pair[::-1]):
            key = name, other, together[other].path.nodes.tobytes()  # where the other one hovers may have changed since
            if name == other or changed or key in tried or len(tried) >= _MEETINGS:
                continue
            tried.add(key)
            clear_of[name] = tuple(dict.fromkeys((*clear_of[name], other)))
            places = tuple(
                place
                for who in clear_of[name]
                for place in hovers_of(held[who], problem.spacing, problem.plan.meetings, anywhere=anywhere)
            )
            try:
                together = {**together, name: robot_flight(problem, name, (*idle_others(problem, name), *places))}
                kept_clear[name], changed = places, True
            except Infeasible:
                continue  # the other robot's path may still move
        halt = _last_halt(held, found) if patient and not changed else None
        if halt is not None and longer.get(halt, 0.0) < _LONGEST_WAIT:
            longer[halt], changed = longer.get(halt, 0.0) + _LONGER_WAIT, True
        if not changed:
            return held, found


def _last_halt(robots: Mapping[str, RobotFlight], conflict: DepartureConflict) -> Halt | None:
    """Return where the one of two robots that come too near each other that waited last did so; None where neither had waited."""
    halts = [
        (float(robots[name].path.knots[node]), name, visit)
        for name in conflict.pair
        for visit, node in robots[name].halts.items()
        if robots[name].path.knots[node] <= conflict.time
    ]
    return max(halts)[1:] if halts else None
