"""How far paths stay from convex parts, proved: what lies between two places is parted from a part by one plane.

Whatever weights w >= 0 are given to a part's half-spaces l.x <= b, all of its points have (sum w l).x <= sum w b. So a point's distance
from the part is at least (sum w l).x - sum w b over |sum w l|, and with the weights of the nearest point it is exactly that, at
faces, edges and corners alike. A quadric has half-spaces of its own, its tangents: by Cauchy and Schwarz u'Q(x - c) <= sqrt(B u'Qu) for
every u. Weights and tangents are found in floats for one place of a path; what they prove holds for all of it, since a polynomial
lies in the hull of its Bernstein coefficients and what a plane parts from them it parts from the path. Every bound is rounded to
the strict side (`verify.arithmetic.balls` says how radii are counted).

Where an opening leads through a part, a point p m off the hoop's axis and d m before or behind all of the part is at least
sqrt(d^2 + (opening - p)^2) from what is solid; the greatest p of a hull is at one of its corners.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from verify.arithmetic.balls import Floats, gamma, nearest
from verify.arithmetic.bounds import Indices
from verify.data.shapes.conditions import HalfSpace, Quadric, condition, root_bounds
from verify.data.shapes.region import Hoop
from verify.data.shapes.solid_parts import SolidPart
from verify.motion.convex_bodies import ConvexPart, farthest
from verify.motion.passages import unit_normal

_SIZES = (4, 6, 8, 12, 16, 24, 32, 64)
"""Parts are looked at together that have at most so many faces."""
_KEPT = 12
"""Of a part with many faces the farthest so many are weighed against each other."""
_SWEEPS = 60
_NEWTON = 12
_WAYS = np.array([way for way in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(way)])
_FAR = 1e6
"""m; tangents are looked for from so far away."""
_NONE = 1e300
"""The bound of a face that is none."""
_GROW = 1.0 + 2.0**-40
_TINY = 1e-290


@dataclass(frozen=True, eq=False, slots=True)
class Hulls:
    """Points, or the corners of what holds a path's part: each corner anywhere within a box.

    Attributes:
        mid: m, world frame. Shape (n, 3, corners).
        rad: Half the boxes' edges, m. The same shape.
    """

    mid: Floats
    rad: Floats

    @classmethod
    def points(cls, places: Floats) -> Hulls:
        """Return points. Shape (n, 3)."""
        return cls(places[..., None], np.zeros((*places.shape, 1)))

    @property
    def extent(self) -> tuple[Floats, Floats]:
        """How large coordinates may be, and how far off the corners, m. Shape (n, 3) each."""
        rad = self.rad.max(axis=-1)
        return (np.abs(self.mid).max(axis=-1) + rad) * _GROW, rad

    def __getitem__(self, index: Indices) -> Hulls:
        return Hulls(self.mid[index], self.rad[index])

    def __len__(self) -> int:
        return len(self.mid)


@dataclass(frozen=True, eq=False, slots=True)
class Found:
    """What is known of some hulls, each beside one part.

    Attributes:
        low: Proved: no point of the hull is nearer to what is solid, m; below zero nothing is. Shape (n,).
        near: About how near the hull's chosen place is, m; below zero how deep it lies inside. Shape (n,).
    """

    low: Floats
    near: Floats


@dataclass(frozen=True, eq=False, slots=True)
class _Rows:
    """Half-spaces normal . x <= bound in a part's frame: exact up to the errors. Shapes (n, rows, 3) and (n, rows)."""

    normals: Floats
    bounds: Floats
    normal_errors: Floats
    bound_errors: Floats

    def joined(self, other: _Rows) -> _Rows:
        return _Rows(
            np.concatenate([self.normals, other.normals], axis=1),
            np.concatenate([self.bounds, other.bounds], axis=1),
            np.concatenate([self.normal_errors, other.normal_errors], axis=1),
            np.concatenate([self.bound_errors, other.bound_errors], axis=1),
        )

    def kept(self, rows: Indices) -> _Rows:
        """Return some rows of each. Shape (n, kept)."""
        deep = rows[..., None]
        return _Rows(
            np.take_along_axis(self.normals, deep, 1),
            np.take_along_axis(self.bounds, rows, 1),
            np.take_along_axis(self.normal_errors, deep, 1),
            np.take_along_axis(self.bound_errors, rows, 1),
        )


