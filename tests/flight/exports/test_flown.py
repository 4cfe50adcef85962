"""Exports that are told of a flight: of this certificate, by a controller that the vehicles run, in its tube; or written by force, with a warning."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

import flight
from flight import ExportTarget, Product, conditions_of
from flight.exports.flown import WARNING, require_controllers
from flight.exports.notes import readme
from flight.exports.target import EXPORT_TARGETS, Request
from tests.helpers.motion.flights import legs, plan_of, small_mission
from verify import certify
from verify.data import NotCertified, load_vehicle
from verify.data.airframe import load_airframe
from verify.data.disturbance import Disturbance, StreamedSetpoints
from verify.data.plan import Visit


@pytest.fixture(scope="module")
def flown():
    mission = small_mission("F G a", margin=0.05)
    plan, team = plan_of(mission, {"r0": [Visit(region="a")]}), {"r0": legs([[0, 0, 1], [0.5, 0, 1], [1, 0, 1]])}
    cert = certify(plan, team)
    return plan, team, cert, flight.fly(plan, team, cert, conditions=conditions_of(mission))


def test_a_flight_by_the_profiles_controller_in_its_tube_is_enough(flown, tmp_path):
    _, team, cert, log = flown
    assert log.controllers == ("mellinger",)
    written = flight.export(team, cert, tmp_path, flight=log)
    assert WARNING not in (tmp_path / "README.txt").read_text()
    assert written.digest == cert.digest()


def test_other_flights_are_refused_each_with_its_reason(flown, tmp_path):
    plan, team, cert, log = flown
    ground = flight.fly(plan, team, cert)
    refused = {
        "is meant for the controller 'mellinger', and the flight was flown by 'geometric'": ground,
        "nobody knows whom": replace(log, controllers=None),
        "of another certificate": replace(log, certificate="0" * 64),
        "strayed 51.0 mm from its certified path, and the margin is 50 mm": replace(log, peak=[0.051]),
        "breaks the formula": replace(log, satisfied=False),
    }
    for said, other in refused.items():
        with pytest.raises(NotCertified, match=said):
            flight.export(team, cert, tmp_path / "out", flight=other)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("form", ["crazyswarm2", "crazyflie"])
def test_without_a_flight_nothing_is_written(flown, tmp_path, form):
    _, team, cert, _ = flown
    with pytest.raises(NotCertified, match=r"no simulated flight that stayed in its tube.*force=True"):
        flight.export(team, cert, tmp_path / "out", format=form)
    assert not (tmp_path / "out").exists()


def test_a_flight_by_a_controller_that_the_vehicle_does_not_run_is_no_rehearsal(flown, tmp_path):
    _, team, cert, log = flown
    with pytest.raises(NotCertified, match=r"meant for the controller 'mellinger', and vehicles of px4 run 'px4'.*--force"):
        flight.export(team, cert, tmp_path / "out", format="px4", flight=log)
    assert not (tmp_path / "out").exists()


def test_every_shipped_target_says_which_controllers_its_vehicles_run():
    """A bag goes with no vehicle in particular; Crazyflies and PX4 run what their firmware has."""
    runs = {name: EXPORT_TARGETS.find(name).controllers for name in EXPORT_TARGETS.built_in}
    firmware = ("pid", "mellinger", "lee")
    assert runs == {
        "crazyswarm2": firmware, "crazyflie": firmware, "crazyflie-compressed": firmware, "px4": ("px4",), "ros2": ("profile",)
    }  # fmt: skip


def test_set_points_that_say_less_than_simulation_flew_open_no_export(flown, tmp_path):
    """A bag has no jerk, from which Mellinger's controller turns."""
    _, team, cert, log = flown
    with pytest.raises(
        NotCertified, match=r"'mellinger' of r0.*derivatives up to order 3, and set-points of ros2 hold 2.*force=True"
    ):
        flight.export(team, cert, tmp_path / "out", format="ros2", flight=log)


