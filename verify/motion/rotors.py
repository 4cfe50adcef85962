"""Greatest yaw rate and rotor thrusts of a team for all times, from what `turned_frame` encloses at each place."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from verify.arithmetic.balls import Balls, Floats, dot
from verify.arithmetic.bounds import Indices, Peaks, search
from verify.arithmetic.centred import Centred
from verify.arithmetic.intervals import Interval
from verify.motion.paths import TeamPaths
from verify.motion.turned_frame import Quantity, TurnedFrame, rotor_thrusts

_SLACK = 1e-3
"""How near to the true extreme a bound is driven at first, as a share of the limit."""

_FINE_SLACK = 1e-5
"""The same where the limit lies between the bounds; what decides is found to about 1e-12 of the limit."""

_DEPTH = 26
_FINE_DEPTH = 34
"""Most halvings of a piece at first, and where the limit lies between the bounds."""

_STRIDE = 2

_State = tuple[Balls, ...]
_Enclose = Callable[[_State, Indices], tuple[Floats, Floats, Floats]]


def yaw_rate_peaks(paths: TeamPaths, force: Balls, jerk: Balls, limits: Sequence[float]) -> Peaks:
    """Bound the magnitude of the rate about the body's z axis, robot by robot, in rad/s.

    Args:
        paths: The team.
        force: f on each piece. Shape (pieces, 3, 6).
        jerk: r''' on each piece. Shape (pieces, 3, 5).
        limits: Each robot's limit, in rad/s, which sets how tight the bounds are made.
    """
    state = (force, jerk, dot(force, force), paths.derivative(0)[:, 3], paths.derivative(1)[:, 3])
    enclosures = _enclose_yaw_rate, _enclose_yaw_rate_closely
    return _peaks(state, enclosures, paths.piece_owner, np.array(limits), np.array(limits))


def rotor_peaks(
    paths: TeamPaths, force: Balls, jerk: Balls, snap: Balls, limits: Sequence[tuple[float, float]]
) -> tuple[Peaks, Peaks]:
    """Bound the thrusts of all rotors, robot by robot, in N.

    Args:
        paths: The team.
        force: f on each piece. Shape (pieces, 3, 6).
        jerk: r''' on each piece. Shape (pieces, 3, 5).
        snap: r'''' on each piece. Shape (pieces, 3, 4).
        limits: Least and greatest thrust allowed each robot, in N, which set how tight the bounds are made.

    Returns:
        Bounds on minus the least thrust, and on the greatest.
    """
    yaw, turn, spin = (paths.derivative(order)[:, 3] for order in range(3))
    pieces, count = len(paths.piece_owner), len(paths.robots)
    rotors, least, most = _Rotors.of(paths), *np.array(limits).T
    both = _peaks(
        rotors.state(Motion(force, jerk, snap, yaw, turn, spin)), (rotors.enclose, rotors.enclose_closely), rotors.groups,
        np.concatenate([-least, most]), np.concatenate([most, most]),
    )  # fmt: skip
    first, second = slice(0, count), slice(count, 2 * count)
    return (
        Peaks(both.upper[first], both.lower[first], both.item[first] % pieces, both.place[first]),
        Peaks(both.upper[second], both.lower[second], both.item[second] % pieces, both.place[second]),
    )


@dataclass(frozen=True, eq=False, slots=True)
class Motion:
    """Bounds on a motion on each piece; it stands for any of many motions, by the radii of these.

    Attributes:
        force: f, m/s^2. Shape (pieces, 3, n + 1).
        jerk: m/s^3. Likewise.
        snap: m/s^4. Likewise.
        yaw: Heading, rad. Shape (pieces, n + 1).
        turn: Its rate, rad/s. Likewise.
        spin: Its second derivative, rad/s^2. Likewise.
    """

    force: Balls
    jerk: Balls
    snap: Balls
    yaw: Balls
    turn: Balls
    spin: Balls


@dataclass(frozen=True, eq=False, slots=True)
class TurningBounds:
    """Proved bounds on yaw rates and rotor thrusts, as tight as the limits need.

    Attributes:
        yaw_rate: At most, rad/s. Shape (robots,).
        least: At least, N. Likewise.
        greatest: At most, N. Likewise.
    """

    yaw_rate: Floats
    least: Floats
    greatest: Floats


@np.errstate(all="ignore")
def turning_bounds(paths: TeamPaths, motion: Motion, limits: Sequence[tuple[float, float, float]], depth: int) -> TurningBounds:
    """Bound the yaw rates and rotor thrusts of any of the motions that are enclosed.

    Args:
        paths: Who flies, and whose pieces the motion is on.
        motion: On each of these pieces.
        limits: Each robot's greatest yaw rate, in rad/s, and least and greatest rotor thrust, in N.
        depth: How often pieces are halved at most where that is not within the limits.
    """
    rotors, count = _Rotors.of(paths), len(paths.robots)
    turn, least, most = np.array(limits).T
    state = (motion.force, motion.jerk, dot(motion.force, motion.force), motion.yaw, motion.turn)
    rates = _within(state, _enclose_yaw_rate, paths.piece_owner, turn, depth)
    thrusts = _within(rotors.state(motion), rotors.enclose, rotors.groups, np.concatenate([-least, most]), depth)
    return TurningBounds(rates, -thrusts[:count], thrusts[count:])


def _within(state: _State, enclose: _Enclose, groups: Indices, critical: Floats, depth: int) -> Floats:
    """Bound greatest values of groups, halving only what may lie above what is critical. Shape (groups,)."""

    def decided(parts: _State, items: Indices) -> tuple[Floats, Floats, Floats]:
        high, _, _ = enclose(parts, items)
        enough = critical[groups[items]]  # nothing below it is looked at closer
        return high, enough, enough

    slack = np.zeros(len(critical))
    return search(state, decided, groups, len(critical), slack=slack, depth=depth, stride=_STRIDE).upper


def _yaw_rate(parts: Sequence[Quantity]) -> Quantity:
    f, j, f2, yaw, turn = parts
    return TurnedFrame.of(f, j, f2, yaw, turn).rate_z


def _enclose_yaw_rate(parts: _State, items: Indices) -> tuple[Floats, Floats, Floats]:
    del items
    return _thirds(_yaw_rate([_spread(part) for part in parts]).magnitude())


def _enclose_yaw_rate_closely(parts: _State, items: Indices) -> tuple[Floats, Floats, Floats]:
    del items
    over = _yaw_rate([Centred.of(part) for part in parts]).over.magnitude()
    return _with_ends(over, _yaw_rate([_ends(part) for part in parts]).magnitude())


@dataclass(frozen=True, eq=False, slots=True)
class _Rotors:
    """All rotors of a team: each piece twice, first for minus the least thrust, then for the greatest.

    Attributes:
        pieces: How many there are.
        robots: How many there are.
        groups: Robot of each piece, and so many more of its second time. Shape (2 pieces,).
        airframes: As `_airframes` gives them.
    """

    pieces: int
    robots: int
    groups: Indices
    airframes: Floats

    @classmethod
    def of(cls, paths: TeamPaths) -> _Rotors:
        count = len(paths.robots)
        groups = np.concatenate([paths.piece_owner, paths.piece_owner + count])
        return cls(len(paths.piece_owner), count, groups, _airframes(paths))

    def state(self, motion: Motion) -> _State:
        force, jerk, snap = motion.force, motion.jerk, motion.snap
        single = (force, jerk, snap, dot(force, force), dot(force, jerk), motion.yaw, motion.turn, motion.spin)
        return tuple(Balls(np.concatenate([b.mid, b.mid]), np.concatenate([b.rad, b.rad])) for b in single)

    def enclose(self, parts: _State, items: Indices) -> tuple[Floats, Floats, Floats]:
        items = np.tile(items, 3)
        return _thirds(_extreme(self._thrusts([_spread(part) for part in parts], items), items < self.pieces))

    def enclose_closely(self, parts: _State, items: Indices) -> tuple[Floats, Floats, Floats]:
        over = _extreme([t.over for t in self._thrusts([Centred.of(part) for part in parts], items)], items < self.pieces)
        items = np.tile(items, 2)
        return _with_ends(over, _extreme(self._thrusts([_ends(part) for part in parts], items), items < self.pieces))

    def _thrusts(self, parts: Sequence[Quantity], items: Indices) -> list[Quantity]:
        f, j, s, f2, fj, yaw, turn, spin = parts
        own = self.airframes if self.airframes.ndim == 1 else self.airframes[:, self.groups[items] % self.robots]
        return rotor_thrusts(TurnedFrame.of(f, j, f2, yaw, turn), s, fj, spin, own)


def _airframes(paths: TeamPaths) -> Floats:
    """Return mass, arm, inertia (x, y, z) and torque to thrust. Shape (6,) where all robots fly the same, else (6, robots)."""
    vehicles = [paths.mission.vehicle_of(robot) for robot in paths.robots]
    numbers = np.array([(v.mass, v.arm, *v.inertia, v.torque_to_thrust) for v in vehicles])
    return numbers[0] if np.all(numbers == numbers[0]) else numbers.T


def _peaks(state: _State, enclosures: tuple[_Enclose, _Enclose], groups: Indices, critical: Floats, scale: Floats) -> Peaks:
    """Bound the greatest values by the first enclosure, and by the second, which costs more, where that does not decide.

    Args:
        state: Polynomials on each piece.
        enclosures: What `search` asks for: a quick one, and one whose error falls with the square of a part's length.
        groups: Group of each piece. Shape (pieces,).
        critical: The limit of each group.
        scale: What the slack of each group is a share of.
    """
    count = len(critical)
    quick, close = enclosures
    found = search(state, quick, groups, count, slack=_SLACK * scale, depth=_DEPTH, stride=_STRIDE)
    open_ = ~((found.upper <= critical) | (found.lower > critical))
    rows = np.flatnonzero(open_[groups])
    if len(rows) == 0:
        return found
    number = np.cumsum(open_) - 1  # of an open group among the open ones
    near = search(
        tuple(part[rows] for part in state), lambda parts, items: close(parts, rows[items]), number[groups[rows]],
        int(open_.sum()), slack=_FINE_SLACK * scale[open_], critical=critical[open_], depth=_FINE_DEPTH, stride=_STRIDE,
    )  # fmt: skip
    better = near.lower > found.lower[open_]
    return Peaks(
        _replaced(found.upper, open_, np.fmin(found.upper[open_], near.upper)),
        _replaced(found.lower, open_, np.where(better, near.lower, found.lower[open_])),
        _replaced(found.item, open_, np.where(better, rows[near.item], found.item[open_])),
        _replaced(found.place, open_, np.where(better, near.place, found.place[open_])),
    )


def _replaced(values: np.ndarray, where: np.ndarray, new: np.ndarray) -> np.ndarray:
    result = values.copy()
    result[where] = new
    return result


def _extreme(thrusts: Sequence[Interval], least: np.ndarray) -> Interval:
    """Enclose minus the least of some thrusts where `least` is true, and the greatest elsewhere."""
    low, high = np.stack([t.low for t in thrusts]), np.stack([t.high for t in thrusts])
    return Interval(np.where(least, -high.min(0), low.max(0)), np.where(least, -low.min(0), high.max(0)))


def _spread(part: Balls) -> Interval:
    """Enclose the values over each part, at its start and at its end, one after another. Shape (3 k,) or (3 k, 3)."""
    low, high = part.low, part.high
    return Interval(
        np.concatenate([low.min(-1), low[..., 0], low[..., -1]]), np.concatenate([high.max(-1), high[..., 0], high[..., -1]])
    )


def _ends(part: Balls) -> Interval:
    """Enclose the values at each part's start and at its end, one after another. Shape (2 k,) or (2 k, 3)."""
    low, high = part.low, part.high
    return Interval(np.concatenate([low[..., 0], low[..., -1]]), np.concatenate([high[..., 0], high[..., -1]]))


def _thirds(values: Interval) -> tuple[Floats, Floats, Floats]:
    """Return what `search` asks for: upper bound over each part, lower bounds at its start and at its end."""
    count = len(values.low) // 3
    return values.high[:count], values.low[count : 2 * count], values.low[2 * count :]


def _with_ends(over: Interval, ends: Interval) -> tuple[Floats, Floats, Floats]:
    """Return the same from enclosures over each part, and at its start and its end."""
    count = len(over.high)
    return over.high, ends.low[:count], ends.low[count:]
