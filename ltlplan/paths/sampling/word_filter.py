"""Which of many sampled paths keep a planned word: a filter for the search, never a claim.

A path counts when the word that its samples show is the planned one, with every region shrunk by the margin and with
every region grown by it; when each hoop is flown through in the planned direction, inside its opening; and when it
meets no ring, no other opening, no obstacle and no wall. Between samples nothing is known: whatever is kept is judged for all times.

Samples are sifted first: one matrix product gives all squared distances to the regions' centres, and only the few samples
within a region's bounding sphere are looked at closely.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ltlplan.paths.hoops.keep_out import KeptRegion, Room, room
from verify.data import Mission, RobotPlan
from verify.data.arrays import Booleans, Floats, Integers

_CHUNK = 32768  # samples looked at together, so that the arrays stay in the cache


@dataclass(frozen=True, eq=False)
class WordFilter:
    """Tells which sampled paths keep a planned word, its passages, and clear of rings and walls.

    Attributes:
        weights: Of the regions that the word visits, each one digit of a sample's code: 0 outside, 1 inside before the
            hoop's plane (or anywhere in a region that is not flown through), 2 inside beyond it.
        word: The codes that a path must show, in order. Shape (letters,).
        through: Hoops that are flown through.
        shrunk: Of each region the level inside which a path is in it for sure.
        where: What is kept clear of, and the regions' levels outside which a path is clear of them.
    """

    weights: Mapping[str, int]
    word: Integers
    through: Collection[str]
    shrunk: Mapping[str, float]
    where: Room

    def keeps(self, positions: Floats) -> Booleans:
        """Tell for each path whether its samples keep everything. Shape (instants, 3, paths) to (paths,)."""
        low, high = positions.min(axis=0), positions.max(axis=0)
        walls = (low >= self.where.low[:, None]) & (high <= self.where.high[:, None])
        wrong = self._met(positions)
        shrunk, grown = np.zeros(wrong.shape, dtype=np.int64), np.zeros(wrong.shape, dtype=np.int64)
        in_shrunk, in_grown, bad = shrunk.reshape(-1), grown.reshape(-1), wrong.reshape(-1)
        near = self.where.near(low.min(axis=1)[None], high.max(axis=1)[None])[0]
        regions = list(itertools.compress(self.where.regions.values(), near))
        for region, at, offset in samples_near(positions, regions):
            level, weight = region.levels(offset.T), self.weights.get(region.name, 0)
            along = None if region.normal is None else region.normal @ offset
            if weight:
                digit = weight * (1 + (along > 0)) if region.name in self.through and along is not None else weight
                in_shrunk[at] += np.where(level <= self.shrunk[region.name], digit, 0)
                in_grown[at] += np.where(level <= region.level, digit, 0)
            else:
                bad[at] |= level <= region.level
            if along is not None:
                across = np.einsum("an,an->n", offset, offset) - along**2
                ring = (across <= region.outer**2) & (np.abs(along) <= region.height)
                bad[at] |= ring & (across >= region.inner**2) if weight else ring
        return np.all(walls, axis=0) & ~np.any(wrong, axis=0) & self._shows_word(shrunk) & self._shows_word(grown)

    def _met(self, positions: Floats) -> Booleans:
        """Tell which samples are too near to an obstacle. Shape (instants, 3, paths) to (instants, paths)."""
        met = np.zeros((len(positions), positions.shape[2]), dtype=np.bool_)
        solids = self.where.solids
        for part, near in zip(solids.parts, solids.near(positions.min(axis=2), positions.max(axis=2)), strict=True):
            if near.any():
                points = positions[near].transpose(0, 2, 1)
                met[near] |= part.met(points.reshape(-1, 3)).reshape(points.shape[:2])
        return met

    def _shows_word(self, codes: Integers) -> Booleans:
        """Tell for each path whether its codes are the word's, each held as long as it may be. Shape (instants, paths) to (paths,)."""
        letter = np.cumsum(np.diff(codes, axis=0, prepend=self.word[0]) != 0, axis=0)
        last = len(self.word) - 1
        return (letter[-1] == last) & np.all(codes == self.word[np.minimum(letter, last)], axis=0)


def samples_near(positions: Floats, regions: Collection[KeptRegion]) -> Iterator[tuple[KeptRegion, Integers, Floats]]:
    """Yield a region, samples that may have to do with it, as indices into all of them, and their offsets from its centre (3, near).

    Args:
        positions: m. Shape (instants, 3, paths).
        regions: Each with its centre, and how far from there a sample may be.
    """
    centres = np.array([region.centre for region in regions]).reshape(-1, 3)
    reach = np.array([region.reach for region in regions])
    bound = (reach**2 - np.einsum("ra,ra->r", centres, centres))[:, None]
    count = positions.shape[2]
    step = max(1, _CHUNK // max(1, count))
    for first in range(0, len(positions), step):
        flat = positions[first : first + step].transpose(1, 0, 2).reshape(3, -1)
        close = (-2.0 * centres) @ flat + np.einsum("an,an->n", flat, flat) <= bound
        for region, near in zip(regions, close, strict=True):
            if len(index := np.flatnonzero(near)):
                yield region, first * count + index, flat[:, index] - region.centre[:, None]


def word_filter(mission: Mission, plan: RobotPlan, *, slack: float = 0.0) -> WordFilter:
    """Return the filter for one robot's planned word and passages.

    Args:
        mission: Regions, margin, workspace, vehicle.
        plan: Word and visits with their sides.
        slack: m kept beyond the mission's margin.
    """
    near, regions = mission.margin + slack, mission.all_regions
    visited = dict.fromkeys(name for letter in plan.word.letters for name in sorted(letter) if name in regions)
    weights = {name: pow(3, i, 1 << 56) for i, name in enumerate(visited)}  # of very many regions, sums hardly coincide
    through = frozenset(visit.region for visit in plan.visits if visit.direction is not None)
    shrunk = {name: max(1.0 - near / region.inner_radius, 0.05) ** 2 for name, region in regions.items()}
    return WordFilter(weights, _codes(plan, weights, through), through, shrunk, room(mission, slack))


def _codes(plan: RobotPlan, weights: Mapping[str, int], through: Collection[str]) -> Integers:
    """The word as codes: a passage F shows its hoop's near half, then its far half; R the other way."""
    directions = {name: iter([visit.direction for visit in plan.visits if visit.region == name]) for name in weights}
    codes: list[int] = []
    held: frozenset[str] = frozenset()
    for letter in plan.word.letters:
        here = letter & weights.keys()
        if here == held and codes:
            continue
        digits: dict[str, tuple[int, int]] = dict.fromkeys(here, (1, 1))
        for name in here - held:
            direction = next(directions[name], None)
            if name in through:
                digits[name] = (2, 1) if direction == "R" else (1, 2)
        codes += [sum(weights[name] * halves[half] for name, halves in digits.items()) for half in (0, 1)]
        held = here
    return np.array([code for code, _ in itertools.groupby(codes)])
