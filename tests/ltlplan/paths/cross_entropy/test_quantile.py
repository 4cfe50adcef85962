"""Quantile samples against the chi-squared distribution, by counting; the step against its closed form."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from ltlplan.paths.cross_entropy.quantile import (
    check_quantile,
    directions,
    quantile_step,
    scalar_step,
    square_root,
)
from ltlplan.reproduction.quantile_parts import quantile_samples
from verify.data import BadInput

COVARIANCE = np.array([[0.5, 0.2, 0.0], [0.2, 0.3, -0.1], [0.0, -0.1, 0.2]])


@pytest.mark.parametrize("probability", [0.05, 0.5, 0.9, 0.92])
def test_the_surface_holds_the_share_that_was_asked_for(probability):
    rng = np.random.default_rng(1)
    mean = np.array([1.0, -2.0, 0.5])
    on_surface = quantile_samples(mean, COVARIANCE, probability, 200, rng)
    inverse = np.linalg.inv(COVARIANCE)
    distance = np.einsum("ni,ij,nj->n", on_surface - mean, inverse, on_surface - mean)
    assert distance == pytest.approx(np.full(200, stats.chi2.ppf(probability, 3)), rel=1e-9)
    drawn = rng.multivariate_normal(mean, COVARIANCE, size=40_000) - mean
    inside = np.einsum("ni,ij,nj->n", drawn, inverse, drawn) <= distance[0]
    assert inside.mean() == pytest.approx(probability, abs=4 * math.sqrt(probability * (1 - probability) / 40_000))


def test_directions_are_unit_vectors_without_a_favourite():
    drawn = directions(np.random.default_rng(0), (20_000, 3))
    assert np.linalg.norm(drawn, axis=1) == pytest.approx(np.ones(20_000))
    assert np.abs(drawn.mean(axis=0)).max() < 0.02
    assert np.cov(drawn.T) == pytest.approx(np.eye(3) / 3, abs=0.02)


def test_in_one_dimension_it_is_the_two_sided_normal_quantile():
    drawn = quantile_samples(np.zeros(1), np.array([[4.0]]), 0.9, 50, np.random.default_rng(2))
    assert np.abs(drawn[:, 0]) == pytest.approx(np.full(50, 2 * stats.norm.ppf(0.95)))


@given(st.lists(st.floats(-2, 2), min_size=9, max_size=9))
@settings(max_examples=40)
def test_the_root_is_symmetric_and_squares_to_the_covariance(numbers):
    factor = np.array(numbers).reshape(3, 3)
    covariance = factor @ factor.T
    root = square_root(covariance)
    assert root == pytest.approx(root.T, abs=1e-9)
    assert root @ root == pytest.approx(covariance, abs=1e-7)


def test_a_flat_covariance_gives_points_in_its_plane():
    flat = quantile_samples(np.zeros(3), np.diag([1.0, 1.0, 0.0]), 0.5, 30, np.random.default_rng(3))
    assert np.all(flat[:, 2] == 0)


def test_the_step_is_the_closed_form_for_a_round_covariance():
    # Sigma = s^2 I, so root = s I: Delta = s^2 (c_high - c_low) u / sqrt(pi), and the scalar is the least 1-norm
    rng = np.random.default_rng(4)
    u = directions(rng, (5, 3))
    root = np.broadcast_to(0.5 * np.eye(3), (5, 3, 3))
    gap = math.sqrt(stats.chi2.ppf(0.92, 3)) - math.sqrt(stats.chi2.ppf(0.9, 3))
    step = quantile_step(root, u, 0.1, 50)
    assert step == pytest.approx(0.25 * gap * u / math.sqrt(math.pi))
    assert scalar_step(step) == pytest.approx(np.abs(step).sum(axis=1).min())


def test_the_step_of_many_rows_is_the_step_of_each():
    rng = np.random.default_rng(5)
    roots = square_root(np.stack([COVARIANCE, 2 * COVARIANCE, np.eye(3), 0.1 * np.eye(3)]).reshape(2, 2, 3, 3))
    u = directions(rng, (2, 2, 3))
    both = scalar_step(quantile_step(roots, u, 0.05, 50))
    each = [scalar_step(quantile_step(roots[i], u[i], 0.05, 50)) for i in range(2)]
    assert both == pytest.approx(np.array(each))


@pytest.mark.parametrize(("elite", "trajectories"), [(0.1, 10), (0.05, 20), (0.3, 3), (0.5, 2), (0.1, 0)])
def test_too_few_trajectories_are_refused(elite, trajectories):
    with pytest.raises(BadInput, match="more than 1 / rho"):
        check_quantile(elite, trajectories)
