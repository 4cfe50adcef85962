"""Labels and automaton runs of many sampled paths, as arrays: a filter for the search, never a claim.

A path counts when the word that its samples show is the planned one, with every region shrunk by the margin and with
every region grown by it; when each hoop is flown through in the planned direction, inside its opening; and when it
meets no ring, no other opening and no wall. Between samples nothing is known: whatever is kept is judged for all times.

Samples are sifted first: one matrix product gives all squared distances to the regions' centres, and only the few samples
within a region's bounding sphere are looked at closely.
"""

from __future__ import annotations

from collections.abc import Collection, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ltlplan.paths.hoops.clearance import Obstacle, room
from verify.data import BadInput, Letter, Mission, RobotPlan

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]

_CHUNK = 32768  # samples labelled at a time, so that the arrays stay in the cache


class WordAutomaton(Protocol):
    """What a run needs of an automaton; `ltlplan.translate` returns one."""

    @property
    def initial(self) -> Hashable:
        """State before the first letter."""
        ...

    @property
    def accepting(self) -> Collection[Hashable]:
        """States in which a finite word may end."""
        ...

    def successor(self, state: Hashable, letter: Letter) -> Hashable | None:
        """Return the state after a letter, or None where there is none."""
        ...


@dataclass(frozen=True, eq=False, slots=True)
class Labels:
    """The letter of every sample of every path, as codes.

    Attributes:
        codes: Index of a letter. Shape (instants, paths).
        regions: Region i is in the letter where bit i of the code is set.
    """

    codes: NDArray[np.int32]
    regions: tuple[str, ...]

    def letter(self, code: int) -> Letter:
        """Return the letter that a code stands for."""
        return frozenset(name for bit, name in enumerate(self.regions) if code >> bit & 1)


def label(mission: Mission, positions: Floats, *, grow: float = 0.0) -> Labels:
    """Label sampled paths: which regions each sample is in.

    Args:
        mission: At most 30 regions.
        positions: m, as `SampledPaths.axes(0)` has them. Shape (instants, 3, paths).
        grow: m by which every region is grown (shrunk where negative) before labelling.

    Raises:
        BadInput: There are more regions than a code has bits for.
    """
    names = tuple(mission.all_regions)
    if len(names) > 30:
        raise BadInput(f"{len(names)} regions; sampled labels hold at most 30.")
    codes = np.zeros((len(positions), positions.shape[2]), dtype=np.int32)
    flat = codes.reshape(-1)
    regions = list(mission.all_regions.values())
    centres = np.array([region.center for region in regions]).reshape(-1, 3)
    levels = np.array([_grown(region.inner_radius, grow) for region in regions])
    reach = np.array([region.outer_radius for region in regions]) * np.sqrt(levels)
    for start, i, index, offset in _near(positions, centres, reach):
        inside = index[_level(regions[i].shape, offset) <= levels[i]]
        flat[start + inside] |= 1 << i
    return Labels(codes, names)


def run(automaton: WordAutomaton, labels: Labels, internal: Letter = frozenset()) -> Booleans:
    """Tell for each path whether the word of its samples is accepted.

    Args:
        automaton: Deterministic, over finite words.
        labels: Codes of all samples.
        internal: Propositions that hold at every sample beside the regions.
    """
    present = np.flatnonzero(np.bincount(labels.codes.ravel()))
    dense = np.zeros(int(present.max(initial=0)) + 1, dtype=np.int64)
    dense[present] = np.arange(len(present))
    letters = [labels.letter(int(code)) | internal for code in present]
    index: dict[Hashable, int] = {automaton.initial: 0}
    states: list[Hashable] = [automaton.initial]
    rows: list[list[int]] = []
    while len(rows) < len(states):  # closure under the letters that occur
        row = []
        for letter in letters:
            following = automaton.successor(states[len(rows)], letter)
            if following is not None and following not in index:
                index[following] = len(states)
                states.append(following)
            row.append(-1 if following is None else index[following])
        rows.append(row)
    accepting = set(automaton.accepting)
    accepts = np.array([state in accepting for state in states] + [False])
    return accepts[_final(np.array(rows, dtype=np.int64), dense[labels.codes])]


def _final(table: Integers, codes: NDArray[np.integer]) -> Integers:
    """Run a table over codes from state 0; the state after the last is len(table) where a run died. Shape (paths,)."""
    dead = len(table)
    full = np.concatenate([np.where(table < 0, dead, table), np.full((1, table.shape[1]), dead)])
    width = full.shape[1]
    flat = (full * width).ravel()  # offsets of rows, so that one step is one addition and one look-up
    state = np.zeros(codes.shape[1], dtype=np.int64)
    for row in codes:
        state = flat.take(state + row)
    return state // width


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

    obstacle: Obstacle
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
        for start, k, index, offset in _near(positions, centres, reach):
            i = bodies[k]
            body, obstacle = self._bodies[i], self._bodies[i].obstacle
            level = _level(obstacle.matrix, offset)
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
        final = self._run(np.concatenate([shrunk, grown], axis=1)) == len(self.word) - 1
        return np.all(walls, axis=0) & ~np.any(wrong, axis=0) & final[:count] & final[count:]

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
        return _final(table, dense.reshape(codes.shape))


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
        obstacle = where.obstacles[name]
        weight = place.get(name, 0)
        bodies.append(_Body(obstacle, weight, name in sides, _grown(region.inner_radius, -near), obstacle.reach))
    return WordFilter(visited, _codes(plan, place, sides), tuple(bodies), where.low, where.high)


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


def _grown(inner_radius: float, by: float) -> float:
    """Level of the ellipsoid scaled so that its shortest radius changes by `by` m (never below a twentieth of it)."""
    return max(1.0 + by / inner_radius, 0.05) ** 2


def _near(positions: Floats, centres: Floats, reach: Floats) -> Iterator[tuple[int, int, Integers, Floats]]:
    """Yield (first sample of a block, region, samples of the block near it, their offsets from its centre (3, near))."""
    count = positions.shape[2]
    step = max(1, _CHUNK // max(1, count))
    bound = (reach**2 - np.einsum("ra,ra->r", centres, centres))[:, None]
    for first in range(0, len(positions), step):
        flat = positions[first : first + step].transpose(1, 0, 2).reshape(3, -1)
        close = (-2.0 * centres) @ flat + np.einsum("an,an->n", flat, flat) <= bound
        for i in np.flatnonzero(close.any(axis=1)):
            index = np.flatnonzero(close[i])
            yield first * count, int(i), index, flat[:, index] - centres[i][:, None]


def _level(matrix: Floats, offset: Floats) -> Floats:
    """Level of an ellipsoid at offsets from its centre. Shape (3, n) to (n,)."""
    return np.einsum("an,an->n", matrix @ offset, offset)
