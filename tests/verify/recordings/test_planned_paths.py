"""What is bounded of planned paths, held against their polynomials."""

import numpy as np
import pytest

from tests.helpers.motion.flights import small_mission, wandering
from verify.data.trajectory import Trajectory
from verify.recordings.planned_paths import planned_paths


def at_ends(trajectory: Trajectory, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a derivative of x, y and z where each piece begins and where it ends. Shapes (pieces, 3)."""
    values = trajectory.derivative_coefficients(order)[:, :3]
    powers = trajectory.durations[:, None] ** np.arange(values.shape[-1])
    return values[..., 0], (values * powers[:, None]).sum(axis=-1)


def flight(seed: int) -> Trajectory:
    """A smooth flight with each piece but the first moved and slowed down, so that places and velocities jump at the joints."""
    rng = np.random.default_rng(seed)
    smooth = wandering(rng, pieces=4)
    coefficients = smooth.coefficients.copy()
    coefficients[1:, :3, 0] += rng.normal(size=(3, 3)) * 0.01
    coefficients[1:, :3, 1] += rng.normal(size=(3, 3))
    return Trajectory(smooth.durations, coefficients)


@pytest.mark.parametrize("seed", range(5))
def test_jumps_and_turns_at_joints_are_those_of_the_polynomials(seed):
    flown = flight(seed)
    mission = small_mission(regions="")
    start = tuple(flown.coefficients[0, :3, 0].tolist())
    agents = {"r0": mission.agents["r0"].model_copy(update={"start": start})}
    path = planned_paths(mission.model_copy(update={"agents": agents}), {"r0": flown})["r0"]
    for order, bounds in ((0, path.jumps), (1, path.turns)):
        first, last = at_ends(flown, order)
        outside = np.zeros((1, 3))
        if order:  # before and after its path the robot stands still
            gaps = np.concatenate([first, outside]) - np.concatenate([outside, last])
        else:
            gaps = np.concatenate([outside, first[1:] - last[:-1], outside])
        true = np.linalg.norm(gaps, axis=1)
        assert np.all(bounds >= true * (1 - 1e-12))
        assert bounds == pytest.approx(true, rel=1e-6, abs=1e-9)
    assert path.joints == pytest.approx(np.r_[0.0, np.cumsum(flown.durations)])
