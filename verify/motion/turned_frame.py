"""Yaw rate and rotor thrusts from position and heading at one place, enclosed by interval arithmetic.

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
from typing import Generic, TypeVar

import numpy as np
from flint import arb

from verify.arithmetic.balls import Floats
from verify.arithmetic.centred import Centred
from verify.arithmetic.intervals import Interval, interval

Quantity = TypeVar("Quantity", Interval, Centred)

_GRID = 2.0**14


@dataclass(frozen=True, slots=True)
class TurnedFrame(Generic[Quantity]):
    """f, j and the body rates in the frame turned by the heading; see the top of this module."""

    cos: Quantity
    sin: Quantity
    p: Quantity
    q: Quantity
    w: Quantity
    jx: Quantity
    jy: Quantity
    jz: Quantity
    f: Quantity
    f2: Quantity
    d: Quantity
    root_d: Quantity
    k: Quantity
    turn: Quantity
    rate_x: Quantity
    rate_y: Quantity
    rate_z: Quantity

    @classmethod
    def of(cls, f: Quantity, j: Quantity, f2: Quantity, yaw: Quantity, turn: Quantity) -> TurnedFrame[Quantity]:
        """Turn a motion back by its heading.

        Args:
            f: As above.
            j: As above.
            f2: Its squared size, |f|^2.
            yaw: Heading psi.
            turn: Its rate.
        """
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


def rotor_thrusts(
    frame: TurnedFrame[Quantity], snap: Quantity, fj: Quantity, spin: Quantity, airframe: Floats
) -> list[Quantity]:
    """Enclose the thrusts of the four rotors.

    Args:
        frame: The motion, turned back.
        snap: s, not turned back.
        fj: f . j.
        spin: psi''.
        airframe: Mass, arm, inertia (x, y, z) and torque to thrust.
    """
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


def _turned_back(vector: Quantity, cos: Quantity, sin: Quantity) -> tuple[Quantity, Quantity, Quantity]:
    x, y, z = (vector.component(i) for i in range(3))
    return x * cos + y * sin, y * cos - x * sin, z


def _direction(yaw: Quantity) -> tuple[Quantity, Quantity]:
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
