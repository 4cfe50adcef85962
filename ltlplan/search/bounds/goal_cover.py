"""Lower bounds from the places of the robots: paths that between them reach every goal that is needed.

What one robot pays at the least for a set of goals, in whatever order, is found once for each position from which it may begin (Held and
Karp 1962, over moves), that for what the formula asks of it alone included (`own_progress`). Beyond what all pay for that, the goals are then shared out among robots. Where each is needed once, at the least cost of joining sets: no less
than the spanning tree over goals, which `conjunct_bounds` gives. Where some are needed of several robots, that is a set cover, and its
linear relaxation is looked at: a price for each goal, paid to every robot that reaches it, where no robot gets more than its way costs.
Any prices give a lower bound, so those that are best of one state serve others. Without prices ten robots with counts of three places are not
proved to be cheapest at all.

Goals are landmarks: how many robots must at some later time make a mark, or no longer make it, whatever is done. A state of a conjunct's automaton needs a proposition where no letters without it lead on to acceptance (Hoffmann, Porteous and
Sebastia 2004), and needs it to be false where none with it do. While a proposition `at least k make this mark` is false and needed, as
many robots as are missing to k must come to make the mark; while it is true and must become false, all but k - 1 of them must cease to.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import or_
from typing import NamedTuple

import numpy as np

from ltlplan.logic.automaton import DEAD
from ltlplan.search.bounds.conjunct_graph import ConjunctGraph
from ltlplan.search.bounds.own_progress import Positions, Way
from ltlplan.search.counting.classes import Classes, Numbers
from ltlplan.search.counting.counting_propositions import NEVER, Marks, States, Sums
from ltlplan.search.joint.conjuncts import JointConjunct, subsets
from ltlplan.search.memoization import memoized
from ltlplan.search.team_reading import UNREACHABLE
from verify.data.arrays import Floats

MOST_GOALS = 8
"""Goals that are looked at."""
_MOST_PRICES = 4
"""Prices by which states that need the same goals are bounded."""
_ROUNDING = 1e-7
"""By how much less than computed a bound by prices is, in units of costs: prices are what an optimiser finds."""
MOST_READ = 50_000
"""States times letters of a conjunct up to which its landmarks are looked for."""


class Goal(NamedTuple):
    """Goal of some robots: make a mark on their way, or show a letter that does not make it.

    Attributes:
        mark: Its number.
        made: Whether it is to be made.
    """

    mark: int
    made: bool

    def shown(self, marks: Sums) -> bool:
        """Tell whether a letter of one robot, by its marks, does it."""
        return bool(marks[self.mark]) == self.made


_Needed = tuple[Goal, int]
"""A goal, and the sum from which on its proposition is true."""


class CountedLandmarks:
    """Goals that are still to be reached, by states and sums.

    Args:
        marks: What the formula sees.
        without: Conjuncts, by index, that are not looked at.

    Attributes:
        goals: All that any state may need.
    """

    def __init__(self, marks: Marks, without: Collection[int] = ()) -> None:
        self._needed = [{} if k in without else _landmarks(marks, part) for k, part in enumerate(marks.parts)]
        self.goals = tuple(sorted({goal for found in self._needed for needed in found.values() for goal, _ in needed}))

    def __call__(self, states: States, sums: Sums) -> tuple[int, ...]:
        """Return for each goal how many robots that have not reached it must.

        Args:
            states: The conjuncts' states.
            sums: How many robots make each mark.
        """
        missing = [0] * len(self.goals)
        for number, (mark, made), least in self._asked(states):
            more = least - sums[mark] if made else sums[mark] - least + 1
            missing[number] = max(more, missing[number])
        return tuple(missing)

    @memoized
    def _asked(self, states: States) -> list[tuple[int, Goal, int]]:
        """Return what states need, each with the number of its goal."""
        needed = {one for found, state in zip(self._needed, states, strict=True) for one in found.get(state, ())}
        return [(self.goals.index(goal), goal, least) for goal, least in needed]


def _landmarks(marks: Marks, part: JointConjunct) -> dict[int, list[_Needed]]:
    """Return what each state of a conjunct needs; nothing where there are too many."""
    levels = {1 << bit: level for bit, level in enumerate(marks.levels) if part.mask >> bit & 1}
    graph = _graph(part, _letters(levels) if len(levels) <= MOST_READ.bit_length() else [])
    found: dict[int, list[_Needed]] = {state: [] for state in graph.nodes}
    for (bit, (mark, least)), made in itertools.product(levels.items(), (True, False)):
        without = graph.leading_to(graph.goals, lambda letter, bit=bit, made=made: bool(letter & bit) != made)
        for state in found.keys() - without if least < NEVER else ():
            found[state].append((Goal(mark, made), least))
    return found


def _graph(part: JointConjunct, letters: Sequence[int]) -> ConjunctGraph[int]:
    """Return a conjunct's graph under some letters; without nodes where there are too many."""
    nodes, back = [part.initial], dict[int, list[tuple[int, int]]]()
    for read, state in enumerate(nodes):  # grows while it is walked
        if read * len(letters) >= MOST_READ or not letters:
            return ConjunctGraph((), {}, frozenset(), part.mask, ())
        for letter in letters:
            after = part.step(state, letter)
            if after != DEAD:
                if after not in back and after != part.initial:
                    nodes.append(after)
                back.setdefault(after, []).append((state, letter))
    return ConjunctGraph(nodes, back, frozenset(filter(part.accepting, nodes)), part.mask, ())


