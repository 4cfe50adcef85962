"""The rate about the body's z axis, and the thrust of each rotor, from place and heading.

With f = r'' + g e3 and heading psi (Z-Y-X Euler: the body's x axis lies in the plane of (cos psi, sin psi, 0) and the vertical), let
(p, q, w) be f turned back by psi, F = |f|, D = p^2 + w^2, and j = r''', s = r'''' turned likewise:

    x_B = (w, 0, -p) / sqrt D     y_B = (-p q, D, -q w) / (F sqrt D)     z_B = (p, q, w) / F
    rate about y_B:  K / (F sqrt D)            with K = jx w - p jz
    rate about x_B:  -(j . y_B) / F
    rate about z_B:  N / (F D)                 with N = psi' w F^2 + q K

from j = F' z_B + F (omega x z_B) and from x_B staying level with psi. Their derivatives follow from R' s = d/dt (R' j) + omega x R' j,
and N' by the product rule. Torques are I omega' + omega x I omega. Rotor i stands at (sx, sy) arm / sqrt 2 with sx, sy = +-1 and
carries m F / 4 + sy tau_x / (4 d) - sx tau_y / (4 d) + sx sy tau_z / (4 kappa), d = arm / sqrt 2.
"""

from __future__ import annotations

from fractions import Fraction

from .bounds import Interval, cosine_and_sine
from .flights import Path, Piece
from .refused import Refused
from .statement import Robot
from .trees import Cell, Marks, Rows, require

_TWO, _QUARTER = Interval.of(Fraction(2)), Interval.of(Fraction(1, 4))


class _Frame:
    """f, j, s and the body's rates x, y and z in the frame turned by the heading."""

    def __init__(self, rows: Rows) -> None:
        fx, fy, fz, jx, jy, jz, sx, sy, sz, yaw, turn, spin, f2, fj = map(Interval.range_of, rows)
        cos, sin = cosine_and_sine(yaw)
        self.p, self.q, self.w = fx * cos + fy * sin, fy * cos - fx * sin, fz
        self.jx, self.jy, self.jz = jx * cos + jy * sin, jy * cos - jx * sin, jz
        self.sx, self.sy, self.sz = sx * cos + sy * sin, sy * cos - sx * sin, sz
        self.turn, self.spin, self.f2, self.fj = turn, spin, f2, fj
        self.f, self.d = f2.root(), self.p.squared() + self.w.squared()
        self.root_d = self.d.root()
        self.k = self.jx * self.w - self.p * self.jz
        self.y = self.k / (self.f * self.root_d)
        self.x = ((self.p * self.jx + self.w * self.jz) * self.q - self.d * self.jy) / (f2 * self.root_d)
        self.z = (turn * self.w * self.f + self.q * self.k / self.f) / self.d


def rotor_thrusts(robot: Robot, h: _Frame) -> list[Interval]:
    """Return the thrusts of the four rotors, N."""
    mass, arm, kappa = (Interval.of(value) for value in (robot.mass, robot.arm, robot.torque_to_thrust))
    ix, iy, iz = map(Interval.of, robot.inertia)
    growth = h.fj / h.f  # F'
    snap_x = (h.sx * h.w - h.sz * h.p) / h.root_d
    snap_y = (h.d * h.sy - (h.p * h.sx + h.w * h.sz) * h.q) / (h.f * h.root_d)
    accel_y = (snap_x - growth * h.y * _TWO) / h.f - h.z * h.x
    accel_x = -(snap_y + growth * h.x * _TWO) / h.f + h.y * h.z
    p_rate, q_rate = h.jx + h.turn * h.q, h.jy - h.turn * h.p
    k_rate = h.sx * h.w - h.p * h.sz + h.turn * (h.jy * h.w - h.q * h.jz)
    n_rate = (h.spin * h.w + h.turn * h.jz) * h.f2 + h.turn * h.w * h.fj * _TWO + q_rate * h.k + h.q * k_rate
    d_rate = (h.p * p_rate + h.w * h.jz) * _TWO
    accel_z = n_rate / (h.f * h.d) - h.z * (h.fj / h.f2 + d_rate / h.d)
    torque_x = accel_x * ix + h.y * h.z * (iz - iy)
    torque_y = accel_y * iy + h.z * h.x * (ix - iz)
    torque_z = accel_z * iz + h.x * h.y * (iy - ix)
    lever = _TWO.root() * arm * _TWO  # 4 d
    share, roll, pitch, yaw = h.f * mass * _QUARTER, torque_x / lever, torque_y / lever, torque_z / kappa * _QUARTER
    return [share + roll - pitch + yaw, share + roll + pitch - yaw, share - roll - pitch - yaw, share - roll + pitch + yaw]


def turning(robot: Robot, piece: Piece) -> Cell:
    """Return the claim `m` that on a piece the rate about z and all rotors' thrusts stay within the limits."""
    f, (j, s) = piece.force, (piece.derivatives[order][:3] for order in (3, 4))
    headings = [piece.derivatives[order][3] for order in range(3)]
    along = f[0] * j[0] + f[1] * j[1] + f[2] * j[2]
    limits = robot.limits

    def claims(mark: str, rows: Rows) -> bool:
        try:
            frame = _Frame(rows)
            if mark != "m" or not frame.z.within(-limits.yaw_rate, limits.yaw_rate):
                return False
            return all(one.within(limits.rotor_thrust_min, limits.rotor_thrust_max) for one in rotor_thrusts(robot, frame))
        except Refused:
            return False  # a divisor may be zero

    return Cell([piece.bernstein(row) for row in (*f, *j, *s, *headings, piece.size, along)], claims)


def check_turning(path: Path, marks: Marks) -> None:
    """Check the rate about the body's z axis, and all rotors' thrusts, for all times.

    Raises:
        Refused: They are not proved to keep their limits.
    """
    for piece in path.pieces:
        require(turning(path.robot, piece), marks, "yaw rate and rotors keep their limits")
