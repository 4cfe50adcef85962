"""Physical limits for all times: speed, acceleration, thrust, tilt, body rates, yaw rate and rotor thrusts.

With g = 9.80665 m/s^2 and f = r'' + g e3 the collective thrust is m |f| and the body's z axis is f / |f|. Squared
speed, acceleration and thrust are polynomials; the squared roll and pitch rates together, |j x f|^2 / |f|^4 with
j = r''', are a quotient of polynomials, and so is what says the tilt: see `tilt`. Yaw rate and rotor thrusts hold the
heading and |f| itself: see `rotors`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Literal

import numpy as np
from flint import fmpq_poly

from verify.arithmetic import exact
from verify.arithmetic.balls import Balls, concatenate, dot, raised, restricted
from verify.arithmetic.bounds import Peaks, peaks
from verify.data.sections import LegLimits
from verify.data.vehicle import GRAVITY
from verify.motion.paths import Segment, TeamPaths
from verify.motion.rotors import rotor_peaks, yaw_rate_peaks
from verify.motion.tilt import tilt_peaks

LimitName = Literal[
    "speed", "acceleration", "thrust_max", "thrust_min", "rotor_thrust_max", "rotor_thrust_min", "tilt", "body_rate", "yaw_rate"
]

UNITS: dict[LimitName, str] = {
    "speed": "m/s", "acceleration": "m/s^2", "thrust_max": "N", "thrust_min": "N", "rotor_thrust_max": "N",
    "rotor_thrust_min": "N", "tilt": "rad", "body_rate": "rad/s", "yaw_rate": "rad/s",
}  # fmt: skip

Unit = Callable[[float, bool], float]
"""Turns a bound on a squared quantity into one on the quantity; True rounds up."""

_SHARE = 1e-5
"""How near to the true extreme a bound on a square is driven, as a share of the limit's; nearer where that decides."""


@dataclass(frozen=True, slots=True)
class Extreme:
    """The extreme of one quantity over one robot's flight.

    Attributes:
        robot: Name.
        name: Which limit.
        limit: What must not be passed.
        bound: Proved for all times, on the strict side.
        reached: Proved to be reached or passed (towards the limit) at `time`.
        time: When, in s.
        holds: Whether the limit is proved to be kept.
        fails: Whether it is proved to be broken.
    """

    robot: str
    name: LimitName
    limit: float
    bound: float
    reached: float
    time: Fraction
    holds: bool
    fails: bool


@np.errstate(all="ignore")
def extremes(paths: TeamPaths) -> list[Extreme]:
    """Bound every limited quantity of every robot's nominal flight."""
    limits = [paths.mission.limits_of(robot) for robot in paths.robots]
    masses = [paths.mission.vehicle_of(robot).mass for robot in paths.robots]
    velocity, acceleration = paths.derivative(1)[:, :3], paths.derivative(2)[:, :3]
    jerk, snap = paths.derivative(3)[:, :3], paths.derivative(4)[:, :3]
    force = with_gravity(acceleration)
    thrust2 = dot(force, force)
    found: list[Extreme] = []

    def add(name: LimitName, result: Peaks, units: list[Unit], *, least: bool = False) -> None:
        asked = [getattr(limit, name) for limit in limits]
        found.extend(_decided(paths, extreme) for extreme in _read(paths, name, asked, result, units, least))

    # speed, acceleration and thrust are polynomials of degree 12 and 10: one search for all of them
    squares = [raised(dot(v, v), 12) for v in (velocity, acceleration)] + [raised(t, 12) for t in (thrust2, -thrust2)]
    ceilings = [limit.speed**2 for limit in limits] + [limit.acceleration**2 for limit in limits]
    ceilings += [(limit.thrust_max / mass) ** 2 for limit, mass in zip(limits, masses, strict=True)]
    ceilings += [-((limit.thrust_min / mass) ** 2) for limit, mass in zip(limits, masses, strict=True)]
    count = len(paths.robots)
    critical = np.array(ceilings)
    groups = np.concatenate([paths.piece_owner + count * i for i in range(len(squares))])
    both = peaks(concatenate(squares), groups, len(critical), slack=_SHARE * np.abs(critical), critical=critical)
    speed, push, most_thrust, least_thrust = _parted(both, len(squares), len(paths.piece_owner))
    root, same, newton = [_root] * count, [_same] * count, [_thrust(mass) for mass in masses]
    add("speed", speed, root)
    add("acceleration", push, root)
    add("thrust_max", most_thrust, newton)
    add("thrust_min", least_thrust, newton, least=True)
    add("tilt", tilt_peaks(paths, force, [limit.tilt for limit in limits]), same)
    turning = _cross(jerk, force)
    critical = np.array([limit.body_rate**2 for limit in limits])
    rate = peaks(
        raised(dot(turning, turning), 20), paths.piece_owner, count, slack=_SHARE * critical, critical=critical,
        denominator=thrust2 * thrust2,
    )  # fmt: skip
    add("body_rate", rate, root)
    add("yaw_rate", yaw_rate_peaks(paths, force, jerk, [limit.yaw_rate for limit in limits]), same)
    least, most = rotor_peaks(paths, force, jerk, snap, [(limit.rotor_thrust_min, limit.rotor_thrust_max) for limit in limits])
    add("rotor_thrust_max", most, same)
    add("rotor_thrust_min", least, same, least=True)
    return found


