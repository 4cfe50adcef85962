"""The claim `tracking`: proved, proved again from files, and refused in words."""

from __future__ import annotations

import dataclasses
import json
import re

import numpy as np
import pytest

from tests.helpers.motion.flights import legs, plan_of, small_mission
from tests.helpers.motion.small_flights import turning
from verify import certify, judge, recheck
from verify.certificate import payload_digest
from verify.data import NotCertified, Trajectory
from verify.data.airframe import load_airframe
from verify.data.autopilot import load_autopilot
from verify.data.disturbance import Disturbance, StreamedSetpoints, Unrest
from verify.data.files.mission_file import load_mission_file, mission_to_yaml
from verify.data.files.trajectory_csv import write_csv
from verify.data.plan import Visit
from verify.data.vehicle import load_vehicle

GENTLE = Disturbance(airframe=load_airframe("crazyflie-2.1"), wind=0.05, mass=0.002, gyroscope=0.002)


def flight(told: Disturbance | None = GENTLE, *, controller: str = "geometric", margin: float = 0.05, **changes):
    mission = small_mission("F a", regions="a: {center: [0.5, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}", margin=margin)
    vehicle = load_vehicle("crazyflie-2.1").changed(controller=controller)
    mission = mission.changed(vehicle=vehicle, disturbance=told, **changes)
    return plan_of(mission, {"r0": [Visit(region="a")]}), {"r0": legs([[0, 0, 1], [0.5, 0, 1]], speed=0.15)}


def claim_of(certificate):
    (claim,) = (claim for claim in certificate.claims if claim.name == "tracking")
    return claim


def test_a_flight_is_proved_to_stay_within_its_margin():
    certificate = certify(*flight())
    claim = claim_of(certificate)
    assert claim.outcome == "holds"
    assert 0.001 < claim.bound < claim.limit == 0.05
    assert 0 <= claim.time <= certificate.duration
    assert "geometric" in claim.sentence
    assert "Assumed: a start at rest in hover" in claim.sentence
    assert (
        "wind 0.05 m/s, gyroscope 0.002 rad/s, mass 0.2 %, thrust that changes by at most 0.2 % in the flight" in claim.sentence
    )
    assert "rotors that reach 100 % of their greatest speed" in claim.sentence
    assert certificate.tube == "proved"


STREAMED = GENTLE.changed(
    setpoints=StreamedSetpoints(age=(0.0, 0.004), orders=3, position=0.0005, heading=0.001),
    rest=Unrest(speed=0.005, summed=0.01),
)


def test_streamed_set_points_and_starts_off_rest_are_named():
    own = claim_of(certify(*flight(STREAMED)))
    assert own.outcome == "holds"
    assert (
        "with set-points, by `geometric`, that are streamed at 50 Hz, 0 to 0.004 s old, without derivatives above the order 3, "
        "rounded by at most 0.0005 m, 0.001 rad of heading" in own.sentence
    )
    assert re.search(r"set-points \d\.\d mm", own.sentence)
    assert "a start within 0.005 m/s of a hover at rest, summed errors within 0.01 m/s^2" in own.sentence
    assert own.bound > claim_of(certify(*flight())).bound


def test_a_larger_rounding_is_refused_of_a_certificate_that_states_less(folder):
    plan, team = flight(STREAMED)
    (folder / "mission.yaml").write_text(text := mission_to_yaml(plan.mission))
    (folder / "plan.json").write_text(plan.to_json())
    (folder / "certificate.json").write_text(certify(plan, team).to_json())
    assert recheck(folder).tube == "proved"
    for stated, other in (("position: 0.0005", "position: 0.001"), ("orders: 3", "orders: 2"), ("speed: 0.005", "speed: 0.05")):
        assert stated in text
        (folder / "mission.yaml").write_text(text.replace(stated, other))
        with pytest.raises(NotCertified, match="mission"):
            recheck(folder)


@pytest.mark.slow
def test_set_points_that_are_rounded_too_coarsely_are_refused_with_the_share_that_would_hold():
    sentence = refused(*flight(STREAMED.changed(setpoints=StreamedSetpoints(position=0.05))))
    assert "% of these disturbances would hold" in sentence


@pytest.mark.parametrize("name", ["setpoints", "rest"])
def test_what_the_proof_of_mellinger_has_not_is_refused(name):
    told = FAINT.changed(**{name: getattr(STREAMED, name)})
    assert f"`{name}`" in refused(*on_board(told))


FAINT = GENTLE.scaled(0.2)


