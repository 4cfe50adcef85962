"""Parts of obstacles as arrays, by how many faces they have: how far many hulls stay from many parts at once."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from verify.arithmetic.balls import Floats
from verify.arithmetic.bounds import Indices
from verify.data.shapes.conditions import HalfSpace, Quadric, condition
from verify.data.shapes.nearest import surface_of
from verify.data.shapes.solid_parts import SolidPart
from verify.motion.obstacles.half_spaces import (
    GROW,
    NONE,
    TINY,
    HalfSpaces,
    Hulls,
    apart_by,
    apart_by_one,
    farthest_of,
    weighed,
    weights_of,
)
from verify.motion.obstacles.openings import BESIDE, Found, Opening
from verify.motion.obstacles.tangents import Tangents

_SIZES = (4, 6, 8, 12, 16, 24, 32, 64)
"""Parts are looked at together that have at most so many faces."""
_AXES = np.concatenate([np.eye(3), -np.eye(3)])
_FAR = 1e6
"""m; what holds a part along an axis is looked for from so far away."""
_NO_FARTHER = 1e150
"""m; squares of more may overflow."""


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
        beyond: Places in the parts' frames to which what lies farthest along the axes is nearest, there and back, m. Shape (parts, 6, 3).
        holes: By the part's row.
    """

    indices: Indices
    centres: Floats
    normals: Floats
    bounds: Floats
    quadrics: tuple[Tangents, ...]
    mixed: bool
    beyond: Floats
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
            np.array([_beyond(part, flat=not quadrics) for _, part in chosen]),
            {
                row: tuple(Opening.of(part, hoop) for _, hoop in part.holes)
                for row, (_, part) in enumerate(chosen)
                if part.holes
            },
        )

    def extents(self) -> tuple[Floats, Floats]:
        """Return boxes along the world's axes that surely hold the parts, infinite where none is found: their least and greatest corners.

        Towards a place beyond along an axis e a half-space l.x <= b is weighed whose l is nearly e: it bounds e.x by what the little
        between l and e makes of the largest coordinate x has, which the six bounds together bound.

        Returns:
            m. Shape (parts, 3) each.
        """
        count = len(self.indices)
        rows, ways, places = np.repeat(np.arange(count), 6), np.tile(_AXES, (count, 1)), self.beyond.reshape(-1, 3)
        *_, plane = self._planes(rows, self._known(rows, places), places)
        normal, doubt = plane.normals[:, 0], plane.normal_errors.sum(axis=(1, 2))
        ahead = np.einsum("ni,ni->n", normal, ways) - doubt
        side = np.maximum(plane.bounds[:, 0] + plane.bound_errors[:, 0], 0.0) / ahead
        lean = ((np.abs(normal) * (ways == 0)).sum(axis=1) + doubt) / ahead
        side, lean = side.reshape(count, 6), np.where(ahead > 0, lean, np.inf).reshape(count, 6) * GROW
        most = lean.max(axis=1)
        size = np.where(most < 0.5, side.max(axis=1) * GROW / (1.0 - most), np.inf)
        reach = (side + lean * size[:, None]) * GROW + TINY
        reach = np.where(np.isfinite(size)[:, None] & ~np.isnan(reach), reach, np.inf)
        return np.nextafter(self.centres - reach[:, 3:], -np.inf), np.nextafter(self.centres + reach[:, :3], np.inf)

    def _known(self, rows: Indices, places: Floats) -> HalfSpaces:
        """Return the faces of parts, and tangents of their quadrics near places in the parts' frames."""
        bounds = self.bounds[rows]
        known = HalfSpaces(self.normals[rows], bounds, np.zeros((*bounds.shape, 3)), np.zeros(bounds.shape))
        for one in self.quadrics:
            known = known.joined(one.tangents(rows, places))
        return known

    def _planes(self, rows: Indices, known: HalfSpaces, places: Floats) -> Iterator[HalfSpaces]:
        """Yield half-spaces of parts between them and places, each farther from these than those before where quadrics are mixed."""
        for turn in range(3 if self.mixed else 1):
            chosen = farthest_of(known, places)
            weights, back = weights_of(chosen, places)
            yield weighed(chosen, weights)
            if turn < 2 and self.mixed:
                for one in self.quadrics:
                    known = known.joined(one.tangents(rows, places - back))

    def distances(self, rows: Indices, hulls: Hulls, places: Floats, *, enough: Floats | None = None) -> Found:
        """Return how far hulls stay from what is solid of parts.

        Args:
            rows: The part that each hull is compared with, by its row in this table. Shape (n,).
            hulls: n of them.
            places: One place of each, for which weights are looked for, m. Shape (n, 3).
            enough: Hulls whose faces alone prove as much as this are not looked at any closer, m. Shape (n,). None: all are.
        """
        middle = places - self.centres[rows]
        known = self._known(rows, middle)
        own = hulls.beside(self.centres[rows])
        low, near = apart_by_one(known, own, middle)
        deeper = np.arange(len(rows)) if enough is None else np.flatnonzero(~(low >= enough))
        deeper = deeper[near[deeper] > 0]
        if len(deeper):
            some, hull, place = known.of(deeper), own[deeper], middle[deeper]
            for plane in self._planes(rows[deeper], some, place):
                sure, about = apart_by(plane, hull, place)
                low[deeper], near[deeper] = np.fmax(low[deeper], sure), np.fmax(near[deeper], about)
        for row, holes in self.holes.items():
            of_row = np.flatnonzero(rows == row)
            for hole in holes if len(of_row) else ():
                found = hole.distances(hulls[of_row], places[of_row])
                low[of_row] = np.fmax(low[of_row], found.low)
                near[of_row] = np.fmax(near[of_row], found.near)
                open_ = of_row if enough is None else of_row[~(low[of_row] >= enough[of_row])]
                open_ = open_[hole.is_slanted(known.of(open_), middle[open_]) | bool(self.quadrics)]
                if len(open_):
                    sure, about = self._beside(hole, known.of(open_), rows[open_], hulls[open_], places[open_])
                    low[open_], near[open_] = np.fmax(low[open_], sure), np.fmax(near[open_], about)
        return Found(np.where(np.isnan(low), -np.inf, low), near)

    # five parameters: what is known of each hull
    def _beside(self, hole: Opening, known: HalfSpaces, rows: Indices, hulls: Hulls, places: Floats) -> tuple[Floats, Floats]:
        """Return what parts' half-spaces prove of hulls beside an opening, and about how far places are from its edge. Shape (n,) each."""
        middle, own = places - self.centres[rows], hulls.beside(self.centres[rows])
        low, near = np.full(len(rows), -np.inf), np.full(len(rows), -np.inf)
        at = middle
        for _ in range(2 if self.quadrics else 1):
            chosen = farthest_of(known, at, BESIDE)
            weights, about, at = hole.weights(chosen, places, middle)
            more = np.flatnonzero(weights.any(axis=1))  # of the others the opening alone tells as much
            if len(more):
                sure = hole.apart_by(weighed(chosen.of(more), weights[more]), hulls[more], own[more])
                low[more] = np.fmax(low[more], sure)
            near = np.fmax(near, about)
            for one in self.quadrics:
                known = known.joined(one.tangents(rows, at))
        return low, near


