"""What is flown for ever: one robot's lasso, or laps that a team begins together, as an assignment.

`lasso`, `shared_parts` and `team_lassos` search; here their answers become itineraries, with what is known of their costs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ltlplan.logic.automaton import Automaton
from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.logic.conjunction import conjunct_automata
from ltlplan.search.assignment import TIES, Assignment, NoWords, asked_of
from ltlplan.search.itineraries import lasso_itinerary
from ltlplan.search.lassos.forgetful import closes_at_once
from ltlplan.search.lassos.lasso import LassoRun, cheapest_lasso
from ltlplan.search.lassos.resting_actions import acts_at_rest, comes_anew
from ltlplan.search.lassos.shared_parts import parts_of, share_out
from ltlplan.search.lassos.team_itineraries import team_itineraries, team_meetings
from ltlplan.search.lassos.team_lassos import TeamLasso, plan_team_lasso, team_lasso_exists
from ltlplan.search.lassos.team_readers import reads_letters
from ltlplan.search.lassos.word_lasso import improve_lasso
from ltlplan.search.refusals.requirements import all_of
from ltlplan.search.weighted_sums import BY_WEIGHTED_SUMS, LeastSum, lower_the_dearest
from ltlplan.systems.robot_systems import Systems
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Formula, Infeasible, Mission, Unsatisfiable

Cheapest = Callable[[Mission], float | None]
"""What the cheapest plan of a mission costs; None where there is none."""

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
        from ltlplan.search.refusals.relaxation import relaxed
        from ltlplan.search.refusals.unsatisfiable_cores import explain

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


def assign_team_laps(
    mission: Mission, systems: Systems, each: list[TransitionSystem], budget: Budget, cheapest: Cheapest
) -> Assignment:
    """Plan a team's laps; as many count as are flown.

    Args:
        mission: Of several robots.
        systems: What robots can do.
        each: Every robot's system.
        budget: Bounds on the search.
        cheapest: Prices missions that ask for less, where there is no plan.

    Raises:
        NoWords: No laps were found; it finds out why.
        TooLarge: A budget was used up before an answer was found.
    """
    asked, longest = asked_of(mission, each), mission.planner.objective == "longest"
    parts, bound = parts_of(mission, asked), None
    if parts is not None:
        shared = share_out(mission, each, parts, budget, longest=longest)
        if shared is None:
            raise NoWords(lambda: _no_team_laps(mission, systems, each, budget, cheapest))
        found = TeamLasso(shared.prefixes, shared.laps, None, shared.least, shared.least is not None, shared.lassos)
        notes = [f"The parts of the formula were shared out, by {shared.lassos:,} lassos of single robots."]
    else:

        def search(worlds: Sequence[TransitionSystem]) -> LeastSum[TeamLasso] | None:
            product = plan_team_lasso(mission, worlds, asked, budget)
            if product is None:
                return None
            flown = team_itineraries(each, product, mission.spec.repeat)
            paths = tuple((*once, *lap) for once, lap in zip(product.prefixes, product.laps, strict=True))
            return LeastSum(product, tuple(robot.cost for robot in flown.values()), paths, product.least)

        best = search(each)
        if best is None:
            raise NoWords(lambda: _no_team_laps(mission, systems, each, budget, cheapest))
        if longest:
            best, bound = lower_the_dearest(each, best, search)
        found = best.plan
        notes = [f"The search reached {found.reached:,} places of the team's product, in which one robot flies at a time."]
    robots, waits = team_itineraries(each, found, mission.spec.repeat), team_meetings(each, found)
    if waits:
        notes.append("Robots wait for each other within each lap, as the formula asks.")
    total, least = sum(robot.cost for robot in robots.values()), found.least
    if longest:
        total = max(robot.cost for robot in robots.values())
        if parts is None:
            least = bound
    complete = least is not None and total <= least + 2 * TIES
    if longest and parts is None and not complete:
        notes.append(BY_WEIGHTED_SUMS)
    if not complete and not longest:
        notes.append(
            "The cheapest laps of robots that fly one at a time." if found.exact else "A cheaper lap was not ruled out."
        )
    return Assignment(robots, total, least, complete, 1, (*notes, *systems.unclear()), tuple(waits))


def _no_team_laps(
    mission: Mission, systems: Systems, each: list[TransitionSystem], budget: Budget, cheapest: Cheapest
) -> Unsatisfiable | Infeasible:
    """Return the error that says why there are no laps."""
    from ltlplan.search.refusals.relaxation import relaxed
    from ltlplan.search.refusals.unsatisfiable_cores import explain

    def possible(parts: Sequence[Formula], worlds: Sequence[TransitionSystem]) -> bool:
        if len(worlds) < len(each) and any(part.counts for part in parts):
            return False  # what is said of all robots says nothing of some of them
        try:
            if (shared := parts_of(mission, all_of(parts))) is not None:
                return share_out(mission, worlds, shared, budget, longest=False) is not None
            return team_lasso_exists(mission, worlds, all_of(parts), budget, together=False)
        except (TooLarge, Infeasible):
            return True  # not known to be impossible

    asked, waits = asked_of(mission, each), False
    if parts_of(mission, asked) is None:
        try:
            waits = not reads_letters(mission, asked) or team_lasso_exists(mission, each, asked, budget, together=True)
        except TooLarge:
            waits = True
    if waits:
        return Infeasible(
            "No laps were found in which one robot flies at a time while the others rest, in regions or at their starts. Others may exist, "
            "in which robots hover outside all regions for one another, or are read in a lap where they only rest: these are not planned. Give such "
            "a place a region of its own, or let the formula come true in flight."
        )
    return relaxed(mission, explain(mission, systems, each, feasible=possible), cheapest)


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
