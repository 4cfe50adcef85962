"""Laps of a team whose dearest robot pays least: what each robot has paid is kept apart.

Places before the laps, and then of a lap from each home, are walked over with the least bound first; of two ways to a place only one that is cheaper
for some robot is gone on with (a search with several objectives: Martins 1984; with bounds: Mandow and Perez de la Cruz 2010). A lap is
judged by its effect, so that no word is missed whose laps bring the automata round only several at a time.
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

from ltlplan.search.lassos.lap_bounds import LapBounds
from ltlplan.search.lassos.lap_effects import LapEffects
from ltlplan.search.lassos.lap_places import LapPlaces
from ltlplan.search.lassos.order_bounds import Floats
from ltlplan.search.lassos.team_system import SEAM, Nodes
from ltlplan.systems.transition_systems import TransitionSystem

_GRAIN = 1e-7
"""m; bounds that differ by less are ties: then robots that begin a lap apart come first, and smaller sums."""

_ROUNDING = 1e-9  # by which sums of the same costs may differ

_Costs = tuple[float, ...]
_Key = tuple[int, int, int, int, int]
"""The place where the lap begins, or the team is before it; nodes in the lap, marks that were shown, the effect, and who has set out."""
_BEFORE = -1
"""The nodes of a way before the laps."""
_UNSEEN = -1
"""The marks of a lap that is about to begin, and whose bounds are not looked at yet."""


@dataclass(frozen=True, slots=True)
class DearestLaps:
    """What a search for laps whose dearest robot pays least found.

    Attributes:
        prefix: What all robots are at before the lap, and where it begins; nothing where no laps were found.
        lap: From where it begins back to there.
        bound: In no laps does the dearest robot pay less, where that is below the limit; infinite where there are none below it.
        expanded: Ways that were gone on with.
    """

    prefix: tuple[Nodes, ...]
    lap: tuple[Nodes, ...]
    bound: float
    expanded: int


@dataclass(frozen=True, slots=True)
class Terms:
    """How laps are judged.

    Attributes:
        weight: How many laps count.
        below: What the dearest robot is to pay less than.
        most: Ways that may be gone on with.
        apart: For each home by the number of its nodes: whether robots are there apart from each other.
    """

    weight: float
    below: float
    most: int
    apart: Sequence[bool]


def laps_of_least_dearest(systems: Sequence[TransitionSystem], places: LapPlaces, terms: Terms) -> DearestLaps:
    """Return laps whose dearest robot pays least, if that is below a limit.

    Args:
        systems: One for each robot.
        places: Where the team can be.
        terms: How laps are judged.
    """
    search = _Search(systems, places, terms)
    expanded = 0
    while search.heap:
        bound, label = search.pop()
        if label.key is None:
            return DearestLaps(*search.way(label), max(label.paid), expanded)
        if search.is_dominated(label):
            continue
        expanded += 1
        if expanded > terms.most:
            return DearestLaps((), (), bound, expanded)
        search.expand(label)
    return DearestLaps((), (), math.inf, expanded)


@dataclass(frozen=True, slots=True, eq=False)
class _Label:
    """A way: where it has come to (None: a lap is closed), what each robot has paid for it, and the way without its last step."""

    key: _Key | None
    paid: _Costs
    before: _Label | None


class _Home:
    """Laps from one place: their bounds, and what they do to what the conjuncts remember there."""

    def __init__(self, bounds: LapBounds, effects: LapEffects, home: int) -> None:
        self.effects, self._bounds = effects, bounds
        self._left: Floats = bounds.lap(home)

    def left(self, at: int, shown: int) -> list[float]:
        return self._left[self._bounds.point(at, shown)].tolist()


class _Search:
    def __init__(self, systems: Sequence[TransitionSystem], places: LapPlaces, terms: Terms) -> None:
        self._systems, self._places, self._terms = systems, places, terms
        self._acting = [bool(system.actions) for system in systems]
        self._bounds = LapBounds(places, len(systems), terms.weight)
        self._homes: dict[int, _Home] = {}  # by the number of their nodes
        self._fronts: dict[_Key, list[_Costs]] = {}
        self.heap: list[tuple[int, bool, float, int, _Label]] = []
        self._count = itertools.count()
        if places.places:
            self._push(_Label((0, _BEFORE, 0, 0, 0), (0.0,) * len(systems), None), self._bounds.before[0].tolist())

    def pop(self) -> tuple[float, _Label]:
        """Return the way with the least bound, and that."""
        grains, _, _, _, label = heapq.heappop(self.heap)
        return grains * _GRAIN, label

    def is_dominated(self, label: _Label) -> bool:
        """Tell whether another way to the same place is no dearer for any robot; if not, this one is known from now on."""
        assert label.key is not None  # of a closed lap nobody asks
        front = self._fronts.setdefault(label.key, [])
        if _is_matched(front, label.paid):
            return True
        front.append(label.paid)
        return False

    def expand(self, label: _Label) -> None:
        """Go on with a way."""
        assert label.key is not None  # a closed lap is the answer
        place, at, shown, _, _ = label.key
        if at == _BEFORE:
            self._go_before(label, place)
        elif shown == _UNSEEN:
            self._begin(label, place, at)
        else:
            self._go_round(label, label.key)

    def _go_before(self, label: _Label, place: int) -> None:
        for robot, cost, target in self._places.ways[place]:
            paid = _paying(label.paid, robot, cost)
            self._push(_Label((target, _BEFORE, 0, 0, 0), paid, label), self._bounds.before[target].tolist())
        at, _ = self._places.places[place]
        if self._places.homes[at]:
            self._push(_Label((place, at, _UNSEEN, 0, 0), label.paid, label), self._bounds.begun[at].tolist())

    def _begin(self, label: _Label, place: int, at: int) -> None:
        """Begin a lap: what is shown at home is shown at its end. All may rest there for ever."""
        home, shown = self._home(at), self._places.marks[at]
        self._push(_Label((place, at, shown, 0, 0), label.paid, label), home.left(at, shown))
        self._close(label, place, at, shown, 0)

    def _go_round(self, label: _Label, key: _Key) -> None:
        place, at, shown, effect, out = key
        begun, masks = self._places.places[place]
        home = self._home(begun)
        for robot, cost, target in self._places.steps[at]:
            if not self._places.lasting[target]:
                continue
            gone = out
            if self._acting[robot] and not out >> robot & 1:
                if self._acts(robot, at, target):
                    continue  # what is done where a lap begins is done at its end
                gone |= 1 << robot
            after = home.effects.after(effect, self._places.letter(target, robot))
            if not home.effects.alive(masks, after):
                continue
            seen = shown | self._places.marks[target]
            way = _Label((place, target, seen, after, gone), _paying(label.paid, robot, self._terms.weight * cost), label)
            if target != begun or not self._close(way, place, begun, seen, after):
                self._push(way, home.left(target, seen))

    def _close(self, label: _Label, place: int, home: int, shown: int, effect: int) -> bool:
        """End a lap at home, if the formula is kept when it is repeated for ever; tell whether it is."""
        if shown != self._places.everything:
            return False
        effects, masks = self._home(home).effects, self._places.places[place][1]
        if not effects.accepts(masks, effects.after(effect, self._places.letter(home, SEAM))):
            return False
        self._push(_Label(None, label.paid, label), [0.0] * len(self._bounds.subsets))
        return True

    def _acts(self, robot: int, at: int, target: int) -> bool:
        """Tell whether a step is an action."""
        nodes = self._systems[robot].nodes
        here, there = (self._places.nodes[number][robot] for number in (at, target))
        return nodes[here].internal != nodes[there].internal

    def _home(self, at: int) -> _Home:
        if at not in self._homes:
            self._homes[at] = _Home(self._bounds, LapEffects(self._places.followers, self._places.at_home(at)), at)
        return self._homes[at]

    def _push(self, label: _Label, left: Sequence[float]) -> None:
        """Keep a way for later, if with what is left it can stay below the limit."""
        paid, subsets, key = label.paid, self._bounds.subsets, label.key
        bound = max(sum(map(paid.__getitem__, some)) / len(some) + rest for some, rest in zip(subsets, left, strict=True))
        if bound >= self._terms.below or (key is not None and _is_matched(self._fronts.get(key, ()), paid)):
            return
        begun = label.before.key if key is None and label.before is not None else key
        together = begun is not None and begun[1] != _BEFORE and not self._terms.apart[self._places.places[begun[0]][0]]
        total = sum(paid) + len(paid) * left[-1]
        heapq.heappush(self.heap, (math.floor(bound / _GRAIN), together, total, next(self._count), label))

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
        prefix = [nodes[self._places.places[place][0]] for place, at, *_ in keys if at == _BEFORE]
        lap = [nodes[at] for _, at, shown, *_ in keys if at != _BEFORE and shown != _UNSEEN]
        return tuple(prefix), tuple(lap or [prefix[-1]] * 2)


def _is_matched(front: Sequence[_Costs], paid: _Costs) -> bool:
    return any(all(a <= b + _ROUNDING for a, b in zip(known, paid, strict=True)) for known in front)


def _paying(paid: _Costs, robot: int, cost: float) -> _Costs:
    return (*paid[:robot], paid[robot] + cost, *paid[robot + 1 :])
