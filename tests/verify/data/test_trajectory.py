import numpy as np
import pytest
from numpy.polynomial import polynomial

from verify.data import BadInput, Trajectory


def random_trajectory(seed: int, pieces: int = 4, cycle: int | None = None) -> Trajectory:
    rng = np.random.default_rng(seed)
    return Trajectory(rng.uniform(0.5, 2.0, pieces), rng.normal(size=(pieces, 4, 8)), cycle=cycle)


def test_derivatives_are_those_of_numpy() -> None:
    trajectory = random_trajectory(1)
    for piece in range(len(trajectory)):
        local = np.linspace(0.01, 0.99, 7) * trajectory.durations[piece]
        for derivative in range(10):
            values = trajectory.evaluate(trajectory.knots[piece] + local, derivative)
            for axis in range(4):
                wanted = polynomial.polyval(local, polynomial.polyder(trajectory.coefficients[piece, axis], derivative))
                np.testing.assert_allclose(values[:, axis], wanted, rtol=1e-9, atol=1e-9)


def test_after_the_end_the_robot_hovers() -> None:
    trajectory = random_trajectory(2)
    end = trajectory.evaluate(trajectory.duration)
    np.testing.assert_array_equal(trajectory.evaluate(trajectory.duration + 5.0), end)
    np.testing.assert_array_equal(trajectory.evaluate(trajectory.duration + 5.0, 1), np.zeros(4))


def test_a_cycle_repeats() -> None:
    trajectory = random_trajectory(3, cycle=1)
    lap = trajectory.duration - trajectory.knots[1]
    times = trajectory.knots[1] + np.linspace(0.01, 0.99, 11) * lap
    np.testing.assert_allclose(trajectory.evaluate(times + 2 * lap), trajectory.evaluate(times), rtol=1e-7, atol=1e-7)
    flat = trajectory.flattened(3)
    assert flat.cycle is None
    assert len(flat) == 1 + 3 * 3
    np.testing.assert_allclose(flat.evaluate(times + 2 * lap), trajectory.evaluate(times), rtol=1e-7, atol=1e-7)


def test_arrays_are_read_only_and_copied() -> None:
    values = np.zeros((1, 4, 8))
    trajectory = Trajectory([1.0], values)
    values[0, 0, 0] = 5.0
    assert trajectory.coefficients[0, 0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        trajectory.coefficients[0, 0, 0] = 1.0


def test_the_digest_sees_the_last_bit() -> None:
    trajectory = random_trajectory(4)
    changed = trajectory.coefficients.copy()
    changed[2, 1, 3] = np.nextafter(changed[2, 1, 3], np.inf)
    assert Trajectory(trajectory.durations, changed) != trajectory
    assert Trajectory(trajectory.durations, trajectory.coefficients, cycle=0) != trajectory
    assert Trajectory(trajectory.durations, trajectory.coefficients) == trajectory


def test_float32_is_recognised() -> None:
    trajectory = random_trajectory(5)
    assert not trajectory.is_float32
    assert Trajectory(trajectory.durations.astype(np.float32), trajectory.coefficients.astype(np.float32)).is_float32


@pytest.mark.parametrize(
    ("durations", "coefficients", "says"),
    [
        ([], np.zeros((0, 4, 8)), "at least one piece"),
        ([0.0], np.zeros((1, 4, 8)), r"durations\[0\] is 0.0"),
        ([-1.0], np.zeros((1, 4, 8)), "positive"),
        ([np.inf], np.zeros((1, 4, 8)), "finite"),
        ([1.0], np.full((1, 4, 8), np.nan), r"coefficients\[0, 0, 0\] is nan"),
        ([1.0], np.zeros((1, 4, 9)), "degree at most 7"),
        ([1.0], np.zeros((2, 4, 8)), r"shape \(1, 4, 8\)"),
        (["x"], np.zeros((1, 4, 8)), "array of numbers"),
        (np.ones(5000), np.zeros((5000, 4, 8)), "at most"),
    ],
)
def test_nonsense_is_refused(durations: object, coefficients: object, says: str) -> None:
    with pytest.raises(BadInput, match=says):
        Trajectory(durations, coefficients)  # type: ignore[arg-type]


def test_times_before_the_start_are_refused() -> None:
    with pytest.raises(BadInput, match="not before"):
        random_trajectory(6).evaluate(-0.1)
    with pytest.raises(BadInput, match="finite"):
        random_trajectory(6).evaluate(np.nan)