def _beyond(part: SolidPart, *, flat: bool) -> Floats:
    """Return places beyond the corners that lie farthest along the axes; where there are none, places far off."""
    corners = surface_of(part.inequalities).corners if flat else np.zeros((0, 3))
    return corners[np.argmax(corners @ _AXES.T, axis=0)] + _AXES if len(corners) else _FAR * _AXES


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
    """All parts as boxes along the world's axes that surely hold them, for boxes that may be far.

    Attributes:
        low: m. Shape (parts, 3).
        high: m. Shape (parts, 3).
    """

    low: Floats
    high: Floats

    @classmethod
    @np.errstate(all="ignore")
    def of(cls, tables: Sequence[PartTable], count: int) -> Outlines:
        """Take the boxes around the parts of tables.

        Args:
            tables: That hold the parts.
            count: How many parts there are.
        """
        low, high = np.full((count, 3), -np.inf), np.full((count, 3), np.inf)
        for table in tables:
            low[table.indices], high[table.indices] = table.extents()
        return cls(low, high)

    def beyond(self, low: Floats, high: Floats) -> Floats:
        """Return how far boxes are from each part at the least, m; below zero nothing is proved. Shape (n, 3) each to (n, parts)."""
        return _gaps(low[:, None], high[:, None], self.low, self.high)

    def beyond_one(self, low: Floats, high: Floats, parts: Indices) -> Floats:
        """Return how far boxes are at the least from one part each, m; below zero nothing is proved.

        Args:
            low: m. Shape (n, 3).
            high: m. Shape (n, 3).
            parts: Shape (n,).
        """
        return _gaps(low, high, self.low[parts], self.high[parts])


def _gaps(low: Floats, high: Floats, other_low: Floats, other_high: Floats) -> Floats:
    """Return the distances of boxes, rounded down; below zero, that they overlap. Shapes (..., 3) to (...)."""
    x, y, z = (np.maximum(other_low[..., i] - high[..., i], low[..., i] - other_high[..., i]) for i in range(3))
    most = np.maximum(np.maximum(x, y), z)
    squares = np.maximum(x, 0.0) ** 2 + np.maximum(y, 0.0) ** 2 + np.maximum(z, 0.0) ** 2
    return np.where(most > 0, np.minimum(np.sqrt(squares) * (1 - 2.0**-48), _NO_FARTHER), most)
