"""Which samples belong to the judged time."""

import numpy as np
import pytest

from verify.recordings.reachable_sets import Bounds, track


@pytest.mark.parametrize(
    ("start", "stop", "wanted"), [(1.0, 3.0, [1.0, 2.0, 3.0]), (0.5, 3.5, [1.0, 2.0, 3.0]), (1.5, 2.0, [2.0])]
)
def test_samples_at_both_ends_of_the_judged_time_belong_to_it(start, stop, wanted):
    times = np.arange(6.0)
    one = track("r0", times, np.zeros((6, 3)), Bounds(speed=1.0, error=0.0), start=start, stop=stop)
    assert one.times[one.samples].tolist() == wanted


def test_what_stands_for_a_sample_is_none():
    one = track("r0", np.array([1.0, 2.0]), np.zeros((2, 3)), Bounds(speed=1.0, error=0.0), start=0.0, stop=4.0)
    assert one.times[one.samples].tolist() == [1.0, 2.0]
    assert len(one.times) == 4
