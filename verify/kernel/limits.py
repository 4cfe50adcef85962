"""Limits of a robot's nominal flight: polynomials, and by intervals the rate about the body's z axis and the thrust of each rotor; its joints; how
long it lasts. Each jump at a joint of pieces, of parts or of laps is the exact difference of two derivatives.

With f = r'' + g e3 the thrust is m |f| and the body's z axis f / |f|; roll and pitch turn it at |r''' x f| / |f|^2. All are squared and
multiplied out: nothing is divided.

*Turning.* Heading is psi (Z-Y-X Euler: the body's x axis lies in the plane of (cos psi, sin psi, 0) and the vertical). Let (p, q, w) be f turned back
by psi, F = |f|, D = p^2 + w^2, and j = r''', s = r'''' turned likewise:

    x_B = (w, 0, -p) / sqrt D     y_B = (-p q, D, -q w) / (F sqrt D)     z_B = (p, q, w) / F
    rate about y_B:  K / (F sqrt D)            with K = jx w - p jz
    rate about x_B:  -(j . y_B) / F
    rate about z_B:  N / (F D)                 with N = psi' w F^2 + q K

from j = F' z_B + F (omega x z_B) and from x_B staying level with psi. Their derivatives follow from R' s = d/dt (R' j) + omega x R' j, and N' by the
product rule. Torques are I omega' + omega x I omega. Rotor i stands at (sx, sy) arm / sqrt 2 with sx, sy = +-1 and carries m F / 4 + sy tau_x / (4 d)
- sx tau_y / (4 d) + sx sy tau_z / (4 kappa), d = arm / sqrt 2. (Coq: `level_rate`, `accelerations`, `yaw_acceleration`, `rotors_share`)
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise

from .flights import Path, Segment, Team
from .statement import ZERO, Limit, Robot, require
from .trees import Atom, Cell, Polynomial, Rules, square

BITS = 64
ONE = 1 << BITS
PI = Fraction(3141592653589793238462643383279502884197, 10**39)  # below pi, by less than 1e-39
_GRID = 1 << 16
TURNING = ("yaw_rate", "rotor_thrust_max", "rotor_thrust_min")
JUMPS = (Fraction(1, 10_000), Fraction(1, 1_000), Fraction(1, 100), Fraction(1, 10))
"""Greatest jumps in position (m), velocity, acceleration and jerk, and the same in rad for heading, its rate and its acceleration."""
_UP_TO = f"up to jumps of {', '.join(str(float(jump)) for jump in JUMPS)} in place and its derivatives"
PAUSE, CLIMB_AND_LANDING = 60, 11  # s that an endurance counts for a pause between parts, and beside the flight


@dataclass(slots=True)
class Interval:
    """All numbers from low / 2^64 to high / 2^64; every result holds all that may come of the operands (Coq: `times_sound`, `over_sound`)."""

    low: int
    high: int

    @classmethod
    def of(cls, low: Fraction, high: Fraction | None = None) -> Interval:
        """Return the least interval that holds a number, or two."""
        high = low if high is None else high
        return cls((low.numerator << BITS) // low.denominator, -((-high.numerator << BITS) // high.denominator))

    def __add__(self, other: Interval) -> Interval:
        return Interval(self.low + other.low, self.high + other.high)

    def __sub__(self, other: Interval) -> Interval:
        return Interval(self.low - other.high, self.high - other.low)

    def __mul__(self, other: Interval) -> Interval:
        a, b, c, d = self.low * other.low, self.low * other.high, self.high * other.low, self.high * other.high
        return Interval(min(a, b, c, d) >> BITS, -(-max(a, b, c, d) >> BITS))

    def __truediv__(self, other: Interval) -> Interval:
        require(other.low > 0 or other.high < 0, "a divisor may be zero")
        return self * Interval(ONE * ONE // other.high, -(-ONE * ONE // other.low))

    def root(self) -> Interval:
        """Return the roots of what is not negative."""
        return Interval(math.isqrt(max(self.low, 0) << BITS), math.isqrt(max(self.high, 0) << BITS) + 1)

    def cosine_and_sine(self) -> tuple[Interval, Interval]:
        """Return all cosines and all sines of angles: those of one in the middle, and as far beside as angles are."""
        middle = (self.low + self.high) * _GRID // (2 * ONE)
        at = middle * ONE // _GRID
        away = max(self.high - at, at - self.low)
        cosine, sine = (Interval(max(c.low - away, -ONE), min(c.high + away, ONE)) for c in _cosine_and_sine(middle))
        return cosine, sine

    def within(self, low: Fraction, high: Fraction) -> bool:
        """Return whether all of it lies between two numbers."""
        return self.low * low.denominator >= low.numerator * ONE and self.high * high.denominator <= high.numerator * ONE


@lru_cache(maxsize=65536)
def _cosine_and_sine(middle: int) -> tuple[Interval, Interval]:
    """Return cosine and sine of middle / _GRID, less full turns, by Taylor's sums, off by less than the next term (Coq: `whole_turns`, `taylor_within`)."""
    angle, term = Fraction(middle, _GRID), Interval(ONE, ONE)
    turns, sums = round(angle / (2 * PI)), [Interval(0, 0), Interval(0, 0)]
    loose = 1 + abs(turns) * 2 * ONE // 10**39
    x = Interval.of(angle - 2 * turns * PI) + Interval(-loose, loose)
    for k in range(40):
        sums[k % 2] = sums[k % 2] + term if k % 4 < 2 else sums[k % 2] - term
        term = term * x * Interval.of(Fraction(1, k + 1))
    rest = max(-term.low, term.high)
    return sums[0] + Interval(-rest, rest), sums[1] + Interval(-rest, rest)