@dataclass(frozen=True, eq=False, slots=True)
class _Quadrics:
    """The k-th quadric of each part of a table, in the part's frame.

    Attributes:
        matrices: m^-2, exact. Shape (parts, 3, 3).
        centres: m. Shape (parts, 3).
        centre_errors: How far off they may be, m. Shape (parts, 3).
        roots: Upper bounds of the right-hand sides' roots; infinite where a part has no such quadric. Shape (parts,).
        values: Eigenvalues, in floats, for proposals. Shape (parts, 3).
        ways: Eigenvectors. Shape (parts, 3, 3).
    """

    matrices: Floats
    centres: Floats
    centre_errors: Floats
    roots: Floats
    values: Floats
    ways: Floats

    @classmethod
    def of(cls, quadrics: Sequence[Quadric | None]) -> _Quadrics:
        matrices, centres = np.zeros((len(quadrics), 3, 3)), np.zeros((len(quadrics), 3))
        errors, roots = np.zeros((len(quadrics), 3)), np.full(len(quadrics), _NONE)
        for k, one in enumerate(quadrics):
            if one is None:
                continue
            matrices[k] = [[float(x) for x in row] for row in one.matrix]  # they were floats
            pairs = [nearest(x) for x in one.centre]
            centres[k], errors[k] = [value for value, _ in pairs], [error for _, error in pairs]
            roots[k] = np.nextafter(float(root_bounds(one.square)[1]), np.inf)
        values, ways = np.linalg.eigh(matrices)
        return cls(matrices, centres, errors, roots, np.maximum(values, 0.0), ways)

    def tangents(self, parts: Indices, places: Floats) -> _Rows:
        """Return half-spaces that touch the quadrics near where they are nearest to places, in the parts' frame. Shape (n, 3)."""
        matrix, centre, root = self.matrices[parts], self.centres[parts], self.roots[parts]
        toward = _nearest_way(self.values[parts], self.ways[parts], root, places - centre)
        normal = np.einsum("nij,nj->ni", matrix, toward)
        error = np.einsum("nij,nj->ni", np.abs(matrix), np.abs(toward)) * gamma(5) + _TINY
        square = np.einsum("ni,ni->n", normal, toward)
        square += np.einsum("ni,ni->n", error + gamma(5) * np.abs(normal), np.abs(toward))
        reach = root * np.sqrt(np.maximum(square, 0.0) * _GROW) * _GROW + _TINY
        shift = np.einsum("ni,ni->n", normal, centre)
        off = np.einsum("ni,ni->n", error + gamma(5) * np.abs(normal), np.abs(centre) + self.centre_errors[parts])
        off += np.einsum("ni,ni->n", np.abs(normal), self.centre_errors[parts])
        none = (root >= _NONE) | ~(np.abs(normal).max(axis=1) > 1e-150)
        bound = np.where(none, _NONE, reach + shift)
        off = np.where(none, 0.0, off * _GROW + gamma(3) * np.abs(bound) + _TINY)
        normal[none], error[none] = 0.0, 0.0
        return _Rows(normal[:, None], bound[:, None], error[:, None], off[:, None])


def _nearest_way(values: Floats, ways: Floats, root: Floats, offset: Floats) -> Floats:
    """Return the way from a quadric's centre to its point nearest to places, in floats. Shape (n, 3)."""
    own = np.einsum("nij,ni->nj", ways, offset)
    factor = np.zeros(len(own))
    for _ in range(_NEWTON):
        shrunk = 1.0 / (1.0 + factor[:, None] * values)
        level = np.sqrt(np.sum(values * (own * shrunk) ** 2, axis=1))
        open_ = level > root * (1 + 1e-15)
        if not open_.any():
            break
        slope = np.sum(values**2 * own**2 * shrunk**3, axis=1)
        factor = np.where(open_, factor + (level / root - 1.0) * level / np.maximum(slope, 1e-300), factor)
    return np.einsum("nij,nj->ni", ways, own / (1.0 + factor[:, None] * values))


