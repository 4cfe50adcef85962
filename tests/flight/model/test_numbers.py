"""Texts, truth values, NaN and infinity in the place of numbers are refused in a sentence, wherever a caller may give them."""

import math

import numpy as np
import pytest

import flight
from flight.control.lee import Lee
from flight.control.mellinger import Mellinger
from flight.model.disturbances import Wind
from flight.model.numbers import is_number
from flight.model.sensing import MotionCapture
from flight.rehearsal.combinations import Combinations
from verify.data import BadInput

NONE = ("a", "0.03", True, math.nan, math.inf, (1.0,), 1j)


@pytest.mark.parametrize("value", NONE)
@pytest.mark.parametrize(
    "made",
    [
        lambda value: Mellinger(mass=value),
        lambda value: Lee(mass=value),
        lambda value: MotionCapture(noise=value),
        lambda value: MotionCapture(delay=value),
        lambda value: MotionCapture(burst=value),
        lambda value: Wind(mean=(0.0, value, 0.0)),
        lambda value: Wind(gust=value),
        lambda value: Wind(scale=value),
        lambda value: Combinations(masses=(value,)),
        lambda value: Combinations(latencies=(value,)),
    ],
)
def test_what_is_no_number_is_refused_in_a_sentence(made, value) -> None:
    with pytest.raises(BadInput):
        made(value)


def test_numbers_of_all_kinds_are_taken() -> None:
    assert all(is_number(value) for value in (0, 1.5, -2, np.float32(0.5), np.int64(3)))
    assert Mellinger(mass=np.float64(0.03)).mass == 0.03
    assert flight.Conditions(noise=0.002).noise == MotionCapture(noise=0.002)
