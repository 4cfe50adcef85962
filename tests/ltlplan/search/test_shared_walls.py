"""Rooms that share a wall: what may be shown there is known when words are planned, and agrees with what the judge says of flights."""

from __future__ import annotations

import pytest

import ltlplan
from ltlplan.pipeline import certified_team
from ltlplan.search.shared_walls import OpenWall
from ltlplan.systems.shared_walls import hold_a_ball
from tests.helpers.few import few_of
from verify.data import Mission, parse_mission
from verify.data.shapes.region import Region

HALL, BATH = "{center: [-1, 0, 1], size: [2, 2, 1.6]}", "{center: [1, 0, 1], size: [2, 2, 1.6]}"


def rooms(
    formula: str, *, bath: str = BATH, more: str = "", trace: str = "finite", team: str = "own", other: str = ""
) -> Mission:
    return parse_mission(
        f"""format: 1
name: rooms
spec: {{formula: "{formula}", trace: {trace}, team: {team}}}
regions:
  hall: {HALL}
  bath: {bath}
{more}
agents:
  q: {{start: [-1.5, 0, 1]}}
{other}
vehicle: crazyflie-2.1
workspace: {{min: [-3, -3, 0.1], max: [3, 3, 3]}}
"""
    )


@pytest.mark.parametrize(
    "formula", ["G (hall | bath) & F bath", "G !free & F bath", "hall U bath", "F (hall & bath)", "F bath & G !(hall & bath)"]
)
def test_what_breaks_at_the_wall_is_refused_with_the_wall_and_what_mends_it(formula: str) -> None:
    with pytest.raises(ltlplan.Unsatisfiable, match=r"'bath' and 'hall' share a wall.*union.*twice the margin"):
        ltlplan.plan(rooms(formula))


@few_of(2, "formula", ["F bath", "F bath & G (bath -> F hall)", "!bath U hall & F bath", "(hall | free) U bath"])
def test_what_holds_whatever_is_shown_at_the_wall_is_planned(formula: str) -> None:
    word = ltlplan.plan(rooms(formula)).robots["q"].word
    assert frozenset({"hall", "bath"}) in word.letters


def test_a_room_that_is_asked_for_after_the_other_is_gone_back_to(pace: float | str) -> None:
    """On the planned letters alone the wall itself would do: both names are shown there."""
    plan = ltlplan.plan(rooms("F (bath & F hall)"), pace=pace)
    assert [visit.region for visit in plan.robots["q"].visits] == ["hall", "bath", "hall"]
    assert certified_team(plan).certificate.holds


def test_infinite_words_and_teams_are_held_to_it_too() -> None:
    with pytest.raises(OpenWall) as refused:
        ltlplan.plan(rooms("G (hall | bath) & G F bath & G F hall", trace="infinite"))
    assert (refused.value.robot, set(refused.value.rooms)) == ("q", {"hall", "bath"})
    beside = "  r: {start: [1.5, 0.6, 1], end: [-1.5, 0.6, 1]}"
    with pytest.raises(ltlplan.Unsatisfiable, match="share a wall"):
        ltlplan.plan(rooms("F (bath & F hall) & G (hall | bath)", other=beside))
    with pytest.raises(OpenWall):
        ltlplan.plan(rooms("F (bath & !hall) & G (hall | bath)", team="joint", other="  r: {start: [2.5, 0.6, 1]}"))
    joint = ltlplan.plan(rooms("F bath & G (hall | bath)", team="joint", other="  r: {start: [1.5, 0.6, 1]}"))
    assert joint.robots["q"].word.letters == (frozenset({"hall"}),)  # r is in the bath all the time, and shows it for both


def test_another_way_is_taken_where_there_is_one(pace: float | str) -> None:
    plan = ltlplan.plan(
        rooms("F bath & G (hall | bath | corridor)", more="  corridor: {center: [0, 1.3, 1], size: [3.6, 1.0, 1.6]}"),
        pace=pace,
    )
    assert [visit.region for visit in plan.robots["q"].visits] == ["hall", "corridor", "bath"]
    assert certified_team(plan).certificate.holds


@pytest.mark.slow
def test_the_union_of_both_rooms_mends_it(pace: float | str) -> None:
    both = f"  house: {{union: [{HALL}, {BATH}]}}"
    assert certified_team(ltlplan.plan(rooms("F bath & G house", more=both), pace=pace)).certificate.holds


@pytest.mark.parametrize(("width", "sure"), [(2.099, False), (2.101, True)])
def test_rooms_that_overlap_by_twice_the_margin_are_left_and_entered_for_sure(
    width: float, sure: bool, pace: float | str
) -> None:
    mission = rooms("F bath & G (hall | bath)", bath=f"{{center: [{2 - width / 2}, 0, 1], size: [{width}, 2, 1.6]}}")
    if sure:
        assert certified_team(ltlplan.plan(mission, pace=pace)).certificate.holds
    else:
        with pytest.raises(ltlplan.Unsatisfiable):
            ltlplan.plan(mission)


def test_balls_in_two_rooms_of_other_shapes() -> None:
    post = Region.model_validate({"center": (0.0, 0.0, 1.0), "cylinder": {"radius": 0.5, "height": 1.0}})
    room = Region.model_validate({"center": (1.0, 0.0, 1.0), "size": (1.2, 1.0, 1.0)})  # from x = 0.4 on
    assert hold_a_ball(post, room, 0.049)
    assert not hold_a_ball(post, room, 0.051)
    shelf = {
        "union": [{"center": (1.0, 0.0, 1.0), "size": (1.0, 1.0, 1.0)}, {"center": (0.25, 0.0, 1.0), "size": (0.5, 1.0, 1.0)}]
    }
    assert hold_a_ball(post, Region.model_validate(shelf), 0.2)  # across the seam of both boxes
