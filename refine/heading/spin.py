"""A heading for flights that tumble: yaw chosen so that the body hardly turns about its own z axis.

A vehicle that leans over, or beyond, cannot keep its yaw without spinning about its thrust axis, and yaw torque is what a
quadrotor has least of. Spin depends on heading and its rate alone, so a search over a grid of headings finds a yaw that
spins little, which is then fitted by pieces and improved by damped Gauss-Newton steps that weigh the greatest spins most.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from refine.heading.least_squares import bases, fitted
from refine.limits.flatness import flat_samples
from refine.limits.limits import Limits
from refine.limits.stretching import stretch_to_limits
from refine.spline.basis import ORDER
from refine.spline.spline import Spline
from verify.data import GRAVITY

Floats = NDArray[np.float64]

_SAMPLES = 64
_GRID = 96
_MOVES = 10
_ROUNDS = 40
_STEP = 1e-6
_PACES = (1.0, 1.1, 1.25, 1.5, 1.75, 2.0, 2.5)


def least_spin(path: Spline) -> Spline:
    """Return yaw with a small rate about the body's z axis, on the path's own pieces.

    Args:
        path: Three axes. Thrust must not vanish.

    Returns:
        One axis, rad, unwrapped.
    """
    at = np.linspace(0.0, 1.0, _SAMPLES)
    motion = tuple(path.sample(at, derivative) for derivative in (2, 3, 4))
    planned = _planned(path, at)
    paces = (np.gradient(planned, axis=1) / (path.durations[:, None] * np.gradient(at))).ravel()
    planned = planned.ravel()
    free = np.ones((len(path) + 1, ORDER), dtype=bool)
    free[0, 1:] = False  # at rest, as after a hover
    values, rates, _ = bases(path, at)
    slope = (_spin(motion, planned + _STEP, paces) - _spin(motion, planned - _STEP, paces)) / (2 * _STEP)
    states = fitted(path, values, planned, free, 1.0 + np.minimum(np.abs(slope), 100.0))
    spin = _spin(motion, values @ states, rates @ states)
    best, damping = states, 1e-3
    power = 2.0
    for _ in range(_ROUNDS):
        peak = np.abs(spin).max()
        weights = (np.abs(spin) / peak + 0.05) ** (power / 2 - 1)
        slope_value = (_spin(motion, values @ states + _STEP, rates @ states) - spin) / _STEP
        slope_rate = (_spin(motion, values @ states, rates @ states + _STEP) - spin) / _STEP
        jacobian = ((slope_value[:, None] * values + slope_rate[:, None] * rates) * weights[:, None])[:, free.ravel()]
        normal = jacobian.T @ jacobian
        step = np.zeros(states.shape)
        step[free.ravel()] = np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-9), -jacobian.T @ (weights * spin))
        trial = states + step
        trial_spin = _spin(motion, values @ trial, rates @ trial)
        if np.sum((weights * trial_spin) ** 2) < np.sum((weights * spin) ** 2):
            states, spin, damping = trial, trial_spin, max(damping / 4, 1e-9)
            power = min(power + 0.5, 10.0)
        else:
            damping *= 8
        if np.abs(spin).max() < np.abs(_spin(motion, values @ best, rates @ best)).max():
            best = states
    return Spline(path.durations, best.reshape(-1, ORDER, 1))


def with_least_spin(path: Spline, limits: Limits, *, safety: float = 2e-4) -> tuple[Spline, Spline]:
    """Return path and yaw, slowed as little as we can so that all limits hold.

    Slowing a finished heading lets its spin fall only with the pace, while a vehicle that flies more slowly leans less and
    needs another heading, so a few paces are tried, each with a heading of its own and with a constant one.

    Args:
        path: Three axes.
        limits: What must hold.
        safety: Share of each limit kept back.

    Raises:
        Infeasible: No pace helps; says which limit is in the way.
    """
    best: tuple[Spline, Spline] | None = None
    for pace in _PACES:
        if best is not None and pace * path.duration >= best[0].duration:
            break
        slower = path.stretched(pace)
        constant = Spline(slower.durations, np.zeros((len(slower) + 1, ORDER, 1)))
        for yaw in (least_spin(slower), constant):
            factor = stretch_to_limits(slower, yaw, limits, safety=safety)
            if best is None or slower.duration * factor < best[0].duration:
                best = slower.stretched(factor), yaw.stretched(factor)
    assert best is not None
    return best


def _spin(motion: tuple[Floats, ...], yaw: Floats, rate: Floats) -> Floats:
    """Return the rate about the body's z at all samples. Shape (pieces * samples,)."""
    shape = motion[0].shape[:2]
    acceleration, jerk, snap = motion
    flat = flat_samples(acceleration, jerk, snap, yaw.reshape(shape), rate.reshape(shape), np.zeros(shape))
    return flat.rates[2].ravel()


