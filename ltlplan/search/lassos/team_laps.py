"""What a team flies for ever, as an assignment: laps that all robots begin together.

`shared_parts`, `team_lassos` and `labels` search; here their answers become itineraries, with what is known of their costs.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from ltlplan.allocation import Itinerary
from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.search.assignment import TIES, Assignment, Cheapest, NoWords, asked_of
from ltlplan.search.explanations.requirements import all_of
from ltlplan.search.lagrangian_bounds import BY_WEIGHTED_SUMS, LeastSum, lower_the_dearest
from ltlplan.search.lassos.conjunct_assignment import Parts, parts_of, share_out
from ltlplan.search.lassos.product_search.cheapest_laps import laps_below, least_of_all_laps
from ltlplan.search.lassos.team_itineraries import team_itineraries, team_meetings
from ltlplan.search.lassos.team_lassos import TeamLasso, plan_team_lasso, team_lasso_exists
from ltlplan.search.lassos.team_readers import reads_letters
from ltlplan.systems.robot_systems import Systems
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Formula, Infeasible, Mission, Unsatisfiable
from verify.data.plan import Meeting

_NOT_RULED_OUT = "A cheaper lap was not ruled out."


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
    found = _cheapest(mission, each, budget)
    if found is None:
        raise NoWords(lambda: _no_team_laps(mission, systems, each, budget, cheapest))
    notes = (*found.notes, *(() if found.proved else (found.gap,)), *systems.unclear())
    return Assignment(found.robots, found.cost, found.least, found.proved, 1, notes, found.waits)


@dataclass(frozen=True, slots=True)
class _Flown:
    """Laps as they are flown.

    Attributes:
        robots: What each robot does.
        waits: Who waits for whom.
        cost: What they pay, in sum or the dearest of them, as is asked.
        notes: How they were found.
        gap: What is said where cheaper laps are not ruled out.
        least: No laps cost less; None where that is not known.
    """

    robots: dict[str, Itinerary]
    waits: tuple[Meeting, ...]
    cost: float
    notes: tuple[str, ...]
    gap: str
    least: float | None

    @property
    def proved(self) -> bool:
        """Whether no laps are cheaper."""
        return self.least is not None and self.cost <= self.least + 2 * TIES


def _flown(mission: Mission, each: Sequence[TransitionSystem], found: TeamLasso, note: str, gap: str) -> _Flown:
    robots, waits = team_itineraries(each, found, mission.spec.repeat), team_meetings(each, found)
    more = ("Robots wait for each other within each lap, as the formula asks.",) if waits else ()
    costs = [robot.cost for robot in robots.values()]
    cost = max(costs) if _is_longest(mission) else sum(costs)
    return _Flown(robots, tuple(waits), cost, (note, *more), gap, found.least)


def _is_longest(mission: Mission) -> bool:
    return mission.planner.objective == "longest"


def _cheapest(mission: Mission, each: Sequence[TransitionSystem], budget: Budget) -> _Flown | None:
    """Return the cheapest laps, by the sum or by the dearest robot, or None where there are none."""
    asked = asked_of(mission, each)
    parts = parts_of(mission, asked)

    by_sums = _by_weighted_sums if _is_longest(mission) else _by_product

    def searched(below: float) -> _Flown | None:
        for at_once in (False, True) if any(own.actions for own in each) else (False,):
            found = laps_below(mission, each, asked, budget, below, at_once=at_once)
            with contextlib.suppress(Infeasible):  # they cannot be said of visits and waits
                gap = _gap(mission, found, at_once=at_once) if found is not None else ""
                return None if found is None else _flown(mission, each, found, _ways(found), gap)
        return None

    if parts is not None:
        best = _shared(mission, each, parts, budget)
        if best is not None and not best.proved:
            best = searched(best.cost - TIES) or best
    else:
        best = searched(math.inf)
        if best is None:
            best = by_sums(mission, each, asked, budget)
        elif best.gap == _NOT_RULED_OUT:
            with contextlib.suppress(Infeasible, TooLarge):
                best = min((best, by_sums(mission, each, asked, budget) or best), key=lambda laps: laps.cost)
    if best is None or best.proved:
        return best
    least = least_of_all_laps(mission, each, asked, budget, best.cost)
    return best if least is None else replace(best, least=max(least, best.least or 0.0))


def _gap(mission: Mission, found: TeamLasso, *, at_once: bool) -> str:
    """Return what is said of laps that were searched for, where cheaper ones are not ruled out."""
    if not found.exact:
        return _NOT_RULED_OUT
    if at_once:
        return "Robots act where they come to before others go on; a cheaper lap was not ruled out."
    return f"The cheapest laps{', by the dearest robot,' * _is_longest(mission)} of robots that fly one at a time."


def _by_product(mission: Mission, each: Sequence[TransitionSystem], asked: Formula, budget: Budget) -> _Flown | None:
    """Return laps with a small sum of costs, or None where there are none."""
    found = plan_team_lasso(mission, each, asked, budget)
    return None if found is None else _flown(mission, each, found, _places(found), _NOT_RULED_OUT)


def _shared(mission: Mission, each: Sequence[TransitionSystem], parts: Parts, budget: Budget) -> _Flown | None:
    """Return laps of robots to which the parts of the formula are given, or None where there are none."""
    shared = share_out(mission, each, parts, budget, longest=_is_longest(mission))
    if shared is None:
        return None
    found = TeamLasso(shared.prefixes, shared.laps, None, shared.least, shared.least is not None, shared.lassos)
    return _flown(
        mission,
        each,
        found,
        f"The parts of the formula were shared out, by {shared.lassos:,} lassos of single robots.",
        _NOT_RULED_OUT,
    )


def _by_weighted_sums(mission: Mission, each: Sequence[TransitionSystem], asked: Formula, budget: Budget) -> _Flown | None:
    """Return laps whose dearest robot pays less than in those of the least sum, or None where there are none."""

    def search(worlds: Sequence[TransitionSystem]) -> LeastSum[TeamLasso] | None:
        product = plan_team_lasso(mission, worlds, asked, budget)
        if product is None:
            return None
        robots = team_itineraries(each, product, mission.spec.repeat)
        paths = tuple((*once, *lap) for once, lap in zip(product.prefixes, product.laps, strict=True))
        return LeastSum(product, tuple(robot.cost for robot in robots.values()), paths, product.least)

    first = search(each)
    if first is None:
        return None
    best, bound = lower_the_dearest(each, first, search)
    return replace(_flown(mission, each, best.plan, _places(best.plan), BY_WEIGHTED_SUMS), least=bound)


def _ways(found: TeamLasso) -> str:
    return f"A search went on with {found.reached:,} ways over the team's product, in which one robot flies at a time."


def _places(found: TeamLasso) -> str:
    return f"The search reached {found.reached:,} places of the team's product, in which one robot flies at a time."


def _no_team_laps(
    mission: Mission, systems: Systems, each: list[TransitionSystem], budget: Budget, cheapest: Cheapest
) -> Unsatisfiable | Infeasible:
    """Return the error that says why there are no laps."""
    from ltlplan.search.explanations.relaxation import relaxed
    from ltlplan.search.explanations.unsatisfiable_cores import explain

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