def on_board(told: Disturbance = FAINT, heading: float = 0.0, way: float = 0.0):
    """Return a hover under `mellinger`, or a short way, by a filter that drops no correction."""
    mission = small_mission("F a", regions="a: {center: [0.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}", margin=0.05)
    stock = load_autopilot("crazyflie-2")
    quick = stock.changed(ekf=stock.ekf.changed(least_turn=0.0))
    vehicle = load_vehicle("crazyflie-2.1").changed(controller="mellinger", autopilot=quick)
    coefficients = np.zeros((1, 4, 8))
    coefficients[0, 2:, 0] = 1.0, heading
    coefficients[0, 0, 4:] = way * np.array([35.0, -84.0, 70.0, -20.0])
    mission = mission.changed(vehicle=vehicle, disturbance=told)
    return plan_of(mission, {"r0": [Visit(region="a")]}), {"r0": Trajectory([1.0], coefficients)}


def test_a_hover_under_mellinger_on_its_filter_is_proved():
    certificate = certify(*on_board())
    claim = claim_of(certificate)
    assert claim.outcome == "holds"
    assert 0.0001 < claim.bound < claim.limit == 0.05
    assert "set-points of polynomials on board at 100 Hz, by `mellinger` on its filter" in claim.sentence
    assert "the filter's covariance settled" in claim.sentence
    assert certificate.tube == "proved"


@pytest.mark.slow  # two more proofs of a second each
def test_a_slow_way_under_mellinger_on_its_filter_is_proved():
    claim, still = claim_of(certify(*on_board(way=0.01))), claim_of(certify(*on_board()))
    assert claim.outcome == "holds"
    assert still.bound + 0.0001 < claim.bound < claim.limit
    assert 0.3 < claim.time < 1.0


def test_other_headings_under_mellinger_are_refused():
    assert "at other headings than 0" in refused(*on_board(heading=0.3))


@pytest.mark.slow
def test_hovers_under_mellinger_are_refused_with_what_stands_in_the_way():
    sentence = refused(*on_board(GENTLE.changed(wind=0.8)))
    assert "the bounds do not close" in sentence
    assert "% of these disturbances would hold" in sentence


def test_without_disturbances_the_tube_is_assumed():
    certificate = certify(*flight(None))
    assert certificate.tube == "assumed"
    assert not any(claim.name == "tracking" for claim in certificate.claims)
    assert certificate.to_dict()["tube"] == "assumed"


def test_one_robot_of_which_it_is_not_proved_leaves_the_tube_assumed():
    certificate = certify(*flight())
    lacking = dataclasses.replace(claim_of(certificate), robot="r1", outcome="undecided")
    assert dataclasses.replace(certificate, claims=(*certificate.claims, lacking)).tube == "assumed"


def refused(plan, team) -> str:
    claim = claim_of(judge(plan, team))
    assert claim.outcome == "undecided"
    assert claim.witness is not None
    with pytest.raises(NotCertified):
        certify(plan, team)
    return claim.sentence


def test_refusals_say_what_stands_in_the_way():
    assert "no proof for this controller, 'lee'" in refused(*flight(controller="lee"))
    sentence = refused(*flight(margin=0.001))
    assert "more than the margin" in sentence
    assert "% of these disturbances would hold" in sentence
    other = GENTLE.changed(airframe=load_airframe("crazyflie-brushless"))
    assert "another airframe than that of 'crazyflie-2.1'" in refused(*flight(other))
    plan, team = flight()
    assert "heading that turns; write `heading: fixed`" in refused(plan, {"r0": turning(team["r0"], 0.3)})


@pytest.mark.slow
@pytest.mark.parametrize("margin", [0.003, 0.05])
def test_disturbances_that_are_too_much_are_refused_with_the_share_that_would_hold(margin):
    plan, team = flight(GENTLE.changed(wind=1.5), margin=margin)
    sentence = refused(plan, team)
    share = float(sentence.split("; ")[-1].split(" %")[0]) / 100.0
    assert 0.0 < share < 1.0
    told = plan.mission.disturbance.scaled(share)
    assert claim_of(judge(plan.changed(mission=plan.mission.changed(disturbance=told)), team)).outcome == "holds"


@pytest.mark.slow  # a share of all of them, by default, too
def test_the_disturbance_that_is_too_much_is_named_with_what_would_hold_of_it():
    plan, team = flight(GENTLE.changed(wind=1.5))
    size = float(refused(plan, team).split("`wind` is too much: ")[1].split(" m/s would hold")[0])
    assert 0.1 < size < 1.5
    told = plan.mission.disturbance.changed(wind=size)
    assert claim_of(judge(plan.changed(mission=plan.mission.changed(disturbance=told)), team)).outcome == "holds"