def _letters(levels: Mapping[int, tuple[int, int]]) -> list[int]:
    """Return the letters, as bits, that some sums make: of two counts of the same mark the larger is not true alone.

    Args:
        levels: Of each proposition, as a bit, its mark and the least sum that makes it true.
    """
    choices: dict[int, set[int]] = {}
    for mark, made in [(mark, sums) for mark, least in levels.values() for sums in (0, least) if sums < NEVER]:
        true = sum(bit for bit, (own, least) in levels.items() if own == mark and least <= made)
        choices.setdefault(mark, set()).add(true)
    return [reduce(or_, chosen, 0) for chosen in itertools.product(*map(sorted, choices.values()))]


class GoalCover:
    """Lower bounds on what is left, from goals that must be reached, and from what robots that the formula names have to do by themselves.

    Args:
        classes: The team's.
    """

    def __init__(self, classes: Classes) -> None:
        self._positions = Positions(classes)
        self._landmarks = CountedLandmarks(classes.marks, self._positions.own)
        self._bits = [1 << index for index in range(len(self._landmarks.goals[:MOST_GOALS]))]
        costs = np.hstack([self._costs(*block) for block in self._positions.ways])
        self._open = [self._missed((classes.resting[place],)) for place, _ in self._positions.known]
        sets = np.arange(1 << len(self._bits))
        self._alone = np.where(
            sets[:, None] & ~np.array(self._open), np.inf, costs
        )  # of sets that a robot there has not reached in part
        self._rows: list[list[float]] = self._alone.tolist()
        self._more = self._alone - np.where(np.isfinite(self._alone[0]), self._alone[0], 0.0)
        self._prices: dict[int, list[_Prices]] = {}

    def __call__(self, states: States, sums: Sums, numbers: Numbers) -> float:
        """Return a lower bound; `UNREACHABLE` where a goal is out of reach.

        Args:
            states: The conjuncts' states.
            sums: How many robots make each mark.
            numbers: How many robots rest in each class.
        """
        team = {self._positions.of(place, states): count for place, count in enumerate(numbers) if count}
        begun = sum(map(self._rows[0].__getitem__, team), 0.0)  # nobody does anything alone whom the formula does not name
        missing = self._landmarks(states, sums)[: len(self._bits)]
        asked = sum(bit for bit, more in zip(self._bits, missing, strict=True) if more)
        found = self._join(asked, frozenset(team)) if begun < UNREACHABLE else UNREACHABLE
        if max(missing, default=0) > 1 and found < UNREACHABLE:
            found = max(found, *(prices.bound(missing, team) - _ROUNDING for prices in self._priced(asked, missing, team)))
        return begun + found

    def highest(self, states: States, sums: Sums, robots: Sequence[tuple[int, float]]) -> float:
        """Return a lower bound on what the dearest robot pays in the end.

        A goal that is needed of all robots that have not reached it adds to what each of them pays; of any other one, so many robots that
        reach it cheaply pay at least as much as the last of them does.

        Args:
            states: The conjuncts' states.
            sums: How many robots make each mark.
            robots: The class of each, and what it has paid.
        """
        missing = self._landmarks(states, sums)[: len(self._bits)]
        team = [(self._positions.of(place, states), paid) for place, paid in robots]
        left = [self._open[position] for position, _ in team]
        forced, some = 0, list[tuple[int, int]]()
        for bit, more in zip(self._bits, missing, strict=True):
            able = sum(1 for own in left if own & bit) if more else 0
            if more > able:
                return UNREACHABLE
            if more and more == able:
                forced |= bit
            elif more:
                some.append((bit, more))
        begun = [(position, paid, own & forced) for (position, paid), own in zip(team, left, strict=True)]
        found = max(paid + self._rows[own][position] for position, paid, own in begun)
        for bit, more in some:
            reached = sorted(paid + self._rows[own | bit][at] for at, paid, own in begun if self._open[at] & bit)
            found = max(found, reached[more - 1])
        return found - _ROUNDING

    def _missed(self, letters: Sequence[Sums]) -> int:
        """Return the goals, as bits, that none of a robot's letters reaches."""
        goals = zip(self._bits, self._landmarks.goals, strict=False)
        return sum(bit for bit, goal in goals if not any(map(goal.shown, letters)))

    def _costs(self, positions: range, ways: Sequence[Way]) -> Floats:
        """Return what one robot pays at the least for each set of goals, as bits, from each of some positions. Shape (sets, positions)."""
        count, everything = len(positions), sum(self._bits)
        far = np.full((count, count), np.inf)
        np.fill_diagonal(far, 0.0)
        helpful: dict[tuple[int, int, int], float] = {}  # source, target, goals
        for source, target, cost, marks in ((way.source - positions[0], way.target - positions[0], *way[2:]) for way in ways):
            far[source, target] = min(far[source, target], cost)
            reached = everything ^ self._missed(marks)
            if reached:
                key = source, target, reached
                helpful[key] = min(cost, helpful.get(key, np.inf))
        for middle in range(count):
            np.minimum(far, far[:, middle, None] + far[middle], out=far)
        sources, targets, reached = np.array(list(helpful), dtype=np.int64).reshape(-1, 3).T
        costs = np.array(list(helpful.values()))
        found = np.zeros((everything + 1, count))
        found[0] = far[:, [self._positions.done[position] for position in positions]].min(axis=1, initial=np.inf)
        for wanted in range(1, everything + 1):
            helps = (reached & wanted) > 0
            left = costs[helps] + found[wanted & ~reached[helps], targets[helps]]
            begun = np.full(count, np.inf)
            np.minimum.at(begun, sources[helps], left)
            found[wanted] = (far + begun).min(axis=1)
        return found

    @memoized
    def _join(self, asked: int, places: frozenset[int]) -> float:
        """Return the least sum of what robots from these positions, as many as are wanted, pay for the goals beyond what each does alone."""
        if not asked:
            return 0.0
        least, lowest = self._least(places), asked & -asked
        found = UNREACHABLE
        for more in subsets(asked ^ lowest):
            first = least[more | lowest]
            if first < found:
                found = min(found, first + self._join(asked ^ (more | lowest), places))
        return found

    @memoized
    def _least(self, places: frozenset[int]) -> list[float]:
        """Return what one robot from these positions pays at the least for each set of goals, as bits, beyond what it does alone."""
        return self._more[:, sorted(places)].min(axis=1).tolist()

    def _priced(self, asked: int, missing: Sequence[int], team: Mapping[int, int]) -> list[_Prices]:
        """Return prices for states that need these goals: those of states that need more, and the best of this one."""
        found = self._prices.get(asked)
        if found is None:
            within = [own for own in range(1, len(self._more)) if not own & ~asked]
            paid = (np.array(within)[:, None] >> np.arange(len(self._bits)) & 1).astype(np.float64)
            others = [prices for known, group in self._prices.items() if not asked & ~known for prices in group]
            kept = [prices.of * [bool(bit & asked) for bit in self._bits] for prices in others[-_MOST_PRICES + 1 :]]
            best = _best_prices(paid, self._more[within], missing, team)
            found = self._prices[asked] = [_Prices.at(of, paid, self._more[within]) for of in (*kept, best)]
        return found


