"""Set-points as a controller is given them: what they are off the plan by where they are rounded, of some age, and without high derivatives.

The path is delayed by the middle of the age, so that what is off is on both sides of it; `behind` is the distance that this costs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from verify.arithmetic.balls import Floats
from verify.data.disturbance import StreamedSetpoints
from verify.tracking.plan_samples import ORDERS, PlanSamples
from verify.tracking.sampled_loop import GROW, TICK

_ORDERS = ORDERS - 1


@dataclass(frozen=True, eq=False, slots=True)
class GivenSetpoints:
    """Path, and the plan's force with drag, as a controller is given them at each command.

    Attributes:
        jerk: The force's derivative as it is given without errors. Shape (ticks, 3).
        snap: Its second derivative.
        spread: How far the force and both derivatives may be from these by errors, m/s^2 and s. Shape (3, ticks, 3).
        place: m, by which a position may be off; across and along. Shape (ticks, 2).
        speed: m/s, a velocity.
        force: m/s^2, the force.
        slid: By how much both derivatives may be off the plan's: across and along. Shape (2, ticks, 2).
        heading: rad, by which the heading is off, always by the same.
    """

    jerk: Floats
    snap: Floats
    spread: Floats
    place: Floats
    speed: Floats
    force: Floats
    slid: Floats
    heading: float

    @property
    def strayed(self) -> tuple[Floats, Floats]:
        """Distance until the next command between what both derivatives make of a force, and its rate, and what the plan's make. Shape (ticks,) each."""
        first, second = np.hypot(self.slid[0, :, 0], self.slid[0, :, 1]), np.hypot(self.slid[1, :, 0], self.slid[1, :, 1])
        return TICK * first + 0.5 * TICK**2 * second, first + TICK * second


def delay_of(told: StreamedSetpoints | None) -> float:
    """Return the middle of the age of set-points, s."""
    return 0.0 if told is None else 0.5 * sum(told.age)


def given_setpoints(plan: PlanSamples, told: StreamedSetpoints | None, drags: tuple[float, float]) -> GivenSetpoints:
    """Bound what set-points are off by.

    Args:
        plan: The path as it is sampled, delayed by the middle of their age.
        told: What is said of them; None where they are the plan's at each command.
        drags: Damping that the controller counts on, across and along, 1/s.
    """
    told = StreamedSetpoints() if told is None else told
    half = 0.5 * (told.age[1] - told.age[0])
    held = plan.at[:, :_ORDERS].copy()
    held[:, told.orders + 1 :] = 0.0
    off = np.zeros((_ORDERS, len(plan), 2))
    for order in range(told.orders + 1):
        for axis, (sizes, jumps) in enumerate(((plan.across, plan.jumps), (plan.along, plan.rises))):
            moved = half * _around(sizes[:, order + 1], half, most=True) + _around(jumps[:, order], half, most=False)
            off[order, :, axis] = (told.rounding[order] + (moved if half else 0.0)) * GROW
    damping = np.array(drags)
    forces = off[2:] + damping * off[1:-1]
    lost = np.abs(plan.at[:, :_ORDERS] - held).transpose(1, 0, 2)
    sides = np.stack([np.linalg.norm(lost[..., :2], axis=-1), lost[..., 2]], axis=-1)
    slid = forces[1:] + sides[3:] + damping * sides[2:-1]
    across, along = drags
    wide = np.array([across, across, along])
    derivatives = [held[:, order] + wide * held[:, order - 1] for order in (2, 3, 4)]
    turned = told.heading * np.array([np.linalg.norm(each[:, :2], axis=1) for each in derivatives])
    spread = np.concatenate([np.zeros((1, *forces.shape[1:])), forces[1:]])
    spread = np.stack([spread[..., 0] + turned, spread[..., 0] + turned, spread[..., 1]], axis=-1)
    return GivenSetpoints(
        derivatives[1], derivatives[2], spread * GROW, off[0], off[1], forces[0], slid * (1.0 + 1e-12), told.heading
    )


def behind(plan: PlanSamples, delay: float) -> Floats:
    """Bound the distance between a path and where its delayed one is, until the next command. Shape (ticks,)."""
    if not delay:
        return np.zeros(len(plan))
    ticks = math.ceil(delay / TICK) + 1
    pace = np.hypot(plan.across[:, 1], plan.along[:, 1])
    later = np.concatenate([pace, np.zeros(ticks)]), np.concatenate([plan.jumps[:, 0], np.zeros(ticks)])
    fastest = np.max([later[0][k : k + len(plan)] for k in range(ticks + 1)], axis=0)
    jumped = np.sum([later[1][k : k + len(plan)] for k in range(ticks + 1)], axis=0)
    return (delay * fastest + jumped) * (1.0 + 1e-9)


def _around(values: Floats, half: float, *, most: bool) -> Floats:
    """Return the largest, or the sum, of what stands in the commands within a time of each one, before and behind it."""
    ticks = math.ceil(half / TICK - 1e-9)
    wide = np.concatenate([np.zeros(ticks), values, np.full(ticks, values[-1])])
    shifted = [wide[k : k + len(values)] for k in range(2 * ticks + 1)]
    return np.max(shifted, axis=0) if most else np.sum(shifted, axis=0)
