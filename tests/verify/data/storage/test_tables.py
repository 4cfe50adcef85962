"""What the digits of a table say of its numbers."""

import math
from fractions import Fraction

import pytest

from verify.data.storage.tables import Decimal, counted, decimal, rounding


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


def test_a_number_is_the_decimal_that_was_written() -> None:
    number = Decimal(125, -2)
    assert (number.exact(), number.float()) == (Fraction(5, 4), 1.25)
    assert (number.exact(3), number.float(3)) == (1250, 1250.0)
    assert (number.exact(-3), number.float(-3)) == (Fraction(1, 800), 0.00125)


def test_numbers_are_counted_in_one_power_of_ten() -> None:
    numbers = [Decimal(1, 0), Decimal(125, -2), Decimal(3, 1)]
    assert counted(numbers) == ([100, 125, 3000], -2)
    assert counted(numbers, 3) == ([1000, 1250, 30000], 0)
