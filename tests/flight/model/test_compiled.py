"""Few vehicles are stepped by compiled arithmetic, many by arrays: the numbers are the same to the last bit."""

import numpy as np
import pytest

from flight.model.airframe import airframe_of
from flight.model.compiled import Compiled
from flight.model.full import FULL
from flight.model.plant import Command
from verify.data import load_vehicle

MANY, FEW = 45, 3


def command(rng, n, *, steered):
    attitude = rng.normal(size=(4, n)) * 0.1 + np.array([1.0, 0.0, 0.0, 0.0])[:, None]
    attitude /= np.sqrt(np.sum(attitude**2, axis=0))
    thrust = 0.3 + 0.4 * rng.random(n)  # rotors at their limits too
    return Command(
        thrust, rng.normal(size=n), rng.normal(size=(3, n)), 20 * rng.normal(size=(3, n)), attitude if steered else None
    )


def some(value, n):
    return Command(*(None if part is None else part[..., :n] for part in (getattr(value, name) for name in Command.__slots__)))


@pytest.mark.parametrize("steered", [True, False], ids=["attitude", "rates only"])
@pytest.mark.parametrize("body_drag", [(0.0, 0.0), (0.01, 0.02)], ids=["rotors' drag", "body's drag"])
def test_few_vehicles_fly_as_they_do_among_many(steered, body_drag):
    rng = np.random.default_rng(5)
    airframe = airframe_of(load_vehicle("crazyflie-2.1")).model_copy(update={"body_drag": body_drag})
    start = rng.normal(size=(4, MANY))
    many, few = FULL.begin(airframe, start), FULL.begin(airframe, start[:, :FEW])
    for _ in range(5):
        asked, wind = command(rng, MANY, steered=steered), rng.normal(size=(3, MANY))
        many.follow(asked)
        few.follow(some(asked, FEW))
        for count in (5, 2, 3):
            assert np.array_equal(many.fly(wind, count)[..., :FEW], few.fly(wind[:, :FEW], count))
        for name in ("position", "velocity", "attitude", "rates"):
            assert np.array_equal(getattr(many.motion(), name)[:, :FEW], getattr(few.motion(), name))
        assert np.array_equal(many.rotors[:, :FEW], few.rotors)
        assert np.array_equal(many.felt()[:, :FEW], few.felt())


def test_what_is_no_number_is_no_number_for_few_and_many():
    airframe = airframe_of(load_vehicle("crazyflie-2.1"))
    plants = [FULL.begin(airframe, np.zeros((4, n))) for n in (MANY, FEW)]
    ends = []
    for plant, n in zip(plants, (MANY, FEW), strict=True):
        zero = np.zeros((3, n))
        plant.follow(Command(np.full(n, np.nan), np.zeros(n), zero, zero, None))
        plant.fly(0.0, 5)
        ends.append((plant.position[:, 0], plant.rotors[:, 0]))
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(*ends, strict=True))
    assert np.isnan(ends[1][1]).all()


def test_what_other_libraries_round_otherwise_is_not_compiled():
    with pytest.raises(TypeError, match="sin is not compiled"):
        Compiled(lambda rows, acting: np.sin(rows), 2, 1)