@dataclass(frozen=True, eq=False, slots=True)
class _Hole:
    """An opening that leads through a part.

    Attributes:
        hoop: Whose.
        normal: Of the hoop, as stored. Shape (3,).
        error: How far each part of it is off the unit vector's. Shape (3,).
        ahead: How far the part reaches along the normal from the hoop's centre, at most, m.
        behind: Against it.
    """

    hoop: Hoop
    normal: Floats
    error: Floats
    ahead: float
    behind: float

    @classmethod
    def of(cls, part: SolidPart, hoop: Hoop) -> _Hole:
        normal, error = unit_normal(hoop)
        whole = ConvexPart(part.center, part.inequalities)
        reaches: list[float] = []
        for sign in (1, -1):
            x, y, z = (sign * Fraction(n) for n in normal.tolist())
            reach = farthest(whole, (x, y, z))
            at = sum((n * Fraction(c) for n, c in zip((x, y, z), hoop.center, strict=True)), Fraction(0))
            reaches.append(np.inf if reach is None else _above(reach - at))
        return cls(hoop, normal, error, *reaches)

    def distances(self, hulls: Hulls, places: Floats) -> Found:
        """Return how far hulls stay from what is solid of the part, before, behind and within the opening.

        Args:
            hulls: n of them.
            places: One place of each, m. Shape (n, 3).
        """
        offset = hulls.mid - np.array(self.hoop.center)[:, None]
        rad = (hulls.rad + gamma(2) * np.abs(offset)) * _GROW + _TINY
        size = np.abs(offset) + rad
        along = np.einsum("i,nik->nk", self.normal, offset)
        known = np.abs(self.normal) * gamma(6) + self.error
        off = (np.einsum("i,nik->nk", known, size) + np.einsum("i,nik->nk", np.abs(self.normal), rad)) * _GROW + _TINY
        beyond = np.maximum(np.min(along - off, axis=1) - self.ahead, -np.max(along + off, axis=1) - self.behind)
        beside = np.maximum(beyond * (1 - 2.0**-50), 0.0)
        across = offset - self.normal[:, None] * along[:, None]
        loose = rad + (np.abs(self.normal) + self.error)[:, None] * off[:, None] + self.error[:, None] * np.abs(along)[:, None]
        loose += gamma(4) * (size + np.abs(along)[:, None])
        widest = np.max(np.linalg.norm(across, axis=1) * (1 + 2.0**-48) + loose.sum(axis=1) * _GROW, axis=1)
        inside = np.nextafter(self.hoop.opening - widest, -np.inf)
        low = np.where(inside > 0, np.hypot(beside, np.maximum(inside, 0.0)) * (1 - 2.0**-50), inside)
        return Found(low, self._near(places))

    def _near(self, places: Floats) -> Floats:
        offset = places - np.array(self.hoop.center)
        along = offset @ self.normal
        inside = self.hoop.opening - np.linalg.norm(offset - along[:, None] * self.normal, axis=1)
        beside = np.maximum(np.maximum(along - self.ahead, -along - self.behind), 0.0)
        return np.where(inside > 0, np.hypot(beside, inside), inside)


def _above(value: Fraction) -> float:
    """Return a float that is surely above a rational, by a share that also covers a normal that is not quite a unit vector."""
    return float(np.nextafter(float(value) + abs(float(value)) * 2.0**-44, np.inf))


