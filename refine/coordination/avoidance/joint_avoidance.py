"""A team that flies at once: robots that meet on the way swerve, all of them together, and nobody waits.

Robots that meet nobody keep their flights. The others form groups, which are solved apart; groups whose bent paths meet become one
(independence detection, as in Standley 2010). A group keeps its robots' own times first, and has all of them arrive together where
that does not do: then nobody rests in the way of those that are still flying.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from refine.coordination.avoidance.conflict_intervals import Mover, cut_legs
from refine.coordination.avoidance.conflict_resolution import along, among, mover_of, paced, timed_faster
from refine.coordination.avoidance.joint_bending import Beginning, Bent, bend_apart
from refine.coordination.departures import DepartureConflict, departures
from refine.coordination.spacing import flight_of
from refine.corridor.fitting import fit
from refine.corridor.sampled_stays import violations
from refine.single_robot.task import Problem, RobotFlight
from refine.spline.spline import Spline
from verify.data import Infeasible

Floats = NDArray[np.float64]
Team = tuple[dict[str, RobotFlight], dict[str, float]]
"""Robots with their paths, and departures in s by robot."""

_PARTS = 8
"""Pieces that a path is bent in, at least, where the vehicle's memory allows."""
_STEP = 1 / 16
"""s between two samples of a flight, for who meets whom."""
_LOOK = 0.02
"""m on top of the distance within which robots meet, for what samples cannot see."""
_EVALUATIONS = 1000
"""Of the sum that bending makes least, after which a group is given up, and for each robot of the team the team is. Groups that part
need 60 to 400; those that do not use all that they are given."""
_UNMOVED = 1e-4
"""m that a robot's points are moved by at most while its flight stays what it was."""


@dataclass(frozen=True, slots=True)
class _Try:
    """One way to part a group.

    Attributes:
        together: Whether all arrive at one time.
        beginning: Where the search for bent paths begins.
        parts: Pieces that a path is bent in, at least.
    """

    together: bool
    beginning: Beginning
    parts: int = _PARTS


_TRIES = (
    _Try(False, Beginning(swirl=0.02, layers=2, height=0.2)),
    _Try(True, Beginning(swirl=0.02, layers=2, height=0.2)),
    _Try(True, Beginning(swirl=0.3, layers=2, height=0.2)),
    _Try(True, Beginning(swirl=0.02, layers=3, height=1.5), parts=14),
)


def avoid_jointly(problem: Problem, robots: dict[str, RobotFlight]) -> Team | DepartureConflict:
    """Return the team with everyone departing as planned, or two robots that swerving does not keep apart.

    Args:
        problem: What is refined; its robots do not wait for meetings on the way.
        robots: The team's flights, each as if the others were not there.
    """
    spacing, waits = problem.spacing, among(problem, tuple(robots))
    earliest = departures(
        _scheduled(problem, robots), distance=-np.inf, z_scale=spacing.z_scale, skew=spacing.skew, precedences=waits
    )
    if isinstance(earliest, DepartureConflict):
        return earliest
    team, starts = dict(robots), dict(earliest)
    groups = {name: (name,) for name in robots}
    tried: set[tuple[str, ...]] = set()
    spent = 0
    while True:
        met = _meetings(problem, team, starts)
        if not met:
            flights = _scheduled(problem, team)
            kept = departures(
                flights, distance=spacing.distance, z_scale=spacing.z_scale, skew=spacing.skew, precedences=waits, given=starts
            )
            if not isinstance(kept, DepartureConflict) or kept.pair[0] == kept.pair[1]:
                return kept if isinstance(kept, DepartureConflict) else (team, kept)
            met = [kept]
        groups = _joined(groups, [conflict.pair for conflict in met])
        for names in dict.fromkeys(groups[conflict.pair[0]] for conflict in met):
            if names in tried or spent >= _EVALUATIONS * len(robots):
                return next(conflict for conflict in met if conflict.pair[0] in names)
            tried.add(names)
            parted, evaluations = _parted(
                problem, {name: robots[name] for name in names}, {name: earliest[name] for name in names}
            )
            spent += evaluations * len(names)
            if isinstance(parted, DepartureConflict):
                return parted
            team, starts = {**team, **parted[0]}, {**starts, **parted[1]}


