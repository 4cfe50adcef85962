"""Labels of a flight by another exact method than the judge's: Arb's complex roots of the exact polynomials.

Returns what truly happens on the path itself (margin 0), root by root; the tests hold the judge's timelines against it.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from flint import fmpq, fmpq_poly

from verify.data.mission import Mission
from verify.data.shapes.region import Region
from verify.data.trajectory import Trajectory
from verify.motion.membership.polynomials import membership_polynomials
from verify.motion.membership.statuses import statuses
from verify.motion.paths import read_team


@dataclass
class Crossing:
    """One real root of a piece's membership polynomial: where (mission time), and how often it is one."""

    low: Fraction
    high: Fraction
    multiplicity: int


def _exact(value: float) -> fmpq:
    return fmpq(*float(value).as_integer_ratio())


def membership(trajectory: Trajectory, piece: int, region: Region) -> fmpq_poly:
    """Return (r - c)' M (r - c) - 1 of one piece in its local time, exactly."""
    parts = []
    for axis in range(3):
        parts.append(fmpq_poly([_exact(c) for c in trajectory.coefficients[piece, axis]]) - _exact(region.center[axis]))
    total = fmpq_poly([-1])
    for i in range(3):
        for j in range(3):
            total += parts[i] * parts[j] * _exact(region.matrix[i][j])
    return total


def crossings(trajectory: Trajectory, region: Region) -> tuple[bool, list[Crossing]]:
    """Return whether the path starts inside, and all boundary points of all pieces in order."""
    found: list[Crossing] = []
    start = Fraction(0)
    for piece in range(len(trajectory)):
        length = Fraction(float(trajectory.durations[piece]))
        p = membership(trajectory, piece, region)
        for root, multiplicity in p.complex_roots() if p.degree() > 0 else []:
            if root.imag != 0:
                continue
            mantissa, exponent = (int(part) for part in root.real.mid().man_exp())
            middle = mantissa * Fraction(2) ** exponent
            low, high = middle - Fraction(1, 2**30), middle + Fraction(1, 2**30)
            if high < 0 or low > length:
                continue
            found.append(Crossing(start + low, start + high, int(multiplicity)))
        start += length
    found.sort(key=lambda c: c.low)
    return bool(membership(trajectory, 0, region)(0) <= 0), found


def inside(trajectory: Trajectory, region: Region, time: Fraction) -> bool:
    """Tell exactly whether the path is in a region at a time."""
    start = Fraction(0)
    for piece in range(len(trajectory)):
        length = Fraction(float(trajectory.durations[piece]))
        last = piece == len(trajectory) - 1
        if time <= start + length or last:
            local = min(time - start, length)
            return bool(membership(trajectory, piece, region)(fmpq(local.numerator, local.denominator)) <= 0)
        start += length
    raise AssertionError("a trajectory has pieces")


def compare(trajectory: Trajectory, mission: Mission) -> tuple[int, int]:
    """Hold the judge's spans at margin 0 against true roots; return how many regions it told and how many it left open.

    Raises:
        AssertionError: The judge was sure of something that is not so.
    """
    (robot,) = mission.agents
    spans = statuses(membership_polynomials(read_team(mission, {robot: trajectory})), Fraction(0))[robot]
    told = left_open = 0
    for name, region in mission.all_regions.items():
        row = spans[name]
        if any(span.mark == "may" for span in row):
            left_open += 1
            continue
        told += 1
        starts_inside, roots = crossings(trajectory, region)
        assert (row[0].mark == "must") == starts_inside
        switches = [span for span in row if span.mark == "switch"]
        assert len(switches) == len(roots), (name, switches, roots)
        for span, root in zip(switches, roots, strict=True):
            assert root.multiplicity == 1
            assert span.start <= root.high
            assert root.low <= span.stop
    return told, left_open