def _asked(robot: Robot, name: str, limit: Fraction) -> Sequence[Atom]:
    """Return what polynomials of a piece have to keep (Coq: `speed_kept`, `tilt_kept`, `rate_kept`)."""

    def upright(piece: Segment) -> Polynomial:
        cosine = Fraction(max(Interval.of(limit).cosine_and_sine()[0].high, 0), ONE)  # (Coq: `cosine_above`)
        return piece.force[2] * piece.force[2] - square(piece.force) * Polynomial.of([cosine**2])

    def turned(piece: Segment) -> Polynomial:
        f, j = piece.force, piece.derivatives[3]
        rates = [j[i] * f[k] - j[k] * f[i] for i, k in ((1, 2), (2, 0), (0, 1))]
        return square(piece.force) * square(piece.force) * Polynomial.of([limit**2]) - square(rates)

    enough = (lambda piece: square(piece.force), ">=", (robot.limits["thrust_min"] / robot.mass) ** 2)  # f has a direction
    return {
        "speed": [(lambda piece: square(piece.derivatives[1][:3]), "<=", limit**2)],
        "acceleration": [(lambda piece: square(piece.derivatives[2][:3]), "<=", limit**2)],
        "thrust_max": [(enough[0], "<=", (limit / robot.mass) ** 2)],
        "thrust_min": [enough],
        "tilt": [enough, (lambda piece: piece.force[2], ">=", ZERO), (upright, ">=", ZERO)],  # below a quarter turn
        "body_rate": [enough, (turned, ">=", ZERO)],
    }[name]


def kept(path: Path, limit: tuple[Limit, Fraction]) -> Iterator[Cell]:
    """Yield for each piece of a path the claim `m` that a limit, SI, is kept."""
    rules: Rules = {"m": [[[atom] for atom in _asked(path.robot, *limit)]]}
    return (Cell(lambda find, piece=piece: piece.bernstein(find(piece)), rules) for piece in path.pieces)


def rates_and_thrusts(robot: Robot, given: Sequence[Interval]) -> list[Interval]:
    """Return the rate about z and the four rotors' thrusts of f, r''', r'''', heading and two derivatives of it, |f|^2 and f . r'''."""
    fx, fy, fz, ax, ay, az, bx, by, bz, yaw, turn, spin, f2, fj = given
    of = type(yaw).of
    cos, sin = yaw.cosine_and_sine()
    (p, q, w), (jx, jy, jz), (sx, sy, sz) = (
        (x * cos + y * sin, y * cos - x * sin, z) for x, y, z in ((fx, fy, fz), (ax, ay, az), (bx, by, bz))
    )
    f, d, two, quarter = f2.root(), p * p + w * w, of(Fraction(2)), of(Fraction(1, 4))
    root_d, k = d.root(), jx * w - p * jz
    y = k / (f * root_d)
    x = ((p * jx + w * jz) * q - d * jy) / (f2 * root_d)
    z = (turn * w * f + q * k / f) / d
    growth = fj / f  # F'
    snap_x, snap_y = (sx * w - sz * p) / root_d, (d * sy - (p * sx + w * sz) * q) / (f * root_d)
    accel_y = (snap_x - growth * y * two) / f - z * x
    accel_x = y * z - (snap_y + growth * x * two) / f
    p_rate, q_rate = jx + turn * q, jy - turn * p
    k_rate = sx * w - p * sz + turn * (jy * w - q * jz)
    n_rate = (spin * w + turn * jz) * f2 + turn * w * fj * two + q_rate * k + q * k_rate
    accel_z = n_rate / (f * d) - z * (fj / f2 + (p * p_rate + w * jz) * two / d)
    mass, arm, kappa, ix, iy, iz = map(of, (robot.mass, robot.arm, robot.torque_to_thrust, *robot.inertia))
    lever = two.root() * arm * two  # 4 d
    roll, pitch = (accel_x * ix + y * z * (iz - iy)) / lever, (accel_y * iy + z * x * (ix - iz)) / lever
    share, yawing = f * mass * quarter, (accel_z * iz + x * y * (iy - ix)) / kappa * quarter
    left, right = share + roll, share - roll
    return [z, left - pitch + yawing, left + pitch - yawing, right - pitch - yawing, right + pitch + yawing]


