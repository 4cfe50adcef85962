"""Which of many sampled paths keep a planned word: a filter for the search, never a claim.

A path counts when the word that its samples show is the planned one, with every region shrunk by the margin and with
every region grown by it; when each hoop is flown through in the planned direction, inside its opening; and when it
meets no ring, no other opening, no obstacle and no wall. Between samples nothing is known: whatever is kept is judged for all times.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ltlplan.free_space.inflated_obstacles import NO_SOLIDS, Solids
from ltlplan.paths.hoops.keep_out import KeptRegion, room
from ltlplan.paths.sampling.sampled_paths import ellipsoid_level, final_states, samples_near, scaled_level
from verify.data import Mission, RobotPlan

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]


@dataclass(frozen=True, eq=False, slots=True)
class _Body:
    """What is kept of one region.

    Attributes:
        obstacle: Centre, matrix, ring, and the level outside which a path is clear of it.
        weight: Of its digit in a sample's code; 0 for a region that is not visited.
        through: Whether it is a hoop that is flown through.
        shrunk: Level inside which a path is in it for sure.
        reach: m; samples farther from the centre than this have nothing to do with it.
    """

    obstacle: KeptRegion
    weight: int
    through: bool
    shrunk: float
    reach: float


@dataclass(frozen=True, eq=False)
class WordFilter:
    """Tells which sampled paths keep a planned word, its passages, and clear of rings and walls.

    Attributes:
        visited: Regions that the word visits; each is one digit of a sample's code: 0 outside, 1 inside before the
            hoop's plane (or anywhere in a region that is not flown through), 2 inside beyond it.
        word: The codes that a path must show, in order.
    """

    visited: tuple[str, ...]
    word: tuple[int, ...]
    _bodies: tuple[_Body, ...]
    _low: Floats
    _high: Floats
    _solids: Solids = NO_SOLIDS

    def keeps(self, positions: Floats) -> Booleans:
        """Tell for each path whether its samples keep everything. Shape (instants, 3, paths) to (paths,)."""
        count = positions.shape[2]
        walls = (positions.min(axis=0) >= self._low[:, None]) & (positions.max(axis=0) <= self._high[:, None])
        shrunk = np.zeros((len(positions), count), dtype=np.int64)
        grown = np.zeros((len(positions), count), dtype=np.int64)
        wrong = np.zeros((len(positions), count), dtype=np.bool_)
        in_shrunk, in_grown, bad = shrunk.reshape(-1), grown.reshape(-1), wrong.reshape(-1)
        bodies = self._within(positions.min(axis=(0, 2)), positions.max(axis=(0, 2)))
        centres = np.array([self._bodies[i].obstacle.centre for i in bodies]).reshape(-1, 3)
        reach = np.array([self._bodies[i].reach for i in bodies])
        for start, k, index, offset in samples_near(positions, centres, reach):
            i = bodies[k]
            body, obstacle = self._bodies[i], self._bodies[i].obstacle
            level = ellipsoid_level(obstacle.matrix, offset) if obstacle.measures is None else obstacle.levels(offset.T)
            along = None if obstacle.normal is None else obstacle.normal @ offset
            at = start + index
            if body.weight:
                digit = body.weight * (1 + (along > 0)) if body.through and along is not None else body.weight
                in_shrunk[at] += np.where(level <= body.shrunk, digit, 0)
                in_grown[at] += np.where(level <= obstacle.level, digit, 0)
            else:
                bad[at] |= level <= obstacle.level
            if along is not None:
                across = np.einsum("an,an->n", offset, offset) - along**2
                ring = (across <= obstacle.outer**2) & (np.abs(along) <= obstacle.height)
                if body.weight:
                    ring &= across >= obstacle.inner**2
                bad[at] |= ring
        if self._solids.parts:
            wrong |= self._met(positions)
        final = self._run(np.concatenate([shrunk, grown], axis=1)) == len(self.word) - 1
        return np.all(walls, axis=0) & ~np.any(wrong, axis=0) & final[:count] & final[count:]

    def _met(self, positions: Floats) -> Booleans:
        """Tell which samples are too near to an obstacle. Shape (instants, 3, paths) to (instants, paths)."""
        met = np.zeros((len(positions), positions.shape[2]), dtype=np.bool_)
        low, high = positions.min(axis=2), positions.max(axis=2)
        for part, near in zip(self._solids.parts, self._solids.near(low, high), strict=True):
            instants = np.flatnonzero(near)
            if len(instants):
                points = positions[instants].transpose(0, 2, 1)
                met[instants] |= part.met(points.reshape(-1, 3)).reshape(len(instants), -1)
        return met

    def _within(self, low: Floats, high: Floats) -> list[int]:
        """Return the bodies that may reach into a box."""
        if not self._bodies:
            return []
        centres = np.array([body.obstacle.centre for body in self._bodies])
        beside = np.maximum(np.maximum(low - centres, centres - high), 0.0)
        return np.flatnonzero(np.linalg.norm(beside, axis=1) <= [body.reach for body in self._bodies]).tolist()

    def _run(self, codes: Integers) -> Integers:
        """Run the automaton that accepts exactly the word, each letter held as long as it may be. Shape (paths,)."""
        letters = np.unique(np.array(self.word, dtype=np.int64))
        table = np.full((len(self.word), len(letters) + 1), -1, dtype=np.int64)  # the last column: any other code
        for i, code in enumerate(self.word):
            table[i, np.searchsorted(letters, code)] = i
            if i + 1 < len(self.word):
                table[i, np.searchsorted(letters, self.word[i + 1])] = i + 1
        flat = codes.reshape(-1)
        dense = np.full(len(flat), 0 if letters[0] == 0 else len(letters), dtype=np.int64)
        somewhere = np.flatnonzero(flat)  # most samples are in free flight, code 0
        place = np.minimum(np.searchsorted(letters, flat[somewhere]), len(letters) - 1)
        dense[somewhere] = np.where(letters[place] == flat[somewhere], place, len(letters))
        return final_states(table, dense.reshape(codes.shape))


def word_filter(mission: Mission, plan: RobotPlan, *, slack: float = 0.0) -> WordFilter:
    """Return the filter for one robot's planned word and passages.

    Args:
        mission: Regions, margin, workspace, vehicle.
        plan: Word and visits with their sides.
        slack: m kept beyond the mission's margin.
    """
    where = room(mission, slack)
    near = mission.margin + slack
    visited = tuple(dict.fromkeys(n for letter in plan.word.letters for n in sorted(letter) if n in mission.all_regions))
    place = _weights(visited)
    sides = {v.region for v in plan.visits if v.direction is not None}
    bodies = []
    for name, region in mission.all_regions.items():
        obstacle = where.regions[name]
        weight = place.get(name, 0)
        bodies.append(_Body(obstacle, weight, name in sides, scaled_level(region.inner_radius, -near), obstacle.reach))
    return WordFilter(visited, _codes(plan, place, sides), tuple(bodies), where.low, where.high, where.solids)


def _weights(visited: Sequence[str]) -> dict[str, int]:
    """Return each region's weight in a code: powers of 3; for very many regions, spread so that sums hardly coincide."""
    if len(visited) < 39:
        return {name: 3**i for i, name in enumerate(visited)}
    drawn = np.random.default_rng(0).integers(1, 2**62 // (2 * len(visited)), len(visited))
    return {name: int(weight) for name, weight in zip(visited, drawn, strict=True)}


def _codes(plan: RobotPlan, place: Mapping[str, int], sides: Collection[str]) -> tuple[int, ...]:
    """The word as codes: a passage F shows its hoop's near half, then its far half; R the other way."""
    result: list[int] = []
    held: frozenset[str] = frozenset()
    visits = list(plan.visits)
    for letter in plan.word.letters:
        here = frozenset(name for name in letter if name in place)
        entered = sorted(here - held)
        steps = [here]
        order: dict[str, tuple[int, int]] = {}
        for name in entered:
            visit = next((v for v in visits if v.region == name), None)
            if visit is not None:
                visits.remove(visit)
            if name in sides:
                order[name] = (2, 1) if visit is not None and visit.direction == "R" else (1, 2)
                steps = [here, here]
        if here == held and result:
            continue
        for step in range(len(steps)):
            result.append(sum(place[name] * (order[name][step] if name in order else 1) for name in here))
        held = here
    return tuple(code for i, code in enumerate(result) if i == 0 or code != result[i - 1])