@dataclass(frozen=True, eq=False, slots=True)
class PartTable:
    """Parts with about equally many faces, as arrays.

    Attributes:
        indices: Which parts they are. Shape (parts,).
        centres: m, world frame. Shape (parts, 3).
        normals: Of the faces, as they are written; zero beyond a part's own. Shape (parts, faces, 3).
        bounds: Shape (parts, faces).
        quadrics: The parts' first quadrics, their second ones, and so on.
        mixed: Whether a quadric's axes are those of some face, too, so that tangents are looked for more than once.
        holes: By the part's row.
    """

    indices: Indices
    centres: Floats
    normals: Floats
    bounds: Floats
    quadrics: tuple[_Quadrics, ...]
    mixed: bool
    holes: dict[int, tuple[_Hole, ...]]

    @classmethod
    def of(cls, chosen: Sequence[tuple[int, SolidPart]], faces: int, quadrics: int, *, mixed: bool) -> PartTable:
        """Write parts as arrays.

        Args:
            chosen: The parts with their indices.
            faces: Room for so many faces.
            quadrics: How many quadrics each has.
            mixed: Whether faces and quadrics share axes.
        """
        normals, bounds = np.zeros((len(chosen), faces, 3)), np.full((len(chosen), faces), _NONE)
        round_: list[list[Quadric]] = []
        for row, (_, part) in enumerate(chosen):
            flat = [one for one in part.inequalities if not any(map(any, one.quadratic))]
            normals[row, : len(flat)] = np.array([one.linear for one in flat]).reshape(-1, 3)
            bounds[row, : len(flat)] = [one.bound for one in flat]
            known = (condition(one) for one in part.inequalities)
            round_.append([one for one in known if not isinstance(one, HalfSpace)])
        return cls(
            np.array([index for index, _ in chosen], dtype=np.intp),
            np.array([part.center for _, part in chosen]),
            normals,
            bounds,
            tuple(_Quadrics.of([row[k] for row in round_]) for k in range(quadrics)),
            mixed,
            {row: tuple(_Hole.of(part, hoop) for _, hoop in part.holes) for row, (_, part) in enumerate(chosen) if part.holes},
        )

    def rows(self) -> _Rows:
        """Return all faces, and tangents of the quadrics in some directions. Shape (parts, rows, 3)."""
        every = np.arange(len(self.indices))
        shape = self.bounds.shape
        known = _Rows(self.normals, self.bounds, np.zeros((*shape, 3)), np.zeros(shape))
        for one in self.quadrics:
            for way in _WAYS:
                known = known.joined(one.tangents(every, one.centres + _FAR * way))
        return known

    def distances(self, rows: Indices, hulls: Hulls, places: Floats, *, enough: Floats | None = None) -> Found:
        """Return how far hulls stay from what is solid of parts.

        Args:
            rows: The part that each hull is held against, by its row in this table. Shape (n,).
            hulls: n of them.
            places: One place of each, for which weights are looked for, m. Shape (n, 3).
            enough: Hulls whose faces alone prove as much as this are not looked at any closer, m. Shape (n,). None: all are.
        """
        middle = places - self.centres[rows]
        known = _Rows(
            self.normals[rows],
            self.bounds[rows],
            np.zeros((len(rows), self.normals.shape[1], 3)),
            np.zeros(self.bounds[rows].shape),
        )
        for one in self.quadrics:
            known = known.joined(one.tangents(rows, middle))
        centred = Hulls(hulls.mid - self.centres[rows][..., None], hulls.rad)
        own = Hulls(centred.mid, (hulls.rad + gamma(2) * np.abs(centred.mid)) * _GROW + _TINY)
        low, near = _by_faces(known, own, middle)
        deeper = np.arange(len(rows)) if enough is None else np.flatnonzero(~(low >= enough))
        deeper = deeper[near[deeper] > 0]
        if len(deeper):
            some = _Rows(*(part[deeper] for part in (known.normals, known.bounds, known.normal_errors, known.bound_errors)))
            for turn in range(3 if self.mixed else 1):
                chosen = _farthest(some, middle[deeper])
                weights, back = _weights(chosen, middle[deeper])
                low[deeper] = np.fmax(low[deeper], _by_weights(chosen, weights, own[deeper]))
                near[deeper] = np.fmax(near[deeper], np.linalg.norm(back, axis=1))
                if turn < 2 and self.mixed:
                    for one in self.quadrics:
                        some = some.joined(one.tangents(rows[deeper], middle[deeper] - back))
        for row, holes in self.holes.items():
            of_row = np.flatnonzero(rows == row)
            for hole in holes if len(of_row) else ():
                found = hole.distances(hulls[of_row], places[of_row])
                low[of_row] = np.fmax(low[of_row], found.low)
                near[of_row] = np.fmax(near[of_row], found.near)
        return Found(np.where(np.isnan(low), -np.inf, low), near)


