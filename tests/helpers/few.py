"""A few cases of a test by default, and all others with the slow tests."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import pytest
from hypothesis import given, settings

_CASE = type(pytest.param())


def few_of(number: int, names: str | tuple[str, ...], cases: Iterable[Any], **options: Any) -> Callable[..., Any]:
    """Parametrise a test by cases of which a few, from the first to the last, run by default; the others are slow.

    Args:
        number: How many cases run by default.
        names: Of the test's arguments.
        cases: As `pytest.mark.parametrize` takes them; what is marked already stays as it is.
        options: What `pytest.mark.parametrize` takes besides.
    """
    one = isinstance(names, str) and "," not in names
    rows = [case if isinstance(case, _CASE) else pytest.param(*((case,) if one else case)) for case in cases]
    plain = [row for row in rows if not row.marks]
    step = (len(plain) - 1) / max(number - 1, 1)
    kept = {id(plain[round(k * step)]) for k in range(min(number, len(plain)))}
    slow = [
        row if row.marks or id(row) in kept else pytest.param(*row.values, id=row.id, marks=pytest.mark.slow) for row in rows
    ]
    return pytest.mark.parametrize(names, slow, **options)


def given_few(few: int, many: int, *drawn: Any, **named: Any) -> Callable[[Callable[..., None]], Callable[[int], None]]:
    """Hold a law to few random cases by default, and to many with the slow tests.

    Args:
        few: How many cases are drawn by default.
        many: How many are drawn with the slow tests.
        drawn: Strategies, as `hypothesis.given` takes them.
        named: Strategies by the law's arguments.
    """

    def decorate(law: Callable[..., None]) -> Callable[[int], None]:
        held = {number: settings(max_examples=number, deadline=None)(given(*drawn, **named)(law)) for number in (few, many)}

        @pytest.mark.parametrize("examples", [few, pytest.param(many, marks=pytest.mark.slow)])
        def test(examples: int) -> None:
            held[examples]()

        test.__name__, test.__doc__, test.__module__ = law.__name__, law.__doc__, law.__module__
        return test

    return decorate
