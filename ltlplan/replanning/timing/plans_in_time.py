"""Plans in other orders of visits, where the cheapest words are too late.

Words are planned without bounds. What their straight ways at the greatest speed say of deadlines is known before any flight: where no order of
visits is in time, the mission is refused, with the least that it misses; words that are late are not refined. Other orders are asked for by a
formula that names the visits in turn.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import reduce

from ltlplan.paths.costs import for_mission
from ltlplan.replanning.timing.horizons import kept_out, too_long
from ltlplan.replanning.timing.returns import impossible_returns
from ltlplan.replanning.timing.timetable import listed_delays, without_one
from ltlplan.replanning.timing.visit_orders import Orders, Routes, likely_travel, planned_routes
from ltlplan.search.explanations.inquiry import all_of
from ltlplan.systems.due_visits import DueVisit, due_visits
from ltlplan.systems.gaps import Travel, straight_travel
from verify.data import BadInput, Infeasible, Mission, Plan, Unsatisfiable
from verify.data.language.formula import TRUE, Formula
from verify.data.language.relaxation import relaxed, tightened, without_idle_bounds
from verify.logic.explanation import show

_STRAIGHT = "by straight ways, from rest at the greatest acceleration and speed"
"""How the bound on times is found."""
_SOONER = "What would help: a later deadline, a start nearer to it, or higher `limits`."

_PLANNED = 20
"""Orders that are planned in search of one, at most."""
_LISTED = 1000
"""Orders that are compared, at most."""

_TO = 0.01
"""s to which the latest start is found."""

MakePlan = Callable[[Mission], Plan]


def plan_in_time(mission: Mission, make: MakePlan) -> Plan:
    """Return the plan of a mission that is bounded in seconds: the cheapest words, or others where these are late by their straight ways.

    Args:
        mission: What is asked.
        make: Plans a mission without bounds.

    Raises:
        Infeasible: No order of visits can be in time.
        Unsatisfiable: No words satisfy what follows for words.
    """
    if why := too_long(mission) or kept_out(mission) or impossible_deadlines(mission) or impossible_returns(mission):
        raise Infeasible(why)
    made = planned_without_bounds(mission, make)
    if not (late := late_by_straight_ways(made)):
        return made
    _, other = next(plans_in_orders(mission, orders_in_time(mission), make), (TRUE, None))
    return made if other is None else other.noting(f"Planned in another order of visits than the cheapest: there {late}.")


def plans_in_orders(mission: Mission, orders: Sequence[Formula], make: MakePlan) -> Iterator[tuple[Formula, Plan]]:
    """Yield plans of the first of some orders, each with its order, but those that are late by their straight ways.

    Args:
        mission: Its formula is bounded in seconds.
        orders: Visits in turn, as formulas.
        make: Plans a mission.
    """
    found = ((order, plan_in_order(mission, order, make)) for order in orders[:_PLANNED])
    return ((order, other) for order, other in found if other is not None and not late_by_straight_ways(other))


def planned_without_bounds(mission: Mission, make: MakePlan, order: Formula = TRUE) -> Plan:
    """Return a mission's plan for a formula without bounds, whose flights are likely to be in time, where there is one.

    Args:
        mission: What is asked.
        make: Plans a mission without bounds.
        order: What is asked beside it, of the order of visits.

    Raises:
        Unsatisfiable: No words satisfy what follows for words.
    """
    asked = without_idle_bounds(mission.written)
    try:
        return _planned_as(tightened(asked), order, make, mission)
    except Unsatisfiable:  # what is asked for seconds may be impossible for ever
        return _planned_as(relaxed(asked), order, make, mission)


def _planned_as(formula: Formula, order: Formula, make: MakePlan, mission: Mission) -> Plan:
    """Return a mission's plan for a formula without bounds in seconds, which says nothing of the costs of the mission's own."""
    asked = formula if order == TRUE else Formula("&", (formula, order))
    to_middles = mission.planner.model_copy(update={"visits": "middle"})  # where a robot is in for longest
    made = for_mission(make(mission.asking(str(asked)).changed(planner=to_middles)), mission)
    note = f"Planned as `{asked}`, bounds in seconds left out; what is said of costs is said of that."
    return made.model_copy(update={"notes": (note, *made.notes), "complete": False, "lower_bound": None})


def plan_in_order(mission: Mission, order: Formula, make: MakePlan) -> Plan | None:
    """Return a mission's plan whose visits are made in an order; None where there is none.

    Args:
        mission: What is asked.
        order: The visits in turn, as a formula without bounds.
        make: Plans a mission without bounds.
    """
    try:
        return planned_without_bounds(mission, make, order)
    except (BadInput, Infeasible, Unsatisfiable):
        return None


def orders_in_time(mission: Mission) -> list[Formula]:
    """Return orders of visits that may be in time, as formulas: those first that leave most time for their ways, then the shortest; none where nothing is known.

    Args:
        mission: Its formula is bounded in seconds.
    """
    visits = due_visits(mission)
    if all(math.isinf(visit.end) for visit in visits):
        return []
    likely = Orders(visits, likely_travel(mission))
    found = sorted(
        itertools.islice(Orders(visits, straight_travel(mission)).in_time(), _LISTED),
        key=lambda routes: (-likely.slowest(routes), likely.length(routes)),
    )
    named = len(mission.agents) > 1
    return list(dict.fromkeys(_formula_of(routes, named=named) for routes in found))


def _formula_of(routes: Routes, *, named: bool) -> Formula:
    """Return the formula, without bounds, that robots make visits in an order."""
    chains: list[Formula] = []
    for name in sorted(routes):
        regions = [region for region, _ in itertools.groupby(stop.region for stop in routes[name])]
        stops = [Formula("name", name=region, robot=name if named else "") for region in regions]
        nothing: list[Formula] = []
        chains += reduce(lambda later, here: [Formula("F", (all_of([here, *later]),))], reversed(stops), nothing)
    return all_of(chains)


def impossible_deadlines(mission: Mission) -> str:
    """Return why no flight can be in time, as sentences, with what would have to be given up; empty where that is not proved."""
    visits, travel = due_visits(mission), straight_travel(mission)
    if not Orders(visits, travel).none_in_time:
        return ""
    parts = tuple(dict.fromkeys(visit.asked for visit in visits))
    each = [tuple(visit for visit in visits if visit.asked == part) for part in parts]
    alone = [
        f"`{show(own[0].asked)}` cannot hold: {_soonest(own, travel)}." for own in each if Orders(own, travel).none_in_time
    ]
    if alone:
        return " ".join([*alone, _SOONER])
    late = Orders(visits, travel).least_late()
    missed = [f"The least that is missed: {listed_delays(late)}."] if late else []
    enough = [part for part in parts if not Orders(tuple(v for v in visits if v.asked != part), travel).none_in_time]
    return " ".join([f"No order of visits keeps all deadlines: {_STRAIGHT}, each is late.", *missed, *without_one(enough)])


def latest_start(mission: Mission) -> float | None:
    """Return how much later a mission may begin until no order of visits can be in time, by straight ways, s; None where that is not known.

    Args:
        mission: Its formula is bounded in seconds; begun at once it may be in time.
    """
    visits, travel = due_visits(mission), straight_travel(mission)
    ends = [visit.end for visit in visits if math.isfinite(visit.end)]

    def late(seconds: float) -> bool:
        later = (replace(visit, begin=max(visit.begin - seconds, 0.0), end=visit.end - seconds) for visit in visits)
        return Orders(tuple(later), travel).none_in_time

    if not ends or late(0.0):
        return None
    low, high = 0.0, max(ends) + 1.0
    while high - low > _TO:
        middle = (low + high) / 2
        low, high = (low, middle) if late(middle) else (middle, high)
    return low


def _soonest(own: tuple[DueVisit, ...], travel: Travel) -> str:
    """Return when a conjunct that cannot be in time comes at the soonest, and how late that is."""
    late = sum((Orders(own, travel).least_late() or {}).values())
    visit, *more = own
    if more:
        return f"{_STRAIGHT}, it comes {late:.3g} s after its deadline"
    nearest, _ = min(visit.places, key=lambda place: travel(place[0], None, place[1]))
    return f"{_STRAIGHT}, {nearest} comes there at {visit.end + late:.3g} s, {late:.3g} s after its deadline"


def late_by_straight_ways(made: Plan) -> str:
    """Return which deadlines no flight of a plan's words keeps, and by how much it misses them at the least; empty where that is not proved."""
    mission = made.mission
    planned = {} if mission.spec.trace == "infinite" else planned_routes(made)  # later laps make the visits again
    visited = {(stop.robot, stop.region) for route in planned.values() for stop in route}
    visits = tuple(visit for visit in due_visits(mission) if visited.intersection(visit.places))
    travel = straight_travel(mission)
    if not planned or not Orders(visits, travel, planned).none_in_time:
        return ""
    late = Orders(visits, travel, planned).least_late()
    return f"{listed_delays(late)} at the least, by straight ways, would be missed" if late else "deadlines would be missed"
