"""What one robot or a team flies for ever, as an assignment: a prefix, and a cycle that all robots begin together.

One robot's is a lasso of its product (`lasso`), improved to the cheapest word (`word_lasso`). For a team the searches of `_tries` are made in
turn: parts of the formula are given to one robot each, else the team's product is searched.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from ltlplan.allocation import Allocation, Itinerary
from ltlplan.logic.automaton import Automaton
from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.logic.conjunction import conjunct_automata
from ltlplan.search.cycles.cheapest_cycles import Effort, cycles_below, least_of_all_cycles
from ltlplan.search.cycles.conjunct_assignment import parts_of, share_out
from ltlplan.search.cycles.lasso import LassoRun, cheapest_lasso, lasso_exists
from ltlplan.search.cycles.memoryless_automata import closes_at_once
from ltlplan.search.cycles.resting_actions import acts_at_rest, comes_anew
from ltlplan.search.cycles.team_cycles import TeamCycles
from ltlplan.search.cycles.team_itineraries import team_itineraries, team_meetings
from ltlplan.search.cycles.team_readers import reads_letters, team_readers
from ltlplan.search.cycles.team_system import TeamSystem
from ltlplan.search.cycles.word_lasso import improve_lasso
from ltlplan.search.explanations.requirements import all_of
from ltlplan.search.itineraries import lasso_itinerary
from ltlplan.search.problem import TIES, NoWords, Problem
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Formula, Infeasible, Unsatisfiable
from verify.data.plan import Meeting

WORD_STATES = 10_000  # states for looking for a cheaper infinite word than the planning automaton's

_NOT_RULED_OUT = "A cheaper lap was not ruled out."


def plan(problem: Problem) -> Allocation:
    """Plan an infinite trace; as many cycles count as are flown.

    Raises:
        NoWords: No cycles were found; it finds out why.
        Unsatisfiable: None but actions to and fro inside one region do.
        Infeasible: They cannot be said of visits and waits.
        TooLarge: A budget was used up before an answer was found.
    """
    return _plan_team(problem) if problem.several else _plan_one(problem)


def _plan_one(problem: Problem) -> Allocation:
    mission, budget, (system,) = problem.mission, problem.budget, problem.each

    def possible(parts: Sequence[Formula], worlds: Sequence[TransitionSystem]) -> bool:
        try:
            return lasso_exists(worlds[0], conjunct_automata(all_of(parts), "infinite", budget=budget), budget=budget)
        except TooLarge:
            return True  # not known to be impossible

    automata, repeat = problem.automata, mission.spec.repeat
    found = _cheapest_word(system, automata, repeat, budget)
    if found is None:
        raise NoWords(lambda: _explained(problem, possible))
    if acts_at_rest(system, found.run.cycle):
        automata = [*automata, *conjunct_automata(comes_anew(system), "infinite", budget=budget)]
        found = _cheapest_word(system, automata, repeat, budget)
        if found is None:
            raise Unsatisfiable(
                "The formula can be kept for ever only by actions to and fro inside one region, where the robot would rest. A lap is "
                "flown: it comes to its regions anew. Let the formula allow the robot to leave the region in each lap, or make the "
                "actions in two regions."
            )
    run = found.run
    (name,) = mission.agents
    robot = lasso_itinerary(mission, system, run.prefix, run.cycle)
    if found.certain:
        least = run.cost(repeat)
        if robot.cost <= least + 2 * TIES:
            return Allocation(robots={name: robot}, cost=robot.cost, lower_bound=robot.cost, complete=True)
        note = "A lap begins with a visit, so part of one is flown before the first lap; a cheaper plan was not ruled out."
        return Allocation(robots={name: robot}, cost=robot.cost, lower_bound=max(0.0, least - TIES), notes=(note,))
    note = "The cheapest round of the planning automaton" if found.exact else "The best round found within the budget of states"
    bound = _least_lasso(system, automata, run, repeat, budget)
    notes = (f"{note}; a cheaper word was not ruled out.",)
    return Allocation(robots={name: robot}, cost=robot.cost, lower_bound=bound, notes=notes)


@dataclass(frozen=True, slots=True)
class _Lasso:
    """A lasso, whether no round of the product is cheaper, and whether no word is."""

    run: LassoRun
    exact: bool
    certain: bool


def _cheapest_word(system: TransitionSystem, automata: Sequence[Automaton], repeat: int, budget: Budget) -> _Lasso | None:
    run = cheapest_lasso(system, automata, weight=repeat, budget=budget)
    if run is None:
        return None
    exact = run.bound >= run.cost(repeat) - TIES
    if exact and all(map(closes_at_once, automata)):
        return _Lasso(run, exact, certain=True)
    run, certain = improve_lasso(system, automata, run, weight=repeat, states=min(budget.states, WORD_STATES))
    return _Lasso(run, exact, certain and exact)


def _least_lasso(
    system: TransitionSystem, automata: Sequence[Automaton], run: LassoRun, repeat: int, budget: Budget
) -> float | None:
    """Return a lower bound on all infinite words: what the conjuncts ask for whose automata forget all but the last letter.

    Of these a cycle of the word is a round of the product, so that a bound on rounds is one on words.
    """
    forgetful = [automaton for automaton in automata if closes_at_once(automaton)]
    if not forgetful:
        return None
    relaxed = run if len(forgetful) == len(automata) else cheapest_lasso(system, forgetful, weight=repeat, budget=budget)
    return None if relaxed is None else max(0.0, relaxed.bound - TIES)


@dataclass(frozen=True, slots=True)
class _Flown:
    """Cycles as they are flown.

    Attributes:
        robots: What each robot does.
        waits: Who waits for whom.
        cost: What they pay, in sum or the highest of them, as is asked.
        notes: How they were found.
        gap: What is said where cheaper cycles are not ruled out.
        least: No cycles cost less; None where that is not known.
    """

    robots: dict[str, Itinerary]
    waits: tuple[Meeting, ...]
    cost: float
    notes: tuple[str, ...]
    gap: str
    least: float | None

    @property
    def proved(self) -> bool:
        """Whether no cycles are cheaper."""
        return self.least is not None and self.cost <= self.least + 2 * TIES


def _plan_team(problem: Problem) -> Allocation:
    found = _cheapest(problem)
    if found is None:
        raise NoWords(lambda: _no_team_cycles(problem))
    if not found.proved:
        least = least_of_all_cycles(problem.mission, problem.each, problem.asked, problem.budget, found.cost)
        found = found if least is None else replace(found, least=max(least, found.least or 0.0))
    notes = (*found.notes, *(() if found.proved else (found.gap,)), *problem.systems.unclear())
    return Allocation(
        robots=found.robots, cost=found.cost, lower_bound=found.least, complete=found.proved, notes=notes, meetings=found.waits
    )


def _cheapest(problem: Problem) -> _Flown | None:
    """Return the cheapest cycles of the first try that answers; None where there are none."""
    best: _Flown | None = None
    refused: Infeasible | TooLarge | None = None
    for attempt in _tries(problem):
        try:
            found = attempt(problem, math.inf if best is None else best.cost - TIES)
        except (Infeasible, TooLarge) as error:
            refused = refused or error
            continue
        best = found or best
        if best is None or best.proved or attempt is not _by_parts:
            return best
    if best is None and refused is not None:
        raise refused
    return best


def _by_parts(problem: Problem, _: float) -> _Flown | None:
    """Give the parts of the formula to one robot each."""
    parts = parts_of(problem.mission, problem.asked)
    assert parts is not None
    found = share_out(problem.mission, problem.each, parts, problem.budget, longest=problem.longest)
    if found is None:
        return None
    note = f"The parts of the formula were shared out, by {found.reached:,} lassos of single robots."
    return _flown(problem, found, note, _NOT_RULED_OUT)


def _one_at_a_time(problem: Problem, below: float) -> _Flown | None:
    """Search the product of all robots, of which one flies while the others rest."""
    gap = f"The cheapest laps{', by the dearest robot,' * problem.longest} of robots that fly one at a time."
    return _searched(problem, below, Effort(), gap)


def _acting_at_once(problem: Problem, below: float) -> _Flown | None:
    """Search it for cycles in which nobody waits for an action alone."""
    gap = "Robots act where they come to before others go on; a cheaper lap was not ruled out."
    return _searched(problem, below, Effort(at_once=True), gap)


def _in_haste(problem: Problem, below: float) -> _Flown | None:
    """Search it for any cycles."""
    return _searched(problem, below, Effort(at_once=True, hasty=True), _NOT_RULED_OUT)


def _tries(problem: Problem) -> Iterator[Callable[[Problem, float], _Flown | None]]:
    """Yield the tries in their order: each returns cycles below a limit, or None where there are none, and raises where it cannot tell."""
    if parts_of(problem.mission, problem.asked) is not None:
        yield _by_parts
    yield _one_at_a_time
    if any(own.actions for own in problem.each):
        yield _acting_at_once
    yield _in_haste


def _searched(problem: Problem, below: float, effort: Effort, gap: str) -> _Flown | None:
    found = cycles_below(problem.mission, problem.each, problem.asked, problem.budget, below, effort)
    if found is None:
        return None
    note = f"A search went on with {found.reached:,} ways over the team's product, in which one robot flies at a time."
    return _flown(problem, found, note, gap if found.exact else _NOT_RULED_OUT)


def _flown(problem: Problem, found: TeamCycles, note: str, gap: str) -> _Flown:
    robots, waits = team_itineraries(problem.each, found, problem.mission.spec.repeat), team_meetings(problem.each, found)
    more = ("Robots wait for each other within each lap, as the formula asks.",) if waits else ()
    costs = [robot.cost for robot in robots.values()]
    cost = max(costs) if problem.longest else sum(costs)
    return _Flown(robots, tuple(waits), cost, (note, *more), gap, found.least)


Possible = Callable[[Sequence[Formula], Sequence[TransitionSystem]], bool]
"""Whether some robots may be able to do what some parts of the formula ask for."""


def _explained(problem: Problem, possible: Possible) -> Unsatisfiable:
    from ltlplan.search.explanations.relaxation import relaxed
    from ltlplan.search.explanations.unsatisfiable_cores import explain

    mission = problem.mission
    return relaxed(mission, explain(mission, problem.systems, problem.each, feasible=possible), problem.cheapest)


def _no_team_cycles(problem: Problem) -> Unsatisfiable | Infeasible:
    """Return the error that says why there are no cycles."""
    mission, each, budget = problem.mission, problem.each, problem.budget

    def exists(asked: Formula, worlds: Sequence[TransitionSystem], *, together: bool) -> bool:
        system = TeamSystem(worlds, together=together)
        return lasso_exists(system, team_readers(mission, asked, system.letters, budget), budget=budget)

    def possible(parts: Sequence[Formula], worlds: Sequence[TransitionSystem]) -> bool:
        if len(worlds) < len(each) and any(part.counts for part in parts):
            return False  # what is said of all robots says nothing of some of them
        try:
            if (shared := parts_of(mission, all_of(parts))) is not None:
                return share_out(mission, worlds, shared, budget, longest=False) is not None
            return exists(all_of(parts), worlds, together=False)
        except (TooLarge, Infeasible):
            return True  # not known to be impossible

    waits = False
    if parts_of(mission, problem.asked) is None:
        try:
            waits = not reads_letters(mission, problem.asked) or exists(problem.asked, each, together=True)
        except TooLarge:
            waits = True
    if waits:
        return Infeasible(
            "No laps were found in which one robot flies at a time while the others rest, in regions or at their starts. Others may exist, "
            "in which robots hover outside all regions for one another, or are read in a lap where they only rest: these are not planned. Give such "
            "a place a region of its own, or let the formula come true in flight."
        )
    return _explained(problem, possible)
