"""A plan as a vehicle that flies `mellinger` on its filter follows it: set-points, and what the linear loop makes of them alone.

The loop's states are about the hover in which the plan begins. What set-points make of them is known: what laws are beside linear ones there is driven
through the loop, over and over, until it changes no more. What is left of it is counted.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from verify.arithmetic.balls import Floats
from verify.data.trajectory import Trajectory
from verify.data.vehicle import GRAVITY
from verify.tracking.on_board.onboard_filter import FRAME
from verify.tracking.on_board.onboard_laws import ASKED, FORCE, BoardLoop
from verify.tracking.on_board.onboard_loop import BODY, COVARIANCES, DRIVEN, GYRO, LIFT, ROTORS, SPEED, SUBSTEPS, TILT, H, N
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
        values: Outputs after jumps and steps. Shape (frames, SUBSTEPS + 1, outputs).
        ends: What is read before jumps. Shape (frames, ends).
        off: How far off these may be. Shape (outputs and ends,).
        asked: Thrusts that are asked for in each step. Shape (frames, SUBSTEPS, 4).
        wanted: Those before they are mixed.
        middles: By law: its variables at all instants. Shape (variables, instants) each.
        quickest: Bounds of the derivatives of body and rotors. Shape (BODY,).
        away: Distance from the plan at the ends of a frame's steps, and by how much the plan strays from a line between them, m. Shape (frames,).
        rest: By input, what is left of the laws beside linear ones that is not driven through the loop. By how much set-points may be off.
    """

    values: Floats
    ends: Floats
    off: Floats
    asked: Floats
    wanted: Floats
    middles: Mapping[str, Floats]
    quickest: Floats
    away: Floats
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
    direct = np.zeros((N + 7, 12))
    direct[FORCE], direct[ASKED] = loop.told[:3], loop.told[3:]
    told, used = setpoints(plan[:-1:SUBSTEPS]), np.zeros((frames, SUBSTEPS * _WIDTH + 9 + COVARIANCES))
    values, ends, off = loop.responses.driven(np.concatenate([told, used], axis=1), direct)
    for _ in range(_PASSES):
        before, (used, _) = used, _remainders(loop, values, _middles(values, ends, used))
        values, ends, off = loop.responses.driven(np.concatenate([told, used], axis=1), direct)
        if float(np.abs(used - before).max()) < _NEAR:
            break
    middles = _middles(values, ends, used)
    found, wrong = _remainders(loop, values, middles)
    left = (np.abs(found - used) + wrong).max(0)
    lag = np.linalg.norm(values[:, 1:, :3].reshape(-1, 3) - plan[1:, 0], axis=1)
    strays = 0.125 * H * H * most[2] + jumps[0] + H * jumps[1]
    steps = left[: SUBSTEPS * _WIDTH].reshape(SUBSTEPS, _WIDTH).max(0)
    parts = np.split(np.concatenate([steps, left[SUBSTEPS * _WIDTH :]]), [13, 17, 18, 19, 28])
    asked = values[:, :-1, ASKED] + _steps(used)[..., 13:17]
    return Followed(
        values,
        ends,
        off,
        asked,
        values[:, :-1, ASKED] + loop.lawful(loop.known("aim", middles["aim"])[0].T[..., None])[..., :4, 0].reshape(asked.shape),
        middles,
        _quickest(loop, values, asked, _steps(used)[..., :13]),
        lag.reshape(frames, SUBSTEPS).max(1) + float(np.linalg.norm(off[:3])) + strays + _LOOSE,
        dict(zip((*STEPPED, *JUMPED), parts, strict=True)) | {"setpoint": np.repeat(loose, 3)},
    )


def _steps(used: Floats) -> Floats:
    """Return the inputs of steps. Shape (frames, SUBSTEPS, _WIDTH)."""
    return used[:, : SUBSTEPS * _WIDTH].reshape(len(used), SUBSTEPS, _WIDTH)


def _quickest(loop: BoardLoop, values: Floats, asked: Floats, pushed: Floats) -> Floats:
    """Bound the derivatives of body and rotors at all times.

    Raises:
        ArithmeticError: They change too fast.
    """
    body = np.abs(values[..., :BODY]).max((0, 1)) + 1e-9
    fixed, linear = np.zeros(BODY), np.abs(loop.flow.derivative)
    fixed[DRIVEN] = np.abs(pushed).max((0, 1)) + 1e-6
    fixed[DRIVEN] += np.abs(np.pad(loop.hover["motion"][:9, 13:17], ((0, 4), (0, 0)))) @ np.abs(asked).max((0, 1))
    fixed[ROTORS] += np.abs(asked).max((0, 1)) / loop.airframe.rotor_lag
    quickest = fixed
    for _ in range(100):
        after = linear @ (body + H * quickest) + fixed
        if np.all(after < quickest):
            return quickest
        quickest = 1.002 * after + 1e-12
    raise ArithmeticError("its plan turns too fast")


def _middles(values: Floats, ends: Floats, used: Floats) -> dict[str, Floats]:
    """Return the variables of all laws where set-points alone lead. Shape (variables, instants) each."""
    start, after, last = values[:, :-1], values[:, 1:], values[:, -1]
    middle, none, nothing = (
        0.5 * (start[..., DRIVEN] + after[..., DRIVEN]),
        np.zeros((*start.shape[:2], 5)),
        np.zeros((len(ends), 9)),
    )
    found = {
        "motion": [middle, start[..., ASKED] + _steps(used)[..., 13:17], none],
        "aim": [start[..., FORCE], start[..., 29:32]],
        "lift": [after[..., TILT], (after[..., SPEED] - start[..., SPEED]) / H],
        "filter": [ends[:, :3], last[:, 26:32], last[:, GYRO], last[:, [LIFT]], ends[:, 3:6], nothing, ends[:, 6:]],
    }
    joint = {name: np.concatenate(parts, axis=-1) for name, parts in found.items()}
    return {name: each.reshape(-1, each.shape[-1]).T for name, each in joint.items()}


def _remainders(loop: BoardLoop, values: Floats, middles: Mapping[str, Floats]) -> tuple[Floats, Floats]:
    """Return what laws are beside linear ones, as inputs of each frame, and how far off that may be."""
    found = {name: loop.known(name, each) for name, each in middles.items()}

    def inputs(which: int, turn: Floats) -> Floats:
        push, lift, filtered = (found[name][which].T for name in ("motion", "lift", "filter"))
        return np.concatenate([np.concatenate([push, turn, lift], axis=1).reshape(len(values), -1), filtered], axis=1)

    turn, off = loop.lawful(found["aim"][0].T[..., None])[..., 0], loop.lawful_size(found["aim"][1].T[..., None])[..., 0]
    wanted = values[:, :-1, ASKED].reshape(-1, 4) + turn[:, :4]
    turn[:, :4] += loop.law.mixed(wanted) - wanted
    off[:, :4] = 3.0 * off[:, :4].sum(1, keepdims=True) + 1e-12
    return inputs(0, turn), inputs(1, off)


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
