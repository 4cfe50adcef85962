"""What one robot flies for ever, as an assignment: `lasso` and `word_lasso` search, here their answer becomes an itinerary."""

from __future__ import annotations

from collections.abc import Sequence

from ltlplan.logic.automaton import Automaton
from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.logic.conjunction import conjunct_automata
from ltlplan.search.assignment import TIES, Assignment, Cheapest, NoWords, asked_of
from ltlplan.search.explanations.requirements import all_of
from ltlplan.search.itineraries import lasso_itinerary
from ltlplan.search.lassos.lasso import LassoRun, cheapest_lasso
from ltlplan.search.lassos.memoryless_automata import closes_at_once
from ltlplan.search.lassos.resting_actions import acts_at_rest, comes_anew
from ltlplan.search.lassos.word_lasso import improve_lasso
from ltlplan.systems.robot_systems import Systems
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Formula, Mission, Unsatisfiable

WORD_STATES = 10_000  # states for looking for a cheaper infinite word than the planning automaton's


def assign_lasso(
    mission: Mission, systems: Systems, system: TransitionSystem, budget: Budget, cheapest: Cheapest
) -> Assignment:
    """Plan one robot's infinite trace; as many laps count as are flown.

    Args:
        mission: Of one robot.
        systems: What robots can do.
        system: What this one can.
        budget: Bounds on the search.
        cheapest: Prices missions that ask for less, where there is no plan.

    Raises:
        NoWords: No words satisfy the formula; it finds out why.
        Unsatisfiable: None but actions to and fro inside one region do.
        TooLarge: A budget was used up before an answer was found.
    """
    automata = conjunct_automata(asked_of(mission, [system]), "infinite", budget=budget)
    run = cheapest_lasso(system, automata, weight=mission.spec.repeat, budget=budget)
    if run is None:
        from ltlplan.search.explanations.relaxation import relaxed
        from ltlplan.search.explanations.unsatisfiable_cores import explain

        def possible(parts: Sequence[Formula], worlds: Sequence[TransitionSystem]) -> bool:
            return _lasso_exists(parts, worlds[0], budget)

        raise NoWords(lambda: relaxed(mission, explain(mission, systems, [system], feasible=possible), cheapest))
    laps = mission.spec.repeat
    run, exact, certain = _improved(system, automata, run, laps, budget)
    if acts_at_rest(system, run.cycle):
        automata = [*automata, *conjunct_automata(comes_anew(system), "infinite", budget=budget)]
        run = cheapest_lasso(system, automata, weight=laps, budget=budget)
        if run is None:
            raise Unsatisfiable(
                "The formula can be kept for ever only by actions to and fro inside one region, where the robot would rest. A lap is "
                "flown: it comes to its regions anew. Let the formula allow the robot to leave the region in each lap, or make the "
                "actions in two regions."
            )
        run, exact, certain = _improved(system, automata, run, laps, budget)
    (name,) = mission.agents
    robot = lasso_itinerary(mission, system, run.prefix, run.cycle)
    if certain:
        least = run.prefix_cost + laps * run.cycle_cost
        if robot.cost <= least + 2 * TIES:
            return Assignment({name: robot}, robot.cost, robot.cost, complete=True, tried=1)
        note = "A lap begins with a visit, so part of one is flown before the first lap; a cheaper plan was not ruled out."
        return Assignment({name: robot}, robot.cost, max(0.0, least - TIES), complete=False, tried=1, notes=(note,))
    note = "The cheapest round of the planning automaton" if exact else "The best round found within the budget of states"
    least = _least_lasso(system, automata, run, laps, budget)
    return Assignment({name: robot}, robot.cost, least, False, 1, (f"{note}; a cheaper word was not ruled out.",))


def _improved(
    system: TransitionSystem, automata: Sequence[Automaton], run: LassoRun, laps: int, budget: Budget
) -> tuple[LassoRun, bool, bool]:
    """Return a lasso that is as cheap or cheaper, whether the first was the cheapest round, and whether this is the cheapest word."""
    exact = run.bound >= run.prefix_cost + laps * run.cycle_cost - TIES
    certain = exact and all(map(closes_at_once, automata))
    if not certain:
        run, certain = improve_lasso(system, automata, run, weight=laps, states=min(budget.states, WORD_STATES))
        certain = certain and exact
    return run, exact, certain


def _least_lasso(
    system: TransitionSystem, automata: Sequence[Automaton], run: LassoRun, laps: int, budget: Budget
) -> float | None:
    """Return a lower bound on all infinite words: what the conjuncts ask for whose automata forget all but the last letter.

    Of these a lap of the word is a round of the product, so that a bound on rounds is one on words.
    """
    forgetful = [automaton for automaton in automata if closes_at_once(automaton)]
    if not forgetful:
        return None
    relaxed = run if len(forgetful) == len(automata) else cheapest_lasso(system, forgetful, weight=laps, budget=budget)
    return None if relaxed is None else max(0.0, relaxed.bound - TIES)


def _lasso_exists(parts: Sequence[Formula], system: TransitionSystem, budget: Budget) -> bool:
    from ltlplan.search.lassos.lasso import lasso_exists

    try:
        return lasso_exists(system, conjunct_automata(all_of(parts), "infinite", budget=budget), budget=budget)
    except TooLarge:
        return True  # not known to be impossible
