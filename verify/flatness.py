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

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from flint import arb

from verify.balls import Balls, Floats, dot
from verify.bounds import Indices, Peaks, search
from verify.data.vehicle import Vehicle
from verify.intervals import Interval, interval
from verify.paths import TeamPaths

_YAW_SLACK = 1e-3
_ROTOR_SLACK = 1e-3
_DEPTH = 26
_GRID = 2.0**14
_STRIDE = 2


def yaw_rate_peaks(paths: TeamPaths, force: Balls, jerk: Balls, limit: float) -> Peaks:
    """Bound the magnitude of the rate about the body's z axis, robot by robot, in rad/s.

    Args:
        paths: The team.
        force: f on each piece. Shape (pieces, 3, 6).
        jerk: r''' on each piece. Shape (pieces, 3, 5).
        limit: The limit, which sets how tight the bounds are made.
    """
    state = (force, jerk, dot(force, force), paths.derivative(0)[:, 3], paths.derivative(1)[:, 3])
    count = len(paths.robots)

    def enclose(parts: tuple[Balls, ...], items: Indices) -> tuple[Floats, Floats, Floats]:
        del items
        f, j, f2, yaw, turn = (_spread(part) for part in parts)
        frame = _Frame.of(f, j, f2, yaw, turn)
        return _thirds(frame.rate_z.magnitude())

    critical = np.full(count, limit)
    return search(
        state, enclose, paths.piece_owner, count, slack=_YAW_SLACK * critical, critical=critical, depth=_DEPTH, stride=_STRIDE
    )


def rotor_peaks(paths: TeamPaths, force: Balls, jerk: Balls, snap: Balls, limits: tuple[float, float]) -> tuple[Peaks, Peaks]:
    """Bound the thrusts of all rotors, robot by robot, in N.

    Args:
        paths: The team.
        force: f on each piece. Shape (pieces, 3, 6).
        jerk: r''' on each piece. Shape (pieces, 3, 5).
        snap: r'''' on each piece. Shape (pieces, 3, 4).
        limits: Least and greatest thrust allowed, which set how tight the bounds are made.

    Returns:
        Bounds on minus the least thrust, and on the greatest.
    """
    yaw, turn, spin = (paths.derivative(order)[:, 3] for order in range(3))
    single = (force, jerk, snap, dot(force, force), dot(force, jerk), yaw, turn, spin)
    pieces, count = len(paths.piece_owner), len(paths.robots)
    state = tuple(Balls(np.concatenate([b.mid, b.mid]), np.concatenate([b.rad, b.rad])) for b in single)
    groups = np.concatenate([paths.piece_owner, paths.piece_owner + count])
    vehicle = paths.mission.vehicle

    def enclose(parts: tuple[Balls, ...], items: Indices) -> tuple[Floats, Floats, Floats]:
        f, j, s, f2, fj, yaw, turn, spin = (_spread(part) for part in parts)
        frame = _Frame.of(f, j, f2, yaw, turn)
        least, most = _rotor_range(frame, s, fj, spin, vehicle)
        wanted = np.tile(items < pieces, 3)
        return _thirds(Interval(np.where(wanted, -least.high, most.low), np.where(wanted, -least.low, most.high)))

    slack = np.full(2 * count, _ROTOR_SLACK * limits[1])
    critical = np.repeat([-limits[0], limits[1]], count)
    both = search(state, enclose, groups, 2 * count, slack=slack, critical=critical, depth=_DEPTH, stride=_STRIDE)
    first, second = slice(0, count), slice(count, 2 * count)
    return (
        Peaks(both.upper[first], both.lower[first], both.item[first] % pieces, both.place[first]),
        Peaks(both.upper[second], both.lower[second], both.item[second] % pieces, both.place[second]),
    )


