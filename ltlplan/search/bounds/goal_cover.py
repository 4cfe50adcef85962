"""Lower bounds from the places of the robots: paths that between them reach every goal that is needed.

What one robot pays at the least for a set of goals, in whatever order, is found once for each class from which it may begin (Held and
Karp 1962, over moves). The goals are then shared out among robots. Where each is needed once, at the least cost of joining sets: no less
than the spanning tree over goals, which `conjunct_bounds` gives. Where some are needed of several robots, that is a set cover, and its
linear relaxation is looked at: a price for each goal, paid to every robot that reaches it, where no robot gets more than its way costs.
Any prices give a lower bound, so those that are best of one state serve others.

Goals are landmarks: how many robots must at some later time make a mark, or no longer make it, whatever is done. A state of a conjunct's automaton needs a proposition where no letters without it lead on to acceptance (Hoffmann, Porteous and
Sebastia 2004), and needs it to be false where none with it do. While a proposition `at least k make this mark` is false and needed, as
many robots as are missing to k must come to make the mark; while it is true and must become false, all but k - 1 of them must cease to.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import or_
from typing import NamedTuple

import numpy as np

from ltlplan.logic.automaton import DEAD
from ltlplan.search.bounds.conjunct_graph import ConjunctGraph
from ltlplan.search.counting.classes import Classes, Numbers
from ltlplan.search.counting.counting_propositions import NEVER, Marks, States, Sums
from ltlplan.search.joint.conjuncts import JointConjunct
from ltlplan.search.memoization import memoized
from ltlplan.search.team_reading import UNREACHABLE
from verify.data.arrays import Floats

MOST_GOALS = 8
"""Goals that are looked at."""
_MOST_PRICES = 4
"""Prices by which states that need the same goals are bounded."""
_ROUNDING = 1e-7
"""By how much less than computed a bound is, in units of costs: sums of the same costs differ by their order."""
MOST_READ = 50_000
"""States times letters of a conjunct up to which its landmarks are looked for."""


class Goal(NamedTuple):
    """What some robots must do: make a mark on their way, or show a letter that does not make it.

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
    """What must still be done, by states and sums.

    Args:
        marks: What the formula sees.

    Attributes:
        goals: All that any state may need.
    """

    def __init__(self, marks: Marks) -> None:
        self._needed = [_landmarks(marks, part) for part in marks.parts]
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
    """Lower bounds on what is left, from goals that must be reached.

    Args:
        classes: The team's.
    """

    def __init__(self, classes: Classes) -> None:
        self._landmarks = CountedLandmarks(classes.marks)
        self._bits = [1 << index for index in range(len(self._landmarks.goals[:MOST_GOALS]))]
        costs = self._costs(classes)
        self._open = [self._missed((own,)) for own in classes.resting]
        sets = np.arange(1 << len(self._bits))
        self._alone = np.where(
            sets[:, None] & ~np.array(self._open), np.inf, costs
        )  # of sets that a robot there has not reached in part
        self._rows: list[list[float]] = self._alone.tolist()
        self._prices: dict[int, list[_Prices]] = {}

    def __call__(self, states: States, sums: Sums, numbers: Numbers) -> float:
        """Return a lower bound; `UNREACHABLE` where a goal is out of reach.

        Args:
            states: The conjuncts' states.
            sums: How many robots make each mark.
            numbers: How many robots rest in each class.
        """
        missing = self._landmarks(states, sums)[: len(self._bits)]
        asked = sum(bit for bit, more in zip(self._bits, missing, strict=True) if more)
        if not asked:
            return 0.0
        places = frozenset(place for place, count in enumerate(numbers) if count)
        found = self._join(asked, places)
        if max(missing) > 1 and found < UNREACHABLE:
            found = max(found, *(prices.bound(missing, numbers, places) for prices in self._priced(asked, missing, numbers)))
        return max(0.0, found - _ROUNDING)

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
        left = [self._open[place] for place, _ in robots]
        forced, some = 0, list[tuple[int, int]]()
        for bit, more in zip(self._bits, missing, strict=True):
            able = sum(1 for own in left if own & bit) if more else 0
            if more > able:
                return UNREACHABLE
            if more and more == able:
                forced |= bit
            elif more:
                some.append((bit, more))
        begun = [(place, paid, own & forced) for (place, paid), own in zip(robots, left, strict=True)]
        found = max(paid + self._rows[own][place] for place, paid, own in begun)
        for bit, more in some:
            reached = sorted(paid + self._rows[own | bit][place] for place, paid, own in begun if self._open[place] & bit)
            found = max(found, reached[more - 1])
        return found - _ROUNDING

    def _missed(self, letters: Sequence[Sums]) -> int:
        """Return the goals, as bits, that none of a robot's letters reaches."""
        goals = zip(self._bits, self._landmarks.goals, strict=False)
        return sum(bit for bit, goal in goals if not any(map(goal.shown, letters)))

    def _costs(self, classes: Classes) -> Floats:
        """Return what one robot pays at the least for each set of goals, as bits, from each class. Shape (sets, classes)."""
        count, everything = len(classes.moves), sum(self._bits)
        far = np.full((count, count), np.inf)
        np.fill_diagonal(far, 0.0)
        helpful: dict[tuple[int, int, int], float] = {}  # source, target, goals
        for move in (move for found in classes.moves for move in found):
            far[move.source, move.target] = min(far[move.source, move.target], move.cost)
            reached = everything ^ self._missed(move.marks)
            if reached:
                key = move.source, move.target, reached
                helpful[key] = min(move.cost, helpful.get(key, np.inf))
        for middle in range(count):
            np.minimum(far, far[:, middle, None] + far[middle], out=far)
        sources, targets, reached = np.array(list(helpful), dtype=np.int64).reshape(-1, 3).T
        costs = np.array(list(helpful.values()))
        found = np.zeros((everything + 1, count))
        for wanted in range(1, everything + 1):
            helps = (reached & wanted) > 0
            left = costs[helps] + found[wanted & ~reached[helps], targets[helps]]
            begun = np.full(count, np.inf)
            np.minimum.at(begun, sources[helps], left)
            found[wanted] = (far + begun).min(axis=1)
        return found

    @memoized
    def _join(self, asked: int, places: frozenset[int]) -> float:
        """Return the least sum of what robots from these classes, as many as are wanted, pay for the goals."""
        if not asked:
            return 0.0
        least, lowest = self._least(places), asked & -asked
        found, more = UNREACHABLE, asked ^ lowest
        while True:
            first = least[more | lowest]
            if first < found:
                found = min(found, first + self._join(asked ^ (more | lowest), places))
            if not more:
                return found
            more = (more - 1) & (asked ^ lowest)

    @memoized
    def _least(self, places: frozenset[int]) -> list[float]:
        """Return what one robot from these classes pays at the least for each set of goals, as bits."""
        return self._alone[:, sorted(places)].min(axis=1).tolist()

    def _priced(self, asked: int, missing: Sequence[int], numbers: Numbers) -> list[_Prices]:
        """Return prices for states that need these goals: those of states that need more, and the best of this one."""
        found = self._prices.get(asked)
        if found is None:
            within = [own for own in range(1, len(self._alone)) if not own & ~asked]
            paid = (np.array(within)[:, None] >> np.arange(len(self._bits)) & 1).astype(np.float64)
            others = [prices for known, group in self._prices.items() if not asked & ~known for prices in group]
            kept = [prices.of * [bool(bit & asked) for bit in self._bits] for prices in others[-_MOST_PRICES + 1 :]]
            best = _best_prices(paid, self._alone[within], missing, numbers)
            found = self._prices[asked] = [_Prices.at(of, paid, self._alone[within]) for of in (*kept, best)]
        return found