@pytest.mark.parametrize(
    ("controllers", "refused"),
    [
        ((), "not modelled"),
        (("lee", "pid"), r"meant for the controller 'mellinger', and vehicles of mine run 'lee', 'pid'. Name one of these"),
        (("lee", "mellinger"), None),
        (("profile",), None),
    ],
)
def test_a_target_of_another_package_is_opened_by_flights_of_controllers_that_it_names(flown, tmp_path, controllers, refused):
    _, team, cert, log = flown
    mine = ExportTarget("mine", lambda request: Product({"flight.json": b"{}"}), controllers=controllers)
    if refused is None:
        flight.export(team, cert, tmp_path, format=mine, flight=log)
        assert "controller mellinger" in (tmp_path / "README.txt").read_text()
        return
    with pytest.raises(NotCertified, match=refused):
        flight.export(team, cert, tmp_path, format=mine, flight=log)
    flight.export(team, cert, tmp_path, format=mine, flight=log, force=True)
    assert json.loads((tmp_path / "flight.json").read_text())["warning"] == WARNING
    assert "margin meant for the controller mellinger, which it does not run" in (tmp_path / "README.txt").read_text()


def test_a_target_that_flies_another_controller_says_that_tracking_is_not_proved():
    told = Disturbance(airframe=load_airframe("crazyflie-2.1"), wind=0.05)
    vehicle = load_vehicle("crazyflie-2.1").changed(controller="geometric")
    mission, team = small_mission("F G a", margin=0.05).changed(vehicle=vehicle), {"r0": legs([[0, 0, 1], [1, 0, 1]])}
    target = EXPORT_TARGETS.find("px4")
    for disturbance, said in ((None, False), (told, True)):
        request = Request(mission.changed(disturbance=disturbance), team, 1, 0.05, "digest", {})
        assert ("tracking not proved for this target" in readme(request, target, (), ())) == said
        with pytest.raises(NotCertified, match="vehicles of px4 run 'px4'") as refusal:
            require_controllers(target, request.mission, team, {})
        assert ("Tracking is not proved for this target." in str(refusal.value)) == said


def test_a_target_that_streams_rounded_set_points_says_that_tracking_is_not_proved():
    told = Disturbance(airframe=load_airframe("crazyflie-2.1"), start=0.003)
    mission, team = small_mission("F G a", margin=0.05).changed(disturbance=told), {"r0": legs([[0, 0, 1], [1, 0, 1]])}
    request = Request(mission, team, 1, 0.05, "digest", {})
    rounded = "tracking not proved for this target, as its set-points are streamed and rounded"
    for rate in (50.0, None):
        target = ExportTarget("mine", lambda request: Product({}), controllers=("mellinger",), rate=rate)
        note = readme(request, target, (), ())
        assert (rounded in note) is (rate is not None)
        assert "starting further than 0.003 m from the planned start or not at rest" in note
    assert "0.003" not in readme(Request(mission.changed(disturbance=None), team, 1, 0.05, "digest", {}), target, (), ())


@pytest.fixture(scope="module")
def streamed():
    """A flight of which tracking is proved on set-points without jerk and snap."""
    told = Disturbance(
        airframe=load_airframe("crazyflie-2.1"), sag=0.0, setpoints=StreamedSetpoints(age=(0.0, 0.002), orders=2)
    )
    vehicle = load_vehicle("crazyflie-2.1").changed(controller="geometric")
    mission = small_mission("F a", regions="a: {center: [0.3, 0.0, 1.0], radii: [0.1, 0.1, 0.1]}", margin=0.05)
    mission = mission.changed(vehicle=vehicle, disturbance=told)
    plan, team = plan_of(mission, {"r0": [Visit(region="a")]}), {"r0": legs([[0, 0, 1], [0.3, 0, 1]], speed=0.08)}
    return plan, team, certify(plan, team)


def test_a_stream_within_what_tracking_is_proved_on_is_written_and_says_so(streamed, tmp_path):
    plan, team, cert = streamed
    log = flight.fly(plan, team, cert, conditions=conditions_of(plan.mission))
    assert log.controllers == ("geometric on streamed set-points",)
    assert 0.0 < log.worst_error("r0") < 0.05
    flight.export(team, cert, tmp_path, format="ros2", flight=log)
    note = (tmp_path / "README.txt").read_text()
    assert "not proved" not in note
    assert "tracking is proved where each command follows a set-point that is 0 to 0.002 s old" in note


