"""The tube where the flight's beginning is known within an interval only: outside means outside for every beginning."""

import numpy as np
import pytest

from tests.helpers.recordings import along_x
from verify.recordings.alignment import Alignment
from verify.recordings.tracks import Bounds, track
from verify.recordings.tube import tube_claim

MARGIN = 0.08


@pytest.mark.parametrize("parts", [1, 3])
@pytest.mark.parametrize("share", [0.999, 0.99, 1.01])
@pytest.mark.parametrize("ahead", [True, False])
def test_outside_of_the_tube_is_told_only_where_no_beginning_puts_the_robot_inside(parts, share, ahead):
    """Beginnings move the plan by up to `parts` eighths of the margin, towards the robot or away from it."""
    width = parts * MARGIN / 8
    alignment = Alignment(0.0, width, width / 2, True)
    times = np.arange(1.0, 9.0, 0.05)
    by = share * MARGIN if ahead else -(width + share * MARGIN)  # nearest to the plan of the first beginning, or of the last
    positions = np.stack([times + by, np.zeros_like(times), np.zeros_like(times)], axis=1)
    flown = track("r0", times, positions, Bounds(speed=1.5, error=0.0), start=1.0, stop=8.0)
    claim = tube_claim(flown, along_x(), alignment, MARGIN, 10.0)
    assert claim.verdict == ("fails" if share > 1 else "undecided")
    if share > 1:
        assert MARGIN < claim.bound <= share * MARGIN
