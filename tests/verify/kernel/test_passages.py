"""Passages of openings: a path that goes back and forth within one leaf of a tree passes more than once."""

from fractions import Fraction
from types import SimpleNamespace

import pytest

from verify.kernel.flights import Path, Segment
from verify.kernel.statement import Refused, Ring, Shape
from verify.kernel.timelines import Course
from verify.kernel.trees import Evidence, Polynomial

NOWHERE = Polynomial.of([Fraction(0)])


def passed(coefficients, marks, margin=Fraction(1, 20), away=1):
    """The ways in which a path passes an opening around the origin: along x by a polynomial, and then away, or not."""
    ring = Ring((Fraction(1), Fraction(0), Fraction(0)), opening=Fraction(1), rim=Fraction(1, 50))
    statement = SimpleNamespace(margin=margin, regions={"h": Shape((Fraction(0),) * 3, (), ring)})
    ways = [[Fraction(x) for x in coefficients], [Fraction(sum(coefficients)), Fraction(sum(coefficients)) * away]]
    segments = [Segment(Fraction(k), Fraction(k + 1), [Polynomial.of(x), NOWHERE, NOWHERE]) for k, x in enumerate(ways)]
    path = Path("r", SimpleNamespace(radius=Fraction(1, 20)), segments, segments, None)
    return [way for *_, way in Course(statement, path, Evidence({"openings/r/h": marks}))._passages("h")]


def test_one_way_is_one_passage():
    assert passed([-1, 2], "ssnFFn") == ["F"]
    assert passed([1, -2], "ssnRRn") == ["R"]


@pytest.mark.parametrize("marks", ["sssssnFFFFFn", "ssssssnFFFFFFn", "sssssnFFRRFn"])
def test_back_and_forth_is_not_one_passage(marks):
    """It comes through at 0.07, goes back at 0.5 and comes again at 0.93: by Chebyshev's polynomial."""
    with pytest.raises(Refused):
        passed([-1, 18, -48, 32], marks)


@pytest.mark.parametrize(("coefficients", "marks"), [([-1, 1], "snFF"), ([0, 1], "Fn")])
def test_who_stays_in_an_opening_or_begins_there_does_not_pass_it(coefficients, marks):
    with pytest.raises(Refused, match="without passing"):
        passed(coefficients, marks)


@pytest.mark.parametrize("beyond", [0, 1])
def test_who_stops_a_margin_beyond_an_opening_has_not_passed_it(beyond):
    """It may be in the opening's plane, by as much as it may stray."""
    margin, end = Fraction(1, 16), Fraction(1, 16) + Fraction(beyond, 1024)
    if beyond:
        assert passed([-1, 1 + end], "ssnFFF", margin, away=0) == ["F"]
    else:
        with pytest.raises(Refused, match="without passing"):
            passed([-1, 1 + end], "ssnFFF", margin, away=0)
