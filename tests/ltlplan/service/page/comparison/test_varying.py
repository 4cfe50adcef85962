"""Values of a study as people type them."""

from __future__ import annotations

import pytest

from ltlplan.service.page.comparison.varying import values_of
from verify.data import BadInput


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("0..3", (0, 1, 2, 3)),
        ("0.5, 0.7,1", (0.5, 0.7, 1)),
        ("geometric, px4", ("geometric", "px4")),
        ("F[0,10] a\nG b & F c\n", ("F[0,10] a", "G b & F c")),
        ("F a & F b", ("F a & F b",)),
        ("[0, 0, 1]\n[0, 1, 1]", ((0, 0, 1), (0, 1, 1))),
        ("true\nfalse", (True, False)),
        ("null", ("null",)),
        ("7", (7,)),
    ],
)
def test_values_are_read_as_they_are_meant(text: str, values: tuple[object, ...]) -> None:
    assert values_of(text) == values


@pytest.mark.parametrize("text", ["", " \n", "9..0", "0..200", ","])
def test_what_names_no_values_is_refused(text: str) -> None:
    with pytest.raises(BadInput):
        values_of(text)
