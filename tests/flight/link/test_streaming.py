"""Set-points of one clock: where robots are asked to stay when this computer was late."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from flight.link.link import LinkLost
from flight.link.streaming import LATE, RATE, SetpointStream
from tests.helpers.motion.flights import legs

PATH = legs([[0.0, 0.0, 1.0], [2.0, 0.0, 1.0]])


def sent(late_at: float, late: float, *, before: float = 1.0) -> list[tuple[float, float]]:
    """Send set-points of a flight that begins at 0 s behind a hover, late once; return times and how far along each is."""
    stream, found, now = SetpointStream(["r0"]), [], -before
    stream.store("r0", 0, PATH)
    stream.fly(0, np.inf)
    while now < 2.0:
        if now >= 0.0 and np.isinf(stream.begin):
            stream.fly(0, 0.0)
        if stream.due(now):
            found.append((now, float(stream.of("r0", now, 1).flat[0, 0])))
            stream.require_in_time()
        now += 0.005 + late * (now <= late_at < now + 0.005)
    return found


@pytest.mark.parametrize("late_at", [-0.001, 0.0, 0.013, 0.5, 1.4])
def test_who_is_late_in_a_flight_or_at_its_very_beginning_asks_nobody_to_jump(late_at) -> None:
    with pytest.raises(LinkLost, match="set-points were"):
        sent(late_at, LATE + 0.1)
    at_most = LATE + 2.0 / RATE
    rows = sent(late_at, LATE - 0.05)
    fastest = float(np.linalg.norm(PATH.evaluate(PATH.duration / 2, 1)[:3]))
    assert max(b - a for (_, a), (_, b) in itertools.pairwise(rows)) <= fastest * at_most


def test_a_robot_that_is_late_for_the_beginning_is_asked_to_stay_there() -> None:
    stream = SetpointStream(["r0"])
    stream.store("r0", 0, PATH)
    stream.fly(0, np.inf)
    assert stream.due(9.98)
    stream.fly(0, 10.0)
    assert stream.due(10.0 + LATE + 0.2)
    asked = stream.of("r0", 10.0 + LATE + 0.2, 3)
    assert asked.time == 0.0
    assert asked.flat[0, :3] == pytest.approx([0.0, 0.0, 1.0])
    assert not asked.flat[1:].any()
    with pytest.raises(LinkLost, match=f"set-points were {LATE + 0.2:.2f} s late"):
        stream.require_in_time()


def test_a_hover_before_a_flight_may_be_late() -> None:
    stream = SetpointStream(["r0"])
    stream.store("r0", 0, PATH)
    stream.fly(0, np.inf)
    assert stream.due(1.0)
    assert stream.due(5.0)
    stream.require_in_time()
