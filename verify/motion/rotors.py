"""Yaw rate and rotor thrusts from position and heading, enclosed for all times by interval arithmetic.

With f = r'' + g e3 and heading psi (Z-Y-X Euler: the body's x axis lies in the plane of (cos psi, sin psi, 0) and the
vertical), let (p, q, w) be f turned back by psi, F = |f|, D = p^2 + w^2, and j = r''', s = r'''' turned likewise:

    x_B = (w, 0, -p) / sqrt D     y_B = (-p q, D, -q w) / (F sqrt D)     z_B = (p, q, w) / F
    rate about y_B:  K / (F sqrt D)            with K = jx w - p jz
    rate about x_B:  -(j . y_B) / F
    rate about z_B:  N / (F D)                 with N = psi' w F^2 + q K

from j = F' z_B + F (omega x z_B) and from x_B staying level with psi. Their derivatives follow from
R' s = d/dt (R' j) + omega x R' j, and N' by the product rule. Torques are I omega' + omega x I omega. Rotor i stands
at (sx, sy) arm / sqrt 2 with sx, sy = +-1 and carries m F / 4 + sy tau_x / (4 d) - sx tau_y / (4 d)
+ sx sy tau_z / (4 kappa), d = arm / sqrt 2: the X layout, and the spin directions, of the Crazyflie's firmware.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Generic, TypeVar

import numpy as np
from flint import arb

from verify.arithmetic.balls import Balls, Floats, dot
from verify.arithmetic.bounds import Indices, Peaks, search
from verify.arithmetic.centred import Centred
from verify.arithmetic.intervals import Interval, interval
from verify.motion.paths import TeamPaths

_SLACK = 1e-3
"""How near to the true extreme a bound is driven at first, as a share of the limit."""

_FINE_SLACK = 1e-5
"""The same where the limit lies between the bounds; what decides is found to about 1e-12 of the limit."""

_DEPTH = 26
_FINE_DEPTH = 34
"""Most halvings of a piece at first, and where the limit lies between the bounds."""

_GRID = 2.0**14
_STRIDE = 2

_Quantity = TypeVar("_Quantity", Interval, Centred)
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


def _yaw_rate(parts: Sequence[_Quantity]) -> _Quantity:
    f, j, f2, yaw, turn = parts
    return _Frame.of(f, j, f2, yaw, turn).rate_z


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

    def _thrusts(self, parts: Sequence[_Quantity], items: Indices) -> list[_Quantity]:
        f, j, s, f2, fj, yaw, turn, spin = parts
        own = self.airframes if self.airframes.ndim == 1 else self.airframes[:, self.groups[items] % self.robots]
        return _rotor_thrusts(_Frame.of(f, j, f2, yaw, turn), s, fj, spin, own)


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


@dataclass(frozen=True, slots=True)
class _Frame(Generic[_Quantity]):
    """f, j and the body rates in the frame turned by the heading; see the top of the module."""

    cos: _Quantity
    sin: _Quantity
    p: _Quantity
    q: _Quantity
    w: _Quantity
    jx: _Quantity
    jy: _Quantity
    jz: _Quantity
    f: _Quantity
    f2: _Quantity
    d: _Quantity
    root_d: _Quantity
    k: _Quantity
    turn: _Quantity
    rate_x: _Quantity
    rate_y: _Quantity
    rate_z: _Quantity

    @classmethod
    def of(cls, f: _Quantity, j: _Quantity, f2: _Quantity, yaw: _Quantity, turn: _Quantity) -> _Frame[_Quantity]:
        cos, sin = _direction(yaw)
        p, q, w = _turned_back(f, cos, sin)
        jx, jy, jz = _turned_back(j, cos, sin)
        f2 = f2.at_least_zero()
        size = f2.root()
        d = p.squared() + w.squared()
        root_d = d.root()
        k = jx * w - p * jz
        rate_y = k / (size * root_d)
        rate_x = ((p * jx + w * jz) * q - d * jy) / (f2 * root_d)
        rate_z = (turn * w * size + q * k / size) / d
        return cls(cos, sin, p, q, w, jx, jy, jz, size, f2, d, root_d, k, turn, rate_x, rate_y, rate_z)


def _rotor_thrusts(
    frame: _Frame[_Quantity], snap: _Quantity, fj: _Quantity, spin: _Quantity, airframe: Floats
) -> list[_Quantity]:
    """Enclose the thrusts of the four rotors of airframes as `_airframes` gives them."""
    h = frame
    mass, arm, ix, iy, iz, torque_to_thrust = (interval(value) for value in airframe)
    sx, sy, sz = _turned_back(snap, h.cos, h.sin)
    growth = fj / h.f  # F'
    x, y, z = h.rate_x, h.rate_y, h.rate_z
    snap_x = (sx * h.w - sz * h.p) / h.root_d
    snap_y = (h.d * sy - (h.p * sx + h.w * sz) * h.q) / (h.f * h.root_d)
    accel_y = (snap_x - (growth * y).times(2.0)) / h.f - z * x
    accel_x = -(snap_y + (growth * x).times(2.0)) / h.f + y * z
    p_rate = h.jx + h.turn * h.q
    q_rate = h.jy - h.turn * h.p
    k_rate = sx * h.w - h.p * sz + h.turn * (h.jy * h.w - h.q * h.jz)
    n_rate = (spin * h.w + h.turn * h.jz) * h.f2 + (h.turn * h.w * fj).times(2.0) + q_rate * h.k + h.q * k_rate
    d_rate = (h.p * p_rate + h.w * h.jz).times(2.0)
    accel_z = n_rate / (h.f * h.d) - z * (fj / h.f2 + d_rate / h.d)
    torque_x = accel_x * ix + y * z * (iz - iy)
    torque_y = accel_y * iy + z * x * (ix - iz)
    torque_z = accel_z * iz + x * y * (iy - ix)
    lever = interval(2.0).root() * arm.times(2.0)  # 4 d = 4 arm / sqrt 2
    share = h.f * mass.times(0.25)
    roll, pitch = torque_x / lever, torque_y / lever
    yaw = torque_z / torque_to_thrust.times(4.0)
    return [share + roll - pitch + yaw, share + roll + pitch - yaw, share - roll - pitch - yaw, share - roll + pitch + yaw]


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


def _turned_back(vector: _Quantity, cos: _Quantity, sin: _Quantity) -> tuple[_Quantity, _Quantity, _Quantity]:
    x, y, z = (vector.component(i) for i in range(3))
    return x * cos + y * sin, y * cos - x * sin, z


def _direction(yaw: _Quantity) -> tuple[_Quantity, _Quantity]:
    """Enclose cosine and sine of a heading."""
    if isinstance(yaw, Interval):
        return _cos_sin(yaw)
    (cos, sin), (cos_over, sin_over) = _cos_sin(yaw.middle), _cos_sin(yaw.over)
    return (
        Centred(cos, cos_over, -(sin_over * yaw.rate)).tightened(),
        Centred(sin, sin_over, cos_over * yaw.rate).tightened(),
    )


def _cos_sin(yaw: Interval) -> tuple[Interval, Interval]:
    """Enclose cosine and sine: Taylor's formula of order three around the middle, whose own values come from Arb."""
    middle = np.round((yaw.low + (yaw.high - yaw.low) / 2) * _GRID) / _GRID  # on a grid, so that few have to be computed
    points, back = np.unique(middle, return_inverse=True)
    table = np.array([_sin_cos(float(point)) for point in points])[back]
    sin, cos = Interval(table[:, 0], table[:, 1]), Interval(table[:, 2], table[:, 3])
    away = yaw - interval(middle)
    square = away.squared()
    rest = square.squared().high / 24
    rest = Interval(np.nextafter(-rest, -np.inf), np.nextafter(rest, np.inf))
    one = interval(1.0)
    even, odd = one - square.times(0.5), away * (one - square / interval(6.0))
    return _within_one(cos * even - sin * odd + rest), _within_one(sin * even + cos * odd + rest)


def _within_one(values: Interval) -> Interval:
    """Cut to [-1, 1], where NaN and all else that is not known become the whole of it."""
    low, high = np.where(values.low > -1.0, values.low, -1.0), np.where(values.high < 1.0, values.high, 1.0)
    return Interval(low, high)


@lru_cache(maxsize=65536)
def _sin_cos(angle: float) -> tuple[float, float, float, float]:
    if not np.isfinite(angle):
        return -1.0, 1.0, -1.0, 1.0
    sin, cos = arb(angle).sin_cos()
    ends: list[float] = []
    for value in (sin, cos):
        middle, radius = float(value.mid()), float(value.rad())
        ends += [float(np.nextafter(middle - radius, -np.inf)), float(np.nextafter(middle + radius, np.inf))]
    return ends[0], ends[1], ends[2], ends[3]
