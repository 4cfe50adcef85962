"""Section 6 of the 2022 paper: the elite threshold, quantiles of a multivariate normal distribution, online cross-entropy."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np
from numpy.random import Generator

from ltlplan.online_mtac.cross_entropy import OnlineSettings, OnlineState, ask_all, start, tell_all
from ltlplan.paths.cross_entropy.quantile import directions, quantile_radius, quantile_step, scalar_step, square_root
from ltlplan.reproduction.charts import clouds, lines
from ltlplan.reproduction.element import Element, Findings, Quantity, holds
from verify.data.arrays import Floats

SHARE, TRAJECTORIES = 0.05, 50
"""rho of Fig. 12, and N of eq. (11)."""
VARIANCE = 0.05
"""Sigma of Fig. 12 is this times the identity, m^2."""
START, HOOP = np.array([1.0, -0.5, 0.8]), np.array([0.35, -0.85, 0.9])
"""Where a robot is, and the hoop that it flies to, m."""
STEPS, RATE = 500, 50
"""Steps of a search, and how many are made in a second."""
DRAWS = 20_000
"""Samples of a check."""


def quantile_samples(mean: Floats, covariance: Floats, probability: float, count: int, rng: Generator) -> Floats:
    """Draw points uniformly by direction from a quantile surface (Algorithm 3).

    Args:
        mean: Centre. Shape (dimension,).
        covariance: Symmetric, no negative eigenvalue. Shape (dimension, dimension).
        probability: Share of the distribution inside the surface, between 0 and 1.
        count: How many points.
        rng: Source of the directions.

    Returns:
        Shape (count, dimension).
    """
    centre = np.asarray(mean, dtype=np.float64)
    stretched = quantile_radius(probability, len(centre)) * square_root(covariance)
    return directions(rng, (count, len(centre))) @ stretched + centre


def threshold() -> Findings:
    """Move the threshold by the printed cases on costs whose quantile is known."""
    rng, settings = np.random.default_rng(0), OnlineSettings(elite=SHARE, trajectories=TRAJECTORIES, weight=1e-9)
    state = start(np.zeros((1, 3)), VARIANCE, rng, settings=settings)
    costs, samples, valid = rng.normal(size=DRAWS), np.zeros((DRAWS, 1, 3)), np.ones(DRAWS, dtype=np.bool_)
    moved = tell_all(state, samples[:1], np.zeros(1), valid[:1], settings=settings)
    elite = tell_all(moved, samples[:1], np.array([-1.0]), valid[:1], settings=settings).threshold
    other = tell_all(moved, samples[:1], np.array([1.0]), valid[:1], settings=settings).threshold
    missed = tell_all(moved, samples[:1], np.array([1.0]), ~valid[:1], settings=settings)
    rested = tell_all(moved, samples, costs, valid, settings=settings)
    step = moved.step
    return Findings(
        (
            holds("a new elite sample moves it by (1 - rho) Delta", math.isclose(elite, moved.threshold - (1 - SHARE) * step), "lambda + (1 - rho) Delta"),
            holds("another one moves it by rho Delta the other way", math.isclose(other, moved.threshold + SHARE * step), "lambda - rho Delta"),
            holds("a path that misses its hoop moves nothing", (missed.threshold, missed.step) == (moved.threshold, step)),
            Quantity("share of N(0, 1) below where it rests", 0.5 * (1 + math.erf(rested.threshold / math.sqrt(2))), paper="rho = 0.05", digits=3),
        )
    )  # fmt: skip


def inversion() -> Findings:
    """Check that the quantile inverts the distribution function, in one dimension and three."""
    rng = np.random.default_rng(0)
    drawn = np.linalg.norm(rng.standard_normal((DRAWS, 3)), axis=1)
    below = [float(np.mean(drawn <= quantile_radius(p, 3))) for p in (0.05, 0.5, 0.95)]
    one = [math.erf(quantile_radius(p, 1) / math.sqrt(2)) for p in (0.05, 0.5, 0.95)]
    return Findings(
        (
            *(Quantity(f"Phi(Phi^-1({p})), three dimensions", share, paper=str(p), digits=3) for p, share in zip((0.05, 0.5, 0.95), below, strict=True)),
            holds("Phi(Phi^-1(p)) = p in one dimension", np.allclose(one, (0.05, 0.5, 0.95))),
            holds("the quantile grows with p, as an infimum over Phi(x) >= p does", quantile_radius(0.05, 3) < quantile_radius(0.5, 3) < quantile_radius(0.95, 3)),
        )
    )  # fmt: skip


def quantile_function() -> Findings:
    """Compare the share inside F^-1 with the covariance's root, and with the covariance itself as printed."""
    rng, covariance = np.random.default_rng(0), VARIANCE * np.eye(3)
    drawn = np.linalg.norm(rng.multivariate_normal(np.zeros(3), covariance, DRAWS), axis=1)
    radius = quantile_radius(SHARE, 3)
    ours = np.linalg.norm(quantile_samples(np.zeros(3), covariance, SHARE, 100, rng), axis=1)
    return Findings(
        (
            Quantity("share inside F^-1(0.05), with the root of Sigma", float(np.mean(drawn <= ours[0])), paper="rho = 0.05", digits=3),
            Quantity("share inside it with Sigma as printed", float(np.mean(drawn <= VARIANCE * radius)), digits=3),
            holds("all points of the surface are equally far from the mean", np.allclose(ours, ours[0])),
        )
    )  # fmt: skip


