"""An order of visits in which nobody rests where another one comes to rest."""

from __future__ import annotations

import pytest

from ltlplan import plan
from ltlplan.pipeline import certified_team
from refine.coordination.visit_ordering import Turns
from tests.helpers.missions.worlds import world
from tests.helpers.motion.plans_by_hand import ball, room, straight
from verify.data import Plan
from verify.data.plan import Meeting, Precedence
from verify.data.sections import Agent

GATE, EAST, NORTH = (0.0, 0.0, 1.0), (2.0, 0.0, 1.0), (0.0, 2.0, 1.0)
STARTS = {"a": (-1.0, 0.0, 1.0), "b": (-2.0, 0.3, 1.0), "c": (-2.0, 1.8, 1.0)}


def team(**ways: tuple[tuple[float, float, float], ...]) -> Plan:
    """Return a plan of robots that visit places in turn: the gate, which has room for one, and places beyond."""
    regions = {"gate": ball(0, 0, 0.2), "east": ball(2, 0, 0.2), "north": ball(0, 2, 0.2)}
    names = {GATE: "gate", EAST: "east", NORTH: "north"}
    robots = {
        name: straight(STARTS[name], *places, visits={i + 1: names[place] for i, place in enumerate(places)})
        for name, places in ways.items()
    }
    return Plan(mission=room(regions, {name: Agent(start=STARTS[name]) for name in ways}), robots=robots)


def order(made: Plan) -> list[tuple[str, int]] | None:
    return Turns(made, 0.5, 1.0).order()


def test_who_ends_in_a_small_place_comes_to_it_last() -> None:
    assert order(team(a=(GATE,), b=(GATE, EAST))) == [("b", 0), ("b", 1), ("a", 0)]


def test_two_robots_that_end_at_one_place_have_no_order() -> None:
    assert order(team(a=(GATE,), b=(GATE,))) is None


def test_an_order_keeps_meetings_and_precedences() -> None:
    made = team(a=(GATE, EAST), c=(NORTH,))
    meeting = Meeting(first=("a", 1), then=("c", 0))
    wait = Precedence(first=("a", 0), then=("c", 0))
    for waits in ({"meetings": (meeting,)}, {"precedences": (wait,)}):
        assert order(made.model_copy(update=waits)) == [("a", 0), ("a", 1), ("c", 0)]
    circle = (meeting, Meeting(first=("c", 0), then=("a", 0)))
    assert order(made.model_copy(update={"meetings": circle})) is None


def test_as_few_robots_as_can_be_rest_in_a_way() -> None:
    """Robot a starts between the gate and b: it flies first, though its name is the later one."""
    made = team(b=(GATE, EAST), a=(NORTH,))
    assert order(made) == [("a", 0), ("b", 0), ("b", 1)]


def test_only_visits_in_each_others_way_wait() -> None:
    made = team(a=(GATE,), b=(GATE, EAST), c=(NORTH,))
    turns = Turns(made, 0.5, 1.0)
    found = turns.order()
    assert found is not None
    meetings = turns.meetings(found)
    assert meetings == (Meeting(first=("b", 1), then=("a", 0)),)
    assert not any("c" in (meeting.first[0], meeting.then[0]) for meeting in meetings)


@pytest.mark.parametrize(
    ("ways", "shared"), [({"a": (GATE,), "b": (GATE, EAST)}, True), ({"a": (EAST,), "c": (NORTH,)}, False)]
)
def test_it_is_told_whether_robots_share_a_place(ways: dict[str, tuple[tuple[float, float, float], ...]], shared: bool) -> None:
    assert Turns(team(**ways), 0.5, 1.0).share_places() == shared


@pytest.mark.slow  # two seconds: departures and other places are tried before
def test_robots_that_wait_for_each_other_to_leave_a_small_region_take_turns() -> None:
    """Both are at home once, which has room for one, and come to it through the hazard, where both are together."""
    places = {"home": (0.23, 0.17), "hazard": (-1.05, -0.2), "gate": (-1.46, 1.05)}
    mission = world(
        "each(F home) & F all(hazard)",
        robots=2,
        regions=places,
        radii={"home": 0.2, "hazard": 0.55, "gate": 0.25},
        starts=((-0.58, 1.75), (-0.03, -0.92)),
        team="joint",
        extra="environment: {start: robot, edges: [[robot, gate], [gate, hazard], [hazard, home]]}\nseparation: 0.4\nmargin: 0.05",
    )
    assert certified_team(plan(mission)).certificate.holds