@dataclass(frozen=True, slots=True)
class _Frame:
    """f, j and the body rates in the frame turned by the heading; see the top of the module."""

    cos: Interval
    sin: Interval
    p: Interval
    q: Interval
    w: Interval
    jx: Interval
    jy: Interval
    jz: Interval
    f: Interval
    f2: Interval
    d: Interval
    root_d: Interval
    k: Interval
    turn: Interval
    rate_x: Interval
    rate_y: Interval
    rate_z: Interval

    @classmethod
    def of(cls, f: Interval, j: Interval, f2: Interval, yaw: Interval, turn: Interval) -> _Frame:
        cos, sin = _direction(yaw)
        p, q, w = _turned_back(f, cos, sin)
        jx, jy, jz = _turned_back(j, cos, sin)
        f2 = Interval(np.maximum(f2.low, 0.0), f2.high)
        size = f2.root()
        d = p.squared() + w.squared()
        root_d = d.root()
        k = jx * w - p * jz
        rate_y = k / (size * root_d)
        rate_x = ((p * jx + w * jz) * q - d * jy) / (f2 * root_d)
        rate_z = (turn * w * size + q * k / size) / d
        return cls(cos, sin, p, q, w, jx, jy, jz, size, f2, d, root_d, k, turn, rate_x, rate_y, rate_z)


def _rotor_range(frame: _Frame, snap: Interval, fj: Interval, spin: Interval, vehicle: Vehicle) -> tuple[Interval, Interval]:
    """Enclose the least and the greatest of the four rotors' thrusts."""
    h = frame
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
    ix, iy, iz = (interval(value) for value in vehicle.inertia)
    torque_x = ix * accel_x + (iz - iy) * y * z
    torque_y = iy * accel_y + (ix - iz) * z * x
    torque_z = iz * accel_z + (iy - ix) * x * y
    lever = interval(2.0).root() * interval(vehicle.arm).times(2.0)  # 4 d = 4 arm / sqrt 2
    share = h.f * interval(vehicle.mass).times(0.25)
    roll, pitch = torque_x / lever, torque_y / lever
    yaw = torque_z / interval(vehicle.torque_to_thrust).times(4.0)
    thrusts = [share + roll - pitch + yaw, share + roll + pitch - yaw, share - roll - pitch - yaw, share - roll + pitch + yaw]
    low, high = np.stack([t.low for t in thrusts]), np.stack([t.high for t in thrusts])
    return Interval(low.min(0), high.min(0)), Interval(low.max(0), high.max(0))


def _spread(part: Balls) -> Interval:
    """Enclose the values over each part, at its start and at its end, one after another. Shape (3 k,) or (3 k, 3)."""
    low, high = part.low, part.high
    return Interval(
        np.concatenate([low.min(-1), low[..., 0], low[..., -1]]), np.concatenate([high.max(-1), high[..., 0], high[..., -1]])
    )


def _thirds(values: Interval) -> tuple[Floats, Floats, Floats]:
    """Return what `search` asks for: upper bound over each part, lower bounds at its start and at its end."""
    count = len(values.low) // 3
    return values.high[:count], values.low[count : 2 * count], values.low[2 * count :]


def _turned_back(vector: Interval, cos: Interval, sin: Interval) -> tuple[Interval, Interval, Interval]:
    x, y, z = (Interval(vector.low[:, i], vector.high[:, i]) for i in range(3))
    return x * cos + y * sin, y * cos - x * sin, z


def _direction(yaw: Interval) -> tuple[Interval, Interval]:
    """Enclose cosine and sine: Taylor's formula of order one around the middle, whose own values come from Arb."""
    middle = np.round((yaw.low + (yaw.high - yaw.low) / 2) * _GRID) / _GRID  # on a grid, so that few have to be computed
    points, back = np.unique(middle, return_inverse=True)
    table = np.array([_sin_cos(float(point)) for point in points])[back]
    sin, cos = Interval(table[:, 0], table[:, 1]), Interval(table[:, 2], table[:, 3])
    away = yaw - interval(middle)
    bend = away.squared().times(0.5)
    bend = Interval(-bend.high, bend.high)
    return _within_one(cos - away * sin + bend), _within_one(sin + away * cos + bend)


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