def _parted(found: Peaks, parts: int, pieces: int) -> list[Peaks]:
    """Take apart a search for several quantities, each of the same groups and pieces."""
    count = len(found.upper) // parts
    rows = [slice(i * count, (i + 1) * count) for i in range(parts)]
    return [Peaks(found.upper[r], found.lower[r], found.item[r] % pieces, found.place[r]) for r in rows]


def with_gravity(acceleration: Balls) -> Balls:
    """Return f = r'' + g e3. Shape (pieces, 3, n + 1)."""
    gravity = np.zeros((1, 3, 1))
    gravity[0, 2] = GRAVITY
    return acceleration + Balls(gravity, np.zeros((1, 3, 1)))


@np.errstate(all="ignore")
def leg_extremes(
    paths: TeamPaths, robot: int, windows: Sequence[tuple[Fraction, Fraction]], wanted: LegLimits
) -> list[Extreme]:
    """Bound speed and acceleration of one robot over some times only (where it flies to one region).

    Args:
        paths: The team.
        robot: Index of the robot.
        windows: Exact times, in s, from and to.
        wanted: The limits there.
    """
    rows: list[int] = []
    starts: list[Fraction] = []
    stops: list[Fraction] = []
    for row in np.flatnonzero(paths.piece_owner == robot):
        segment = paths.segments[int(paths.piece_segments[row])]
        for low, high in windows:
            start, stop = max(low, segment.start), min(high, segment.stop)
            if start < stop:
                length = segment.stop - segment.start
                rows.append(int(row))
                starts.append((start - segment.start) / length)
                stops.append((stop - segment.start) / length)
    found: list[Extreme] = []
    asked: tuple[tuple[LimitName, int, float | None], ...] = (
        ("speed", 1, wanted.speed),
        ("acceleration", 2, wanted.acceleration),
    )
    for name, order, limit in asked:
        if limit is None:
            continue
        if not rows:  # of no time at all nothing is proved
            when = windows[0][0] if windows else Fraction(0)
            found.append(Extreme(paths.robots[robot], name, limit, math.inf, 0.0, when, False, False))
            continue
        part = restricted(paths.derivative(order)[np.array(rows), :3], starts, stops)
        result = peaks(
            dot(part, part),
            np.zeros(len(rows), dtype=np.intp),
            1,
            slack=np.array([_SHARE * limit**2]),
            critical=np.array([limit**2]),
        )
        bound, reached = _root(float(result.upper[0]), True), _root(float(result.lower[0]), False)
        at = int(result.item[0])
        place = starts[at] + (stops[at] - starts[at]) * Fraction(float(result.place[0]))
        time = paths.segments[int(paths.piece_segments[rows[at]])].time(place)
        found.append(Extreme(paths.robots[robot], name, limit, bound, reached, time, bound <= limit, reached > limit))
    return found


