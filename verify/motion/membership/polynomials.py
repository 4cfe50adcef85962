"""Inequalities of every region along a path, as polynomials: of degree 14 on each piece, or 7 for a half-space."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np
from flint import fmpq_poly

from verify.arithmetic import exact
from verify.arithmetic.balls import Balls, Floats, constants, dot, gamma, nearest
from verify.data.shapes.conditions import Condition, HalfSpace
from verify.data.shapes.inequalities import Inequality, Point
from verify.motion.membership.bodies import Body
from verify.motion.paths import TeamPaths

_CHUNK = 20_000


@dataclass(frozen=True, eq=False)
class MembershipPolynomials:
    """Every region's inequalities along all segments, computed once for any margin.

    Attributes:
        paths: The team.
        bodies: By region, in the mission's order.
        columns: For each region the columns of its inequalities in `quadrics` or, for half-spaces, in `planes`.
        quadrics: Quadratic forms. Shape (segments, quadrics, 15).
        planes: Of half-spaces, normal . (r - c). Shape (segments, half-spaces, 8).
    """

    paths: TeamPaths
    bodies: dict[str, Body]
    columns: dict[str, tuple[int, ...]]
    quadrics: Balls
    planes: Balls

    def values(self, one: Condition) -> Balls:
        """Return the table that an inequality has its column in."""
        return self.planes if isinstance(one, HalfSpace) else self.quadrics

    def extent(self, one: Condition) -> tuple[Floats, Floats]:
        """Return bounds of the table that an inequality has its column in, over whole segments. Shapes (segments, columns).

        A polynomial lies between the least and the greatest of its Bernstein coefficients.
        """
        return self._extents[isinstance(one, HalfSpace)]

    @cached_property
    def _extents(self) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
        """Extents of quadrics, and of half-spaces, for `extent`: it is called at every margin."""
        with np.errstate(all="ignore"):
            quadrics, planes = ((table.low.min(-1), table.high.max(-1)) for table in (self.quadrics, self.planes))
        return quadrics, planes


@np.errstate(all="ignore")
def membership_polynomials(paths: TeamPaths) -> MembershipPolynomials:
    """Compute the membership polynomials of a team."""
    bodies = {name: Body.of(region) for name, region in paths.mission.all_regions.items()}
    columns: dict[str, tuple[int, ...]] = {}
    planes: list[tuple[Body, int]] = []
    quadrics: list[tuple[Body, int]] = []
    for name, body in bodies.items():
        row: list[int] = []
        for k, one in enumerate(body.conditions):
            listed = planes if isinstance(one, HalfSpace) else quadrics
            row.append(len(listed))
            listed.append((body, k))
        columns[name] = tuple(row)
    tables: list[Balls] = []
    for listed, width in ((quadrics, 15), (planes, 8)):
        mid = np.empty((len(paths.segments), len(listed), width))
        rad = np.empty_like(mid)
        for column, (body, k) in enumerate(listed):
            for first in range(0, len(paths.segments), _CHUNK):
                part = slice(first, first + _CHUNK)
                values = _along(paths.positions[part], body, k)
                mid[part, column], rad[part, column] = values.mid, values.rad
        tables.append(Balls(mid, rad))
    return MembershipPolynomials(paths, bodies, columns, *tables)


def exact_level(paths: TeamPaths, index: int, centre: Point, inequality: Inequality) -> fmpq_poly:
    """Return by how much a segment breaks an inequality, as an exact polynomial in u, from 0 to 1.

    Args:
        paths: The team.
        index: Of the segment, among all of the team's.
        centre: The region's, m.
        inequality: One of the region's.
    """
    offset = [p - exact.rational(c) for p, c in zip(paths.exact_position(index), centre, strict=True)]
    total = fmpq_poly([-exact.rational(inequality.bound)])
    for i in range(3):
        total += offset[i] * exact.rational(inequality.linear[i])
        for j in range(3):
            total += offset[i] * offset[j] * exact.rational(inequality.quadratic[i][j])
    return total


def _along(positions: Balls, body: Body, k: int) -> Balls:
    """Return what one of a region's inequalities bounds, as polynomials. Shape (segments, 3, 8) to (segments, degree + 1)."""
    one = body.conditions[k]
    if isinstance(one, HalfSpace):
        normal = constants(np.array(body.inequalities[k].linear)).reshape(1, 3, 1)
        return dot(normal, positions - constants(np.array(body.centre)).reshape(1, 3, 1))
    if any(one.centre):
        pairs = [nearest(Fraction(c) + own) for c, own in zip(body.centre, one.centre, strict=True)]
        centre = constants(np.array([value for value, _ in pairs]), np.array([error for _, error in pairs]))
    else:
        centre = constants(np.array(body.centre))
    offset = positions - centre.reshape(1, 3, 1)
    return dot(offset, _turned(np.array(body.inequalities[k].quadratic), offset))


def _turned(matrix: Floats, offset: Balls) -> Balls:
    """Return the (exact) matrix times vectors of polynomials. Shape (k, 3, n + 1)."""
    mid = np.einsum("ij,kjn->kin", matrix, offset.mid)
    rad = np.einsum("ij,kjn->kin", np.abs(matrix), offset.rad + gamma(4) * np.abs(offset.mid))
    return Balls(mid, rad * (1.0 + 2.0**-40) + 1e-290)