@dataclass(frozen=True, eq=False, slots=True)
class _Prices:
    """Price of each goal, and the most by which a robot is then paid more than its way costs.

    Attributes:
        of: For each goal. Shape (goals,).
        gains: For each position, not below 0.
    """

    of: Floats
    gains: list[float]

    @classmethod
    def at(cls, of: Floats, paid: Floats, costs: Floats) -> _Prices:
        """Return these prices with what robots gain by them."""
        return cls(of, np.maximum(0.0, (paid @ of)[:, None] - costs).max(axis=0).tolist())

    def bound(self, missing: Sequence[int], team: Mapping[int, int]) -> float:
        """Return a lower bound on what all pay."""
        paid = float(self.of @ np.array(missing))
        return paid - sum(self.gains[position] * count for position, count in team.items())


def _best_prices(paid: Floats, costs: Floats, missing: Sequence[int], team: Mapping[int, int]) -> Floats:
    """Return the prices that give the largest bound: the dual of the cover's linear relaxation.

    Args:
        paid: For each set of goals, which of them it has. Shape (sets, goals).
        costs: Of each set from each position. Shape (sets, positions).
        missing: For each goal how many robots must reach it.
        team: How many robots are at which positions.
    """
    from scipy.optimize import linprog  # here: it takes long to load, and few plans need it

    places = list(team)
    gained = np.kron(np.eye(len(places)), np.ones((len(paid), 1)))
    rows, limits = np.hstack([np.tile(paid, (len(places), 1)), -gained]), costs[:, places].T.ravel()
    possible = np.isfinite(limits)
    aim = np.array([*(-float(more) for more in missing), *map(float, team.values())])
    found = linprog(aim, A_ub=rows[possible], b_ub=limits[possible], bounds=(0.0, None), method="highs")
    return np.maximum(0.0, found.x[: len(missing)]) if found.success else np.zeros(len(missing))
