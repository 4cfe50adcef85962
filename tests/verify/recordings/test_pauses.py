"""Recorded flights in parts: held against the plan with the pauses that there were."""

from __future__ import annotations

import numpy as np
import pytest

from tests.flight.exports.test_parts import BALLS, POINTS, cut
from tests.helpers.flights import legs, plan_of, small_mission
from tests.verify.test_run_folder import write_folder
from verify import certify, check_flight
from verify.data import BadInput, NotCertified, Trajectory
from verify.data.plan import Visit
from verify.recordings.asked import asked_of
from verify.recordings.flight_log import Samples


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    mission = small_mission("F a & F b", regions=BALLS, margin=0.05)
    plan = plan_of(mission, {"r0": [Visit(region="a"), Visit(region="b")]})
    team = {"r0": cut(legs(POINTS), 1, 2)}
    return write_folder(tmp_path_factory.mktemp("run") / "out", plan, team, certify(plan, team)), team["r0"]


def flown(path: Trajectory, pauses: tuple[float, ...]) -> Samples:
    real = path.paused(pauses)
    times = np.arange(0.0, real.duration, 0.02)
    return Samples(times, {"r0": real.evaluate(times)[:, :3]})


def test_a_flight_with_pauses_satisfies_what_its_parts_are_certified_for(folder) -> None:
    place, path = folder
    samples = flown(path, (3.5, 0.0))
    judged = check_flight(samples, asked_of(place, (3.5, 0.0)), max_speed=1.5, start=0.0)
    assert judged.outcome == "holds"
    assert check_flight(samples, asked_of(place), max_speed=1.5, start=0.0).outcome != "holds"
    assert check_flight(samples, asked_of(place, (0.0, 3.5)), max_speed=1.5, start=0.0).outcome != "holds"


def test_pauses_that_there_cannot_be_are_refused(folder) -> None:
    place, path = folder
    with pytest.raises(BadInput, match="1 pauses are given; the flight is in 3 parts, so 2 are asked for"):
        asked_of(place, (3.5,))
    with pytest.raises(BadInput, match="A pause must be a number"):
        asked_of(place, (-1.0, 0.0))
    with pytest.raises(BadInput, match="no certified run"):
        asked_of(place / "mission.yaml", (1.0, 1.0))
    with pytest.raises(BadInput, match="Pauses between laps"):
        cut(legs([POINTS[0], POINTS[1], POINTS[0]], cycle=0), 0).paused((1.0,))
    assert path.paused((0.0, 0.0)) == Trajectory(path.durations, path.coefficients)


def test_pauses_that_outlast_an_endurance_are_not_proved(tmp_path) -> None:
    mission = small_mission("F a & F b", regions=BALLS, margin=0.05)
    mission = mission.model_copy(update={"vehicle": mission.vehicle.changed(endurance=100.0)})
    plan = plan_of(mission, {"r0": [Visit(region="a"), Visit(region="b")]})
    team = {"r0": cut(legs(POINTS), 2)}
    place = write_folder(tmp_path / "out", plan, team, certify(plan, team))
    with pytest.raises(NotCertified, match="with these pauses the flight is not proved"):
        asked_of(place, (90.0,))
