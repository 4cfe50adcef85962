"""Set-points over a stream: what the controller behind it is given, against the plan's polynomials."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from flight.control.controller import Controller
from flight.control.geometric import GEOMETRIC
from flight.control.streamed import StreamedController
from flight.model.airframe import airframe_of
from tests.verify.tracking.test_proof import line
from verify.data import load_vehicle
from verify.data.disturbance import StreamedSetpoints


@dataclass
class Listening(Controller):
    """Keeps what it is given."""

    given: list = field(default_factory=list)

    def begin(self, airframe, flat):
        return self

    def command(self, flat, now):
        self.given.append(flat)


def sent(path, told: StreamedSetpoints, ticks: int = 130):
    listening = Listening()
    start = path.evaluate(0.0)[:, None]
    loop = StreamedController(listening, "listening", told).begin(airframe_of(load_vehicle("crazyflie-2.1")), start)
    for tick in range(ticks):
        loop.command(np.stack([path.evaluate(0.02 * tick, order)[:, None] for order in range(5)]), None)
    return np.array(listening.given)[..., 0]


@pytest.mark.parametrize("age", [0.0, 0.003, 0.02, 0.033, 0.05])
def test_set_points_are_as_old_as_they_may_be(age):
    path = line(0.3, 2.4)
    given = sent(path, StreamedSetpoints(age=(0.0, age)))
    for tick, flat in enumerate(given):
        time = 0.02 * tick - age
        wanted = np.stack([path.evaluate(max(time, 0.0), order) for order in range(5)])
        wanted[1:] *= time > -1e-12
        assert np.abs(flat - wanted)[:3].max() < 2e-5


def test_set_points_are_rounded_within_what_is_stated_and_without_high_derivatives():
    path, told = line(0.3, 2.4), StreamedSetpoints(orders=3, position=0.00087, velocity=0.002, acceleration=0.01, jerk=0.1)
    given, exact = sent(path, told), sent(path, StreamedSetpoints())
    off = np.linalg.norm((given - exact)[..., :3], axis=-1)
    for order, size in enumerate(told.rounding[:4]):
        assert 0.5 * size < off[:, order].max() <= size * (1.0 + 1e-9)
    assert np.all(given[:, 4] == 0.0)
    assert StreamedController(GEOMETRIC, "geometric", told).orders == 3
