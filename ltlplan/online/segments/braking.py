"""Coming to rest on the way: polynomials that end a certified flight early, checked before they are handed to a robot.

When the world changes, a robot flies on along its certified polynomials for a moment and then slows down along one more
piece, to a hover that is clear of the edges of all regions. Velocity is the polynomial of degree 5 that begins with the robot's
velocity, acceleration and jerk and ends with all three at zero; its integral has degree 7 at most and needs no optimiser. When and
how quickly to slow down is tried out, soonest rest first, until the checker has no objection. Flying the certified trajectory to
its end is among what is tried.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from ltlplan.online.checked_events import rim_distance
from refine.obstacles.keep_out_bodies import within
from refine.obstacles.solid_body import SolidBody, solid_bodies
from verify.claims.claim import Claim
from verify.data import Mission, Trajectory
from verify.data.sections import LegLimits
from verify.data.validation.spacing import ROUNDING
from verify.flight_segments import judge_stop

Floats = NDArray[np.float64]

Way = tuple[Fraction, Fraction | float, str]
"""From when until when (inf: for good) a robot may be on its way to a region, on its trajectory's clock in s, and which it is."""
Ways = Mapping[str, tuple[Way, ...]]
"""For each robot."""

REACTION = 0.2
"""s that robots fly on before they slow down: time to compute how. The checker takes about 0.05 s for three robots."""

LENGTHS = (0.5, 0.7, 1.0, 1.4, 2.0)
"""s that slowing down takes."""

LATER = 0.1
"""s between the places at which slowing down may begin."""

TRIES = 30
"""Ways to come to rest together that are checked."""


@dataclass(frozen=True, eq=False, slots=True)
class Stop:
    """Query for a way to stop a team; another process can answer it.

    Attributes:
        mission: The world as it is now; its agents are the robots in the air, with the starts of their trajectories.
        team: What they fly, from rest to rest.
        now: From when that is checked in this world, on the trajectories' clocks, exact, in s.
        braking: They are slowing down already: what they fly comes first.
        ways: When they are on their way to which regions; the limits of a leg hold for slowing down on it as well.
        reaction: s after `now` before which nobody slows down.
    """

    mission: Mission
    team: Mapping[str, Trajectory]
    now: Fraction
    braking: bool
    ways: Ways = field(default_factory=dict[str, tuple[Way, ...]])
    reaction: float = REACTION


@dataclass(frozen=True, eq=False)
class StoppingManoeuvre:
    """Manoeuvre that stops a team.

    Attributes:
        team: A trajectory for each robot, the same as before up to where it slows down.
        refused: Claims that do not hold; empty where the stop is proved.
        ways: What was given, less what is not flown any more: who slowed down stays on its way to where it was going.
    """

    team: Mapping[str, Trajectory]
    refused: tuple[Claim, ...]
    ways: Ways


@dataclass(frozen=True, eq=False, slots=True)
class _Surroundings:
    """Surroundings that a robot must not meet while it slows down.

    Attributes:
        mission: The world as it is now.
        name: The robot's.
        now: Time on its trajectory's clock, s.
        solids: Obstacles, grown by the robot's radius, the margin and what rounding needs.
    """

    mission: Mission
    name: str
    now: float
    solids: tuple[SolidBody, ...]

    @classmethod
    def of(cls, mission: Mission, name: str, now: float) -> _Surroundings:
        need = mission.vehicle_of(name).radius + mission.margin + 2 * ROUNDING
        return cls(mission, name, now, solid_bodies(mission, need))

    def look_clear(self, trajectory: Trajectory) -> bool:
        """Tell at sampled instants whether a way keeps out of rims, obstacles and walls and ends clear of edges: a filter, no claim."""
        mission, margin = self.mission, self.mission.margin
        times = np.linspace(self.now, trajectory.duration, max(int((trajectory.duration - self.now) / 0.02), 2))
        points = trajectory.evaluate(times)[:, :3]
        low, high = np.array(mission.workspace.min) + margin, np.array(mission.workspace.max) - margin
        if np.any(points < low) or np.any(points > high):
            return False
        if np.linalg.norm(trajectory.evaluate(times, 1)[:, :3], axis=1).max() > mission.limits_of(self.name).speed:
            return False
        for index in within(self.solids, points.min(axis=0), points.max(axis=0)) if self.solids else ():
            if self.solids[index].part.distances(points).min() <= self.solids[index].growth:
                return False
        need = mission.vehicle_of(self.name).radius + margin
        for hoop in mission.hoops.values():
            if min(rim_distance((float(x), float(y), float(z)), hoop) for x, y, z in points) <= need:
                return False
        for region in mission.all_regions.values():
            level, slack = float(np.sqrt(region.level(points[-1]))), 1.05 * margin / region.inner_radius
            if 1 - slack <= level <= 1 + slack:
                return False
        return True


