"""Refusals name the narrow place, the robots, what was tried and what would help, and nothing that the mission does not have."""

from __future__ import annotations

import pytest

import ltlplan
from ltlplan.pipeline import certified_team
from tests.helpers.few import few_of
from tests.helpers.missions.refused_missions import CASES, strangers
from tests.helpers.missions.room_teams import drawn
from verify.data import BadInput, Infeasible, LtlplanError, Mission, NotCertified, Unsatisfiable, parse_mission
from verify.data.obstruction import Obstruction

SLOW = {
    "a link between parts of a room is too narrow",
    "a robot may not leave a region in a corridor",
    "two regions are too near each other for two robots",
    "two robots swap places between forbidden regions",
    "two robots swap places in a room",
    "the one in front has no place to come out to",
    "a robot is to stay in a corridor",
    "two robots swap places in a tube",
    "robots swap places for ever in a tube",
    "two robots swap ends in a tube",
}


def refusal(mission: Mission) -> LtlplanError:
    """Return why a mission has no certified flight."""
    with pytest.raises((BadInput, Unsatisfiable, Infeasible, NotCertified)) as caught:
        certified_team(ltlplan.plan(mission))
    return caught.value


@few_of(8, "name", [pytest.param(name, marks=pytest.mark.slow) if name in SLOW else name for name in CASES])
def test_a_refusal_says_where_who_and_what_would_help(name: str) -> None:
    case = CASES[name]
    mission = parse_mission(case.text)
    error = refusal(mission)
    said = str(error)
    assert not [piece for piece in case.says if piece not in said], said
    assert not [piece for piece in case.never if piece in said], said
    assert not strangers(mission, said), said
    if isinstance(error, Infeasible) and error.obstruction is not None:
        assert error.obstruction.sentence == said
        assert all(robot in said for robot in error.obstruction.robots)


def test_robots_that_no_sentence_names_are_added() -> None:
    of_two = Obstruction("b's way is shut.", ("a", "b"), tried=("letting robots give way",), helps=("a second door", "a rest"))
    assert of_two.sentence == (
        "b's way is shut. It concerns a. Tried: letting robots give way. What would help: a second door or a rest."
    )
    assert of_two.saying("It is dark.").what == "b's way is shut. It is dark."


@pytest.mark.parametrize("wide", [0.06, 0.1, 0.12])
def test_a_gap_between_forbidden_regions_is_called_too_narrow_where_the_margin_leaves_nothing(wide: float) -> None:
    """By hand: a robot's centre keeps the margin, 0.05 m, from both."""
    case = CASES["regions to keep out of leave a gap that is too narrow"]
    text = case.text.replace("0.64", str(0.6 + wide / 2))
    if wide > 0.1:
        assert ltlplan.plan(parse_mission(text)).cost > 2.8
    else:
        assert f"{wide:g} m wide between 'one' and 'other'" in str(refusal(parse_mission(text)))


@pytest.mark.parametrize(
    ("margin", "wide", "more"),
    [("0.05", 1.1, ""), ("0.026", 0.8, ""), ("0.05", 0.8, ", aside: {center: [0, 0.75, 1], size: [0.3, 0.3, 0.2]}")],
)
def test_what_would_help_in_a_room_with_an_obstacle_helps(margin: str, wide: float, more: str) -> None:
    """By hand: the room leaves half its width less 0.25 m, and the robot needs 0.07 m and twice the margin; it may go by another region."""
    case = CASES["an obstacle leaves a gap in a room"]
    text = case.text.replace("3.9, 0.8", f"3.9, {wide}").replace("4.0]}}\nobst", f"4.0]}}{more}}}\nobst")
    text = text.replace(" & G room", "") if more else text
    assert certified_team(ltlplan.plan(parse_mission(f"{text}\nmargin: {margin}\n"))).certificate.holds


@pytest.mark.slow
@pytest.mark.parametrize("seed", [4 + 7 * k for k in range(1, 8)])
def test_refusals_in_random_rooms_name_what_is_there(seed: int) -> None:
    """Robots that take turns, of which some find no room to."""
    mission, error = drawn(seed).mission(), None
    try:
        certified_team(ltlplan.plan(mission))
    except (Unsatisfiable, Infeasible, NotCertified) as refused:
        error = refused
    assert not strangers(mission, str(error or ""))
    if isinstance(error, Infeasible) and error.witness is not None and error.witness.claim == "separation":
        assert error.obstruction is not None
        assert error.obstruction.helps


def test_what_is_so_of_several_robots_is_said_once() -> None:
    """Two robots whose tracking nobody proves are refused in one sentence, and another one in its own."""
    mission = ltlplan.load_mission("proved-inspection")
    said = str(refusal(mission.changed(vehicle=mission.vehicle.changed(controller="lee"))))
    assert said.count("no proof for this controller") == 1
    assert "quad0: no proof" in said
    assert said.endswith("So it is of quad1.")
