"""Exports that are told of a flight: of this certificate, by the profile's controller, in its tube; or written anyway, with a warning."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

import flight
from flight import conditions_of
from flight.exports.flown import WARNING
from tests.helpers.flights import legs, plan_of, small_mission
from verify import certify
from verify.data import NotCertified
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


@pytest.mark.parametrize("form", ["crazyswarm2", "crazyflie", "px4"])
def test_without_a_flight_nothing_is_written(flown, tmp_path, form):
    _, team, cert, _ = flown
    with pytest.raises(NotCertified, match=r"no simulated flight that stayed in its tube.*anyway=True"):
        flight.export(team, cert, tmp_path / "out", format=form)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("form", "named"), [("crazyswarm2", "crazyflies.yaml"), ("crazyflie", "upload.json")])
def test_what_is_written_anyway_says_so(flown, tmp_path, form, named):
    plan, team, cert, _ = flown
    left = flight.fly(plan, team, cert)
    done = flight.export(team, cert, tmp_path, format=form, flight=left, anyway=True)
    assert done.notes[0] == WARNING
    assert WARNING in (tmp_path / "README.txt").read_text()
    text = (tmp_path / named).read_text()
    assert WARNING in text
    if named.endswith("json"):
        assert json.loads(text)["certificate"] == cert.digest()
    else:
        compile((tmp_path / "fly_mission.py").read_text(), "fly_mission.py", "exec")
        assert WARNING in (tmp_path / "fly_mission.py").read_text()
