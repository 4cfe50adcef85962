"""Recorded flights in parts: held against the plan with the pauses that there were."""

from __future__ import annotations

import numpy as np
import pytest

from tests.flight.exports.test_parts import BALLS, POINTS, cut
from tests.helpers.motion.flights import legs, plan_of, small_mission
from tests.verify.test_run_folder import write_folder
from verify import certify, check_flight
from verify.data import BadInput, NotCertified, Trajectory
from verify.data.plan import Visit
from verify.recordings.flight_log import Samples
from verify.recordings.flight_reference import lap_times, load_reference


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


@pytest.mark.slow
def test_a_flight_with_pauses_satisfies_what_its_parts_are_certified_for(folder) -> None:
    place, path = folder
    samples = flown(path, (3.5, 0.0))
    judged = check_flight(samples, load_reference(place, (3.5, 0.0)), max_speed=1.5, start=0.0)
    assert judged.outcome == "holds"
    assert check_flight(samples, load_reference(place), max_speed=1.5, start=0.0).outcome != "holds"
    assert check_flight(samples, load_reference(place, (0.0, 3.5)), max_speed=1.5, start=0.0).outcome != "holds"


def test_pauses_that_there_cannot_be_are_refused(folder) -> None:
    place, path = folder
    with pytest.raises(BadInput, match="1 pauses are given; the flight is in 3 parts, so 2 are asked for"):
        load_reference(place, (3.5,))
    with pytest.raises(BadInput, match="A pause must be a number"):
        load_reference(place, (-1.0, 0.0))
    with pytest.raises(BadInput, match="no certified run"):
        load_reference(place / "mission.yaml", (1.0, 1.0))
    with pytest.raises(BadInput, match="It has laps; say with `flattened`"):
        cut(legs([POINTS[0], POINTS[1], POINTS[0]], cycle=0), 0).paused((1.0,))
    assert path.paused((0.0, 0.0)) == Trajectory(path.durations, path.coefficients)


def test_pauses_that_outlast_an_endurance_are_not_proved(tmp_path) -> None:
    mission = small_mission("F a & F b", regions=BALLS, margin=0.05)
    mission = mission.model_copy(update={"vehicle": mission.vehicle.changed(endurance=100.0)})
    plan = plan_of(mission, {"r0": [Visit(region="a"), Visit(region="b")]})
    team = {"r0": cut(legs(POINTS), 2)}
    place = write_folder(tmp_path / "out", plan, team, certify(plan, team))
    with pytest.raises(NotCertified, match="with these pauses the flight is not proved"):
        load_reference(place, (90.0,))


LAPS = [POINTS[0], POINTS[1], POINTS[3], POINTS[1]]


def patrol_folder(place, **vehicle):
    """Write three laps from `a` to `b` and back, each uploaded part started anew."""
    mission = small_mission("G F a & G F b", regions=BALLS, margin=0.05, trace="infinite")
    mission = mission.changed(spec={**mission.spec.model_dump(), "repeat": 3}, vehicle=mission.vehicle.changed(**vehicle))
    plan = plan_of(mission, {"r0": [Visit(region="a"), Visit(region="b"), Visit(region="a")]})
    robot = plan.robots["r0"].model_copy(update={"cycle_visit": 1, "cycle_waypoint": 0})
    plan = plan.model_copy(update={"robots": {"r0": robot}})
    team = {"r0": cut(legs(LAPS, cycle=1), 1)}
    return write_folder(place, plan, team, certify(plan, team), 3), team["r0"].flattened(3)


def test_laps_with_pauses_between_them_are_held_against_laps_with_these_pauses(tmp_path) -> None:
    place, laps = patrol_folder(tmp_path / "out")
    samples = flown(laps, (2.0, 0.0, 1.5))
    outcomes = {}
    for pauses in ((), (2.0, 0.0, 1.5), (2.0, 1.5, 0.0)):
        judged = check_flight(samples, load_reference(place, pauses), max_speed=1.5, start=0.0)
        outcomes[pauses] = {claim.name: claim.outcome for claim in judged.claims}
    with_pauses = outcomes[2.0, 0.0, 1.5]
    assert with_pauses.pop("formula") == "undecided", "which is asked of laps for ever"
    assert set(with_pauses.values()) == {"holds"}
    assert outcomes[()]["tube"] == outcomes[2.0, 1.5, 0.0]["tube"] == "fails"
    with pytest.raises(BadInput, match="2 pauses are given; the flight is in 4 parts, so 3 are asked for"):
        load_reference(place, (2.0, 1.5))


def test_pauses_between_laps_that_outlast_an_endurance_are_not_proved(tmp_path) -> None:
    place, _ = patrol_folder(tmp_path / "out", endurance=400.0)
    assert load_reference(place, (100.0, 30.0, 40.0)).team is not None
    with pytest.raises(NotCertified, match=r"they last 190.0 s in all, and its endurance counts 180 s"):
        load_reference(place, (100.0, 50.0, 40.0))


def test_what_happens_in_a_lap_happens_in_each() -> None:
    path = legs(LAPS, cycle=1)
    begin, lap = float(path.knots[1]), path.duration - float(path.knots[1])
    assert lap_times(0.5, path, 3) == (0.5,)
    assert [float(time) for time in lap_times(begin + 0.5, path, 3)] == pytest.approx([begin + 0.5 + k * lap for k in range(3)])
    assert lap_times(9.0, legs(POINTS), 3) == (9.0,)
