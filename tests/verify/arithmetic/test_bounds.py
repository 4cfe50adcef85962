import itertools
import math
from fractions import Fraction

import numpy as np
import pytest
from flint import arb, fmpq, fmpq_poly
from hypothesis import given, settings
from hypothesis import strategies as st

from verify.arithmetic import exact
from verify.arithmetic.balls import Balls, constants, dot, from_power, gamma, halves, nearest, raised, restricted
from verify.arithmetic.bounds import peaks
from verify.arithmetic.intervals import Interval, interval

QUICK = settings(max_examples=40, deadline=None)

FLOATS = st.floats(-1e3, 1e3, allow_nan=False) | st.sampled_from([0.0, 1.0, -1.0, 1e-30, 1e15, 5e-324])


def rows(degree: int):
    return st.lists(FLOATS, min_size=degree + 1, max_size=degree + 1)


def bernstein(ascending: list[Fraction]) -> list[Fraction]:
    n = len(ascending) - 1
    return [sum(Fraction(math.comb(i, k), math.comb(n, k)) * ascending[k] for k in range(i + 1)) for i in range(n + 1)]


def power(values: list[Fraction]) -> list[Fraction]:
    """Ascending powers of a polynomial given by Bernstein coefficients."""
    n = len(values) - 1
    return [math.comb(n, k) * sum((-1) ** (k - i) * math.comb(k, i) * values[i] for i in range(k + 1)) for k in range(n + 1)]


def product(a: list[Fraction], b: list[Fraction]) -> list[Fraction]:
    out = [Fraction(0)] * (len(a) + len(b) - 1)
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            out[i + j] += x * y
    return out


def holds(balls: Balls, values: list[Fraction]) -> bool:
    """Tell whether every exact coefficient lies in its ball."""
    mid, rad = balls.mid.reshape(-1), balls.rad.reshape(-1)
    assert len(mid) == len(values)
    return all(abs(Fraction(m) - v) <= Fraction(r) for m, r, v in zip(mid.tolist(), rad.tolist(), values, strict=True))


def scaled(values: list[float], length: float) -> list[Fraction]:
    return [Fraction(v) * Fraction(length) ** k for k, v in enumerate(values)]


@QUICK
@given(rows(7), st.floats(0.01, 20))
def test_a_piece_lies_in_its_balls(values, length):
    balls = from_power(np.array([values]), np.array([length]))
    assert holds(balls, bernstein(scaled(values, length)))
    assert np.all(balls.rad <= 2.4e-15 * np.sum(np.abs(values) * length ** np.arange(8.0)) + 1e-280)


@pytest.mark.parametrize("length", [1e-60, 1e-45, 1e-20, 1e30])
@pytest.mark.parametrize("size", [1e-300, 1.0, 1e38, 1e250])
def test_underflow_is_within_the_balls(length, size):
    values = [size * (-1) ** k for k in range(8)]
    with np.errstate(all="ignore"):
        balls = from_power(np.array([values]), np.array([length]))
        square = balls * balls
    exactly = bernstein(scaled(values, length))
    for found, wanted in ((balls, exactly), (square, bernstein(product(scaled(values, length), scaled(values, length))))):
        if np.all(np.isfinite(found.mid)) and np.all(np.isfinite(found.rad)):
            assert holds(found, wanted)


@QUICK
@given(rows(4), rows(3), rows(4))
def test_sums_and_products_lie_in_their_balls(a, b, c):
    x, y, z = (from_power(np.array([v]), np.ones(1)) for v in (a, b, c))
    p, q, r = ([Fraction(v) for v in values] for values in (a, b, c))
    assert holds(x * y, bernstein(product(p, q)))
    assert holds(x + z, bernstein([u + v for u, v in zip(p, r, strict=True)]))
    assert holds(x - z, bernstein([u - v for u, v in zip(p, r, strict=True)]))
    assert holds(-x, bernstein([-u for u in p]))
    assert holds(raised(y, 6), bernstein([*q, Fraction(0), Fraction(0), Fraction(0)]))
    pair, other = (Balls(np.stack([u.mid[0], v.mid[0]]), np.stack([u.rad[0], v.rad[0]])) for u, v in ((x, z), (z, z)))
    total = [u + v for u, v in zip(product(p, r), product(r, r), strict=True)]
    assert holds(dot(pair, other), bernstein(total))