def update_step() -> Findings:
    """Compare the step of eq. (12) with its closed form, and its factor with drawn samples."""
    rng, sigma = np.random.default_rng(0), math.sqrt(VARIANCE)
    unit = directions(rng, (5, 3))
    root = np.tile(sigma * np.eye(3), (5, 1, 1))
    step = quantile_step(root, unit, SHARE, TRAJECTORIES)
    gap = quantile_radius(1 - SHARE + 1 / TRAJECTORIES, 3) - quantile_radius(1 - SHARE, 3)
    apart = float(np.mean(np.abs(np.diff(rng.normal(0, sigma, (DRAWS, 2)), axis=1))))
    return Findings(
        (
            Quantity("mean distance of two samples over sigma", apart / sigma, paper="2/sqrt(pi) = 1.128", digits=3),
            holds("eq. (12) for Sigma = sigma^2 I", np.allclose(step, VARIANCE * gap * unit / math.sqrt(math.pi))),
            Quantity("F^-1(1 - rho + 1/N) - F^-1(1 - rho) for unit deviations", gap, digits=3),
            holds("N <= 1/rho is rejected", _rejects(0.05, 20), "1 - rho + 1/N"),
        )
    )


def _rejects(elite: float, trajectories: int) -> bool:
    from verify.data import BadInput

    try:
        OnlineSettings(elite=elite, trajectories=trajectories)
    except BadInput:
        return True
    return False


def scalar_form() -> Findings:
    """Compare the scalar step with the printed minimum of sums."""
    steps = np.random.default_rng(0).normal(size=(100, 5, 3))
    printed = [min(sum(abs(entry) for entry in row) for row in step) for step in steps]
    return Findings(
        (holds("min over i of the sum over j of |Delta_ij|, 100 matrices", np.allclose(scalar_step(steps), printed)),)
    )


def quantile_sampling() -> Findings:
    """Draw from a quantile surface of a distribution that is not round."""
    rng = np.random.default_rng(0)
    shape = rng.normal(size=(3, 3))
    mean, covariance = rng.normal(size=3), shape @ shape.T
    offsets = quantile_samples(mean, covariance, SHARE, DRAWS, rng) - mean
    levels = np.einsum("ni,ij,nj->n", offsets, np.linalg.inv(covariance), offsets)
    drawn = rng.multivariate_normal(np.zeros(3), covariance, DRAWS)
    inside = np.einsum("ni,ij,nj->n", drawn, np.linalg.inv(covariance), drawn) <= levels[0]
    return Findings(
        (
            holds("(Y - mu)' Sigma^-1 (Y - mu) = c^2 for every sample", np.allclose(levels, quantile_radius(SHARE, 3) ** 2), "c^2 = chi^2 at rho"),
            Quantity("share of the distribution inside the surface", float(np.mean(inside)), paper="rho = 0.05", digits=3),
            Quantity("mean of the directions drawn", float(np.linalg.norm(offsets.mean(axis=0)) / np.linalg.norm(offsets, axis=1).mean()), paper="0", digits=3),
        )
    )  # fmt: skip