class Turning(Cell):
    """The claim `m` that on a piece the rate about z and all rotors' thrusts stay within the limits."""

    def __init__(self, robot: Robot, piece: Segment) -> None:
        f, (jx, jy, jz, _), s = piece.force, piece.derivatives[3], piece.derivatives[4]
        headings, along = [piece.derivatives[order][3] for order in range(3)], f[0] * jx + f[1] * jy + f[2] * jz
        rows = [*f, jx, jy, jz, *s[:3], *headings, square(f), along]
        super().__init__(lambda k: piece.bernstein(rows[k]), {})
        self.robot = robot

    def holds(self, mark: str) -> bool:
        """Return whether it is so."""
        limits = self.robot.limits
        rows = map(self.row, range(14))
        ranges = [Interval.of(Fraction(row.lowest, row.unit), Fraction(row.highest, row.unit)) for row in rows]
        rate, *thrusts = rates_and_thrusts(self.robot, ranges)
        well = all(one.within(limits["rotor_thrust_min"], limits["rotor_thrust_max"]) for one in thrusts)
        return mark == "m" and well and rate.within(-limits["yaw_rate"], limits["yaw_rate"])


def _require(order: int, one: Sequence[Fraction], other: Sequence[Fraction], where: str, turns: bool = False) -> None:
    """Refuse a jump that is too large; `turns` leaves full turns of the heading aside."""
    x, y, z, yaw = (b - a for a, b in zip(one, other, strict=True))
    full = 2 * PI * round(yaw / (2 * PI)) if turns else ZERO
    # pi is off by so little that a million turns are off by less than 1e-30
    near = x * x + y * y + z * z <= JUMPS[order] ** 2 and (order == 3 or abs(yaw - full) <= JUMPS[order] - abs(full) / 10**30)
    require(near, f"derivative {order} of place or heading jumps {where} by more than {float(JUMPS[order]):g}")


def check_continuity(path: Path, team: Team) -> str:
    """Check all jumps, from rest at the start to rest at the end, or to where the lap begins; laps of several robots begin and end at rest."""
    robot, zero = path.robot, [ZERO] * 4
    for order in range(4):
        ends = [piece.ends(order) for piece in path.pieces]
        last = ends[-1][1]
        _require(order, zero if order else [*robot.start, robot.yaw], ends[0][0], "at the start", turns=not order)
        for number, ((_, before), (after, _)) in enumerate(pairwise(ends)):
            _require(order, before, after, f"between pieces {number} and {number + 1}")
        if robot.cycle is None:
            _require(order, last, zero if order else [*(robot.end or last[:3]), last[3]], "at the end")
        elif not order or len(team.paths) == 1:
            _require(order, last, ends[robot.cycle][0], "where the lap ends", turns=not order)
        else:
            _require(order, last, zero, "where the lap ends")
            _require(order, ends[robot.cycle][0], zero, "where the lap begins")
    return f"The pieces of {path.name} join, from rest at its start, {_UP_TO}."


def check_parts(path: Path, team: Team) -> str:
    """Check that a flight in parts is cut where all are, and rests at each cut, and that its vehicle holds each part."""
    robot, cuts, size = path.robot, list(path.robot.cuts), len(path.pieces)
    in_order = cuts == sorted(set(cuts)) and all(cut < size for cut in cuts) and (robot.cycle is None or robot.cycle in cuts)
    require(in_order, "its cuts are no pieces in order, or its lap begins with none of them")
    instants = {tuple(one.pieces[cut].start for cut in one.robot.cuts if cut < len(one.pieces)) for one in team.paths.values()}
    require(len(instants) == 1, "robots are cut at different instants")
    longest = max(b - a for a, b in pairwise(sorted({0, *cuts, size})))
    require(robot.pieces is None or longest <= robot.pieces, f"a part has {longest} pieces; its vehicle holds {robot.pieces}")
    seam = [] if robot.cycle is None else [(size - 1, robot.cycle)]
    for before, after in [*((cut - 1, cut) for cut in cuts if cut), *seam]:
        where = f"at the cut before piece {after}"
        for order in range(4):
            end, begin = path.pieces[before].ends(order)[1], path.pieces[after].ends(order)[0]
            require(not order or max(abs(end[3]), abs(begin[3])) <= JUMPS[order], f"its heading turns {where}")
            for side in (end, begin):
                _require(order, side, [*(begin[:3] if not order else [ZERO] * 3), side[3]], where)
    return f"The path of {path.name} rests at each of {len(cuts)} cuts, {_UP_TO}."


def check_endurance(team: Team, path: Path) -> str:
    """Check that a robot lands in time, all laps counted, and all pauses of the robot that pauses most."""
    total = team.end + CLIMB_AND_LANDING + (0 if path.lap is None else (team.repeat - 1) * (team.end - path.lap))
    cut = [(robot.cycle, {0, *robot.cuts}) for robot in (other.robot for other in team.paths.values()) if robot.cuts]
    parts = [sum(1 if lap is None or begin < lap else team.repeat for begin in begins) for lap, begins in cut]
    total += (max(parts, default=1) - 1) * PAUSE
    require(total <= (path.robot.endurance or ZERO), f"it is in the air for {float(total):.1f} s, longer than its endurance")
    return f"{path.name} is in the air for less than {int(total) + 1} s."
