"""When a flight began, fitted to a plan along a straight line at 1 m/s: each second of shift is one metre."""

import numpy as np
import pytest

from tests.helpers.few import few_of
from tests.helpers.live.recordings import along_x
from verify.recordings.alignment import fitted

STEP = 0.05


def fit(shift: float, error: float = 0.0):
    """Fit a recording of the middle of the flight, which began `shift` s after the recording's clock."""
    times = np.arange(3.0, 7.0, STEP)
    positions = np.stack([times - shift, np.zeros_like(times), np.zeros_like(times)], axis=1)
    return fitted(times, {"r0": positions}, {"r0": along_x()}, error=error, clock_error=0.0)


@few_of(5, "shift", np.random.default_rng(0).uniform(-0.5, 0.5, 20).tolist())
def test_the_best_shift_is_found_to_a_fortieth_of_a_millisecond(shift):
    assert fit(shift).fitted == pytest.approx(shift, abs=2.5e-5)


@pytest.mark.parametrize("error", [0.001, 0.02, 0.1, 0.3])
def test_shifts_that_the_error_explains_and_half_a_sample_are_kept(error):
    found = fit(0.25, error)
    room = error + STEP / 2
    assert not found.trusted
    assert found.low == pytest.approx(0.25 - room, abs=3e-4)
    assert found.high == pytest.approx(0.25 + room, abs=3e-4)
