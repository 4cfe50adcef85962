"""What the digits of a table say of its numbers."""

import math

import pytest

from verify.data.storage.tables import decimal, rounding


def half(texts: list[str], unit: int = 0) -> float:
    return rounding([decimal(text) for text in texts], unit)


@pytest.mark.parametrize(
    ("texts", "unit", "wanted"),
    [
        (["1.2345", "0.0001"], 0, 0.5e-4),
        (["1.23456"], 0, 0.5e-5),
        (["0.12345678"], 0, 0.5e-8),
        (["1234.5"], -3, 0.5e-4),  # mm to a tenth
        (["1700000000123456789"], -9, 0.5e-9),
        (["1e-5", "2"], 0, 0.5),  # one digit of 2
        (["1.000000001e4", "1.5"], 0, 0.5e-5),
    ],
)
def test_half_a_unit_of_the_last_place_that_is_written(texts, unit, wanted):
    found = half(texts, unit)
    if wanted > 0.5e-4:
        assert found == 0.0, "coarser than a tenth of a millimetre: meant"
    else:
        assert found == math.nextafter(wanted, math.inf) or found == pytest.approx(wanted, rel=1e-12)
        assert found >= wanted


def test_coarse_numbers_are_taken_as_meant():
    assert half(["1.234", "0.5"]) == 0.0
    assert half(["3", "4"]) == 0.0
    assert half([]) == 0.0
    assert rounding([None, None]) == 0.0
