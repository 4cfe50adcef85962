"""Intervals are rounded outwards as the next float is."""

import numpy as np

from verify.arithmetic.intervals import Interval


def test_results_reach_to_the_next_float():
    rng = np.random.default_rng(1)
    sizes = 2.0 ** rng.integers(-1074, 1023, 4000) * rng.uniform(-1.0, 1.0, 4000)
    ends = np.array([0.0, -0.0, 1.0, -1.0, 2.0**-1074, 2.0**-1022, 2.0**-970, 1.0 - 2.0**-53, 2.0**52, np.finfo(float).max / 2])
    values = np.concatenate([sizes, ends, -ends])
    found = Interval(values, values) + Interval(0.0 * values, 0.0 * values)
    below, above = np.nextafter(values, -np.inf), np.nextafter(values, np.inf)
    assert np.all(found.low <= below)
    assert np.all(found.high >= above)
    usual = np.abs(values) > 2.0**-900
    assert np.array_equal(found.low[usual], below[usual])
    assert np.array_equal(found.high[usual], above[usual])


def test_zeros_do_not_become_subnormal():
    zero = Interval(np.zeros(1), np.zeros(1))
    found = (zero + zero) * Interval(np.full(1, 1e-3), np.full(1, 1e3))
    assert found.low[0] < -np.finfo(float).tiny
    assert found.high[0] > np.finfo(float).tiny
