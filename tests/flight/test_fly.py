"""Flights in closed loop: what the log holds, that it is the seed's alone, and that bad input is refused."""

from __future__ import annotations

import numpy as np
import pytest

import flight
from flight.control import CONTROL_STEP
from flight.reference import sample_reference
from flight.sensing import MotionCapture
from flight.simulate import SUBSTEPS, Setup, steps
from tests.flight.flights import flight as made_flight
from tests.flight.flights import mission, rest_to_rest, stand_in
from verify.data import BadInput, NotCertified, load_vehicle


@pytest.fixture(scope="module")
def plan_and_team():
    return made_flight()


@pytest.mark.parametrize("model", ["full", "paper"])
@pytest.mark.parametrize("controller", ["geometric", "paper"])
def test_the_team_stays_near_its_plan_and_its_letters_are_the_planned_words(plan_and_team, model, controller):
    plan, team = plan_and_team
    log = flight.fly(plan, team, stand_in(plan, team), model=model, controller=controller)
    assert log.worst_error() < 0.03
    for name in log.robots:
        assert tuple(letter for _, letter in log.word(name)) == plan.robots[name].word.prefix
    assert log.margin == 0.05
    assert log.certificate is not None


def test_the_same_seed_gives_the_same_log_and_another_seed_another(plan_and_team):
    plan, team = plan_and_team
    conditions = {"wind": "0.3,0.1,0+0.2", "noise": 0.001}
    first, again, other = (flight.fly(plan, team, seed=seed, **conditions) for seed in (3, 3, 4))
    assert first.to_csv() == again.to_csv()
    assert first.to_csv() != other.to_csv()


def test_a_run_among_many_is_bit_for_bit_the_run_alone(plan_and_team):
    _, team = plan_and_team
    short = {name: rest_to_rest([path.evaluate(0)[:3], path.evaluate(9)[:3]], [0.5]) for name, path in team.items()}
    reference = sample_reference(short, CONTROL_STEP, SUBSTEPS)
    setup = Setup(
        flight.airframe_of(load_vehicle("crazyflie-2.1")), reference, flight.Wind((0.4, 0, 0), 0.3), MotionCapture(dropout=0.1)
    )
    together = list(steps(setup, [5, 6, 7]))[-1]
    alone = list(steps(setup, [6]))[-1]
    assert np.array_equal(together.position[:, 2:4], alone.position)
    assert np.array_equal(together.attitude[:, 2:4], alone.attitude)


def test_without_a_certificate_the_log_says_so(plan_and_team):
    plan, team = plan_and_team
    log = flight.fly(plan, team, model="paper")
    assert log.margin is None
    assert any("no certificate" in note for note in log.notes)


def test_a_certificate_of_other_trajectories_is_refused(plan_and_team):
    plan, team = plan_and_team
    certificate = stand_in(plan, team)
    other = {**team, "quad1": rest_to_rest([(1.2, 0.9, 0.8), (0.0, 0.8, 1.0)], [2.6])}
    with pytest.raises(NotCertified, match="does not cover"):
        flight.fly(plan, other, certificate)


def test_a_team_that_is_not_the_missions_is_refused(plan_and_team):
    plan, team = plan_and_team
    with pytest.raises(BadInput, match="quad1"):
        flight.fly(plan, {"quad0": team["quad0"]})


@pytest.mark.parametrize("wind", ["breeze", "1,2", "1+", "nan", "900", "1+-3"])
def test_a_wind_that_is_none_is_refused(plan_and_team, wind):
    plan, team = plan_and_team
    with pytest.raises(BadInput):
        flight.fly(plan, team, wind=wind)


@pytest.mark.parametrize("noise", ["loud", -0.1, 5.0])
def test_a_noise_that_is_none_is_refused(plan_and_team, noise):
    plan, team = plan_and_team
    with pytest.raises(BadInput):
        flight.fly(plan, team, noise=noise)


def test_a_vehicle_without_an_airframe_flies_on_an_estimate_and_the_log_says_so(plan_and_team):
    plan, team = plan_and_team
    vehicle = plan.mission.vehicle.model_copy(update={"name": "homemade"})
    log = flight.fly(plan.model_copy(update={"mission": mission().model_copy(update={"vehicle": vehicle})}), team)
    assert any("homemade" in note for note in log.notes)
    assert log.worst_error() < 0.03
