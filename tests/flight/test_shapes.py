"""Which points of a path are drawn."""

from __future__ import annotations

import itertools

import numpy as np

from flight.shapes import bends, tube


def test_lines_between_the_points_that_are_kept_pass_all_others() -> None:
    time = np.linspace(0.0, 1.0, 400)
    path = np.stack([np.cos(7 * time), np.sin(5 * time), time**2], axis=1)
    for tolerance in (0.3, 0.01, 1e-4):
        kept = bends(path, tolerance)
        assert (kept[0], kept[-1]) == (0, 399)
        for first, last in itertools.pairwise(kept):
            share = np.linspace(0.0, 1.0, 2000)[:, None]
            chord = path[first] + share * (path[last] - path[first])
            off = np.linalg.norm(path[first : last + 1, None] - chord, axis=2).min(axis=1)
            assert off.max() <= tolerance + 1e-3
    assert len(bends(path, 0.3)) < len(bends(path, 0.01)) < 80


def test_a_straight_path_is_its_ends_and_a_lap_comes_back() -> None:
    straight = np.linspace([0.0, 0.0, 1.0], [3.0, 1.0, 1.0], 50)
    assert bends(straight, 1e-6) == [0, 49]
    assert len(tube(straight, 0.05, "quad0", "red")["x"]) == 16
    lap = np.concatenate([straight, straight[::-1]])
    assert bends(lap, 1e-6) == [0, 49, 99]
    assert bends(np.zeros((5, 3)), 1e-6) == [0]
    assert bends(np.array([[0.0, 0, 0], [np.nan] * 3, [1, 0, 0]]), 1e-3) == [0, 1, 2]
