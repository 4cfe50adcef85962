"""Laps of a team that cost least, by the sum or by the dearest robot: what is paid from several accounts is kept apart.

Robots pay from one account, or each from its own; the dearest account is to pay least. Places before the laps, and then of a lap from each home, are
walked over with the least bound first; of two ways to a place only one that is cheaper for some account is gone on with (a search with several objectives:
Martins 1984; with bounds: Mandow and Perez de la Cruz 2010). A lap is
judged by its effect, so that no word is missed whose laps bring the automata round only several at a time.
"""

from __future__ import annotations

import heapq
import itertools
import math
import operator
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ltlplan.search.lassos.lap_effects import LapEffects, Masks
from ltlplan.search.lassos.order_bounds import Floats
from ltlplan.search.lassos.product_search.lap_bounds import bounds_before
from ltlplan.search.lassos.product_search.lap_places import LapPlaces
from ltlplan.search.lassos.product_search.lap_shares import LapShares
from ltlplan.search.lassos.team_system import SEAM, Nodes, TeamSystem

_GRAIN = 1e-7
"""m; bounds that differ by less are ties: then robots that begin a lap apart come first, and smaller sums."""

_ROUNDING = 1e-9  # by which sums of the same costs may differ

_Costs = tuple[float, ...]
_Key = tuple[int, int, int, int, int, int, int]
"""In a lap where it began and where the robots are, what the conjuncts remember by number, marks shown, the effect, who has set out, and who may act."""
_BEFORE = -1
"""Instead of where a lap began: none has; the robots' place follows."""
_ANYBODY = -1
"""Instead of who may act."""
_NOBODY = -2


@dataclass(frozen=True, slots=True)
class CheapestLaps:
    """What a search for the cheapest laps found.

    Attributes:
        prefix: What all robots are at before the lap, and where it begins; nothing where no laps were found.
        lap: From where it begins back to there.
        bound: In no laps does the dearest account pay less, where that is below the limit; infinite where there are none below it.
        expanded: Ways that were gone on with.
    """

    prefix: tuple[Nodes, ...]
    lap: tuple[Nodes, ...]
    bound: float
    expanded: int

    @property
    def ended(self) -> bool:
        """Whether the search came to its end: there are no cheaper laps, or none below the limit."""
        return bool(self.lap) or self.bound == math.inf


@dataclass(frozen=True, slots=True)
class Terms:
    """How laps are judged.

    Attributes:
        weight: How many laps count.
        below: What the dearest account is to pay less than.
        most: Ways that may be gone on with.
        apart: For each home by the number of its nodes: whether robots are there apart from each other.
        at_once: Whether robots act where they come to only before others go on, not when they have waited there.
    """

    weight: float
    below: float
    most: int
    apart: Sequence[bool]
    at_once: bool = False


def cheapest_laps(system: TeamSystem, places: LapPlaces, terms: Terms) -> CheapestLaps:
    """Return laps whose dearest account pays least, if that is below a limit.

    Args:
        system: The team's.
        places: Where it can be.
        terms: How laps are judged.
    """
    search = _Search(system, places, terms)
    expanded = 0
    while search.heap:
        bound, label = search.pop()
        if label.key is None:
            return CheapestLaps(*search.way(label), max(label.paid), expanded)
        if search.is_dominated(label.key, label.paid):
            continue
        expanded += 1
        if expanded > terms.most:
            return CheapestLaps((), (), bound, expanded)
        search.expand(label, label.key)
    return CheapestLaps((), (), math.inf, expanded)


@dataclass(frozen=True, slots=True, eq=False)
class _Label:
    """A way: where it has come to (None: a lap is closed), what each account has paid for it, and the way without its last step."""

    key: _Key | None
    paid: _Costs
    before: _Label | None


@dataclass(frozen=True, slots=True, eq=False)
class _Left:
    """What is left: costs of each account for some ways to share it out, of which one has to be taken, and the least sum. Shape (shares, accounts)."""

    costs: Floats
    total: float


