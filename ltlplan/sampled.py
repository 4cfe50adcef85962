"""Labels and automaton runs of many sampled paths, as arrays: a filter for the search, never a claim.

A path counts when the word that its samples show is the planned one, with every region shrunk by the margin and with
every region grown by it; when each hoop is flown through in the planned direction, inside its opening; and when it
meets no ring, no other opening and no wall. Between samples nothing is known: whatever is kept is judged for all times.

Samples are labelled by one matrix product: squared distances are linear in the ten monomials 1, x, y, z, x^2, .., yz.
"""

from __future__ import annotations

from collections.abc import Collection, Hashable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ltlplan.hoops.clearance import Obstacle, room
from verify.data import BadInput, Letter, Mission, RobotPlan

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]

_CHUNK = 4096  # samples labelled at a time, so that the arrays stay in the cache
_MOST_DIGITS = 12  # regions whose halves are told apart in one code


class Automaton(Protocol):
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
    """
    names = tuple(mission.all_regions)
    if len(names) > 30:
        raise BadInput(f"{len(names)} regions; sampled labels hold at most 30.")
    rows, levels = [], []
    for region in mission.all_regions.values():
        rows.append(_level_row(np.array(region.center), region.shape))
        levels.append(_grown(region.radii, grow))
    codes = np.zeros((len(positions), positions.shape[2]), dtype=np.int32)
    if rows:
        bits = (1 << np.arange(len(names), dtype=np.int32))[:, None]
        bound = np.array(levels)[:, None]
        for part in _chunks(positions):
            inside = np.array(rows) @ _monomials(positions[part]) <= bound
            codes[part] = (inside * bits).sum(axis=0, dtype=np.int32).reshape(-1, positions.shape[2])
    return Labels(codes, names)


def run(automaton: Automaton, labels: Labels, internal: Letter = frozenset()) -> Booleans:
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
    _rows: Floats
    _shrunk: Floats
    _grown: Floats
    _forbidden: Floats
    _hoops: tuple[tuple[Obstacle, int, int, bool, bool], ...]
    _low: Floats
    _high: Floats

    def keeps(self, positions: Floats) -> Booleans:
        """Tell for each path whether its samples keep everything. Shape (instants, 3, paths) to (paths,)."""
        count = positions.shape[2]
        good = np.all(positions.min(axis=0) >= self._low[:, None], axis=0) & np.all(
            positions.max(axis=0) <= self._high[:, None], axis=0
        )
        digits = len(self.visited)
        width = 3**digits
        codes = np.empty((len(positions), 2 * count), dtype=np.int32)
        bad = np.zeros(count, dtype=np.bool_)
        weights = 3 ** np.arange(digits)
        for part in _chunks(positions):
            values = self._rows @ _monomials(positions[part])
            shape = (-1, count)
            first = np.zeros(values.shape[1], dtype=np.int32)
            second = np.zeros(values.shape[1], dtype=np.int32)
            halves = {}
            for _, level_row, plane_row, flown, _ in self._hoops:
                along = values[plane_row]
                if flown:
                    halves[level_row] = along > 0
            for i in range(digits):
                digit = weights[i] * (1 + halves[i]) if i in halves else weights[i]
                first += (values[i] <= self._shrunk[i]) * digit
                second += (values[i] <= self._grown[i]) * digit
            codes[part, :count], codes[part, count:] = first.reshape(shape), second.reshape(shape)
            wrong = np.any(values[digits : digits + len(self._forbidden)] <= self._forbidden[:, None], axis=0)
            for obstacle, _, plane_row, _, entered in self._hoops:
                along = values[plane_row] ** 2
                across = values[plane_row + 1] - along
                ring = across <= obstacle.outer**2
                if entered:
                    ring &= across >= obstacle.inner**2
                ring &= along <= obstacle.height**2
                wrong |= ring
            bad |= np.any(wrong.reshape(shape), axis=0)
        good &= ~bad
        table = np.full((len(self.word), width), -1, dtype=np.int64)
        for i, code in enumerate(self.word):
            table[i, code] = i
            if i + 1 < len(self.word):
                table[i, self.word[i + 1]] = i + 1
        final = _final(table, codes) == len(self.word) - 1
        return good & final[:count] & final[count:]


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
    if len(visited) > _MOST_DIGITS:
        raise BadInput(f"{len(visited)} regions are visited; sampled words tell at most {_MOST_DIGITS} apart.")
    sides = {v.region for v in plan.visits if v.direction is not None}
    others = [name for name in mission.all_regions if name not in visited]
    rows = [_level_row(where.obstacles[n].centre, where.obstacles[n].matrix) for n in (*visited, *others)]
    hoops = []
    for i, name in enumerate((*visited, *others)):
        obstacle = where.obstacles[name]
        if obstacle.normal is None:
            continue
        hoops.append((obstacle, i, len(rows), name in sides, name in visited))
        rows += [_plane_row(obstacle.centre, obstacle.normal), _level_row(obstacle.centre, np.eye(3))]
    regions = mission.all_regions
    return WordFilter(
        visited,
        _codes(plan, visited, sides),
        np.array(rows).reshape(-1, 10),
        np.array([_grown(regions[n].radii, -near) for n in visited]),
        np.array([_grown(regions[n].radii, near) for n in visited]),
        np.array([where.obstacles[n].level for n in others]),
        tuple(hoops),
        where.low,
        where.high,
    )


def _codes(plan: RobotPlan, visited: Sequence[str], sides: Collection[str]) -> tuple[int, ...]:
    """The word as codes: a passage F shows its hoop's near half, then its far half; R the other way."""
    place = {name: 3**i for i, name in enumerate(visited)}
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


def _grown(radii: tuple[float, float, float], by: float) -> float:
    """Level of the ellipsoid scaled so that its shortest radius changes by `by` m (never below a twentieth of it)."""
    return max(1.0 + by / min(radii), 0.05) ** 2


def _chunks(positions: Floats) -> list[slice]:
    step = max(1, _CHUNK // max(1, positions.shape[2]))
    return [slice(i, i + step) for i in range(0, len(positions), step)]


def _monomials(positions: Floats) -> Floats:
    """1, x, y, z, x^2, y^2, z^2, xy, xz, yz of all samples. Shape (instants, 3, paths) to (10, samples)."""
    count = positions.shape[0] * positions.shape[2]
    result = np.empty((10, count))
    result[0] = 1.0
    result[1:4] = positions.transpose(1, 0, 2).reshape(3, count)
    np.multiply(result[1:4], result[1:4], out=result[4:7])
    np.multiply(result[1], result[2], out=result[7])
    np.multiply(result[1], result[3], out=result[8])
    np.multiply(result[2], result[3], out=result[9])
    return result


def _level_row(centre: Floats, matrix: Floats) -> Floats:
    """Level (r - centre)' matrix (r - centre) as weights of the monomials. Shape (10,)."""
    linear = -2.0 * matrix @ centre
    cross = 2.0 * np.array([matrix[0, 1], matrix[0, 2], matrix[1, 2]])
    return np.concatenate([[centre @ matrix @ centre], linear, np.diag(matrix), cross])


def _plane_row(centre: Floats, normal: Floats) -> Floats:
    """Normal . (r - centre) as weights of the monomials. Shape (10,)."""
    return np.concatenate([[-(normal @ centre)], normal, np.zeros(6)])
