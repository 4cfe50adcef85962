"""Robots of several airframes in one simulation fly as each would alone, and exports write each for what can hold it."""

import numpy as np
import pytest

import flight
from flight.closed_loop import Setup, steps
from flight.model.reference import sample_reference
from flight.model.sensing import MotionCapture
from flight.model.timing import CONTROL_STEP, SUBSTEPS
from tests.helpers.missions.kinds import mixed
from tests.helpers.motion.flights import legs
from verify.data import load_vehicle


@pytest.mark.parametrize("controller", ["geometric", "paper"])
def test_a_robot_flies_the_same_whatever_is_beside_it(controller):
    path = legs([[0.0, 0.0, 1.0], [0.3, 0.0, 1.0]])
    other = legs([[0.0, 2.0, 1.0], [0.3, 2.0, 1.0]])
    light = flight.airframe_of(load_vehicle("crazyflie-2.1"))
    heavy = flight.airframe_of(mixed("F smoke").vehicle_of("slow"))
    conditions = flight.Conditions("0.3", controller=controller)

    def ends(team, airframes, runs=1):
        reference = sample_reference(team, CONTROL_STEP, SUBSTEPS)
        *_, last = steps(Setup(airframes, reference, conditions), range(runs))
        return last

    both = ends({"a": path, "b": other, "c": path}, (light, heavy, light), runs=2)
    for airframe, team, columns in ((light, path, (0, 2, 3, 5)), (heavy, other, (1, 4))):
        alone = ends({"a": team}, (airframe,))
        for column in columns:
            assert np.array_equal(both.position[:, column], alone.position[:, 0])
            assert both.thrust[column] == alone.thrust[0]
            assert np.array_equal(both.attitude[:, column], alone.attitude[:, 0])


def test_noise_of_a_mixed_team_is_that_of_its_robots():
    team = {"a": legs([[0.0, 0.0, 1.0], [0.3, 0.0, 1.0]]), "b": legs([[0.0, 2.0, 1.0], [0.3, 2.0, 1.0]])}
    light = flight.airframe_of(load_vehicle("crazyflie-2.1"))
    heavy = flight.airframe_of(mixed("F smoke").vehicle_of("slow"))
    reference = sample_reference(team, CONTROL_STEP, SUBSTEPS)
    conditions = flight.Conditions(noise=MotionCapture())
    *_, mixed_end = steps(Setup((light, heavy), reference, conditions), [3])
    *_, light_end = steps(Setup((light,), reference, conditions), [3])
    assert np.array_equal(mixed_end.position[:, 0], light_end.position[:, 0])
    assert not np.array_equal(mixed_end.position[:, 1], light_end.position[:, 1])
