"""A smooth path that keeps its corridor: minimum snap, with separating planes put in only where the curve breaks a rule.

Rows act on Bernstein points, so a rule that they keep holds at all times on that leg, not at samples. Samples only decide
which rules are worth writing down; the loop ends when no rule is broken any more.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from refine.corridor.corridor import Corridor
from refine.corridor.legs import Cylinder
from refine.obstacles.keep_out_bodies import within
from refine.planes import Plane
from refine.solvers.qp import Programme, Row, rest_to_rest, solve
from refine.spline.basis import bernstein_matrix
from refine.spline.spline import Spline
from verify.data import Infeasible

Floats = NDArray[np.float64]

ROUNDS = 25
BUFFER = 2e-3
"""m by which planes stand off the body, where the straight leg allows it."""
_SAMPLES = np.linspace(0.0, 1.0, 65)
_WHOLE = bernstein_matrix()
_SIDES = 12

Rules = dict[tuple[str, int, int], tuple[Plane, ...]]
"""Planes that a leg must stay beyond, by (kind, leg, number): only those that some path broke."""


def fit(
    corridor: Corridor,
    durations: Floats | None = None,
    *,
    buffer: float = BUFFER,
    rest: frozenset[int] = frozenset(),
    monotone: frozenset[int] = frozenset(),
) -> Spline:
    """Return the spline of least snap that goes through a corridor's points and keeps its rules at all times.

    Args:
        corridor: Points and rules.
        durations: Instead of the corridor's nominal ones, s. Shape (legs,).
        buffer: m by which planes stand off.
        rest: Points at which the flight comes to rest; a leg between two of them is straight.
        monotone: Legs that never go back along their own direction.

    Raises:
        Infeasible: The rules contradict each other.
        SolverTimeout: An engine's seconds ran out before its iterations.
    """
    times = corridor.durations if durations is None else durations
    fixed, rules = fixed_states(corridor, rest), monotone_rules(corridor, monotone)

    def attempt() -> Spline:
        rows = tuple(row for (_, leg, _), planes in rules.items() for plane in planes for row in rows_of(leg, plane))
        return solve(Programme(times, fixed, rows, corridor.cycle))

    return until_kept(corridor, rules, attempt, buffer=buffer)


def fixed_states(corridor: Corridor, rest: frozenset[int]) -> Floats:
    """Return the states that a corridor fixes: its points, rest at the ends and where asked. Shape (points, 4, 3)."""
    fixed = rest_to_rest(corridor.points, corridor.cycle)
    fixed[sorted(rest), 1:] = 0.0
    if corridor.cycle is not None:
        fixed[-1] = fixed[corridor.cycle]
    return fixed


def monotone_rules(corridor: Corridor, legs: frozenset[int]) -> Rules:
    """Return the rules by which these legs never go back along their own direction."""
    rules: Rules = {}
    for leg in legs:
        step = corridor.points[leg + 1] - corridor.points[leg]
        rules["along", leg, 0] = (Plane(step / np.linalg.norm(step), 0.0, monotone=True),)
    return rules


def until_kept(corridor: Corridor, rules: Rules, attempt: Callable[[], Spline], *, buffer: float = BUFFER) -> Spline:
    """Call `attempt` until its path keeps the corridor, writing the rules that it breaks into `rules` in between.

    Args:
        corridor: What is kept.
        rules: Planes that are written down so far; grows.
        attempt: Returns a path that keeps `rules`.
        buffer: m by which planes stand off.

    Raises:
        Infeasible: A straight leg meets an obstacle, or the rounds ran out.
        SolverTimeout: An engine's seconds ran out before its iterations.
    """
    for _ in range(ROUNDS):
        path = attempt()
        fresh = broken_rules(corridor, path, rules, buffer)
        if not fresh:
            return path
        rules.update(fresh)
    raise Infeasible(f"{corridor.robot}: no path kept the corridors within {ROUNDS} rounds.")


def broken_rules(corridor: Corridor, path: Spline, known: Rules, buffer: float) -> Rules:
    """Return planes for the rules that the path breaks and that are not written down yet.

    Args:
        corridor: What is kept.
        path: One piece a leg, m.
        known: Planes that are written down.
        buffer: m by which planes stand off.

    Raises:
        Infeasible: A straight leg meets an obstacle.
    """
    fresh: Rules = {}
    points = path.sample(_SAMPLES)
    for index, leg in enumerate(corridor.legs):
        a, b = corridor.points[index], corridor.points[index + 1]
        for number in within(leg.obstacles, points[index].min(axis=0), points[index].max(axis=0)):
            body = leg.obstacles[number]
            if ("body", index, number) not in known and body.signed_distance(points[index]).min() < 0.0:
                plane = body.plane(a, b)
                if plane is None:
                    raise Infeasible(f"{corridor.robot}: '{body.name}' meets the straight leg {index}.")
                slack = min(float(plane.normal @ a), float(plane.normal @ b)) - plane.offset
                fresh["body", index, number] = (Plane(plane.normal, plane.offset + min(buffer, 0.9 * slack)),)
        cylinders = leg.approaches if leg.cylinder is None else (leg.cylinder, *leg.approaches)
        for number, cylinder in enumerate(cylinders):
            if ("cylinder", index, number) not in known and _outside(cylinder, points[index]):
                fresh["cylinder", index, number] = _prism(cylinder, a, b)
            forward = cylinder.normal * np.sign((b - a) @ cylinder.normal)
            if ("monotone", index, number) not in known and np.min(np.diff(points[index] @ forward)) < 0.0:
                fresh["monotone", index, number] = (Plane(forward, 0.0, monotone=True),)
        for axis in range(3):
            unit = np.eye(3)[axis]
            if ("low", index, axis) not in known and points[index, :, axis].min() < corridor.low[axis]:
                fresh["low", index, axis] = (Plane(unit, min(corridor.low[axis], a[axis], b[axis])),)
            if ("high", index, axis) not in known and points[index, :, axis].max() > corridor.high[axis]:
                fresh["high", index, axis] = (Plane(-unit, min(-corridor.high[axis], -a[axis], -b[axis])),)
    return fresh


def rows_of(piece: int, plane: Plane) -> list[Row]:
    """Return the inequalities by which a whole piece keeps a plane."""
    points = np.diff(_WHOLE, axis=0) if plane.monotone else _WHOLE
    return [Row(piece, weights, plane.normal, plane.offset) for weights in points]


def _outside(cylinder: Cylinder, points: Floats) -> bool:
    offset = points - cylinder.centre
    along = offset @ cylinder.normal
    across = offset - along[:, None] * cylinder.normal
    return bool(np.linalg.norm(across, axis=1).max() > cylinder.radius)


def _prism(cylinder: Cylinder, a: Floats, b: Floats) -> tuple[Plane, ...]:
    """Return the sides of a prism inscribed in the cylinder (widened where an end of the leg needs it)."""
    first = np.cross(cylinder.normal, [0.0, 0.0, 1.0] if abs(cylinder.normal[2]) < 0.9 else [1.0, 0.0, 0.0])
    first /= np.linalg.norm(first)
    second = np.cross(cylinder.normal, first)
    sides = []
    for angle in np.arange(_SIDES) * (2 * np.pi / _SIDES):
        inward = -(np.cos(angle) * first + np.sin(angle) * second)
        offset = float(inward @ cylinder.centre) - cylinder.radius * np.cos(np.pi / _SIDES)
        sides.append(Plane(inward, min(offset, float(inward @ a), float(inward @ b))))
    return tuple(sides)
