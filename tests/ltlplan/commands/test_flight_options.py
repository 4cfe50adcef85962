"""What the options of commands that simulate flights come to."""

from __future__ import annotations

import pytest

from flight.condition_options import Said
from flight.control.lee import Lee
from flight.control.mellinger import Mellinger
from verify.data import BadInput


def test_options_become_conditions() -> None:
    found = Said("0.2+0.1", "0", latency=0.015, mass=0.029).by("mellinger")
    assert found.controller == Mellinger(mass=0.029)
    assert (found.noise.noise, found.noise.delay) == (0.0, 0.015)
    assert found.estimator == "ekf"
    assert Said().by("lee") == Said().by("lee")
    assert Said().by("lee").controller == Lee()
    assert Said(noise="0.001", estimator="ekf").by("geometric").on_board


@pytest.mark.parametrize(
    ("controller", "given", "said"),
    [
        ("pid", {"mass": 0.03}, "`mellinger` or `lee` assumes; 'pid' assumes none"),
        ("mellinger", {"mass": -1.0}, "mass is above 0 in kg"),
        ("mellinger", {"latency": 0.02}, "give --noise as well"),
        ("mellinger", {"estimator": "ekf"}, "give `noise`"),
    ],
)
def test_options_that_say_nothing_together_are_refused(controller: str, given: dict[str, object], said: str) -> None:
    with pytest.raises(BadInput, match=said):
        Said(**given).by(controller)


@pytest.mark.parametrize("mass", [0.0, float("nan"), 33.0e3])
def test_a_mass_that_nothing_has_is_refused_before_anything_is_planned(mass: float) -> None:
    with pytest.raises(BadInput, match="mass is above 0 in kg"):
        Said(mass=mass).require_sense()
    Said(mass=0.03).require_sense()
