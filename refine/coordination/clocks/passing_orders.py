"""Orders in which robots pass where they would come too near each other, on paths that stay as they are.

For two robots the pairs of own times at which they are too near form zones of a plane, their coordination space (O'Donnell and Lozano-Perez,
ICRA 1989). Clocks lead past a zone on one side or the other: either robot may pass first, and the other one follows no sooner than
the zone's border lets it. Every choice is a set of differences of times, so that earliest times follow by longest paths. Zones are
decided in the order of time, each on the side by which the team arrives sooner; a zone that left no side is decided before all others.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from refine.coordination.clocks.earliest_times import After, Line, Times

Indices = NDArray[np.intp]

_RESTARTS = 12
"""How often zones are decided again with one that left no side before all others."""
_FLIPS = 16
"""How often zones are decided again with one on the other side, on the way to the last arrival."""
_SOON = 1.05
"""How much later than with waits alone the last arrival may be, so that no other sides are tried."""


@dataclass(frozen=True, eq=False, slots=True)
class Zone:
    """Cells in which two robots are too near each other, in one piece.

    Attributes:
        sides: Either robot first: what the other one then waits for; None where the first one rests there at its start or end.
        begins: Where the two come into it.
        pair: The robots.
    """

    sides: tuple[After | None, After | None]
    begins: tuple[int, int]
    pair: tuple[int, int]


def zones_of(
    lines: Sequence[Line], distance: float, wider: Mapping[tuple[int, int], float] = MappingProxyType({})
) -> list[Zone]:
    """Return all zones of a team.

    Args:
        lines: One a robot.
        distance: m that they keep.
        wider: More of it for some pairs, the lower number first.
    """
    from scipy.spatial import KDTree  # here: it takes long to load, and few teams need it

    trees = [KDTree(line.places) for line in lines]
    found: list[Zone] = []
    for one in range(len(lines)):
        for other in range(one + 1, len(lines)):
            a, b = lines[one], lines[other]
            kept = distance + wider.get((one, other), 0.0)
            near = trees[one].query_ball_tree(trees[other], kept + float(a.reach.max() + b.reach.max()))
            rows = np.repeat(np.arange(len(near)), [len(each) for each in near])
            columns = np.array([column for each in near for column in each], dtype=np.intp)
            if not len(rows):
                continue
            gaps = np.linalg.norm(a.places[rows] - b.places[columns], axis=1)
            met = gaps < kept + a.reach[rows] + b.reach[columns]
            found += _zones(one, other, rows[met], columns[met], (len(a.places), len(b.places)))
    return found


def _zones(one: int, other: int, rows: Indices, columns: Indices, shape: tuple[int, int]) -> list[Zone]:
    """Return the zones of two robots, given all pairs of cells in which they are too near each other."""
    if not len(rows):
        return []
    low, high = np.array([rows.min(), columns.min()]), np.array([rows.max(), columns.max()])
    table = np.zeros(high - low + 1, dtype=np.bool_)
    table[rows - low[0], columns - low[1]] = True
    labels, count = _labelled(table)
    found: list[Zone] = []
    for number in range(1, count + 1):
        at = np.argwhere(labels == number) + low
        sides = (_side(one, other, at, shape[0]), _side(other, one, at[:, ::-1], shape[1]))
        found.append(Zone(sides, (int(at[:, 0].min()), int(at[:, 1].min())), (one, other)))
    return found


def _labelled(table: NDArray[np.bool_]) -> tuple[NDArray[np.int32], int]:
    """Return the connected parts of a table, corners included, by number from 1 on, and how many there are."""
    labels = np.zeros(table.shape, dtype=np.int32)
    return labels, int(ndimage.label(table, np.ones((3, 3)), output=labels))  # pyright: ignore[reportArgumentType]  # a number with an output


def _side(first: int, then: int, at: NDArray[np.intp], cells: int) -> After | None:
    """Return what the second robot waits for where the first one passes first; None where the first one would have to leave its end."""
    due, done = at[:, 1], at[:, 0] + 1
    if (
        due.min() == 0 or done.max() >= cells
    ):  # the second one rests there before it departs, or the first one when it has arrived
        return None
    latest = np.full(due.max() - due.min() + 1, -1)
    np.maximum.at(latest, due - due.min(), done)
    latest = np.maximum.accumulate(latest)
    new = np.flatnonzero(np.diff(latest, prepend=-1) > 0)
    return After(first, latest[new], then, new + due.min())


@dataclass(frozen=True, eq=False, slots=True)
class Orders:
    """Passing orders of a team, past all zones.

    Attributes:
        differences: What leads past all zones, waits among them.
        times: Earliest times under them.
        firm: Two robots each, the one that passes first before the other one, of zones with one side that delay the last arrival.
    """

    differences: list[After]
    times: Times
    firm: list[tuple[int, int]]


@dataclass(frozen=True, slots=True)
class Stuck:
    """Robots that leave each other no way.

    Attributes:
        pairs: Two robots each, one of which starts, waits or ends in the other one's way; those nearer to the cause first.
    """

    pairs: tuple[tuple[int, int], ...]


def passing_orders(lines: Sequence[Line], zones: Sequence[Zone], waits: Sequence[After]) -> Orders | Stuck | None:
    """Return orders that lead past all zones; else robots that leave each other no way.

    None says that not even the waits can be kept.

    Args:
        lines: One a robot.
        zones: Where they are too near each other.
        waits: Differences that are kept in any case.
    """
    times = Times(lines)
    if not times.add(waits):
        return None
    forced = _Decided(zones, times)
    stuck = forced.force()
    if stuck is not None:
        return forced.blamed(stuck)
    before: list[int] = []
    blamed = Stuck(())
    for _ in range(_RESTARTS):
        found = _decided(forced, dict.fromkeys(before))
        if isinstance(found, _Decided):
            return _sooner(forced, zones, waits, before, found)
        number, blamed = found
        before = [number, *(each for each in before if each != number)]
    return blamed


def _sooner(forced: _Decided, zones: Sequence[Zone], waits: Sequence[After], before: Sequence[int], found: _Decided) -> Orders:
    """Return orders by which the team arrives sooner, if other sides of zones on the way to the last arrival lead to some.

    That is a descent in the choices on the critical path, as for job shops (van Laarhoven and others, Operations Research 1992).
    """
    sides: dict[int, int | None] = dict.fromkeys(before)
    tried: set[frozenset[tuple[int, int | None]]] = set()
    while True:
        orders, critical = found.orders(waits), found.critical(waits)
        flips = [(number, 1 - side) for number, side in critical if zones[number].sides[1 - side] is not None]
        for number, side in flips:
            changed = {number: side, **{other: its for other, its in sides.items() if other != number}}
            key = frozenset(changed.items())
            if len(tried) >= _FLIPS or key in tried or orders.times.arrivals[0] <= _SOON * forced.soonest:
                continue
            tried.add(key)
            trial = _decided(forced, changed)
            if isinstance(trial, _Decided) and trial.orders(waits).times.arrivals < orders.times.arrivals:
                found, sides = trial, changed
                break
        else:
            return orders


def _decided(forced: _Decided, before: Mapping[int, int | None]) -> _Decided | tuple[int, Stuck]:
    """Return a way past all zones; or a zone without a side. Some are decided before all others, on a given side or on either."""
    decided = forced.copy()
    for number, side in before.items():
        if not decided.decide(number, side):
            return number, decided.blamed(number)
    stuck = decided.force()
    if stuck is not None:
        return stuck, decided.blamed(stuck)
    while (number := decided.next()) is not None:
        if not decided.decide(number):
            return number, decided.blamed(number)
    return decided


class _Decided:
    """Zones whose side is chosen, and the earliest times that this leaves."""

    def __init__(self, zones: Sequence[Zone], times: Times) -> None:
        self._zones, self._times = zones, times
        self._chosen: dict[int, After] = {}
        self._refused: dict[int, list[Times]] = {}

    @property
    def soonest(self) -> float:
        """Last arrival so far, s: it only gets later."""
        return self._times.arrivals[0]

    def copy(self) -> _Decided:
        """Return the same choices, to be added to apart."""
        other = _Decided(self._zones, self._times)  # times are copied where a choice changes them
        other._chosen, other._refused = dict(self._chosen), dict(self._refused)
        return other

    def decide(self, number: int, side: int | None = None) -> bool:
        """Choose the side of a zone by which the team arrives sooner, or a given one; return whether there is one."""
        if number in self._chosen:
            return side is None or self._chosen[number] is self._zones[number].sides[side]
        found = self._possible(number, (0, 1) if side is None else (side,))
        if found:
            self._times, self._chosen[number] = min(found, key=lambda each: each[0].arrivals)
        return bool(found)

    def force(self) -> int | None:
        """Choose sides where there is no choice, until there is one at all zones; return a zone without a side, if there is one."""
        left = sorted(
            (number for number in range(len(self._zones)) if number not in self._chosen),
            key=lambda number: None not in self._zones[number].sides,
        )
        while left:
            open_zones: list[int] = []
            for number in left:
                found = self._possible(number)
                if not found:
                    return number
                if len(found) == 1:
                    self._times, self._chosen[number] = found[0]
                else:
                    open_zones.append(number)
            if len(open_zones) == len(left):
                break
            left = open_zones
        return None

    def next(self) -> int | None:
        """Return the zone that both robots come to first, of those that no side is kept of; None where there are none."""
        left = [
            number
            for number, zone in enumerate(self._zones)
            if number not in self._chosen and not any(self._times.keeps(side) for side in zone.sides)
        ]
        return min(left, key=lambda number: (_entered(self._zones[number], self._times), number), default=None)

    def orders(self, waits: Sequence[After]) -> Orders:
        """Return what was chosen, with waits and the sides of other zones that are kept anyhow."""
        kept = [
            next(side for side in zone.sides if side is not None and self._times.keeps(side))
            for number, zone in enumerate(self._zones)
            if number not in self._chosen
        ]
        ways = [self._zones[number].sides[side] for number, side in self.critical(waits) if None in self._zones[number].sides]
        firm = [(after.first, after.then) for after in ways if after is not None]
        return Orders([*waits, *self._chosen.values(), *kept], self._times, firm)

    def critical(self, waits: Sequence[After]) -> list[tuple[int, int]]:
        """Return the chosen zones because of which the last arrival is not sooner, and their sides, from its end on."""
        known = {id(after): number for number, after in self._chosen.items()}
        causes = self._times.causes([*waits, *self._chosen.values()])
        numbers = [(known[id(after)], after) for after in causes if id(after) in known]
        return [(number, self._zones[number].sides.index(after)) for number, after in numbers]

    def _possible(self, number: int, sides: Sequence[int] = (0, 1)) -> list[tuple[Times, After]]:
        """Return the sides of a zone that some times keep, each with the earliest ones."""
        found: list[tuple[Times, After]] = []
        refused: list[Times] = []
        for side in (self._zones[number].sides[each] for each in sides):
            if side is None:
                continue
            times = self._times.copy()
            if times.add((side,)):
                found.append((times, side))
            else:
                refused.append(times)
        self._refused[number] = refused
        return found

    def blamed(self, number: int) -> Stuck:
        """Return the robots of zones with one side, or none, because of which a zone has no side left.

        Each side of it closes a circle of choices. Where one of these had no choice itself, so do the circles that left it none.
        """
        known = {id(after): each for each, after in self._chosen.items()}
        zones = [number]
        for each in zones:  # it grows
            circles = [after for times in self._refused.get(each, ()) for after in times.circle]
            zones += dict.fromkeys(known[id(after)] for after in circles if known.get(id(after), each) not in zones)
        pairs = [self._zones[each].pair for each in zones if None in self._zones[each].sides]
        return Stuck(tuple(dict.fromkeys(pairs)) or (self._zones[number].pair,))


def _entered(zone: Zone, times: Times) -> float:
    """Return when both robots have come into a zone, s."""
    return max(float(times.times[robot][at]) for robot, at in zip(zone.pair, zone.begins, strict=True))