@dataclass(frozen=True, eq=False, slots=True)
class _Prices:
    """What is paid for each goal, and by how much at most a robot is then paid more than its way costs.

    Attributes:
        of: For each goal. Shape (goals,).
        gains: For each class, not below 0.
    """

    of: Floats
    gains: list[float]

    @classmethod
    def at(cls, of: Floats, paid: Floats, costs: Floats) -> _Prices:
        """Return these prices with what robots gain by them."""
        return cls(of, np.maximum(0.0, (paid @ of)[:, None] - costs).max(axis=0).tolist())

    def bound(self, missing: Sequence[int], numbers: Numbers, places: frozenset[int]) -> float:
        """Return a lower bound on what all pay."""
        paid = float(self.of @ np.array(missing))
        return paid - sum(self.gains[place] * numbers[place] for place in places)


def _best_prices(paid: Floats, costs: Floats, missing: Sequence[int], numbers: Numbers) -> Floats:
    """Return the prices that give the largest bound: the dual of the cover's linear relaxation.

    Args:
        paid: For each set of goals, which of them it has. Shape (sets, goals).
        costs: Of each set from each class. Shape (sets, classes).
        missing: For each goal how many robots must reach it.
        numbers: How many robots rest in each class.
    """
    from scipy.optimize import linprog  # here: it takes long to load, and few plans need it

    places = [place for place, count in enumerate(numbers) if count]
    gained = np.kron(np.eye(len(places)), np.ones((len(paid), 1)))
    rows, limits = np.hstack([np.tile(paid, (len(places), 1)), -gained]), costs[:, places].T.ravel()
    possible = np.isfinite(limits)
    aim = np.array([*(-float(more) for more in missing), *(float(numbers[place]) for place in places)])
    found = linprog(aim, A_ub=rows[possible], b_ub=limits[possible], bounds=(0.0, None), method="highs")
    return np.maximum(0.0, found.x[: len(missing)]) if found.success else np.zeros(len(missing))