def come_to_rest(stop: Stop) -> StoppingManoeuvre:
    """Find trajectories by which a team comes to rest soon, and prove them.

    Args:
        stop: The question.

    Returns:
        The first that the checker accepts; where there is none the soonest of all, with what was said against the first try.
    """
    team, ways, now = stop.team, stop.ways, float(stop.now)
    others = {
        name: _stops(stop, _Surroundings.of(stop.mission, name, now), trajectory, ways.get(name, ()))
        for name, trajectory in team.items()
    }
    tried = {name: next(ways_to_rest) for name, ways_to_rest in others.items()}
    objections: tuple[Claim, ...] = ()
    for _ in range(TRIES):
        towards: dict[str, tuple[Fraction, *tuple[str, ...]]] = {}
        for name, trajectory in tried.items():
            begin = _slows(trajectory)
            regions = _regions_ahead(ways.get(name, ()), begin)
            if trajectory is not team[name] and regions:
                towards[name] = (begin, *regions)
        refused = tuple(claim for claim in judge_stop(stop.mission, tried, stop.now, towards) if claim.outcome != "holds")
        if not refused:
            cut_short = {
                name: (*(way for way in ways[name] if way[0] <= begin), *((begin, math.inf, region) for region in regions))
                for name, (begin, *regions) in towards.items()
            }
            return StoppingManoeuvre(tried, (), {**ways, **cut_short})
        objections = objections or refused
        if not _other_stops(tried, others, refused):
            break
    return StoppingManoeuvre({name: _at_once(trajectory, now) for name, trajectory in team.items()}, objections, ways)


def _slows(trajectory: Trajectory) -> Fraction:
    """Return when the last piece begins, exact, in s."""
    return sum(map(Fraction, trajectory.durations[:-1].tolist()), Fraction(0))


def _regions_ahead(ways: tuple[Way, ...], at: Fraction) -> tuple[str, ...]:
    """Return where a robot is on its way to; where it is not yet, in a region for sure, where it is next."""
    start = min((start for start, _, _ in ways if start > at), default=at)
    now = {region for since, until, region in ways if since <= at < until}
    return tuple(sorted(now or {region for since, _, region in ways if since == start > at}))


def _at_once(trajectory: Trajectory, now: float) -> Trajectory:
    """Return the soonest way to come to rest, clear or not: better than flying on where nothing is proved."""
    found = (slow_down(trajectory, now + 0.02 * k, LENGTHS[0]) for k in range(1, 6))
    slowed = next((way for way in found if way is not None), None)
    return trajectory if slowed is None or slowed.duration >= trajectory.duration else slowed


def _other_stops(tried: dict[str, Trajectory], others: Mapping[str, Iterator[Trajectory]], refused: tuple[Claim, ...]) -> bool:
    """Let robots that something was said against try their next way; return whether there is one."""
    moved = False
    for claim in refused:
        for robot in (claim.robot, claim.other):
            if robot is not None and (other := next(others[robot], None)) is not None:
                tried[robot] = other
                moved = True
                break
    return moved


