"""The next order of visits for a team whose flight is late, or has no flight: a cut of the planning loop, as any other.

Orders that no flight keeps in time are left out before they are refined, by their straight ways. Of the others a few are refined, those first
that leave most time for their ways.
"""

from __future__ import annotations

from functools import partial

from ltlplan.paths.costs import for_mission
from ltlplan.replanning.checked_plan import plan, plan_or_none
from ltlplan.replanning.cuts import Candidate
from ltlplan.replanning.refusal import Refusal
from ltlplan.replanning.timing.plans_in_time import late_by_straight_ways, orders_in_time, plan_in_order, plans_in_orders
from verify.data import LtlplanError, Mission, NotCertified, Plan
from verify.data.language.formula_reader import parse_formula
from verify.data.plan import Waypoint

_ORDERS = 8
"""Plans with other visits that are refined, at most."""
_NEARLY = 0.5
"""s; an order that is late by less is planned again for the least time."""
_OTHER_ORDER = "The visits are made in another order than the cheapest words make them, whose flight was not certified in time."


def shared_for_time(refusal: Refusal) -> Candidate | None:
    """Return the plan whose robot that flies longest flies least, where a mission's own was too late; None where it was tried, or is late, too.

    Args:
        refusal: A flight that was refused; its formula is bounded in seconds.
    """
    made, mission = refusal.plan, refusal.plan.mission
    if refusal.holds or refusal.tried.since("visits"):
        return None
    other = plan_or_none(_quick(mission), method=made.method, known=refusal.known)
    if other is None or _waypoints(other) == _waypoints(made) or late_by_straight_ways(other):
        return None
    note = "Shared so that the robot that flies longest flies least: the cheapest plan's flight was not in time."
    return _answered(refusal, other, note)


def in_another_order(refusal: Refusal) -> Candidate | None:
    """Return the mission's plan in the next order of visits that may be in time; None where there is none, or enough were tried.

    Args:
        refusal: A flight that was refused, or none that was found; its formula is bounded in seconds.
    """
    made, mission, tried = refusal.plan, refusal.plan.mission, refusal.tried
    before = tried.since("visits")
    if refusal.holds or not mission.timed_parts or len(before) >= _ORDERS or mission.spec.trace == "infinite":
        return None
    make, last = partial(plan, method=made.method, known=refusal.known), before[-1].order if before else ""
    if last and refusal.relaxation.total < _NEARLY and [cut.order for cut in before].count(last) == 1:
        other = plan_in_order(_quick(mission), parse_formula(last), make)
        if other is not None and _waypoints(other) != _waypoints(made):
            return _answered(refusal, other, _OTHER_ORDER, last)
    orders = orders_in_time(mission)
    written = [str(order) for order in orders]
    if last in written:
        orders = orders[written.index(last) + 1 :]
    known = {_stops(made), *(cut.plan for cut in tried.cuts)}
    others = (found for found in plans_in_orders(mission, orders, make) if _stops(found[1]) not in known)
    order, other = next(others, (None, None))
    return None if other is None else _answered(refusal, other, _OTHER_ORDER, str(order))


def _quick(mission: Mission) -> Mission:
    """Return the mission with the least time of the robot that flies longest in place of its costs."""
    return mission.changed(planner=mission.planner.model_copy(update={"objective": "longest", "cost": {"time": 1.0}}))


def _answered(refusal: Refusal, other: Plan, note: str, order: str = "") -> Candidate | None:
    """Return the candidate of other visits, at the mission's own costs."""
    made, mission = refusal.plan, refusal.plan.mission
    other = for_mission(other, mission)
    other = other.model_copy(
        update={"notes": (*other.notes, note), "complete": False, "lower_bound": None, "method": made.method}
    )
    late = refusal.relaxation.total
    return refusal.answered("visits", other, anew=True, plan=_stops(made), late=late, order=order)


def _waypoints(made: Plan) -> list[tuple[Waypoint, ...]]:
    return [robot.waypoints for robot in made.robots.values()]


def _stops(made: Plan) -> str:
    """Return what tells plans apart that visit other places, or in another order."""
    return str({name: (str(robot.word), [visit.region for visit in robot.visits]) for name, robot in made.robots.items()})


def no_other_order(refusal: Refusal) -> LtlplanError:
    """Return the error for a mission whose other orders of visits were refused, too: of the order that misses the least.

    Args:
        refusal: The last plan that was tried, and what was said of it.
    """
    before = refusal.tried.since("visits")
    least = min(before, key=lambda cut: cut.late)
    said = least.why if least.late < refusal.relaxation.total else str(refusal.error)
    number = len(before)
    others = "Another plan was" if number == 1 else f"{number} other plans, most in other orders of visits, were"
    return NotCertified(f"{said} {others} refined, too, and not certified.", refusal.witnesses)
