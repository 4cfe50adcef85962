"""Ways for a team to fly: as planned, and others that are tried where that leaves robots no flights that keep apart."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from refine.coordination.meeting_orders import in_turn, one_at_a_time
from refine.coordination.spacing import spacing_for
from refine.coordination.visit_ordering import Turns
from refine.corridor.legs import HOVERING
from refine.corridor.meeting_places import moved_apart, moved_to_meet
from refine.feedback import Feedback, feedback_of
from verify.data import Infeasible, Plan
from verify.data.plan import Meeting
from verify.data.validation.spacing import Spacing


@dataclass(frozen=True, slots=True)
class Way:
    """Alternative for a team: waits for arrivals (None: as planned), and whether each robot hovers where its ways are short.

    Robots may be kept from giving way to each other on their ways: always, or where they share places.
    """

    sentence: str = ""
    meetings: tuple[Meeting, ...] | None = None
    nearest: bool = True
    gives_way: Literal["never", "to pass", "anywhere"] = "anywhere"


def _as_planned(_plan: Plan, _feedback: Feedback) -> Iterator[Way]:
    yield Way(gives_way="to pass")


def _at_other_places(plan: Plan, _feedback: Feedback) -> Iterator[Way]:
    if plan.meetings or waits_anywhere(plan):
        yield Way("letting robots wait at other places", nearest=False)


def _taking_turns(plan: Plan, feedback: Feedback) -> Iterator[Way]:
    """Yield orders in which nobody rests where another one comes to: visits that are in each other's way one after another, or all."""
    spacing = spacing_for(plan, feedback)
    for nearest in (True, False) if takes_turns(plan) else ():
        try:
            turns = Turns(placed(plan, spacing, nearest=nearest, parted=True), spacing.distance + HOVERING, spacing.z_scale)
        except Infeasible:
            continue
        order = turns.order()
        if order is not None:
            ways = dict.fromkeys((turns.meetings(order), in_turn(plan, order)))
            yield from (Way("letting robots take turns", meetings, nearest, gives_way="never") for meetings in ways)


def _giving_way_in_shared_places(plan: Plan, feedback: Feedback) -> Iterator[Way]:
    if takes_turns(plan) and share_places(plan, spacing_for(plan, feedback)):
        yield Way("letting robots give way")


def _one_at_a_time(plan: Plan, feedback: Feedback) -> Iterator[Way]:
    if plan.meetings and next(_taking_turns(plan, feedback), None) is not None:
        by_name, backwards = (one_at_a_time(plan, last_first=last_first) for last_first in (False, True))
        for meetings, nearest in ((by_name, False), (by_name, True), (backwards, False)):
            yield Way("letting one robot fly at a time between meetings", meetings, nearest)


ALTERNATIVES = (
    _as_planned, _at_other_places, _taking_turns, _giving_way_in_shared_places, _one_at_a_time
)  # fmt: skip
"""Each yields ways for a team to fly, where it applies; they are tried in this order."""
SOON_TRIED = (_as_planned, _at_other_places)
"""Those of them that look for no orders of turns."""


def has_an_order(plan: Plan) -> bool:
    """Tell whether a team's visits can be made one after another so that nobody rests where another one comes to; sooner than by flights.

    Args:
        plan: Who visits what, in laps or once.
    """
    return not takes_turns(plan) or next(_taking_turns(plan, feedback_of(plan, ())), None) is not None


def takes_turns(plan: Plan) -> bool:
    """Tell whether robots may take turns: of a finite flight with a formula, which says where visits may be made."""
    return len(plan.robots) > 1 and bool(plan.mission.spec.formula) and plan.mission.spec.trace == "finite"


def share_places(plan: Plan, spacing: Spacing) -> bool:
    """Tell whether two robots make visits at places too near each other, also where they are moved apart: by turns, or not at all."""
    try:
        apart = placed(plan, spacing, nearest=False, parted=True)
    except Infeasible:
        return False
    return Turns(apart, spacing.distance + HOVERING, spacing.z_scale).share_places()


def placed(plan: Plan, spacing: Spacing, *, nearest: bool, parted: bool = False) -> Plan:
    """Return the plan with ends apart, and where robots meet, or are to be `parted`, visits at places beside each other.

    Args:
        plan: As it was planned.
        spacing: What robots keep.
        nearest: Whether robots exchange those places so that their ways are short.
        parted: Whether robots that do not meet also get places of their own.
    """
    mission, distance = plan.mission, spacing.distance + HOVERING
    waits = parted or len(plan.meetings) > 0
    if mission.written.counts or (waits and mission.spec.formula):  # of laps, without a formula here, places are chosen
        plan = moved_to_meet(plan, distance, spacing.z_scale, nearest=nearest)
    return moved_apart(plan, distance, spacing.z_scale)


def waits_anywhere(plan: Plan) -> bool:
    """Tell whether robots that count wait for each other's events, outside of regions too."""
    return plan.mission.written.counts and len(plan.precedences) > 0
