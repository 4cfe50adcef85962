"""Bad prefixes: an infinite formula is broken already, whatever the robots did between what is known of them and whatever they do next.

A prefix is bad where no continuation satisfies the formula. With one robot, or unions of letters, each behaviour gives one word (up to
repetition): the graph of all words is led on by every letter, for ever, and a run that satisfies the formula is sought by the tableau
for infinite words, with Spot's agreement. There is none exactly where all prefixes are bad. Of several robots that are read one at a
time all readings of one behaviour are followed together, and one has to be lost: what remains of the formula after it is satisfied by
no infinite word. Letters that can follow are all those that regions allow: the more, the fewer prefixes are bad. That costs the square
of these letters.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction

from verify.data.language.counting import atoms
from verify.data.language.formula import Formula
from verify.data.language.word import Letter
from verify.data.sections import TeamReading
from verify.logic.normal_form import Normal, conjuncts, normal_form, to_formula
from verify.logic.progression import Automaton, OutOfBudget, State
from verify.logic.spot_opinion import LetterGraph
from verify.logic.team_letters import TeamLetters
from verify.model_checking.inclusion import letter_graph
from verify.model_checking.lassos import find_broken_run
from verify.model_checking.refutation import each_broken
from verify.model_checking.robot_letters import ALWAYS, RobotBehaviour, from_timeline
from verify.model_checking.team_graph import JointGraph
from verify.model_checking.timeline import Relations, Timeline

MAX_LETTERS = 128
"""Letters that may follow; a part of the formula that sees more is not refuted."""


def never_kept(
    formula: Formula, timelines: Mapping[str, Timeline], relations: Relations, reading: TeamReading, budget: int
) -> Formula | None:
    """Return what each behaviour that agrees with the timelines breaks for good: a part of the formula, or all of it; None if not proved.

    Args:
        formula: Over infinite words, without "next".
        timelines: One for each robot, by name, without cycles: what was done so far.
        relations: What is proved of the regions at large.
        reading: Whether letters are the robots' own or joint.
        budget: Configurations that each part of the formula may take.

    Raises:
        InternalError: Our tableau and Spot disagree, or there is no word at all: a bug of ours.
        MissingEngine: Spot is not there to be asked.
    """
    parts = conjuncts(normal_form(formula))
    with suppress(OutOfBudget):
        lost = _lost(formula, timelines, relations, reading, budget)
        for part in [*parts, *([normal_form(formula)] if len(parts) > 1 else [])]:
            with suppress(OutOfBudget):
                if lost(part):
                    return to_formula(part)
    return None


def first_never_kept(timelines: Mapping[str, Timeline], lost: Callable[[Mapping[str, Timeline]], bool]) -> Fraction:
    """Return the first instant such that all that was done until any later one is lost already, s of the timelines.

    What is known changes at some instants; between two of them it is as good to stop early as late.

    Args:
        timelines: One for each robot, all as long as the others; `lost` until their end.
        lost: Whether what was done until some instant is lost; then all that is longer is, too.
    """
    actions = [action for timeline in timelines.values() for action in timeline.actions]
    changes = [change.time for timeline in timelines.values() for change in timeline.changes]
    open_ = [(action.time, action.until) for action in actions if action.until is not None]
    open_ += [(time.low, time.high) for time in changes if time.low < time.high]
    end = min(timeline.duration for timeline in timelines.values())
    found = {Fraction(0), end, *(a.time for a in actions), *(time.high for time in changes), *(high for _, high in open_)}
    spans = [(a, (a + b) / 2) for a, b in itertools.pairwise(sorted(found))]
    spans = [(since, stop) for since, stop in spans if not any(low <= stop < high for low, high in open_)]
    low, high = 0, len(spans)
    while low < high:
        middle = (low + high) // 2
        if lost({name: until(timeline, spans[middle][1]) for name, timeline in timelines.items()}):
            high = middle
        else:
            low = middle + 1
    return spans[low][0] if low < len(spans) else end


def until(timeline: Timeline, end: Fraction) -> Timeline:
    """Return what a timeline says of [0, `end`], s; nothing may be under way at its end."""
    changes = tuple(change for change in timeline.changes if change.time.low <= end)
    actions = tuple(action for action in timeline.actions if action.time <= end)
    return replace(timeline, changes=changes, actions=actions, duration=end)


def _lost(
    formula: Formula, timelines: Mapping[str, Timeline], relations: Relations, reading: TeamReading, budget: int
) -> Callable[[Normal], bool]:
    """Return what tells of a part of the formula whether every behaviour breaks it, whatever comes."""
    robots = [from_timeline(timeline, relations) for timeline in timelines.values()]
    known = atoms(formula)
    if not known and reading == "own" and len(robots) > 1:
        return lambda part: _some_reading_lost(robots, part, relations, budget)
    if known:
        letters = TeamLetters.of(formula, known)
        robots = [
            replace(robot, letters=tuple(letters.own(name, letter) for letter in robot.letters))
            for name, robot in zip(timelines, robots, strict=True)
        ]
        graph = JointGraph(robots, timed=True, together=letters.together)
    else:
        graph = JointGraph(robots, timed=True)
    limits = relations if len(robots) == 1 and not known else Relations()

    def lost(part: Normal) -> bool:
        names = part.propositions
        led_on = _led_on(letter_graph(graph, names, budget), _letters(names, limits))
        return _none_satisfies(led_on, to_formula(part), budget)

    return lost


def _some_reading_lost(robots: list[RobotBehaviour], part: Normal, relations: Relations, budget: int) -> bool:
    """Return whether each behaviour has a reading after which the formula cannot be kept."""
    automaton = Automaton(part)
    anything = _led_on(None, _letters(part.propositions, relations))
    known: dict[State, bool] = {}

    def lost(_: bool, rest: State) -> bool:
        if rest not in known:
            known[rest] = _none_satisfies(anything, automaton.remains(rest), budget)
        return known[rest]

    return each_broken(robots, automaton, budget, lost)


def _none_satisfies(robot: RobotBehaviour, formula: Formula, budget: int) -> bool:
    """Return whether every infinite word of a graph breaks a formula."""
    negation = conjuncts(normal_form(formula, negated=True))
    return all(find_broken_run(robot, part, budget) is None for part in negation)


def _letters(names: frozenset[str], relations: Relations) -> tuple[Letter, ...]:
    """Return all letters over some names that the regions among them allow."""
    known = relations.among(names)
    apart = replace(known, nested=frozenset())  # whoever is in two regions that are apart is so in all larger letters
    found: list[Letter] = [frozenset()]
    for name in sorted(names):
        found += [letter | {name} for letter in found if apart.allows(letter | {name})]
        if len(found) > 16 * MAX_LETTERS:
            break
    found = [letter for letter in found if known.allows(letter)]
    if len(found) > MAX_LETTERS:
        raise OutOfBudget(f"more than {MAX_LETTERS} letters can follow")
    return tuple(found)


def _led_on(graph: LetterGraph | None, letters: tuple[Letter, ...]) -> RobotBehaviour:
    """Return all words of a graph (or the empty one), each led on by any of the letters for ever: only those are its runs."""
    edges: Iterable[tuple[int, Letter, int]] = () if graph is None else graph.edges
    index = {node: i for i, node in enumerate(dict.fromkeys((letter, target) for _, letter, target in edges))}
    rest = tuple(range(len(index), len(index) + len(letters)))
    after: dict[int, list[int]] = {}
    for source, letter, target in edges:
        after.setdefault(source, []).append(index[letter, target])
    final = frozenset[int]() if graph is None else graph.final
    count = len(index) + len(rest)
    return RobotBehaviour(
        "",
        (*(letter for letter, _ in index), *letters),
        (ALWAYS,) * count,
        (*((*after.get(target, ()), *(rest if target in final else ())) for _, target in index), *(rest,) * len(rest)),
        rest if graph is None else tuple(after.get(0, ())),
        frozenset(rest),
        frozenset((one, other) for one in rest for other in rest),
        (0,) * count,
    )
