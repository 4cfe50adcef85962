"""Response of the linear loops to what is known of a plan: set-points that age, feed-forward that lags, thrust that is not the commanded one."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from verify.arithmetic.balls import Floats, gamma
from verify.tracking.flatness import FedForward
from verify.tracking.sampled_loop import SUBSTEPS, TICK, Matrix, TickMaps

KNOWN_STEPPED = {"lateral": ("acc", "eacc"), "vertical": ("acc", "rate"), "heading": ()}
KNOWN_COMMANDED = {
    "lateral": ("place", "speed", "dj", "ej", "muj"),
    "vertical": ("place", "speed"),
    "heading": ("fj", "oj", "muj"),
}


Combined = Mapping[str, tuple[str, float, Floats]]
"""Further outputs: one of the loop's, times a factor, with something known added to it until the next command. Shape (ticks, axes)."""


def known_response(maps: TickMaps, kind: str, known: Mapping[str, Floats], further: Combined) -> dict[str, Floats]:
    """Return magnitudes of a loop's outputs under known inputs, each constant between two commands; rounding is added.

    Args:
        maps: Of the loop.
        kind: `lateral`, `vertical` or `heading`.
        known: By input. Shape (ticks, axes) each.
        further: Outputs beside the loop's.

    Returns:
        By output. Shape (ticks,): lengths over the axes.
    """
    loop = maps.loop
    stepped, commanded = KNOWN_STEPPED[kind], KNOWN_COMMANDED[kind]
    enter = _entered(maps, stepped, commanded)
    rows = np.array([*loop.outputs.values()])
    values = np.stack([known[name] for name in (*stepped, *commanded)], axis=1)  # (ticks, inputs, axes)
    (ticks, inputs, axes), names = values.shape, (*loop.outputs, *loop.before)
    drawn = values.transpose(1, 0, 2).reshape(inputs, -1)
    last = enter[-1]
    states = np.zeros((ticks + 1, len(loop.states), axes))
    for tick, entering in enumerate(last.mid @ values):
        states[tick + 1] = maps.tick.mid @ states[tick] + entering
    largest = np.max(maps.norm(states[1:].transpose(1, 0, 2).reshape(len(loop.states), -1)).reshape(ticks, axes), axis=0)
    entered = (last.rad + gamma(inputs + 2) * np.abs(last.mid)).T / maps.weights
    begun = np.max(np.abs(values).transpose(0, 2, 1) @ entered, axis=(0, 2)) * 2.0
    before = states[:-1].transpose(1, 0, 2).reshape(len(loop.states), -1)
    outputs = np.zeros((len(names), ticks * axes))
    if loop.before:
        held = loop.states.index("p")
        outputs[-2] = before[loop.states.index("xi_seen")] + drawn[len(stepped)]
        outputs[-1] = loop.jump.mid[held] @ before + enter[0].mid[held] @ drawn - before[held]
    beside = {name: np.zeros((ticks, axes)) for name in further}
    for read, one in zip(maps.read.mid.reshape(SUBSTEPS + 1, len(rows), -1), enter, strict=True):
        moved = read @ before + (Matrix.exact(rows) @ one).mid @ drawn
        outputs[: len(rows)] = np.maximum(outputs[: len(rows)], np.abs(moved))
        for name, (of, factor, added) in further.items():
            at = moved[names.index(of)].reshape(ticks, axes)
            beside[name] = np.maximum(beside[name], np.abs(factor * at + added))
    error = maps.error(largest, begun).max(1)[:, None] + gamma(64) * float(np.abs(values).max()) * 1e3
    rows_of = {name: (outputs[row].reshape(ticks, axes), error[row]) for row, name in enumerate(names)}
    for name, (of, factor, added) in further.items():
        rows_of[name] = beside[name], factor * error[names.index(of)] + gamma(4) * float(np.abs(added).max())
    return {
        name: (np.linalg.norm(sizes, axis=1) + off * np.sqrt(axes)) * (1.0 + 1e-12) for name, (sizes, off) in rows_of.items()
    }


def turned_at_commands(alone: FedForward) -> Floats:
    """Return twice the vector of the quaternion by which an attitude that turned on since the command before is off what is fed forward then. Shape (ticks, 3).

    It turned by T w + T^2 a / 2 + T^3 (w x a) / 12, but for terms of fifth order (Magnus). Before the first command it is level.

    Args:
        alone: What is fed forward, without feedback.
    """
    z, rates, changes = (
        np.stack([jet.middle for jet in jets], axis=1) for jets in (alone.axis, alone.rates, alone.rates_change)
    )
    level = np.hypot(z[:, 0], z[:, 2])
    x = np.stack([z[:, 2] / level, np.zeros(len(z)), -z[:, 0] / level], axis=1)
    frames = np.stack([x, np.cross(z, x), z], axis=2)
    turned = TICK * rates + 0.5 * TICK**2 * changes + TICK**3 / 12.0 * np.cross(rates, changes)
    angle = np.linalg.norm(turned, axis=1)[:, None, None]
    skew = np.cross(np.eye(3)[None], turned[:, None])  # rows e_k x v: the matrix of v x
    ahead = frames @ (np.eye(3) + np.sinc(angle / np.pi) * skew + 0.5 * np.sinc(0.5 * angle / np.pi) ** 2 * (skew @ skew))
    apart = frames.transpose(0, 2, 1) @ np.concatenate([np.eye(3)[None], ahead[:-1]])
    vector = np.stack(
        [apart[:, 2, 1] - apart[:, 1, 2], apart[:, 0, 2] - apart[:, 2, 0], apart[:, 1, 0] - apart[:, 0, 1]], axis=1
    )
    return vector / np.sqrt(1.0 + np.trace(apart, axis1=1, axis2=2))[:, None]


def _entered(maps: TickMaps, stepped: tuple[str, ...], commanded: tuple[str, ...]) -> list[Matrix]:
    """Return what inputs leave after the jump and after each step of a command. Shape (states, inputs) each."""
    loop = maps.loop
    columns = [loop.stepped[name] for name in stepped]
    entering = Matrix(
        np.concatenate([c.mid for c in columns] + [np.zeros((len(loop.states), len(commanded)))], axis=1),
        np.concatenate([c.rad for c in columns] + [np.zeros((len(loop.states), len(commanded)))], axis=1),
    )
    taken = [loop.commanded[name] for name in commanded]
    now = Matrix(
        np.concatenate([np.zeros((len(loop.states), len(stepped)))] + [c.mid for c in taken], axis=1),
        np.concatenate([np.zeros((len(loop.states), len(stepped)))] + [c.rad for c in taken], axis=1),
    )
    now = loop.record(now) if loop.seen == 0 else now
    found = [now]
    for step in range(SUBSTEPS):
        moved = loop.step @ now
        mid = moved.mid + entering.mid
        now = Matrix(mid, moved.rad + entering.rad + gamma(2) * np.abs(mid))
        if step + 1 == loop.seen:
            now = loop.record(now)
        found.append(now)
    return found
