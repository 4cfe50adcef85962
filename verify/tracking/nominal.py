"""Response of the linear loops to what is known of a plan: set-points that age, feed-forward that lags, thrust that is not the commanded one."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from verify.arithmetic.balls import Floats, gamma
from verify.tracking.sampled_loop import SUBSTEPS, Matrix, TickMaps

KNOWN_STEPPED = {"lateral": ("acc", "eacc"), "vertical": ("acc", "rate")}
KNOWN_COMMANDED = {"lateral": ("place", "speed", "dj", "ej", "muj"), "vertical": ("place", "speed")}


Combined = Mapping[str, tuple[str, float, Floats]]
"""Further outputs: one of the loop's, times a factor, with something known added to it until the next command. Shape (ticks, axes)."""


def known_response(maps: TickMaps, kind: str, known: Mapping[str, Floats], further: Combined) -> dict[str, Floats]:
    """Return magnitudes of a loop's outputs under known inputs, each constant between two commands; rounding is added.

    Args:
        maps: Of the loop.
        kind: `lateral` or `vertical`.
        known: By input. Shape (ticks, axes) each.
        further: Outputs beside the loop's.

    Returns:
        By output. Shape (ticks,): lengths over the axes.
    """
    loop = maps.loop
    stepped, commanded = KNOWN_STEPPED[kind], KNOWN_COMMANDED[kind]
    enter = _entered(maps, stepped, commanded)
    rows = Matrix.exact(np.array([*loop.outputs.values()]))
    read = [rows @ one for one in enter]
    reading = np.concatenate([one.mid for one in read])
    values = np.stack([known[name] for name in (*stepped, *commanded)], axis=1)  # (ticks, inputs, axes)
    ticks, _, axes = values.shape
    states, outputs = np.zeros((len(loop.states), axes)), np.empty((ticks, len(loop.outputs) + 2, axes))
    names = (*loop.outputs, *loop.before)
    combined = {name: (names.index(of), factor, added) for name, (of, factor, added) in further.items()}
    beside = {name: np.empty((ticks, axes)) for name in further}
    last, shape, largest = enter[-1], (SUBSTEPS + 1, len(loop.outputs), axes), np.zeros(axes)
    begun, held = np.zeros(axes), loop.states.index("p")
    entered = (last.rad + gamma(len(values[0]) + 2) * np.abs(last.mid)).T / maps.weights
    jump = loop.jump.mid[[held]]
    direct = enter[0].mid[[held]]
    for tick in range(ticks):
        drawn = values[tick]
        outputs[tick, -2] = states[loop.states.index("xi_seen")] + drawn[len(stepped)]
        outputs[tick, -1] = (jump @ states + direct @ drawn)[0] - states[held]
        moved = (maps.read.mid @ states + reading @ drawn).reshape(shape)
        outputs[tick, :-2] = np.abs(moved).max(0)
        for name, (row, factor, added) in combined.items():
            beside[name][tick] = np.abs(factor * moved[:, row] + added[tick]).max(0)
        states = maps.tick.mid @ states + last.mid @ drawn
        largest = np.maximum(largest, maps.norm(states))
        begun = np.maximum(begun, np.max(np.abs(drawn.T) @ entered, axis=1) * 2.0)
    error = maps.error(largest, begun).max(1)[:, None] + gamma(64) * float(np.abs(values).max()) * 1e3
    rows_of = {name: (outputs[:, row], error[row]) for row, name in enumerate(names)}
    for name, (row, factor, added) in combined.items():
        rows_of[name] = beside[name], factor * error[row] + gamma(4) * float(np.abs(added).max())
    return {
        name: (np.linalg.norm(sizes, axis=1) + off * np.sqrt(axes)) * (1.0 + 1e-12) for name, (sizes, off) in rows_of.items()
    }


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