def _stops(stop: Stop, around: _Surroundings, trajectory: Trajectory, ways: tuple[Way, ...]) -> Iterator[Trajectory]:
    """Yield ways to come to rest that look clear at sampled instants, soonest rest first; what is flown is one.

    Those that end outside all regions come before those that end inside: from within a ring there is no easy way on. A robot that hovers may stay.
    """
    mission, now = around.mission, around.now
    if now >= trajectory.duration:
        yield trajectory
        return
    if stop.braking:
        yield trajectory
    begin = np.arange(now + stop.reaction, trajectory.duration, LATER)
    pairs = sorted(((float(at), length) for at in begin for length in LENGTHS), key=sum)
    inside: list[Trajectory] = []
    for at, length in pairs:
        slowed = slow_down(trajectory, at, length) if at + length < trajectory.duration else None
        if slowed is None or not around.look_clear(slowed):
            continue
        if not all(
            _looks_gentle(mission.leg_limits_of(around.name).get(r), slowed) for r in _regions_ahead(ways, _slows(slowed))
        ):
            continue
        if not _hovers(slowed, now) and any(
            region.level(slowed.evaluate(slowed.duration)[:3]) <= 1 for region in mission.all_regions.values()
        ):
            inside.append(slowed)
        else:
            yield slowed
    if not stop.braking:
        yield trajectory
    yield from inside


def _hovers(trajectory: Trajectory, since: float) -> bool:
    """Return whether a robot stays where it is from a time on, in s."""
    points = trajectory.evaluate(np.linspace(since, trajectory.duration, 20))[:, :3]
    return float(np.abs(points - points[0]).max()) < 1e-6


def slow_down(trajectory: Trajectory, at: float, length: float) -> Trajectory | None:
    """Return a trajectory that is this one until about `at` and then comes to rest within `length`, all in float32.

    Args:
        trajectory: What is flown.
        at: When to begin, s on its clock.
        length: s that slowing down takes.

    Returns:
        None where `at` is too near to the beginning of a piece, or to the end of the last.
    """
    piece = int(np.searchsorted(trajectory.knots, at, side="right")) - 1
    if not 0 <= piece < len(trajectory):
        return None
    kept = float(np.float32(at - trajectory.knots[piece]))
    if not 0.01 < kept <= trajectory.durations[piece] or length <= 0:
        return None
    state = np.stack([_at(trajectory.coefficients[piece], kept, order) for order in range(4)])
    last = float(np.float32(length))
    durations = np.concatenate([trajectory.durations[:piece], [kept, last]])
    brake = _brake(state, last).astype(np.float32).astype(np.float64)
    coefficients = np.concatenate([trajectory.coefficients[: piece + 1], brake[None]])
    return Trajectory(durations, coefficients)


def _at(coefficients: Floats, time: float, order: int) -> Floats:
    return np.array([np.polynomial.polynomial.polyval(time, np.polynomial.polynomial.polyder(c, order)) for c in coefficients])


def _brake(state: Floats, length: float) -> Floats:
    """Return coefficients that begin in a state and end at rest.

    Args:
        state: Position to jerk of x, y, z, yaw. Shape (4, 4).
        length: s.

    Returns:
        Shape (4, 8).
    """
    u, v = length, np.zeros((6, 4))
    v[0], v[1], v[2] = state[1], state[2], state[3] / 2
    # velocity, acceleration and jerk at the end are zero: three equations for the last three coefficients
    powers = np.array([[u**3, u**4, u**5], [3 * u**2, 4 * u**3, 5 * u**4], [6 * u, 12 * u**2, 20 * u**3]])
    known = np.stack([v[0] + v[1] * u + v[2] * u**2, v[1] + 2 * v[2] * u, 2 * v[2]])
    v[3:] = np.linalg.solve(powers, -known)
    result = np.zeros((4, 8))
    result[:, 0] = state[0]
    result[:, 1:7] = (v / np.arange(1, 7)[:, None]).T
    return result


def _looks_gentle(leg: LegLimits | None, trajectory: Trajectory) -> bool:
    """Tell at sampled instants whether slowing down keeps a leg's limits: a filter, no claim."""
    times = np.linspace(float(trajectory.knots[-2]), trajectory.duration, 40)
    for order, limit in () if leg is None else ((1, leg.speed), (2, leg.acceleration)):
        if limit is not None and np.linalg.norm(trajectory.evaluate(times, order)[:, :3], axis=1).max() > limit:
            return False
    return True
