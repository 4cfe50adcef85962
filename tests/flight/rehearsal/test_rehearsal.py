"""Rehearsals: a table of cells, the same whoever does the work, and honest about who leaves the tube."""

from __future__ import annotations

import json

import pytest

import flight
from flight import Combinations, MotionCapture
from flight.model.airframe import airframe_of
from ltlplan.report.rehearsal import rehearsal_html
from tests.helpers.motion.flights import legs, plan_of, small_mission
from tests.helpers.motion.stand_ins import hop, rest_to_rest, stand_in
from verify import certify
from verify.data import BadInput, Visit, load_vehicle

FEW = Combinations(("mellinger", "lee", "pid"), (0.8, 1.0), (0.015,), ("0", "0.3+0.2"))


def short_hop():
    plan, team = hop()
    start = team["quad0"].evaluate(0)[:3]
    return plan, {"quad0": rest_to_rest([start, (start[0] - 0.15, start[1], start[2])], [0.6])}


@pytest.fixture(scope="module")
def found():
    plan, team = short_hop()
    return flight.rehearse(plan, team, stand_in(plan, team), combinations=FEW, runs=2)


def test_every_combination_has_its_cell(found):
    assert len(found.cells) == 3 * 2 * 1 * 2
    assert found.controllers == FEW.controllers
    assert [(cell.mass, cell.wind) for cell in found.of("lee")] == [(0.8, "0"), (0.8, "0.3+0.2"), (1.0, "0"), (1.0, "0.3+0.2")]


def test_the_table_says_who_leaves_the_tube(found):
    assert all(cell.inside for cell in found.of("mellinger") if cell.mass == 1.0)
    assert not any(cell.inside for cell in found.of("pid"))
    wrong, right = found.of("lee")[0], found.of("lee")[2]
    assert wrong.worst > 0.05 > right.worst
    rows = found.rows()
    assert rows[0] == ["controller", "mass", "15 ms, 0 m/s", "15 ms, 0.3+0.2 m/s"]
    assert all(cell.endswith("*") for row in rows if row[0] == "pid" for cell in row[2:])
    assert any("lee stayed in the tube of 0.05 m in 2 of 4 cells" in sentence for sentence in found.sentences)


def test_a_cell_is_the_worst_of_flights_that_anyone_can_fly_again(found):
    plan, team = short_hop()
    cell = found.of("mellinger")[-1]
    sensor = flight.MotionCapture(delay=0.015)
    worst = max(
        float(flight.fly(plan, team, controller="mellinger", noise=sensor, wind="0.3+0.2", seed=seed).peak[0])
        for seed in (0, 1)
    )
    assert cell.worst == pytest.approx(worst, abs=1e-4)


def test_findings_are_plain_data_and_a_page(found):
    data = json.loads(json.dumps(found.to_dict()))
    assert len(data["cells"]) == 12
    assert {"controller", "mass", "latency", "wind", "drag", "worst", "robot", "seed", "left", "inside"} == set(
        data["cells"][0]
    )
    page = rehearsal_html(found)
    assert "<h1>two-tasks: rehearsal of 12 cells of 2 flights</h1>" in page
    assert page == rehearsal_html(found)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"controllers": ("mellingr",)}, "Did you mean 'mellinger'"),
        ({"controllers": ()}, "at least one of its controllers"),
        ({"masses": (0.03,)}, "0.5 to 1.5, not 0.03"),
        ({"masses": (1.0, 1.0)}, "each once"),
        ({"latencies": (15.0,)}, "latencies are 0 to 0.2 s"),
        ({"winds": ("breeze",)}, "is no wind"),
        ({"winds": ("1", "1.0,0,0")}, "at least one of its winds, each once"),
    ],
)
def test_combinations_that_cannot_be_flown_are_refused(given, said):
    with pytest.raises(BadInput, match=said):
        Combinations(**given)


def test_numbers_out_of_range_are_refused():
    plan, team = hop()
    with pytest.raises(BadInput, match="1 to 1000 times"):
        flight.rehearse(plan, team, runs=0)
    with pytest.raises(BadInput, match="workers must be at least 1"):
        flight.rehearse(plan, team, workers=0)
    with pytest.raises(BadInput, match="a seed is a whole number"):
        flight.rehearse(plan, team, seed=-1)


def brushless():
    """A short way at a speed at which drag is felt."""
    mission = small_mission("F G a", margin=0.05).changed(vehicle=load_vehicle("crazyflie-brushless"))
    plan = plan_of(mission, {"r0": [Visit(region="a")]})
    return plan, {"r0": legs([[0, 0, 1], [0.5, 0, 1], [1, 0, 1]], speed=0.5)}


@pytest.mark.slow
def test_a_drag_that_is_a_guess_is_flown_at_both_ends_of_its_range():
    plan, team = brushless()
    few = Combinations(("mellinger",), (1.0,), (0.015,), ("0",))
    found = flight.rehearse(plan, team, certify(plan, team), combinations=few, runs=1)
    by_drag = {cell.drag: cell for cell in found.cells}
    assert list(by_drag) == ["profile", "least", "most"]
    assert by_drag["least"].worst < by_drag["profile"].worst < by_drag["most"].worst
    assert (by_drag["profile"].inside, by_drag["most"].inside) == (True, False)
    assert [row[0] for row in found.rows()[1:]] == ["mellinger", "mellinger, least drag", "mellinger, most drag"]
    assert "leaves its tube in 1 of 1 cells with the most drag that may be, and not with the profile's" in found.sentences[1]
    assert "is a guess (2e-06 kg; 1e-06 to 5.1e-06 may be), and it decides" in found.sentences[2]
    flown = flight.fly(
        plan,
        team,
        controller="mellinger",
        noise=MotionCapture(delay=0.015),
        airframe=airframe_of(plan.mission.vehicle).with_drag("most"),
    )
    assert by_drag["most"].worst == pytest.approx(float(flown.peak[0]), abs=1e-4)


def test_a_team_whose_drag_was_measured_is_flown_with_it_alone(found):
    assert {cell.drag for cell in found.cells} == {"profile"}
    assert found.doubts == ()


def test_the_controller_does_not_know_of_another_drag():
    """The geometric controller compensates the profile's drag, so that another one costs it way."""
    plan, team = brushless()
    few = Combinations(("geometric",), (1.0,), (0.0,), ("0",), ("profile", "most"))
    right, wrong = flight.rehearse(plan, team, combinations=few, runs=1).cells
    assert wrong.worst > 2 * right.worst


def test_what_is_a_guess_is_said_of_every_flight_and_in_every_note(tmp_path):
    plan, team = brushless()
    guess = "drag of 'crazyflie-brushless' is a guess"
    assert any(guess in note for note in flight.fly(plan, team).notes)
    flight.export(team, certify(plan, team), tmp_path, format="ros2", force=True)
    assert guess in (tmp_path / "README.txt").read_text()


def test_a_range_that_does_not_hold_the_drag_is_refused():
    ours = airframe_of(load_vehicle("crazyflie-brushless"))
    with pytest.raises(BadInput, match="is not within its drag_range"):
        ours.changed(rotor_drag=6e-6)
    with pytest.raises(BadInput, match="the least comes first"):
        ours.drag_range.changed(rotor_drag=(2e-6, 1e-6))
    with pytest.raises(BadInput, match="'more' is not a drag"):
        Combinations(drags=("more",))
