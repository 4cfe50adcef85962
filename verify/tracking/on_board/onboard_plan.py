"""A plan as a vehicle that flies `mellinger` on its filter follows it: set-points, and what the linear loop makes of them alone.

The loop's states are about the hover in which the plan begins. What set-points make of them is known: what laws are beside linear ones there is driven
through the loop, over and over, until it changes no more. What is left of it is counted.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from verify.arithmetic.balls import Floats
from verify.data.trajectory import Trajectory
from verify.data.vehicle import GRAVITY
from verify.tracking.on_board.onboard_filter import FRAME
from verify.tracking.on_board.onboard_laws import ASKED, FORCE, LAGGING, BoardLoop
from verify.tracking.on_board.onboard_loop import COVARIANCES, DRIVEN, GYRO, LIFT, SPEED, SUBSTEPS, TILT, H, N
from verify.tracking.on_board.onboard_responses import JUMPED, STEPPED
from verify.tracking.plan_samples import derivatives_at, sample_plan

_LOOSE = 1e-9
"""s by which instants of set-points, and share by which their numbers, may be off."""
_WIDTH = 19
"""Inputs of a step: motion (13), thrusts asked for (4), the sum about z, lift."""
_PASSES = 8
_NEAR = 1e-10
"""Change of what laws are beside linear ones at which it is known well enough."""
_STEEPEST = 0.3 * GRAVITY
"""m/s^2; plans that accelerate more have no proof."""


@dataclass(frozen=True, eq=False, slots=True)
class Followed:
    """Undisturbed flight of a loop along a plan.

    Attributes:
        most: Magnitudes of outputs at the ends of steps and after jumps, and of what is read before jumps. Shape (rows,).
        off: How far off these may be.
        pushed: Magnitudes of what the derivatives of velocity, attitude and rates are beside linear ones. Shape (9,).
        quickest: Largest accelerations, m/s^2. Shape (3,).
        away: Largest distance from the plan at the ends of steps, and by how much the plan strays from a line between them, m.
        time: Of the largest distance, s.
        rest: By input, what is left of the laws beside linear ones that is not driven through the loop. By how much set-points may be off.
    """

    most: Floats
    off: Floats
    pushed: Floats
    quickest: Floats
    away: float
    time: float
    rest: Mapping[str, Floats]


def follow(loop: BoardLoop, path: Trajectory, frames: int) -> Followed:
    """Return what the set-points of a plan at heading 0 make of a loop.

    Args:
        loop: The loop.
        path: The plan; after its end the vehicle hovers.
        frames: Of the flight.

    Raises:
        ArithmeticError: The plan accelerates too much.
    """
    times = H * np.arange(frames * SUBSTEPS + 1, dtype=np.float64)
    plan = derivatives_at(path, times)
    plan[:, 0] -= plan[0, 0]
    bounds = sample_plan(path, FRAME * frames, 0.0, 0.0)
    most, jumps = np.hypot(bounds.across, bounds.along).max(0) * (1.0 + 1e-12), bounds.jumps.max(0)
    if not most[2] < _STEEPEST:
        raise ArithmeticError(f"its plan accelerates by {most[2]:.2f} m/s^2, more than the {_STEEPEST:.2f} of the proof")
    loose = _LOOSE * (1.0 + most[:4] + most[1:5]) + jumps[:4]
    least = GRAVITY - most[2]
    loose[3] = loose[3] / least + 5.0 * most[3] * loose[2] / least**2  # of a jerk along axes that turn with the force
    direct = np.zeros((N + 11, 12))
    direct[FORCE], direct[ASKED], direct[LAGGING] = loop.told[:3], loop.told[3:], loop.told[3:]
    told, used = setpoints(plan[:-1:SUBSTEPS]), np.zeros((frames, SUBSTEPS * _WIDTH + 9 + COVARIANCES))
    values, ends, off = loop.responses.driven(np.concatenate([told, used], axis=1), direct)
    for _ in range(_PASSES):
        before, (used, _) = used, _remainders(loop, values, ends, used)
        values, ends, off = loop.responses.driven(np.concatenate([told, used], axis=1), direct)
        if float(np.abs(used - before).max()) < _NEAR:
            break
    found, wrong = _remainders(loop, values, ends, used)
    left = (np.abs(found - used) + wrong).max(0)
    lag = np.linalg.norm(values[:, 1:, :3].reshape(-1, 3) - plan[1:, 0], axis=1)
    worst = int(lag.argmax())
    strays = 0.125 * H * H * most[2] + jumps[0] + H * jumps[1]
    largest = np.concatenate([np.abs(values).max((0, 1)), np.abs(ends).max(0)])
    steps = left[: SUBSTEPS * _WIDTH].reshape(SUBSTEPS, _WIDTH).max(0)
    beside = np.abs(used[:, : SUBSTEPS * _WIDTH].reshape(-1, _WIDTH)).max(0) + steps
    largest[ASKED], largest[LAGGING] = largest[ASKED] + beside[13:17], largest[LAGGING] + beside[13:17]
    parts = np.split(np.concatenate([steps, left[SUBSTEPS * _WIDTH :]]), [13, 17, 18, 19, 28])
    return Followed(
        largest + off,
        off,
        beside[:9],
        np.abs(np.diff(values[:, :, SPEED], axis=1)).max((0, 1)) / H + 2.0 * off[SPEED] / H,
        float(lag.max()) + float(np.linalg.norm(off[:3])) + strays + _LOOSE,
        float(times[1 + worst]),
        dict(zip((*STEPPED, *JUMPED), parts, strict=True)) | {"setpoint": np.repeat(loose, 3)},
    )


def _remainders(loop: BoardLoop, values: Floats, ends: Floats, before: Floats) -> tuple[Floats, Floats]:
    """Return what laws are beside linear ones where set-points alone lead, as inputs of each frame, and how far off that may be."""
    frames, start, after = len(values), values[:, :-1], values[:, 1:]

    def at(name: str, variables: list[Floats]) -> tuple[Floats, Floats]:
        joint = np.concatenate(variables, axis=-1)
        found = loop.known(name, joint.reshape(-1, joint.shape[-1]).T)
        return found[0].T.reshape(*joint.shape[:-1], -1), found[1].T.reshape(*joint.shape[:-1], -1)

    asked_before = before[:, : SUBSTEPS * _WIDTH].reshape(frames, SUBSTEPS, _WIDTH)[:, :, 13:17]
    middle, none = 0.5 * (start[..., DRIVEN] + after[..., DRIVEN]), np.zeros((frames, SUBSTEPS, 5))
    motion, motion_off = at("motion", [middle, start[..., ASKED] + asked_before, none])
    aim, aim_off = at("aim", [start[..., FORCE], start[..., 29:32]])
    lift, lift_off = at("lift", [after[..., TILT], (after[..., SPEED] - start[..., SPEED]) / H])
    last, nothing = values[:, -1], np.zeros((frames, 9))
    filtered, filtered_off = at(
        "filter", [ends[:, :3], last[:, 26:32], last[:, GYRO], last[:, [LIFT]], ends[:, 3:6], nothing, ends[:, 6:]]
    )

    def lawful(found: Floats, law: Callable[[Floats], Floats]) -> Floats:
        return law(found.reshape(-1, 4).T).T.reshape(frames, SUBSTEPS, 5)

    inputs, offs = list[Floats](), list[Floats]()
    for into, push, turn, up, law, filter_ in (
        (inputs, motion, aim, lift, loop.lawful, filtered),
        (offs, motion_off, aim_off, lift_off, loop.lawful_size, filtered_off),
    ):
        steps = np.concatenate([push, np.zeros((frames, SUBSTEPS, 4)), lawful(turn, law), up], axis=2)
        into.append(np.concatenate([steps.reshape(frames, -1), filter_], axis=1))
    return inputs[0], offs[0]


def setpoints(plan: Floats) -> Floats:
    """Return what the commander on board asks for at heading 0: place, speed, acceleration, and rates that turn the thrust as the jerk asks.

    Args:
        plan: Derivatives from the place to the jerk, m and s. Shape (times, at least 4, 3).

    Returns:
        Shape (times, 12).
    """
    force = plan[:, 2] + np.array([0.0, 0.0, GRAVITY])
    length = np.linalg.norm(force, axis=1, keepdims=True)
    z = force / length
    y = np.stack([0.0 * z[:, 0], z[:, 2], -z[:, 1]], axis=1) / np.hypot(z[:, 1], z[:, 2])[:, None]
    x = np.cross(y, z)
    jerk = plan[:, 3] / length
    rates = np.stack([-(y * jerk).sum(1), (x * jerk).sum(1), 0.0 * z[:, 0]], axis=1)
    return np.concatenate([plan[:, 0], plan[:, 1], plan[:, 2], rates], axis=1)