def one_step() -> Findings:
    """Compare what Algorithm 4 learns from paths with its lines, mirrored for minimisation."""
    rng, settings = np.random.default_rng(0), OnlineSettings(elite=SHARE, trajectories=TRAJECTORIES)
    state = start(_means(), VARIANCE, rng, settings=settings)
    samples = ask_all(state, rng, settings.window)
    falling = np.linspace(2.0, 0.0, settings.window)  # each is below all thresholds before it
    told = tell_all(state, samples, falling, np.ones(settings.window, dtype=np.bool_), settings=settings)
    delta = state.step
    for count, (before, after) in enumerate(itertools.pairwise(falling), 1):
        beta = settings.weight * math.exp(-settings.decay * count)
        delta = (1 - beta) * delta + beta * abs(after - before)
    spread = np.einsum("npi,npj->pij", samples - samples.mean(axis=0), samples - samples.mean(axis=0)) / len(samples)
    fitted = spread + settings.floor**2 * np.eye(3)
    return Findings(
        (
            holds("lines 16 and 21: Delta moves by Section 6.4", math.isclose(told.step, delta), "(1 - beta) Delta + beta |f_t - f_(t-1)|"),
            holds("line 16: the mean is the elites' maximum-likelihood mean", np.allclose(told.mean, samples.mean(axis=0))),
            holds("line 16: so is the covariance, with a floor of 4 mm", np.allclose(np.einsum("pij,pjk->pik", told.root, told.root), fitted)),
            Quantity("elites of 25 falling costs", told.found, digits=0),
        )
    )  # fmt: skip


def _means() -> Floats:
    """Return five points on the straight line from a robot to its hoop. Shape (5, 3)."""
    return START + np.linspace(0, 1, 7)[1:-1, None] * (HOOP - START)


def _search(settings: OnlineSettings, seed: int) -> Iterator[tuple[int, OnlineState, Generator]]:
    """Yield the steps of a search that minimises the length of the way to the hoop, one path a step."""
    rng = np.random.default_rng(seed)
    state = start(_means(), VARIANCE, rng, settings=settings)
    for step in range(STEPS + 1):
        yield step, state, rng
        paths = ask_all(state, rng, 1)
        whole = np.concatenate([np.broadcast_to(START, (1, 1, 3)), paths, np.broadcast_to(HOOP, (1, 1, 3))], axis=1)
        cost = np.linalg.norm(np.diff(whole, axis=1), axis=2).sum(axis=1)
        state = tell_all(state, paths, cost, np.ones(1, dtype=np.bool_), settings=settings)