def _planned(path: Spline, at: Floats) -> Floats:
    """Return a yaw with little spin at samples, by dynamic programming over a grid of headings.

    Spin is A yaw' + B with A and B functions of time and heading. Headings half a turn apart spin alike, so the grid covers
    half a turn; it is singular only where thrust points along the pitch axis, which the costs there keep away from.
    """
    shape = (len(path), len(at))
    force = (path.sample(at, 2) + np.array([0.0, 0.0, GRAVITY])).reshape(-1, 3)
    jerk = path.sample(at, 3).reshape(-1, 3)
    size = np.linalg.norm(force, axis=-1, keepdims=True)
    z = force / size
    z_1 = (jerk - np.sum(z * jerk, axis=-1, keepdims=True) * z) / size
    grid = np.arange(_GRID) * (np.pi / _GRID)
    sin, cos = np.sin(grid), np.cos(grid)
    lean = -np.outer(z[:, 0], sin) + np.outer(z[:, 1], cos)  # z . y_C
    below = np.maximum(np.sqrt(np.maximum(1.0 - lean**2, 0.0)), 1e-2)  # y . y_C, the cosine of roll
    pitch = (
        np.outer(z_1[:, 0] * z[:, 2] - z_1[:, 2] * z[:, 0], cos) + np.outer(z_1[:, 1] * z[:, 2] - z_1[:, 2] * z[:, 1], sin)
    ) / below
    scale, offset = (z[:, 2, None] / below) / below, pitch * lean / below
    shy = 1e4 * np.maximum(np.abs(lean) - 0.7, 0.0) ** 2  # far away: between samples the singularity is narrow
    times = (path.knots[:-1, None] + path.durations[:, None] * at).ravel()
    moves = np.arange(-_MOVES, _MOVES + 1)
    source = (np.arange(_GRID)[:, None] - moves) % _GRID
    total = np.zeros(_GRID)
    back = np.zeros((len(times), _GRID), dtype=np.int64)
    for index in range(1, len(times)):
        step = times[index] - times[index - 1]
        if step <= 0.0:  # a joint is sampled from both sides
            back[index] = _MOVES
            continue
        rate = moves * (np.pi / _GRID) / step
        spin = 0.5 * (
            (scale[index][:, None] + scale[index - 1][source]) * rate + offset[index][:, None] + offset[index - 1][source]
        )
        costs = total[source] + step * (spin**2 + 1e-3 * rate**2 + shy[index][:, None])
        back[index] = np.argmin(costs, axis=1)
        total = costs[np.arange(_GRID), back[index]]
    state = int(np.argmin(total))
    yaw = np.zeros(len(times))
    for index in range(len(times) - 1, 0, -1):
        move = int(moves[back[index, state]])
        yaw[index - 1] = yaw[index] - move * (np.pi / _GRID)
        state = (state - move) % _GRID
    yaw += state * (np.pi / _GRID) - yaw[0]
    return yaw.reshape(shape)