def _decided(paths: TeamPaths, extreme: Extreme) -> Extreme:
    """Decide without rounding what the balls leave open (an exact tie, say), where the quantity is a polynomial."""
    if extreme.holds or extreme.fails or extreme.name not in ("speed", "acceleration", "thrust_max", "thrust_min", "body_rate"):
        return extreme
    robot = paths.robots.index(extreme.robot)
    for index in paths.piece_segments:
        segment = paths.segments[int(index)]
        if segment.robot == robot and not _kept_exactly(paths, segment, extreme):
            return replace(extreme, fails=True)
    return replace(extreme, holds=True, bound=extreme.limit)


def _kept_exactly(paths: TeamPaths, segment: Segment, extreme: Extreme) -> bool:
    coefficients = paths.trajectories[segment.robot].coefficients[segment.piece]
    velocity = [exact.polynomial(coefficients[axis]).derivative() for axis in range(3)]
    acceleration = [p.derivative() for p in velocity]
    force = [acceleration[0], acceleration[1], acceleration[2] + exact.rational(GRAVITY)]
    limit = exact.rational(extreme.limit)

    def square(vector: list[fmpq_poly]) -> fmpq_poly:
        return vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2]

    mass = exact.rational(paths.mission.vehicle_of(extreme.robot).mass)
    newton = limit / mass
    match extreme.name:
        case "speed":
            room = limit * limit - square(velocity)
        case "acceleration":
            room = limit * limit - square(acceleration)
        case "thrust_max":
            room = newton * newton - square(force)
        case "thrust_min":
            room = square(force) - newton * newton
        case _:
            x, y, z = (p.derivative() for p in acceleration)
            a, b, c = force
            turning = [y * c - z * b, z * a - x * c, x * b - y * a]
            room = limit * limit * square(force) * square(force) - square(turning)
    length = segment.stop - segment.start
    if extreme.name == "body_rate":  # where |f| may vanish the inequality holds and proves nothing
        least = exact.rational(paths.mission.limits_of(extreme.robot).thrust_min) / mass
        if not exact.nonnegative(square(force) - least * least, Fraction(0), length):
            return False
    return exact.nonnegative(room, Fraction(0), length)


# six parameters: what is bounded, by how much, and how its bounds are read
def _read(
    paths: TeamPaths, name: LimitName, limits: Sequence[float], result: Peaks, units: Sequence[Unit], least: bool
) -> list[Extreme]:
    """Turn proved bounds on a (squared, or negated) quantity, robot by robot, into bounds in the limits' own unit."""
    rows = []
    for robot, (who, limit, unit) in enumerate(zip(paths.robots, limits, units, strict=True)):
        index = int(paths.piece_segments[int(result.item[robot])])
        time = paths.segments[index].time(float(result.place[robot]))
        upper, lower = float(result.upper[robot]), float(result.lower[robot])
        if least:
            bound, reached = unit(-upper, False), unit(-lower, True)
            holds, fails = bound >= limit, reached < limit
        else:
            bound, reached = unit(upper, True), unit(lower, False)
            holds, fails = bound <= limit, reached > limit
        rows.append(Extreme(who, name, limit, bound, reached, time, holds, fails))
    return rows


def _cross(a: Balls, b: Balls) -> Balls:
    parts = [a[:, i] * b[:, j] - a[:, j] * b[:, i] for i, j in ((1, 2), (2, 0), (0, 1))]
    return Balls(np.stack([p.mid for p in parts], 1), np.stack([p.rad for p in parts], 1))


def _same(value: float, up: bool) -> float:
    del up
    return value


def _root(value: float, up: bool) -> float:
    """Square root, rounded up or down; what is below zero counts as zero."""
    if not value > 0:
        return 0.0 if value <= 0 else value
    return float(np.nextafter(math.sqrt(value), math.inf if up else -math.inf)) if math.isfinite(value) else value


def _thrust(mass: float) -> Callable[[float, bool], float]:
    def newton(value: float, up: bool) -> float:
        root = _root(value, up)
        return 0.0 if root == 0.0 and not up else float(np.nextafter(mass * root, math.inf if up else -math.inf))

    return newton