def samples_over_time() -> Findings:
    """Draw samples at the quantile around five means while the online search runs for 10 s."""
    settings = OnlineSettings(elite=SHARE, trajectories=TRAJECTORIES, floor=0.01)
    spreads: dict[int, Floats] = {}
    clouds_at: dict[int, Floats] = {}
    for step, state, rng in _search(settings, 0):
        if step % (STEPS // 5) == 0:
            drawn = [
                quantile_samples(mean, root @ root.T, SHARE, 100, rng)
                for mean, root in zip(state.mean, state.root, strict=True)
            ]
            spreads[step] = np.array(
                [np.linalg.norm(points - mean, axis=1).mean() for points, mean in zip(drawn, state.mean, strict=True)]
            )
            clouds_at[step] = np.concatenate(drawn)
    last = spreads[STEPS]
    shown = {f"t = {step / RATE:g} s": points for step, points in clouds_at.items() if step in (0, STEPS)}
    return Findings(
        (
            Quantity("mean distance of samples from their means at first", float(spreads[0].mean()), "m", digits=3),
            *(Quantity(f"mean {index} of five after 10 s", float(value), "m", digits=3) for index, value in enumerate(last, 1)),
            holds("the clouds shrink from 0 s to 10 s", last.max() < spreads[0].min(), "the samples close in on the path"),
        ),
        (clouds("Samples at the 0.05 quantile around five means, at first and after 10 s.", shown),),
    )  # fmt: skip


def step_over_time() -> Findings:
    """Follow Delta over 10 s at 50 Hz for the three pairs a, b."""
    rows: list[Quantity] = []
    curves: dict[str, list[float]] = {}
    changes: dict[float, float] = {}
    for a, b in ((0.1, 0.01), (0.01, 0.001), (0.001, 0.0001)):
        values = [state.step for _, state, _ in _search(OnlineSettings(weight=a, decay=b), 1)]
        at = {"at first": 0, "after 2 s": 100, "after 5 s": 250, "after 10 s": 500}
        rows += [
            Quantity(f"Delta {when}, a = {a}", values[step], "m", digits=4 if step == 0 else 3) for when, step in at.items()
        ]
        changes[a] = max(abs(value - values[0]) for value in values[:101])
        curves[f"a = {a}, b = {b}"] = values[::5]
    times = [step / RATE for step in range(0, STEPS + 1, 5)]
    ordered = changes[0.1] > changes[0.01] > changes[0.001]
    return Findings(
        (*rows, holds("larger a and b move Delta sooner", ordered, "a greater dependence on the costs' differences")),
        (lines("Delta over time for three pairs a, b.", times, curves, ("time (s)", "Delta (m)")),),
    )


QUANTILE_PARTS: tuple[Element, ...] = (
    Element(
        id="2022-threshold", publication="2022", kind="section", title="Section 6: the four cases of the elite threshold",
        says="A new elite sample moves lambda by (1 - rho) Delta, any other by rho Delta the other way.",
        differs="Costs are minimised here, so every sign is mirrored; a path that misses its hoop counts for nothing.",
        by=("ltlplan.online_mtac.cross_entropy.tell_all",), compute=threshold,
    ),
    Element(
        id="2022-eq-9", publication="2022", kind="equation", title="Fact 6.1 and eq. (9): inversion", also=("2022-fact-6.1",),
        says="Phi^-1(p) is an infimum, and Phi^-1 of a uniform variable has the distribution Phi.",
        differs="The paper takes the infimum over Phi(x) <= p, which is always minus infinity; the quantile's is over Phi(x) >= p.",
        by=("ltlplan.paths.cross_entropy.quantile.quantile_radius",), compute=inversion,
    ),
    Element(
        id="2022-eq-10", publication="2022", kind="equation", title="Eq. (10): quantile function of N(mu, Sigma)",
        says="F^-1(rho) = mu + Sigma Phi^-1(rho).",
        differs="The square root of Sigma is used, as Algorithm 3 has it: with Sigma itself the share inside is not rho.",
        by=("ltlplan.paths.cross_entropy.quantile.square_root",), compute=quantile_function,
    ),
    Element(
        id="2022-eq-12", publication="2022", kind="equation", title="Eqs. (11) and (12): the update step", also=("2022-eq-11",),
        says="Delta is Sigma / sqrt(pi) times the gap between two quantile points.",
        differs="The square root of Sigma is meant; both samples share a direction, or their difference would be noise.",
        by=("ltlplan.paths.cross_entropy.quantile.quantile_step", "ltlplan.paths.cross_entropy.quantile.check_quantile"), compute=update_step,
    ),
    Element(
        id="2022-eq-13", publication="2022", kind="equation", title="Fact 6.2 and eq. (13): scalar step", also=("2022-fact-6.2",),
        says="The scalar step is the least row sum of absolute entries of Delta.", differs="",
        by=("ltlplan.paths.cross_entropy.quantile.scalar_step",), compute=scalar_form,
    ),
    Element(
        id="2022-alg-3", publication="2022", kind="algorithm", title="Algorithm 3 and Fact 6.3: quantile sampling", also=("2022-fact-6.3",),
        says="A direction, uniform on the sphere, is stretched by c times the root of Sigma.",
        differs="Printed line 6 sums squares over the samples; each point is normalised by itself here.",
        by=("ltlplan.reproduction.quantile_parts.quantile_samples", "ltlplan.paths.cross_entropy.quantile.directions"), compute=quantile_sampling,
    ),
    Element(
        id="2022-alg-4", publication="2022", kind="algorithm", title="Algorithm 4 and Section 6.4: online cross-entropy", also=("2022-section-6.4",),
        says="Each step samples one path, moves the threshold, refits the Gaussian to elites and updates Delta.",
        differs="Delta comes from quantiles once and then follows Section 6.4; the fit reads a window of elites, as one sample has no covariance.",
        by=("ltlplan.online_mtac.cross_entropy.tell_all", "ltlplan.online_mtac.cross_entropy.start"), compute=one_step,
    ),
    Element(
        id="2022-fig-12", publication="2022", kind="figure", title="Fig. 12: samples at the quantile",
        says="With Sigma = 0.05 I and rho = 0.05, samples around five means close in on the path within 10 s.",
        differs="One sample a step learns slowly: the clouds shrink to about 60 % in 500 steps. Flights use more paths a step.",
        by=("ltlplan.reproduction.quantile_parts.quantile_samples", "ltlplan.online_mtac.cross_entropy.tell_all"), compute=samples_over_time,
    ),
    Element(
        id="2022-fig-13", publication="2022", kind="figure", title="Fig. 13: Delta for values of a and b",
        says="With a = 0.1 Delta quickly follows the costs' differences; with a = 0.001 it hardly moves.",
        differs="Ours tends to the mean difference of two samples' costs, Section 6.4's fixed point, not to zero.",
        by=("ltlplan.online_mtac.cross_entropy.tell_all",), compute=step_over_time,
    ),
)  # fmt: skip
