"""Conjuncts of a formula as they read a team of robots that fly cycles: automata over the letters of all robots at one time.

Temporal operators around one condition on a letter (`G F b`, `F G b`, `F b`, `G b`) are read off what all robots show: under `own`
some robot has to show what is to come (it is read at least once in each of its letters), and every robot what is to stay. Any other
conjunct reads the team's letter under `joint`. Under `own` it reads robots one at a time and does not know when: then all states are
followed that some order of readings leads to (a universal Büchi automaton, made deterministic as by Miyano and Hayashi, "Alternating
finite automata on omega-words", Theoretical Computer Science 32, 1984).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable

from ltlplan.logic.automaton import Automaton
from ltlplan.logic.budget import Budget
from ltlplan.logic.conjunction import conjuncts
from ltlplan.logic.small_automata import small_automaton
from ltlplan.search.counting.counting_propositions import shows, true_atoms
from ltlplan.search.cycles.team_system import SEAM, TeamLetter
from ltlplan.search.memoization import memoized
from ltlplan.search.numbering import Numbers
from verify.data import BadInput, Formula, Letter, Mission
from verify.data.language.counting import atoms

Cut = Callable[[tuple[Letter, ...]], Letter]
"""What an automaton sees of the letters of all robots."""

_TEMPORAL = ("F", "G", "U", "R", "W", "M", "X", "X[!]")
_HELD = Formula("name", (), "held")


def closes_at_once(automaton: Automaton) -> bool:
    """Tell whether an automaton forgets all but the last letter, as that of `G F a` does: each letter leads to one state, from wherever.

    Then it is back in its state after every lap of a word, and the product's lassos are all there are.
    """
    first = {target: guard for guard, target in automaton.edges[0]}
    return automaton.deterministic and all({target: guard for guard, target in edges} == first for edges in automaton.edges)


class LetterReader:
    """An automaton over one condition or one letter of the whole team.

    Attributes:
        initial, accepting: The automaton's.
        stays: Whether it asks that its condition holds for ever from some time on; it then guesses when.
        guesses: Whether a letter may lead to several states.
        closes: Whether it is back in its state after every cycle.
    """

    def __init__(self, automaton: Automaton, cut: Cut, *, stays: bool = False) -> None:
        self._automaton, self._cut = automaton, cut
        self.initial, self.accepting, self.stays = automaton.initial, automaton.accepting, stays
        self.guesses = not stays and not automaton.deterministic
        self.closes = closes_at_once(automaton)

    @memoized
    def seen(self, letter: TeamLetter) -> Letter:
        """Return what the conjunct sees of a letter of the team."""
        return self._cut(letter[0])

    def successors(self, state: int, letter: TeamLetter) -> Iterable[int]:
        """Return where a letter leads."""
        return self._automaton.successors(state, self.seen(letter))


_Runs = frozenset[tuple[int, int]]
"""States of the automaton, each with who has been read in its present letter, as bits."""


class ReadingsReader:
    """A deterministic automaton that must accept whenever robots are read one at a time, each at least once in each of its letters.

    Attributes:
        initial: The state before the first letter.
        accepting: States in which all runs have passed an accepting state since the last such.
        stays, guesses, closes: Never.
    """

    stays = guesses = closes = False

    def __init__(self, automaton: Automaton) -> None:
        self._automaton = automaton
        self._states: Numbers[tuple[_Runs, _Runs, tuple[Letter, ...] | None]] = Numbers()
        self.accepting: set[int] = set()
        self.initial = self._number(frozenset({(automaton.initial, 0)}), frozenset(), None)

    def _number(self, runs: _Runs, owing: _Runs, held: tuple[Letter, ...] | None) -> int:
        number = self._states[runs, owing, held]
        if not owing and held is not None:
            self.accepting.add(number)
        return number

    def successors(self, state: int, letter: TeamLetter) -> Iterable[int]:
        """Return where the letters of all robots lead, after those that they held so far were read; nowhere where a run dies."""
        now, mover = letter
        runs, owing, held = self._states.known[state]
        if held is None:
            return (self._number(runs, runs, now),)
        every = self._every_reading(runs, held, owing=False)
        left = self._every_reading(owing or runs, held, owing=True)
        if every is None or left is None:
            return ()
        if mover == SEAM:
            due = (1 << len(now)) - 1
            every, left = (frozenset((q, 0) for q, b in some if b == due) for some in (every, left))
        elif mover >= 0 and now[mover] != held[mover]:
            every, left = (frozenset((q, b & ~(1 << mover)) for q, b in some if b >> mover & 1) for some in (every, left))
        return (self._number(every, left, now),)

    @memoized
    def _every_reading(self, runs: _Runs, held: tuple[Letter, ...], *, owing: bool) -> _Runs | None:
        """Return all runs after any readings of the letters that are held; of those that owe, those that still do."""
        found, stack = set(runs), list(runs)
        while stack:
            q, bits = stack.pop()
            for robot, letter in enumerate(held):
                target = self._successor(q, letter)
                if target is None:
                    return None
                key = (target, bits | 1 << robot)
                if key not in found and not (owing and target in self._automaton.accepting):
                    found.add(key)
                    stack.append(key)
        return _freest(found)

    @memoized
    def _successor(self, state: int, letter: Letter) -> int | None:
        return next(iter(self._automaton.successors(state, letter)), None)


def _freest(runs: set[tuple[int, int]]) -> _Runs:
    """Leave out runs of which another one in the same state has read as many robots and more: what they can go on with, it can."""
    read: dict[int, list[int]] = {}
    for state, bits in runs:
        read.setdefault(state, []).append(bits)
    return frozenset((q, a) for q, some in read.items() for a in some if not any(a != b and a & b == a for b in some))


Reader = LetterReader | ReadingsReader


def team_readers(mission: Mission, formula: Formula, budget: Budget) -> list[Reader]:
    """Return how each conjunct of a formula reads a team.

    Args:
        mission: Gives the robots, and whether they are read one at a time or together.
        formula: Written out for the team.
        budget: Bounds on each automaton.

    Raises:
        BadInput: Under `own` a conjunct has to guess what comes.
        TooLarge: A budget did not suffice.
    """
    known, together = atoms(formula), _together(mission)

    def of_team(shown: tuple[Letter, ...]) -> Letter:
        return frozenset[str]().union(*shown, true_atoms(known, zip(mission.agents, shown, strict=False)))

    def reader(part: Formula) -> Reader:
        operators, condition = temporal_operators(part)
        if condition is None:
            automaton = small_automaton(part, "infinite", budget=budget.alone)
            if together:
                return LetterReader(automaton, of_team)
            if automaton.deterministic:
                return ReadingsReader(automaton)
            raise BadInput(
                f"`{part}` is not planned for a team's laps under `own`: its automaton has to guess what comes, and no robot knows what "
                "others are read to show. Write it as parts that need no guess, or under `team: joint`."
            )
        asked, named = _HELD, _by_names(condition)
        for operator in reversed(operators):
            asked = Formula("F" if operator == "F" else "G", (asked,))

        def cut(shown: tuple[Letter, ...]) -> Letter:
            if together:
                holds = shows(named, of_team(shown))
            else:
                each = (shows(named, letter) for letter in shown)
                holds = any(each) if operators.endswith("F") else all(each)
            return frozenset({"held"}) if holds else frozenset()

        return LetterReader(small_automaton(asked, "infinite", budget=budget.alone), cut, stays=operators == "FG")

    return [reader(part) for part in dict.fromkeys(conjuncts(formula))]


def reads_letters(mission: Mission, asked: Formula) -> bool:
    """Tell whether all conjuncts read what all robots show, so that finding no cycles of the whole product proves that there are none.

    Args:
        mission: Gives the reading.
        asked: The formula, written out.
    """
    return _together(mission) or all(temporal_operators(part)[1] is not None for part in conjuncts(asked))


def _together(mission: Mission) -> bool:
    """Tell whether what all robots show is read as one letter; of a single robot it is."""
    return mission.spec.team == "joint" or len(mission.agents) == 1


def temporal_operators(formula: Formula) -> tuple[str, Formula | None]:
    """Return a formula as operators around a condition on one letter, the last two that differ at the most; no condition for other formulas.

    Args:
        formula: A conjunct.
    """
    operators, negated = "", False
    while True:
        if not any(node.operator in _TEMPORAL for node in formula.nodes()):
            return "".join(operator for operator, _ in itertools.groupby(operators))[-2:], Formula(
                "!", (formula,)
            ) if negated else formula
        if formula.operator == "!":
            negated = not negated
        elif formula.operator in ("F", "G"):
            operators += {"F": "G", "G": "F"}[formula.operator] if negated else formula.operator
        else:
            return "", None
        formula = formula.arguments[0]


def _by_names(condition: Formula) -> Formula:
    """Return a condition over names, single robots' names and counts with names of their own in their place."""
    if condition.operator == "count" or condition.robot:
        return Formula("name", (), condition.atom)
    return Formula(condition.operator, tuple(map(_by_names, condition.arguments)), condition.name)