class _Search:
    def __init__(self, system: TeamSystem, places: LapPlaces, terms: Terms) -> None:
        self._systems, self._places, self._terms, self._accounts = system.systems, places, terms, places.limits.accounts
        self._acting = [bool(own.actions) for own in system.systems]
        self._effects: dict[int, LapEffects] = {}  # by the number of the nodes at home
        self._shares = LapShares(system, places, terms.weight)
        self._before = bounds_before(places, terms.weight).tolist()
        self._left: dict[tuple[int, int, int], _Left] = {}
        self._masks: list[Masks] = []
        self._numbers: dict[Masks, int] = {}
        self._fronts: dict[_Key, list[_Costs]] = {}
        self.heap: list[tuple[int, bool, float, int, _Label]] = []
        self._count = itertools.count()
        if places.places:
            self._go_to_place(None, 0, (0.0,) * places.limits.number, _ANYBODY)

    def pop(self) -> tuple[float, _Label]:
        """Return the way with the least bound, and that."""
        grains, _, _, _, label = heapq.heappop(self.heap)
        return grains * _GRAIN, label

    def is_dominated(self, key: _Key, paid: _Costs) -> bool:
        """Tell whether another way to the same place is no dearer for any account; if not, this one is known from now on."""
        front = self._fronts.setdefault(key, [])
        if _is_matched(front, paid):
            return True
        front.append(paid)
        return False

    def expand(self, label: _Label, key: _Key) -> None:
        """Go on with a way."""
        home, at, *_, able = key
        if home != _BEFORE:
            self._go_round(label, key)
            return
        places = self._places.places
        for robot, cost, target in self._places.ways[at]:
            acting = self._able(able, robot, places[at][0], places[target][0])
            if acting is not None:
                self._go_to_place(label, target, _paying(label.paid, self._accounts[robot], cost), acting)
        begun, masks = self._places.places[at]
        if self._places.homes[begun]:  # what is shown at home is shown at a lap's end; all may rest there for ever
            shown = self._places.marks[begun]
            last = _NOBODY if self._terms.at_once else _ANYBODY
            self._go_in_lap(label, (begun, begun, self._number(masks), shown, 0, 0, last), label.paid)
            self._close(label, begun, masks, shown, 0)

    def _able(self, able: int, robot: int, at: int, target: int) -> int | None:
        """Return who may act after a step; None where a robot may not make it."""
        if not self._terms.at_once:
            return able
        if not self._acting[robot]:
            return _NOBODY
        if not self._acts(robot, at, target):
            return robot
        return able if able in (robot, _ANYBODY) else None

    def _go_to_place(self, label: _Label | None, place: int, paid: _Costs, able: int) -> None:
        at, own = self._places.places[place][0], self._before[place]
        bound = max(max(map(operator.add, paid, own)), sum(paid) / len(paid) + own[-1])
        self._push(_Label((_BEFORE, place, 0, 0, 0, 0, able), paid, label), self._left_at(_BEFORE, at, 0), bound)

    def _go_in_lap(self, label: _Label, key: _Key, paid: _Costs) -> None:
        home, at, _, shown, *_ = key
        self._push(_Label(key, paid, label), self._left_at(home, at, shown), 0.0)

    def _go_round(self, label: _Label, key: _Key) -> None:
        home, at, number, shown, effect, out, able = key
        effects, masks = self._effects_from(home), self._masks[number]
        for robot, cost, target in self._places.steps[at]:
            letter = self._places.letter(target, robot)
            after = self._places.followers.after(masks, letter) if self._places.recurring[target] else None
            acting = self._able(able, robot, at, target)
            if after is None or acting is None:
                continue
            gone = out
            if self._acting[robot] and not out >> robot & 1:
                if self._acts(robot, at, target):
                    continue  # what is done where a lap begins is done at its end
                gone |= 1 << robot
            done, seen = effects.after(effect, letter), shown | self._places.marks[target]
            paid = _paying(label.paid, self._accounts[robot], self._terms.weight * cost)
            further = (home, target, self._number(after), seen, done, gone, acting)
            if target != home or not self._close(_Label(further, paid, label), home, after, seen, done):
                self._go_in_lap(label, further, paid)

    def _close(self, label: _Label, home: int, masks: Masks, shown: int, effect: int) -> bool:
        """End a lap at home, if the formula is kept when it is repeated for ever; tell whether it is."""
        if shown != self._places.everything:
            return False
        effects, letter = self._effects_from(home), self._places.letter(home, SEAM)
        begun = self._places.followers.after(masks, letter)
        if begun is None or not effects.accepts(begun, effects.after(effect, letter)):
            return False
        self._push(_Label(None, label.paid, label), _NOTHING, max(label.paid))
        return True

    def _acts(self, robot: int, at: int, target: int) -> bool:
        """Tell whether a step is an action."""
        nodes = self._systems[robot].nodes
        here, there = (self._places.nodes[number][robot] for number in (at, target))
        return nodes[here].internal != nodes[there].internal

    def _number(self, masks: Masks) -> int:
        number = self._numbers.setdefault(masks, len(self._masks))
        if number == len(self._masks):
            self._masks.append(masks)
        return number

    def _effects_from(self, home: int) -> LapEffects:
        if home not in self._effects:
            self._effects[home] = LapEffects(self._places.followers, self._places.at_home(home))
        return self._effects[home]

    def _left_at(self, home: int, at: int, shown: int) -> _Left:
        found = self._left.get((home, at, shown))
        if found is None:
            nodes = self._places.nodes
            costs = self._shares.before(nodes[at]) if home == _BEFORE else self._shares.of_lap(nodes[home], nodes[at], shown)
            found = self._left[home, at, shown] = _Left(costs, float(costs.sum(axis=1).min()))
        return found

    def _push(self, label: _Label, left: _Left, bound: float) -> None:
        """Keep a way for later, if with what is left it can stay below the limit."""
        paid, key = label.paid, label.key
        bound = max(bound, float((left.costs + paid).max(axis=1).min()))
        if bound >= self._terms.below or (key is not None and _is_matched(self._fronts.get(key, ()), paid)):
            return
        last = key if key is not None or label.before is None else label.before.key
        together = last is not None and self._is_together(last, closed=key is None)
        order = math.floor(bound / _GRAIN), together, sum(paid) + left.total, next(self._count)
        heapq.heappush(self.heap, (*order, label))

    def _is_together(self, key: _Key, *, closed: bool) -> bool:
        """Tell whether robots are not apart from each other where a lap begins, if that is known."""
        home, at, *_ = key
        if home == _BEFORE:
            return closed and not self._terms.apart[self._places.places[at][0]]
        return not self._terms.apart[home]

    def way(self, label: _Label) -> tuple[tuple[Nodes, ...], tuple[Nodes, ...]]:
        """Return what all robots are at before a closed lap, and in it."""
        keys: list[_Key] = []
        before = label.before
        while before is not None:
            assert before.key is not None  # only the last one is closed
            keys.append(before.key)
            before = before.before
        keys.reverse()
        nodes = self._places.nodes
        prefix = [nodes[self._places.places[place][0]] for home, place, *_ in keys if home == _BEFORE]
        lap = [nodes[at] for home, at, *_ in keys if home != _BEFORE]
        return tuple(prefix), tuple(lap or [prefix[-1]] * 2)


_NOTHING = _Left(np.zeros((1, 1)), 0.0)


def _is_matched(front: Sequence[_Costs], paid: _Costs) -> bool:
    return any(all(a <= b + _ROUNDING for a, b in zip(known, paid, strict=True)) for known in front)


def _paying(paid: _Costs, account: int, cost: float) -> _Costs:
    return (*paid[:account], paid[account] + cost, *paid[account + 1 :])