def part_tables(parts: Iterable[SolidPart]) -> tuple[PartTable, ...]:
    """Sort parts by how many faces and quadrics they have."""
    kinds: dict[tuple[int, int, bool], list[tuple[int, SolidPart]]] = {}
    for index, part in enumerate(parts):
        known = [condition(one) for one in part.inequalities]
        flat = [one for one in known if isinstance(one, HalfSpace)]
        round_ = [one for one in known if not isinstance(one, HalfSpace)]
        axes = {axis for one in round_ for axis in range(3) if any(one.matrix[axis])}
        mixed = len(round_) > 1 or (bool(round_) and any(one.normal[axis] for one in flat for axis in axes))
        size = next((size for size in _SIZES if len(flat) <= size), len(flat)) if flat else 0
        kinds.setdefault((size, len(round_), mixed), []).append((index, part))
    return tuple(PartTable.of(chosen, faces, quadrics, mixed=mixed) for (faces, quadrics, mixed), chosen in kinds.items())


@dataclass(frozen=True, eq=False, slots=True)
class Outlines:
    """All parts as polyhedra that hold them, for boxes that may be far: half-spaces normal . x <= bound in the world's frame.

    Attributes:
        normals: No longer than 1. Shape (parts, faces, 3).
        bounds: m, rounded upwards. Shape (parts, faces).
    """

    normals: Floats
    bounds: Floats

    @classmethod
    def of(cls, tables: Sequence[PartTable], count: int) -> Outlines:
        """Take all faces of parts, and tangents of their quadrics in some directions.

        Args:
            tables: That hold the parts.
            count: How many parts there are.
        """
        rows = [table.rows() for table in tables]
        normals = np.zeros((count, max(one.bounds.shape[1] for one in rows), 3))
        bounds = np.full(normals.shape[:2], _NONE)
        for table, one in zip(tables, rows, strict=True):
            lengths = np.linalg.norm(one.normals, axis=-1) * (1 + 2.0**-49) + one.normal_errors.sum(axis=-1)
            size = np.abs(table.centres)
            shift = np.einsum("pri,pi->pr", one.normals, table.centres)
            off = one.bound_errors + np.einsum("pri,pi->pr", one.normal_errors + gamma(8) * np.abs(one.normals), size)
            bound = one.bounds + shift + (off + gamma(8) * (np.abs(one.bounds) + np.abs(shift))) * _GROW
            none = one.bounds >= _NONE
            scale = np.where(none, 1.0, lengths)
            at = table.indices[:, None], np.arange(bound.shape[1])
            normals[at] = np.where(none[..., None], 0.0, one.normals / scale[..., None])
            bounds[at] = np.where(none, _NONE, bound / scale + np.abs(bound / scale) * 2.0**-50)
        return cls(normals, bounds)

    def some(self, parts: Indices) -> Outlines:
        """Return some of the parts."""
        return Outlines(self.normals[parts], self.bounds[parts])

    def beyond(self, low: Floats, high: Floats) -> Floats:
        """Return how far boxes are from each part at the least, m; below zero nothing is proved. Shape (n, 3) each to (n, parts)."""
        middle, half = (low + high) / 2, (high - low) / 2 * _GROW
        flat, bounds = self.normals.reshape(-1, 3), self.bounds.reshape(-1)
        values = middle @ flat.T - half @ np.abs(flat).T - bounds
        most = float(np.max(np.abs(middle) + half, initial=0.0)) + np.where(bounds < _NONE, np.abs(bounds), 0.0)
        values -= gamma(32) * 4 * most
        return np.max(values.reshape(len(low), *self.bounds.shape), axis=-1)