@QUICK
@given(rows(7), st.fractions(0, Fraction(99, 100)), st.fractions(Fraction(1, 100), 1))
def test_parts_of_a_piece_lie_in_their_balls(values, start, share):
    stop = start + (1 - start) * share
    balls = from_power(np.array([values]), np.ones(1))
    left, right = halves(balls)[:1], halves(balls)[1:]
    whole = fmpq_poly([exact.rational(v) for v in values])

    def part(low: Fraction, high: Fraction) -> list[Fraction]:
        moved = exact.on_unit_interval(whole, low, high)
        ascending = [exact.fraction(fmpq(c)) for c in moved.coeffs()]
        return bernstein(ascending + [Fraction(0)] * (8 - len(ascending)))

    assert holds(left, part(Fraction(0), Fraction(1, 2)))
    assert holds(right, part(Fraction(1, 2), Fraction(1)))
    assert holds(restricted(balls, [start], [stop]), part(start, stop))


@QUICK
@given(st.fractions())
def test_nearest_bounds_its_error(value):
    number, error = nearest(value)
    assert abs(Fraction(number) - value) <= Fraction(error)


@pytest.mark.parametrize("operations", [1, 2, 3, 10, 100, 4097, 2**30])
def test_chains_of_rounded_operations_are_off_by_no_more_than_gamma(operations):
    # Higham's bound: each operation is off by a factor of 1 + e with |e| <= 2^-53
    unit = Fraction(1, 2**53)
    assert (
        operations * unit / (1 - operations * unit)
        <= Fraction(gamma(operations))
        <= operations * unit * (1 + Fraction(1, 2**19))
    )
    assert (1 + unit) ** min(operations, 100) - 1 <= Fraction(gamma(min(operations, 100)))


def test_numbers_beyond_floats_prove_nothing():
    assert nearest(Fraction(10) ** 400) == (math.inf, math.inf)
    with np.errstate(all="ignore"):
        huge = constants(np.array([1e200])) * constants(np.array([1e200]))
        assert not huge.high.max() <= 1e308


OPERATIONS = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
}


@QUICK
@given(st.sampled_from(sorted(OPERATIONS)), *[st.tuples(FLOATS, FLOATS, st.floats(0, 1)) for _ in range(2)])
def test_intervals_hold_every_result(sign, first, second):
    sides, points = [], []
    for a, b, share in (first, second):
        low, high = min(a, b), max(a, b)
        sides.append(Interval(np.array([low]), np.array([high])))
        points.append(Fraction(low) + (Fraction(high) - Fraction(low)) * Fraction(share))
    with np.errstate(all="ignore"):
        result = OPERATIONS[sign](*sides)
    if sign == "/" and (second[0] <= 0 <= second[1] or second[1] <= 0 <= second[0]):
        assert result.low[0] == -np.inf
        assert result.high[0] == np.inf
        return
    value = OPERATIONS[sign](*points)
    low, high = float(result.low[0]), float(result.high[0])
    assert math.isnan(low) or low == -math.inf or Fraction(low) <= value
    assert math.isnan(high) or high == math.inf or value <= Fraction(high)


@pytest.mark.parametrize("divisor", [(0.0, 2.0), (-0.0, 2.0), (-2.0, 0.0), (-2.0, -0.0), (0.0, 0.0), (-2.0, 2.0)])
@pytest.mark.parametrize("share", [(1.0, 3.0), (0.0, 0.0), (-3.0, 1.0), (-0.0, 5e-324)])
def test_a_quotient_by_what_touches_zero_is_any_number(share, divisor):
    first, second = (Interval(np.array([low]), np.array([high])) for low, high in (share, divisor))
    result = first / second
    assert (result.low[0], result.high[0]) == (-np.inf, np.inf)