def _scheduled(problem: Problem, robots: Mapping[str, RobotFlight]):
    return [flight_of(problem.plan, robot) for robot in robots.values()]


def _joined(groups: dict[str, tuple[str, ...]], pairs: Sequence[tuple[str, str]]) -> dict[str, tuple[str, ...]]:
    """Return each robot's group, with the groups of these pairs made one; names stay in the team's order."""
    order = list(groups)
    for one, other in pairs:
        if groups[one] != groups[other]:
            members = {*groups[one], *groups[other]}
            joined = tuple(name for name in order if name in members)
            groups = {**groups, **dict.fromkeys(joined, joined)}
    return groups


def _meetings(problem: Problem, robots: Mapping[str, RobotFlight], starts: Mapping[str, float]) -> list[DepartureConflict]:
    """Return the pairs that come too near each other as far as samples show, where each pair is nearest."""
    from scipy.spatial import KDTree  # here: it takes long to load, and few teams need it

    names, wanted = list(robots), problem.spacing.distance + _LOOK
    until = max(starts[name] + robot.path.duration for name, robot in robots.items())
    times = np.arange(0.0, until + _STEP, _STEP)
    scale = np.array([1.0, 1.0, problem.spacing.z_scale])
    flown = [_places(robots[name].path, times - starts[name]) * scale for name in names]
    places, lags = np.concatenate(flown), np.concatenate([_lag(path, problem.spacing.skew) for path in flown])
    within = wanted + float(lags.max())
    when = np.tile(np.arange(len(times)) * 2.0 * within, len(names))
    pairs = KDTree(np.column_stack([places, when])).query_pairs(within, output_type="ndarray")
    sizes = np.linalg.norm(places[pairs[:, 0]] - places[pairs[:, 1]], axis=1) - np.minimum(lags[pairs[:, 0]], lags[pairs[:, 1]])
    pairs, sizes = pairs[sizes <= wanted], sizes[sizes <= wanted]
    met: dict[tuple[str, str], DepartureConflict] = {}
    for index in np.lexsort((pairs[:, 1], pairs[:, 0], sizes)):
        first, second = sorted(pairs[index].tolist())
        pair = names[first // len(times)], names[second // len(times)]
        met.setdefault(pair, DepartureConflict(pair, max(float(sizes[index]), 0.0), float(times[first % len(times)])))
    return list(met.values())


def _lag(places: Floats, skew: float) -> Floats:
    """Return how far a robot flies in the clocks' error, at its speed at each sample, m. Shape (times, 3) to (times,)."""
    return skew / _STEP * np.linalg.norm(np.gradient(places, axis=0), axis=1)


def _places(path: Spline, times: Floats) -> Floats:
    """Return where a robot is at times after its departure, m; it hovers before and after. Shape (times,) to (times, 3)."""
    local = np.clip(times, 0.0, path.duration)
    piece = np.clip(np.searchsorted(path.knots, local, side="right") - 1, 0, len(path) - 1)
    local = np.clip(local - path.knots[piece], 0.0, path.durations[piece])
    found = np.zeros((len(times), 3))
    for power in range(path.coefficients.shape[2] - 1, -1, -1):
        found = found * local[:, None] + path.coefficients[piece, :3, power]
    return found


def _parted(problem: Problem, robots: dict[str, RobotFlight], starts: dict[str, float]) -> tuple[Team | DepartureConflict, int]:
    """Return a group whose robots swerve, as slowly as all of its limits ask for, or who came nearest to each other; and evaluations."""
    conflict, evaluations = DepartureConflict(("", ""), 0.0, 0.0), 0
    for movers, bent in _bends(problem, robots, starts):
        evaluations += bent.evaluations
        names = list(robots)
        nearest = names[bent.nearest[0]], names[bent.nearest[1]]
        conflict = DepartureConflict(nearest, max(bent.least, 0.0), bent.time)
        if bent.least < problem.spacing.distance:
            if evaluations >= _EVALUATIONS:
                break
            continue
        try:
            flown = [_along(problem, *each) for each in zip(robots.values(), movers, bent.points, strict=True)]
            faster = timed_faster(problem, robots.values(), {robot.name: robot.path for robot, _ in flown}, starts)
        except Infeasible:
            continue  # bodies are in the way of these paths
        for fitted, begins in (*filter(None, (faster,)), (flown, starts)):
            factor = max(by for _, by in fitted)
            team = {robot.name: paced(robot, factor) for robot, _ in fitted}
            if any(violations(each.path, problem.plan.mission, name, each.plan) for name, each in team.items()):
                continue
            begun = {name: factor * start for name, start in begins.items()}
            met = _meetings(problem, team, begun)
            if not met:
                return (team, begun), evaluations
            conflict = met[0]
    return conflict, evaluations


def _bends(problem: Problem, robots: dict[str, RobotFlight], starts: dict[str, float]) -> Iterator[tuple[list[Mover], Bent]]:
    """Yield a group's robots and points through which their paths may be bent, by one try after another."""
    for way in _TRIES:
        movers = _movers(problem, robots, starts, way)
        for bent in bend_apart(movers, problem.spacing, way.beginning):
            yield movers, bent


def _movers(problem: Problem, robots: dict[str, RobotFlight], starts: dict[str, float], way: _Try) -> list[Mover]:
    """Return the robots with their legs cut finer, so that their paths have something to give."""
    until = max(starts[name] + robot.path.duration for name, robot in robots.items())
    movers: list[Mover] = []
    for name, robot in robots.items():
        if way.together and robot.corridor is not None:
            robot = paced(robot, (until - starts[name]) / robot.path.duration)
        whole = mover_of(problem.plan, robot, starts, until)
        held = problem.options.held(problem.plan.mission, name)
        movers.append(whole if robot.corridor is None else cut_legs(whole, _parts(whole, held, way)))
    return movers


def _parts(robot: Mover, held: int | None, way: _Try) -> list[int]:
    """Return in how many parts each leg is cut: by its share of the time; legs that are led or that hover stay whole."""
    corridor, durations = robot.corridor, robot.path.durations
    still = np.all(robot.path.nodes[1:] == robot.path.nodes[:-1], axis=1)
    led = np.array([leg.cylinder is not None or len(leg.approaches) > 0 for leg in corridor.legs])
    wanted = max(way.parts, 2 * len(durations))
    if held is not None:
        wanted = min(wanted, held - 1)  # one is the wait before it departs
    room = max(wanted - len(durations), 0)
    parts = np.ones(len(durations), dtype=int)
    for leg in np.argsort(-durations, kind="stable"):
        if not (still[leg] or led[leg]):
            more = min(round(wanted * durations[leg] / durations.sum()) - 1, room)
            parts[leg] += max(more, 0)
            room -= max(more, 0)
    return parts.tolist()


def _along(problem: Problem, robot: RobotFlight, cut: Mover, points: Floats) -> tuple[RobotFlight, float]:
    """Return a robot on its way through bent points, not slowed yet, and by how much it must be.

    Raises:
        Infeasible: A body is in the way, or no pace keeps the limits.
        SolverTimeout: An engine's seconds ran out before its iterations.
    """
    kept = robot.path.duration == cut.path.duration or robot.corridor is None
    if kept and np.abs(points - cut.path.nodes).max() <= _UNMOVED:
        return robot, 1.0
    path = fit(replace(cut.corridor, points=points), cut.path.durations, rest=cut.rest)
    return along(problem, robot, path)