def _by_faces(rows: _Rows, hulls: Hulls, places: Floats) -> tuple[Floats, Floats]:
    """Return what single half-spaces prove, and how far places are from the farthest one, in floats. Shapes (n,)."""
    size, rad = hulls.extent
    least = np.min(np.matmul(rows.normals, hulls.mid), axis=-1) - rows.bounds
    loose = np.abs(rows.normals)
    off = np.einsum("nri,ni->nr", loose * gamma(6) + rows.normal_errors, size) + np.einsum("nri,ni->nr", loose, rad)
    off += rows.bound_errors + gamma(3) * np.abs(rows.bounds)
    least -= off * _GROW + _TINY
    lengths = np.linalg.norm(rows.normals, axis=-1)
    doubt = rows.normal_errors.sum(axis=-1)
    most, fewest = lengths * (1 + 2.0**-49) + doubt, np.maximum(lengths * (1 - 2.0**-49) - doubt, _TINY)
    apart = np.where(least > 0, least / most * (1 - 2.0**-51), least / fewest * (1 + 2.0**-51))
    at = np.einsum("nri,ni->nr", rows.normals, places) - rows.bounds
    return np.max(apart, axis=1), np.max(at / np.maximum(lengths, 1e-150), axis=1)


def _farthest(rows: _Rows, places: Floats) -> _Rows:
    if rows.bounds.shape[1] <= _KEPT:
        return rows
    lengths = np.maximum(np.linalg.norm(rows.normals, axis=-1), 1e-150)
    at = (np.einsum("nri,ni->nr", rows.normals, places) - rows.bounds) / lengths
    return rows.kept(np.argpartition(-at, _KEPT - 1, axis=1)[:, :_KEPT])


def _weights(rows: _Rows, places: Floats) -> tuple[Floats, Floats]:
    """Return the half-spaces' weights at the point of their intersection that is nearest to places, in floats.

    Hildreth's method: each weight in turn becomes what brings the place onto its own plane, or zero.

    Returns:
        Weights of the rows, shape (n, rows), and the way back from the places to the nearest points, shape (n, 3).
    """
    lengths = np.maximum(np.linalg.norm(rows.normals, axis=-1), 1e-150)
    units = rows.normals / lengths[..., None]
    over = (np.einsum("nri,ni->nr", rows.normals, places) - rows.bounds) / lengths
    weights, back = np.zeros_like(over), np.zeros_like(places)
    order = np.argsort(-over.max(axis=0))
    for _ in range(_SWEEPS):
        moved = 0.0
        for k in order.tolist():
            unit = units[:, k]
            wanted = np.maximum(weights[:, k] + over[:, k] - np.einsum("ni,ni->n", unit, back), 0.0)
            step = wanted - weights[:, k]
            if step.any():
                weights[:, k] = wanted
                back += step[:, None] * unit
                moved = max(moved, float(np.max(np.abs(step))))
        if moved <= 1e-13:
            break
    return weights / lengths, back


def _by_weights(rows: _Rows, weights: Floats, hulls: Hulls) -> Floats:
    """Return what weighted half-spaces prove; below zero nothing. Shape (n,)."""
    normal = np.einsum("nr,nri->ni", weights, rows.normals)
    chain = gamma(weights.shape[1] + 3)
    error = np.einsum("nr,nri->ni", weights, chain * np.abs(rows.normals) + rows.normal_errors) * _GROW + _TINY
    bound = np.einsum("nr,nr->n", weights, rows.bounds)
    off = np.einsum("nr,nr->n", weights, chain * np.abs(rows.bounds) + rows.bound_errors) * _GROW + _TINY
    size, rad = hulls.extent
    least = np.min(np.einsum("ni,nik->nk", normal, hulls.mid), axis=1) - bound
    loose = np.einsum("ni,ni->n", error + gamma(6) * np.abs(normal), size) + np.einsum("ni,ni->n", np.abs(normal), rad)
    least -= (loose + off + gamma(3) * np.abs(bound)) * _GROW
    length = np.linalg.norm(normal, axis=1) * (1 + 2.0**-49) + error.sum(axis=1)
    return np.where(least > 0, least / length * (1 - 2.0**-51), -np.inf)