def test_one_of_the_disturbances_is_scaled_alone():
    told = STREAMED.changed(latency=(0.002, 0.01))
    assert "airframe" not in told.stated
    assert {"wind", "gyroscope", "latency", "rest", "setpoints"} <= {*told.stated}
    for name in told.stated:
        half = told.scaled(0.5, name)
        assert half.changed(**{name: getattr(told, name)}) == told
        assert getattr(half, name) == getattr(told.scaled(0.5), name) != getattr(told, name)


def test_a_plan_that_is_too_fast_is_refused_by_itself():
    plan, _ = flight()
    assert "not even the plan alone" in refused(plan, {"r0": legs([[0, 0, 1], [0.5, 0, 1]], speed=1.0)})


def test_gains_that_do_not_stabilise_the_vehicle_are_refused_in_one_sentence():
    airframe = GENTLE.airframe
    wild = GENTLE.changed(airframe=airframe.changed(gains=airframe.gains.changed(position=(2000.0, 2000.0))))
    plan, team = flight(wild)
    own = plan.mission.vehicle.changed(name="homemade", autopilot=None)
    sentence = refused(plan.changed(mission=plan.mission.changed(vehicle=own)), team)
    assert (
        "the controller's gains are not shown to stabilise the vehicle; not even a hover without disturbances is proved"
        in sentence
    )


@pytest.fixture
def folder(tmp_path):
    plan, team = flight()
    (tmp_path / "mission.yaml").write_text(mission_to_yaml(plan.mission))
    (tmp_path / "plan.json").write_text(plan.to_json())
    (tmp_path / "r0.csv").write_text(write_csv(team["r0"], 1))
    (tmp_path / "certificate.json").write_text(certify(plan, team).to_json())
    return tmp_path


def test_the_claim_is_proved_again_from_files_which_hold_all_numbers(folder):
    assert recheck(folder).tube == "proved"
    mission = load_mission_file(folder / "mission.yaml")
    assert mission.disturbance.airframe == load_airframe("crazyflie-2.1")


def test_damaged_certificates_are_refused(folder):
    path = folder / "certificate.json"
    written = json.loads(path.read_text())
    (index,) = (k for k, claim in enumerate(written["claims"]) if claim["name"] == "tracking")
    for key, value in (("bound", 0.001), ("time", 0.0), ("limit", 0.06), ("verdict", "fails"), ("robot", "r1")):
        changed = json.loads(json.dumps(written))
        changed["claims"][index][key] = value
        changed["digest"] = payload_digest(changed)
        path.write_text(json.dumps(changed))
        with pytest.raises(NotCertified):
            recheck(folder)
    path.write_text(json.dumps({**written, "tube": "assumed"}))
    with pytest.raises(NotCertified, match="tube"):
        recheck(folder)
    changed = {**written, "claims": [claim for claim in written["claims"] if claim["name"] != "tracking"]}
    changed["digest"] = payload_digest(changed)
    path.write_text(json.dumps(changed))
    with pytest.raises(NotCertified):
        recheck(folder)
    path.write_text(json.dumps(written))
    text = (folder / "mission.yaml").read_text()
    assert "wind: 0.05" in text
    (folder / "mission.yaml").write_text(text.replace("wind: 0.05", "wind: 0.5"))
    with pytest.raises(NotCertified, match="mission"):
        recheck(folder)


def test_missions_name_airframes_and_are_told_what_is_wrong(tmp_path):
    plan, _ = flight()
    text = mission_to_yaml(plan.mission)
    start = text.index("disturbance:")
    rest = text[start:].split("\n", 1)[1]
    end = next(i for i, line in enumerate(rest.split("\n")) if line and not line.startswith(" "))
    before, after = text[:start], "\n".join(rest.split("\n")[end:])
    path = tmp_path / "m.yaml"
    path.write_text(f"{before}disturbance: {{airframe: crazyflie-2.1, wind: 0.2}}\n{after}")
    assert load_mission_file(path).disturbance.wind == 0.2
    for wrong, said in (
        ("{wind: 0.2}", "airframe"),
        ("{airframe: crazyfly, wind: 0.2}", "crazyflie-2.1"),
        ("{airframe: crazyflie-2.1, wind: -1}", "wind"),
    ):
        path.write_text(f"{before}disturbance: {wrong}\n{after}")
        with pytest.raises(Exception, match=said):
            load_mission_file(path)