def test_a_flight_on_other_set_points_opens_no_stream(streamed, tmp_path):
    plan, team, cert = streamed
    with pytest.raises(NotCertified, match="'geometric on streamed set-points', and the flight was flown by 'geometric'"):
        flight.export(team, cert, tmp_path, format="ros2", flight=flight.fly(plan, team, cert))
    with pytest.raises(NotCertified, match="on 50 set-points a second, and the export has 20"):
        flight.export(team, cert, tmp_path, format="ros2", rate=20.0, flight=flight.fly(plan, team, cert))
    flight.export(team, cert, tmp_path, format="ros2", rate=20.0, force=True)
    assert "tracking not proved for this target" in (tmp_path / "README.txt").read_text()


@pytest.mark.parametrize(
    ("sent", "proved"),
    [
        ({"orders": 2}, True),
        ({"orders": 3, "position": 0.0004}, True),
        ({"orders": 2, "position": 0.002}, False),
        (None, False),
    ],
)
def test_a_target_of_another_package_is_proved_within_what_is_stated(streamed, sent, proved):
    plan, team, _ = streamed
    told = plan.mission.disturbance
    mission = plan.mission.changed(disturbance=told.changed(setpoints=told.setpoints.changed(position=0.0005)))
    mine = ExportTarget("mine", lambda request: Product({}), controllers=("geometric",), rate=50.0)
    mine = replace(mine, sent=None if sent is None else StreamedSetpoints(**sent))
    note = readme(Request(mission, team, 1, 0.05, "digest", {}), mine, (), ())
    assert ("tracking not proved" in note) is not proved
    assert ("tracking is proved where" in note) is proved


def test_a_vehicle_without_a_controller_on_board_is_not_written_for_crazyflies_that_fly_by_theirs(tmp_path):
    own = load_vehicle("crazyflie-2.1").changed(name="own", controller=None, autopilot=None)
    mission = small_mission("F G a", margin=0.05).changed(vehicle=own)
    plan, team = plan_of(mission, {"r0": [Visit(region="a")]}), {"r0": legs([[0, 0, 1], [0.5, 0, 1], [1, 0, 1]])}
    cert = certify(plan, team)
    log = flight.fly(plan, team, cert, conditions=conditions_of(mission))
    assert log.controllers == ("geometric",)
    for form in ("crazyswarm2", "crazyflie"):
        with pytest.raises(NotCertified, match=r"'geometric', and vehicles of crazy.* run 'pid', 'mellinger', 'lee'"):
            flight.export(team, cert, tmp_path / form, format=form, flight=log)


def test_every_file_with_room_for_words_says_that_px4_was_not_rehearsed(flown, tmp_path, monkeypatch):
    pytest.importorskip("pymavlink", reason="pymavlink is not installed")
    monkeypatch.setenv("MAVLINK20", "1")
    from pymavlink import mavutil

    _, team, cert, log = flown
    done = flight.export(team, cert, tmp_path, format="px4", flight=log, force=True)
    for path in done.files:
        if path.name not in ("r0.tlog", "manifest.json"):
            assert "not rehearsed with this vehicle's controller" in path.read_text(), path
    log = mavutil.mavlink_connection(str(tmp_path / "r0.tlog"), dialect="common")
    words: dict[int, str] = {}
    while (message := log.recv_match(type="STATUSTEXT")) is not None:
        words[message.id] = words.get(message.id, "") + message.text
    log.close()
    assert words == {1: f"certificate {cert.digest()}", 2: WARNING}


@pytest.mark.parametrize(("form", "named"), [("crazyswarm2", "crazyflies.yaml"), ("crazyflie", "upload.json")])
def test_what_is_forced_says_so(flown, tmp_path, form, named):
    plan, team, cert, _ = flown
    left = flight.fly(plan, team, cert)
    done = flight.export(team, cert, tmp_path, format=form, flight=left, force=True)
    assert done.notes[0] == WARNING
    assert WARNING in (tmp_path / "README.txt").read_text()
    text = (tmp_path / named).read_text()
    assert WARNING in text
    if named.endswith("json"):
        assert json.loads(text)["certificate"] == cert.digest()
    else:
        compile((tmp_path / "fly_mission.py").read_text(), "fly_mission.py", "exec")
        assert WARNING in (tmp_path / "fly_mission.py").read_text()