@pytest.mark.parametrize(
    ("low", "high"), [(0.0, 2.0), (-2.0, 0.0), (0.0, 0.0), (5e-324, 2.0), (-2.0, -5e-324), (1.0, 2.0), (-2.0, -1.0)]
)
def test_squares_and_magnitudes_of_what_touches_zero(low, high):
    x = Interval(np.array([low]), np.array([high]))
    least, most = min(abs(low), abs(high)), max(abs(low), abs(high))
    assert (x.magnitude().low[0], x.magnitude().high[0]) == (least, most)
    assert x.squared().low[0] >= 0.0
    assert Fraction(x.squared().low[0]) <= Fraction(least) ** 2
    assert Fraction(most) ** 2 <= Fraction(x.squared().high[0])
    assert x.squared().low[0] >= least**2 * (1 - 1e-15)
    assert (x.at_least_zero().low[0], x.at_least_zero().high[0]) == (max(low, 0.0), max(high, 0.0))


@QUICK
@given(st.floats(0, 1e6), st.floats(0, 1e6))
def test_roots_squares_and_magnitudes_are_outward(a, b):
    low, high = min(a, b), max(a, b)
    x = Interval(np.array([-low]), np.array([high]))
    assert x.squared().low[0] == 0.0
    assert Fraction(x.squared().high[0]) >= Fraction(high) ** 2
    assert (x.magnitude().low[0], x.magnitude().high[0]) == (0.0, high)
    root = Interval(np.array([low]), np.array([high])).root()
    assert Fraction(root.low[0]) ** 2 <= Fraction(low)
    assert Fraction(root.high[0]) ** 2 >= Fraction(high)
    assert np.all(interval(2.0).times(3.0).low <= 6.0)


# Greatest values: against flint's own root isolation (of the derivative), and against dense samples.


def greatest(p: fmpq_poly, stop: Fraction) -> tuple[float, float]:
    """Bracket the maximum over [0, stop] by critical points enclosed by Arb: a second exact method."""
    best = [arb(p(fmpq(0))), arb(p(exact.rational(stop)))]
    if p.degree() > 1:
        for root, _ in p.derivative().complex_roots():
            real = root.real
            if root.imag != 0 or real < 0 or real > exact.rational(stop):
                continue
            value = arb(0)
            for c in reversed(p.coeffs()):
                value = value * real + c
            best.append(value)
    return max(float(b.lower()) for b in best), max(float(b.upper()) for b in best)


@QUICK
@given(rows(7), st.sampled_from([0.25, 0.5, 1.0, 1.5, 2.0]))
def test_peaks_agree_with_critical_points(values, length):
    p = fmpq_poly([exact.rational(v) for v in values])
    low, high = greatest(p, Fraction(length))
    size = max(abs(v) * length**k for k, v in enumerate(values)) + 1e-12
    found = peaks(from_power(np.array([values]), np.array([length])), np.zeros(1, dtype=int), 1, slack=np.array([1e-9 * size]))
    assert found.upper[0] >= low
    assert found.lower[0] <= high
    assert found.upper[0] - found.lower[0] <= 1.01e-9 * size
    at = float(found.place[0]) * length
    assert abs(float(p(exact.rational(at))) - found.lower[0]) <= 1e-9 * size


def test_peaks_keep_groups_apart():
    pieces = from_power(np.array([[0.0, 1.0], [5.0, -1.0], [2.0, 0.5]]), np.ones(3))
    found = peaks(pieces, np.array([0, 1, 0]), 3, slack=np.full(3, 1e-12))
    assert found.upper[:2] == pytest.approx([2.5, 5.0])
    assert list(found.item[:2]) == [2, 1]
    assert list(found.place[:2]) == [1.0, 0.0]
    assert found.upper[2] == -np.inf


@QUICK
@given(*[st.lists(st.integers(-8, 8), min_size=4, max_size=4)] * 2)
def test_quotients_are_bounded_from_above(a, b):
    below = fmpq_poly(b)
    under = [float(int(c)) for c in (below * below + 1).coeffs()]
    under += [0.0] * (7 - len(under))
    over = [*map(float, a), 0.0, 0.0, 0.0]
    numerator, denominator = from_power(np.array([over]), np.ones(1)), from_power(np.array([under]), np.ones(1))
    found = peaks(numerator, np.zeros(1, dtype=int), 1, slack=np.array([1e-4]), denominator=denominator)
    values = [fmpq_poly(a)(fmpq(k, 200)) / (below * below + 1)(fmpq(k, 200)) for k in range(201)]
    assert exact.fraction(max(values)) <= Fraction(found.upper[0])
    assert found.upper[0] <= found.lower[0] + 1e-4
    assert found.lower[0] <= float(max(values)) + 1.0


