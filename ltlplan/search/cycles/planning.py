"""Infinite plans of one robot or a team, as an assignment: a prefix, and a cycle that all robots begin together.

The searches of `_tries` are made in turn: parts of the formula are given to one robot each (one robot keeps all of them), else the product of all
robots is searched.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from ltlplan.allocation import Allocation, Itinerary
from ltlplan.logic.budget import TooLarge
from ltlplan.search.cycles.cheapest_cycles import Effort, cycles_below, cycles_may_exist, least_of_all_cycles
from ltlplan.search.cycles.conjunct_assignment import parts_of, share_out
from ltlplan.search.cycles.resting_actions import acts_at_rest, comes_anew
from ltlplan.search.cycles.team_cycles import TeamCycles, team_itineraries, team_meetings
from ltlplan.search.cycles.team_readers import reads_letters
from ltlplan.search.explanations.inquiry import all_of
from ltlplan.search.itineraries import lasso_itinerary
from ltlplan.search.problem import TIES, NoWords, Problem
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Formula, Infeasible, Unsatisfiable

_NOT_RULED_OUT = "A cheaper lap was not ruled out."
_BEGUN_LATER = "A lap begins with a visit, so part of one is flown before the first lap; a cheaper plan was not ruled out."


class _ActsAtRest(Exception):
    """The cycles that were found are actions to and fro inside one region."""


def plan(problem: Problem) -> Allocation:
    """Plan an infinite trace; as many cycles count as are flown.

    Raises:
        NoWords: No cycles were found; it finds out why.
        Unsatisfiable: None but actions to and fro inside one region do.
        Infeasible: They cannot be said of visits and waits.
        TooLarge: A budget was used up before an answer was found.
    """
    asked = problem.asked
    try:
        found = _cheapest(problem, asked)
    except _ActsAtRest:
        asked = all_of([asked, *map(comes_anew, problem.each)])
        found = _cheapest(problem, asked)
        if found is None:
            raise Unsatisfiable(
                "The formula can be kept for ever only by actions to and fro inside one region, where the robot would rest. A lap is "
                "flown: it comes to its regions anew. Let the formula allow the robot to leave the region in each lap, or make the "
                "actions in two regions."
            ) from None
    if found is None:
        raise NoWords(lambda: _no_cycles(problem))
    if problem.several and found.plan.lower_bound is None:
        found = found.at_least(least_of_all_cycles(problem.mission, problem.each, asked, problem.budget, found.plan.cost))
    least = found.plan.lower_bound
    proved = least is not None and found.plan.cost <= least + 2 * TIES
    notes = (*found.plan.notes, *(() if proved else (found.gap,)), *problem.systems.unclear())
    return replace(found.plan, complete=proved, notes=notes)


@dataclass(frozen=True, slots=True)
class _Flown:
    """Cycles as they are flown.

    Attributes:
        plan: What each robot does, who waits for whom, what they pay, and what no cycles cost less than, where that is known.
        gap: What is said where cheaper cycles are not ruled out.
        exact: Whether no cycles of robots that fly one at a time are cheaper.
    """

    plan: Allocation
    gap: str
    exact: bool

    def at_least(self, bound: float | None) -> _Flown:
        """Return these cycles with another lower bound, where it is known and higher."""
        if bound is None:
            return self
        return replace(self, plan=replace(self.plan, lower_bound=max(bound, self.plan.lower_bound or 0.0)))


def _cheapest(problem: Problem, asked: Formula) -> _Flown | None:
    """Return the cheapest cycles of the first try that answers, those of parts bettered by the next one; None where there are none."""
    best: _Flown | None = None
    refused: Infeasible | TooLarge | None = None
    for effort, gap in _tries(problem, asked):
        try:
            best = _by_parts(problem, asked) if effort is None else _searched(problem, asked, best, effort, gap)
        except (Infeasible, TooLarge) as error:
            refused = refused or error
            continue
        if best is None or best.exact or effort is not None:
            return best
    if best is None and refused is not None:
        raise refused
    return best


def _tries(problem: Problem, asked: Formula) -> Iterator[tuple[Effort | None, str]]:
    """Yield the tries in their order, each with what is said where cheaper cycles are not ruled out; no effort where parts are given to one robot each."""
    if parts_of(problem.mission, asked) is not None:
        yield None, _BEGUN_LATER
    gap = f"The cheapest laps{', by the dearest robot,' * problem.longest} of robots that fly one at a time."
    yield Effort(), gap if problem.several else _BEGUN_LATER
    if any(own.actions for own in problem.each):
        yield Effort(at_once=True), "Robots act where they come to before others go on; a cheaper lap was not ruled out."
    yield Effort(at_once=True, hasty=True), _NOT_RULED_OUT


def _by_parts(problem: Problem, asked: Formula) -> _Flown | None:
    """Give the parts of the formula to one robot each."""
    parts = parts_of(problem.mission, asked)
    assert parts is not None
    found = share_out(problem.mission, problem.each, parts, problem.budget, longest=problem.longest)
    if found is None:
        return None
    note = f"The parts of the formula were shared out, by {found.reached:,} lassos of single robots."
    return _flown(problem, found, note, _BEGUN_LATER)


def _searched(problem: Problem, asked: Formula, best: _Flown | None, effort: Effort, gap: str) -> _Flown | None:
    """Search the product of all robots, of which one flies while the others rest, for cheaper cycles than are known."""
    below = math.inf if best is None else best.plan.cost - TIES
    found = cycles_below(problem.mission, problem.each, asked, problem.budget, below, effort)
    if found.cycles is not None:
        note = (
            f"A search went on with {found.cycles.reached:,} ways over the team's product, in which one robot flies at a time."
        )
        flown = _flown(problem, found.cycles, note, gap)
        best = flown if best is None or flown.plan.cost < best.plan.cost else best
    return best and best.at_least(found.least)


def _flown(problem: Problem, found: TeamCycles, note: str, gap: str) -> _Flown:
    waits = team_meetings(problem.each, found)
    if problem.several:
        robots, notes = team_itineraries(problem.each, found, problem.mission.spec.repeat), [note]
    else:
        robots, notes = {problem.each[0].robot: _flown_alone(problem, found)}, []
    if waits:
        notes.append("Robots wait for each other within each lap, as the formula asks.")
    cost = (max if problem.longest else sum)(robot.cost for robot in robots.values())
    plan = Allocation(
        robots=robots, cost=cost, lower_bound=found.least, complete=False, notes=tuple(notes), meetings=tuple(waits)
    )
    return _Flown(plan, gap if found.exact else _NOT_RULED_OUT, found.exact)


def _flown_alone(problem: Problem, found: TeamCycles) -> Itinerary:
    """Return what one robot does; its cycle may begin with any visit."""
    (system,), (prefix,), (cycle,) = problem.each, found.prefixes, found.cycles
    if acts_at_rest(system, cycle):
        raise _ActsAtRest
    return lasso_itinerary(problem.mission, system, prefix[:-1], cycle[:-1] or cycle)


def _no_cycles(problem: Problem) -> Unsatisfiable | Infeasible:
    """Return the error that says why there are no cycles."""
    from ltlplan.search.explanations.relaxation import relaxed
    from ltlplan.search.explanations.unsatisfiable_cores import explain

    mission, each, budget = problem.mission, problem.each, problem.budget

    def possible(parts: Sequence[Formula], worlds: Sequence[TransitionSystem]) -> bool:
        if len(worlds) < len(each) and any(part.counts for part in parts):
            return False  # what is said of all robots says nothing of some of them
        if (shared := parts_of(mission, all_of(parts))) is not None:
            return share_out(mission, worlds, shared, replace(budget, rounds=1), longest=False) is not None
        return cycles_may_exist(mission, worlds, all_of(parts), budget)

    waits = False
    if parts_of(mission, problem.asked) is None:
        try:
            waits = not reads_letters(mission, problem.asked) or cycles_may_exist(
                mission, each, problem.asked, budget, together=True
            )
        except TooLarge:
            waits = True
    if waits:
        return Infeasible(
            "No laps were found in which one robot flies at a time while the others rest, in regions or at their starts. Others may exist, "
            "in which robots hover outside all regions for one another, or are read in a lap where they only rest: these are not planned. Give such "
            "a place a region of its own, or let the formula come true in flight."
        )
    return relaxed(problem, explain(mission, problem.systems, each, possible))
