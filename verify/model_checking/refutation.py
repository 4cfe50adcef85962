"""Refutation: a formula is broken whatever the robots did between what is known of them.

The checker's usual question is whether every team word satisfies a formula. A recorded flight can also be refuted: when
for every behaviour that agrees with it some team word breaks the formula. With one robot, or unions of letters, a
behaviour gives one word (up to repetition), and the question is the usual one for the negation. With several robots
that are read one at a time, all readings of one behaviour are followed together.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from fractions import Fraction

from verify.data.language.counting import atoms
from verify.data.language.formula import Formula
from verify.data.sections import TeamReading
from verify.logic.normal_form import conjuncts, normal_form
from verify.logic.progression import REFUTED, Automaton, OutOfBudget, State
from verify.logic.team_letters import TeamLetters
from verify.model_checking.inclusion import holds_for_all
from verify.model_checking.robot_letters import RobotBehaviour, from_timeline
from verify.model_checking.team_graph import JointGraph, OwnGraph
from verify.model_checking.timeline import Relations, Timeline

_Readings = frozenset[tuple[int, int]]
"""All (robots read in their present letters as bits, what remains of the formula) of one behaviour so far."""


def every_behaviour_breaks(
    formula: Formula, timelines: Mapping[str, Timeline], relations: Relations, reading: TeamReading, budget: int
) -> bool:
    """Return whether each behaviour that agrees with the timelines gives a team word that breaks the formula.

    False means only that this was not proved (a conjunction is refuted by one of its parts alone).

    Args:
        formula: What each team word is compared with.
        timelines: One for each robot, by name.
        relations: What is proved of the regions at large.
        reading: Whether letters are the robots' own or joint.
        budget: Configurations that each part of the formula may take.

    Raises:
        OutOfBudget: More than `budget` configurations were met.
        InternalError: Our progression and Spot disagree, or there is no word at all: a bug of ours.
        MissingEngine: Spot is not there to be asked.
    """
    robots = [from_timeline(timeline, relations) for timeline in timelines.values()]
    if known := atoms(formula):
        letters = TeamLetters.of(formula, known)
        marked = [
            replace(robot, letters=tuple(letters.own(name, letter) for letter in robot.letters))
            for name, robot in zip(timelines, robots, strict=True)
        ]
        graph = JointGraph(marked, timed=True, together=letters.together)
        return all(holds_for_all(graph, part, budget) is None for part in conjuncts(normal_form(formula, negated=True)))
    if reading == "joint" or len(robots) == 1:
        graph = JointGraph(robots, timed=True)
        return all(holds_for_all(graph, part, budget) is None for part in conjuncts(normal_form(formula, negated=True)))
    for automaton in map(Automaton, conjuncts(normal_form(formula))):
        if each_broken(robots, automaton, budget, lambda read, rest, ends=automaton.accepts: read and not ends(rest)):
            return True
    return False


def each_broken(robots: list[RobotBehaviour], automaton: Automaton, budget: int, lost: Callable[[bool, State], bool]) -> bool:
    """Return whether each behaviour of robots that are read one at a time has a reading that is lost.

    Args:
        robots: All that each may do.
        automaton: Of what they are compared with.
        budget: Configurations that may be met.
        lost: Whether a reading of all that was done is, by whether every robot is read in its last letter, and by what then remains.

    Raises:
        OutOfBudget: More than `budget` configurations were met.
    """
    graph = OwnGraph(robots, timed=True, clock_error=Fraction(0))
    seen: set[tuple[tuple[int, ...], _Readings]] = set()
    stack: list[tuple[tuple[int, ...], _Readings]] = []

    def visit(nodes: tuple[int, ...], readings: set[tuple[int, int]]) -> None:
        closed = _closed(readings, nodes)
        if any(rest == REFUTED for _, rest in closed):
            return  # one team word is lost already, whatever follows
        state = (nodes, closed)
        if state not in seen:
            if len(seen) >= budget:
                raise OutOfBudget(f"more than {budget} configurations of team and formula")
            seen.add(state)
            stack.append(state)

    def _closed(readings: set[tuple[int, int]], nodes: tuple[int, ...]) -> _Readings:
        found, work = set(readings), list(readings)
        while work:
            bits, rest = work.pop()
            for r, robot in enumerate(robots):
                after = (bits | 1 << r, automaton.step(rest, automaton.cut(robot.letters[nodes[r]])))
                if after not in found:
                    found.add(after)
                    work.append(after)
        return frozenset(found)

    for _, (nodes, _) in graph.initial():  # type: ignore[misc]  # the graph's own states
        visit(nodes, {(0, automaton.initial)})
    while stack:
        nodes, readings = stack.pop()
        at_end = all(n in robot.final for n, robot in zip(nodes, robots, strict=True))
        if at_end and not any(lost(bits == graph.all_read, rest) for bits, rest in readings):
            return False
        for r, robot in enumerate(robots):
            for target in robot.following[nodes[r]]:
                if not graph.clock.allows(nodes, r, target):
                    continue
                moved = (*nodes[:r], target, *nodes[r + 1 :])
                if robot.letters[target] == robot.letters[nodes[r]]:
                    visit(moved, set(readings))
                else:
                    bit = 1 << r
                    visit(moved, {(bits & ~bit, rest) for bits, rest in readings if bits & bit})
    return True