def test_a_quotient_whose_denominator_vanishes_is_unbounded():
    one, line = from_power(np.array([[1.0, 0.0]]), np.ones(1)), from_power(np.array([[-0.5, 1.0]]), np.ones(1))
    assert peaks(one, np.zeros(1, dtype=int), 1, slack=np.array([1e-3]), denominator=line).upper[0] == np.inf


def test_not_a_number_is_never_a_bound():
    pieces = Balls(np.array([[np.nan, 0.0], [1.0, 1.0]]), np.zeros((2, 2)))
    assert peaks(pieces, np.zeros(2, dtype=int), 1, slack=np.array([1e-3])).upper[0] == np.inf


# The exact fall-back, against flint's complex roots.


SMALL = st.integers(-6, 6)


@QUICK
@given(st.lists(st.tuples(SMALL, st.integers(1, 7), st.integers(1, 3)), max_size=4), st.lists(SMALL, min_size=1, max_size=4))
def test_roots_are_isolated_with_their_multiplicities(planted, rest):
    p = fmpq_poly(rest) if any(rest) else fmpq_poly([1])
    for numerator, denominator, multiplicity in planted:
        p *= fmpq_poly([fmpq(-numerator, denominator), 1]) ** multiplicity
    found = exact.roots(p, Fraction(-1), Fraction(1), Fraction(1, 1000))
    peers = [(r.real, int(m)) for r, m in p.complex_roots() if r.imag == 0]
    inside = [(r, m) for r, m in peers if not (r < -1) and not (r > 1)]
    assert [m for _, m in sorted(inside, key=lambda item: float(item[0].mid()))] == [r.multiplicity for r in found]
    for root, (peer, _) in zip(found, sorted(inside, key=lambda item: float(item[0].mid())), strict=True):
        assert root.high - root.low <= Fraction(1, 1000)
        assert arb(exact.rational(root.low)) <= peer or arb(exact.rational(root.low)).overlaps(peer)
        assert arb(exact.rational(root.high)) >= peer or arb(exact.rational(root.high)).overlaps(peer)


@QUICK
@given(st.lists(SMALL, min_size=1, max_size=7), st.integers(0, 3), st.sampled_from([0, 1, -1]))
def test_sign_decisions_agree_with_roots(values, squares, nudge):
    p = fmpq_poly(values)
    for _ in range(squares):
        p = p * p if p.degree() < 4 else p
    p = p + fmpq(nudge, 10**12)
    decided = exact.nonnegative(p, Fraction(0), Fraction(1))
    critical = [fmpq(0), fmpq(1)]
    if p.degree() > 0:
        for root, _ in p.complex_roots():
            if root.imag == 0:
                critical.append(fmpq(int((root.real * 2**40).mid().floor().unique_fmpz()), 2**40))
                critical.append(fmpq(int((root.real * 2**40).mid().floor().unique_fmpz()) + 1, 2**40))
    points = sorted(c for c in critical if 0 <= c <= 1)
    points += [(a + b) / 2 for a, b in itertools.pairwise(points)]
    assert decided == all(p(c) >= 0 for c in points)


def test_ties_are_decided():
    t = fmpq_poly([0, 1])
    touching = (t - fmpq(1, 3)) ** 2
    assert exact.nonnegative(touching, Fraction(0), Fraction(1))
    assert not exact.nonnegative(touching - fmpq(1, 10**60), Fraction(0), Fraction(1))
    assert exact.nonnegative(t * (1 - t), Fraction(0), Fraction(1))
    assert exact.nonnegative(fmpq_poly([0]), Fraction(0), Fraction(1))
    with pytest.raises(ValueError, match="zero polynomial"):
        exact.roots(fmpq_poly([0]), Fraction(0), Fraction(1), Fraction(1, 2))
