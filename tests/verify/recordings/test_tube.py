"""The tube: what is told where the flight's beginning is known within an interval only, and where a plan is not smooth."""

import numpy as np
import pytest

from tests.helpers.live.recordings import along_x
from verify.recordings.alignment import Alignment
from verify.recordings.planned_paths import PlannedPath
from verify.recordings.reachable_sets import Bounds, track
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
    assert claim.outcome == ("fails" if share > 1 else "undecided")
    if share > 1:
        assert MARGIN < claim.bound <= share * MARGIN


@pytest.mark.parametrize("begin", [5.02, 5.055, 5.07, 5.085])
@pytest.mark.parametrize("how", ["jump", "turn"])
def test_a_plan_that_is_elsewhere_for_a_hundredth_of_a_second_between_two_samples_is_not_kept(how, begin):
    """It is twice the margin away, by a jump there and back or by a dart, in either half of the time between two samples."""
    knots = np.array([0.0, begin, begin + 0.005, begin + 0.01, 10.0])
    coefficients = np.zeros((4, 3, 8))
    speed = 2 * MARGIN / 0.005
    if how == "jump":
        coefficients[1:3, 0, 0] = 2 * MARGIN
        path = PlannedPath("r0", knots, coefficients, 0.0, 0.0, knots, np.array([0, 2, 0, 2, 0]) * MARGIN, np.zeros(5))
    else:
        coefficients[1, 0, 1], coefficients[2, 0, :2] = speed, (2 * MARGIN, -speed)
        path = PlannedPath("r0", knots, coefficients, speed, 0.0, knots, np.zeros(5), np.array([0, 1, 2, 1, 0]) * speed)
    times = np.arange(0.0, 10.05, 0.1)
    still = track("r0", times, np.zeros((len(times), 3)), Bounds(speed=0.01, error=0.0), start=1.0, stop=9.0)
    assert path.places(np.array([begin + 0.005]))[0, 0] == pytest.approx(2 * MARGIN)
    assert tube_claim(still, path, Alignment(0.0, 0.0, None, True), MARGIN, 10.0).outcome != "holds"


def test_a_robot_that_stays_where_its_plan_stays_keeps_the_tube():
    knots = np.array([0.0, 10.0])
    path = PlannedPath("r0", knots, np.zeros((1, 3, 8)), 0.0, 0.0, knots, np.zeros(2), np.zeros(2))
    times = np.arange(0.0, 10.05, 0.1)
    still = track("r0", times, np.zeros((len(times), 3)), Bounds(speed=0.01, error=0.0), start=1.0, stop=9.0)
    assert tube_claim(still, path, Alignment(0.0, 0.0, None, True), MARGIN, 10.0).outcome == "holds"


@pytest.mark.parametrize("begin", [0.93, 0.96, 8.93, 8.96])
def test_a_jump_that_only_some_beginnings_bring_into_the_flight_is_seen(begin):
    """The beginning is known within a tenth of a second, and the jump lies within that of the flight's first or last instant."""
    knots = np.array([0.0, begin, begin + 0.01, 10.0])
    coefficients = np.zeros((3, 3, 8))
    coefficients[1, 0, 0] = 2 * MARGIN
    path = PlannedPath("r0", knots, coefficients, 0.0, 0.0, knots, np.array([0, 2, 2, 0]) * MARGIN, np.zeros(4))
    times = np.arange(0.0, 10.05, 0.1)
    still = track("r0", times, np.zeros((len(times), 3)), Bounds(speed=0.01, error=0.0), start=1.0, stop=9.0)
    assert tube_claim(still, path, Alignment(0.0, 0.1, None, True), MARGIN, 10.0).outcome != "holds"


def test_at_the_margin_itself_rounding_leaves_it_open():
    """A robot that cannot move stands exactly as far from its plan as the margin, a kilometre; ten nanometres nearer it is inside for sure."""
    knots = np.array([0.0, 10.0])
    path = PlannedPath("r0", knots, np.zeros((1, 3, 8)), 0.0, 0.0, knots, np.zeros(2), np.zeros(2))
    times = np.arange(0.0, 0.35, 0.1)
    outcomes = []
    for distance in (1000.0, 1000.0 - 1e-8):
        positions = np.tile([distance, 0.0, 0.0], (len(times), 1))
        still = track("r0", times, positions, Bounds(speed=1e-14, error=0.0), start=0.1, stop=0.2)
        outcomes.append(tube_claim(still, path, Alignment(0.0, 0.0, None, True), 1000.0, 10.0).outcome)
    assert outcomes == ["undecided", "holds"]


@pytest.mark.parametrize("speed", [1.0, 4.0])
@pytest.mark.parametrize("stop", [0.7, 0.9])
def test_a_plan_that_moves_away_from_a_robot_that_stands_is_followed_to_the_last_instant(stop, speed):
    """It is farthest at the end of the judged time, which lies between two samples: at the margin to a part in 10^8."""
    knots, coefficients = np.array([0.0, 10.0]), np.zeros((1, 3, 8))
    coefficients[0, 0, 1] = speed
    path = PlannedPath("r0", knots, coefficients, speed, 0.0, knots, np.zeros(2), np.zeros(2))
    still = track("r0", np.array([0.0, 1.0]), np.zeros((2, 3)), Bounds(speed=1e-14, error=0.0), start=0.0, stop=stop)
    margins = (speed * stop - 1e-8, speed * stop + 1e-8)
    found = [tube_claim(still, path, Alignment(0.0, 0.0, None, True), margin, 10.0).outcome for margin in margins]
    assert found == ["undecided", "holds"]
