"""Parts of obstacles as arrays, by how many faces they have: how far many hulls stay from many parts at once."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from verify.arithmetic.balls import Floats, gamma
from verify.arithmetic.bounds import Indices
from verify.data.shapes.conditions import HalfSpace, Quadric, condition
from verify.data.shapes.solid_parts import SolidPart
from verify.motion.solids.half_spaces import (
    GROW,
    NONE,
    TINY,
    HalfSpaces,
    Hulls,
    apart_by_one,
    apart_by_weights,
    farthest_of,
    weights_of,
)
from verify.motion.solids.openings import Found, Opening
from verify.motion.solids.tangents import Tangents

_SIZES = (4, 6, 8, 12, 16, 24, 32, 64)
"""Parts are looked at together that have at most so many faces."""
_WAYS = np.array([way for way in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(way)])
_FAR = 1e6
"""m; tangents are looked for from so far away."""


@dataclass(frozen=True, eq=False, slots=True)
class PartTable:
    """Parts with about equally many faces, as arrays.

    Attributes:
        indices: Which parts they are. Shape (parts,).
        centres: m, world frame. Shape (parts, 3).
        normals: Of the faces, scaled by powers of two; zero beyond a part's own. Shape (parts, faces, 3).
        bounds: Shape (parts, faces).
        quadrics: The parts' first quadrics, their second ones, and so on.
        mixed: Whether a quadric's axes are those of some face, too, so that tangents are looked for more than once.
        holes: By the part's row.
    """

    indices: Indices
    centres: Floats
    normals: Floats
    bounds: Floats
    quadrics: tuple[Tangents, ...]
    mixed: bool
    holes: dict[int, tuple[Opening, ...]]

    @classmethod
    def of(cls, chosen: Sequence[tuple[int, SolidPart]], faces: int, quadrics: int, *, mixed: bool) -> PartTable:
        """Write parts as arrays.

        Args:
            chosen: The parts with their indices.
            faces: Room for so many faces.
            quadrics: How many quadrics each has.
            mixed: Whether faces and quadrics share axes.
        """
        normals, bounds = np.zeros((len(chosen), faces, 3)), np.full((len(chosen), faces), NONE)
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
            *_scaled(normals, bounds),
            tuple(Tangents.of([row[k] for row in round_]) for k in range(quadrics)),
            mixed,
            {
                row: tuple(Opening.of(part, hoop) for _, hoop in part.holes)
                for row, (_, part) in enumerate(chosen)
                if part.holes
            },
        )

    def rows(self) -> HalfSpaces:
        """Return all faces, and tangents of the quadrics in some directions. Shape (parts, rows, 3)."""
        every = np.arange(len(self.indices))
        shape = self.bounds.shape
        known = HalfSpaces(self.normals, self.bounds, np.zeros((*shape, 3)), np.zeros(shape))
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
        known = HalfSpaces(
            self.normals[rows],
            self.bounds[rows],
            np.zeros((len(rows), self.normals.shape[1], 3)),
            np.zeros(self.bounds[rows].shape),
        )
        for one in self.quadrics:
            known = known.joined(one.tangents(rows, middle))
        mid = hulls.mid - self.centres[rows][..., None]
        own = Hulls(mid, (hulls.rad + gamma(2) * np.abs(mid)) * GROW + TINY)
        low, near = apart_by_one(known, own, middle)
        deeper = np.arange(len(rows)) if enough is None else np.flatnonzero(~(low >= enough))
        deeper = deeper[near[deeper] > 0]
        if len(deeper):
            some = HalfSpaces(
                *(part[deeper] for part in (known.normals, known.bounds, known.normal_errors, known.bound_errors))
            )
            for turn in range(3 if self.mixed else 1):
                chosen = farthest_of(some, middle[deeper])
                weights, back = weights_of(chosen, middle[deeper])
                sure, about = apart_by_weights(chosen, weights, own[deeper], middle[deeper])
                low[deeper], near[deeper] = np.fmax(low[deeper], sure), np.fmax(near[deeper], about)
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


def _scaled(normals: Floats, bounds: Floats) -> tuple[Floats, Floats]:
    """Return half-spaces multiplied by powers of two, so that squares of normals neither vanish nor overflow.

    What falls below the least number is less than TINY, which is taken off all that is proved.
    """
    most = np.abs(normals).max(axis=-1, initial=0.0)
    powers = np.where(most > 0, -np.frexp(most)[1], 0)
    scaled = np.clip(np.ldexp(bounds, powers), -NONE, NONE)
    return np.ldexp(normals, powers[..., None]), np.where(most > 0, scaled, NONE)


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
        bounds = np.full(normals.shape[:2], NONE)
        for table, one in zip(tables, rows, strict=True):
            lengths = np.linalg.norm(one.normals, axis=-1) * (1 + 2.0**-49) + one.normal_errors.sum(axis=-1)
            size = np.abs(table.centres)
            shift = np.einsum("pri,pi->pr", one.normals, table.centres)
            off = one.bound_errors + np.einsum("pri,pi->pr", one.normal_errors + gamma(8) * np.abs(one.normals), size)
            bound = one.bounds + shift + (off + gamma(8) * (np.abs(one.bounds) + np.abs(shift))) * GROW
            none = one.bounds >= NONE
            scale = np.where(none, 1.0, lengths)
            at = table.indices[:, None], np.arange(bound.shape[1])
            normals[at] = np.where(none[..., None], 0.0, one.normals / scale[..., None])
            bounds[at] = np.where(none, NONE, bound / scale + np.abs(bound / scale) * 2.0**-50)
        return cls(normals, bounds)

    def some(self, parts: Indices) -> Outlines:
        """Return some of the parts."""
        return Outlines(self.normals[parts], self.bounds[parts])

    def beyond(self, low: Floats, high: Floats) -> Floats:
        """Return how far boxes are from each part at the least, m; below zero nothing is proved. Shape (n, 3) each to (n, parts)."""
        middle, half = (low + high) / 2, (high - low) / 2 * GROW
        flat, bounds = self.normals.reshape(-1, 3), self.bounds.reshape(-1)
        values = middle @ flat.T - half @ np.abs(flat).T - bounds
        most = float(np.max(np.abs(middle) + half, initial=0.0)) + np.where(bounds < NONE, np.abs(bounds), 0.0)
        values -= gamma(32) * 4 * most
        return np.max(values.reshape(len(low), *self.bounds.shape), axis=-1)
