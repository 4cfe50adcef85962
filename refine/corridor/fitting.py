"""A smooth path that keeps its course: minimum snap, with separating planes put in only where the curve breaks a rule.

Rows act on Bernstein points, so a rule that they keep holds at all times on that leg, not at samples. Samples only decide
which rules are worth writing down; the loop ends when no rule is broken any more.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from refine.corridor.bodies import Plane, within
from refine.corridor.course import Course
from refine.corridor.legs import Tube
from refine.solvers.qp import Programme, Row, rest_to_rest, solve
from refine.spline.basis import bernstein_matrix
from refine.spline.values import Spline
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
    course: Course,
    durations: Floats | None = None,
    *,
    buffer: float = BUFFER,
    rest: frozenset[int] = frozenset(),
    onward: frozenset[int] = frozenset(),
) -> Spline:
    """Return the spline of least snap that goes through a course's points and keeps its rules at all times.

    Args:
        course: Points and rules.
        durations: Instead of the course's nominal ones, s. Shape (legs,).
        buffer: m by which planes stand off.
        rest: Points at which the flight comes to rest; a leg between two of them is straight.
        onward: Legs that never go back along their own direction.

    Raises:
        Infeasible: The rules contradict each other.
    """
    times = course.durations if durations is None else durations
    fixed, rules = fixed_states(course, rest), onward_rules(course, onward)

    def attempt() -> Spline:
        rows = tuple(row for (_, leg, _), planes in rules.items() for plane in planes for row in rows_of(leg, plane))
        return solve(Programme(times, fixed, rows, course.cycle))

    return until_kept(course, rules, attempt, buffer=buffer)


def fixed_states(course: Course, rest: frozenset[int]) -> Floats:
    """Return the states that a course fixes: its points, rest at the ends and where asked. Shape (points, 4, 3)."""
    fixed = rest_to_rest(course.points, course.cycle)
    fixed[sorted(rest), 1:] = 0.0
    if course.cycle is not None:
        fixed[-1] = fixed[course.cycle]
    return fixed


def onward_rules(course: Course, legs: frozenset[int]) -> Rules:
    """Return the rules by which these legs never go back along their own direction."""
    rules: Rules = {}
    for leg in legs:
        step = course.points[leg + 1] - course.points[leg]
        rules["along", leg, 0] = (Plane(step / np.linalg.norm(step), 0.0, onward=True),)
    return rules


def until_kept(course: Course, rules: Rules, attempt: Callable[[], Spline], *, buffer: float = BUFFER) -> Spline:
    """Call `attempt` until its path keeps the course, writing the rules that it breaks into `rules` in between.

    Raises:
        Infeasible: A straight leg meets an obstacle, or the rounds ran out.
    """
    for _ in range(ROUNDS):
        path = attempt()
        fresh = _broken(course, path, rules, buffer)
        if not fresh:
            return path
        rules.update(fresh)
    raise Infeasible(f"{course.robot}: no path kept the corridors within {ROUNDS} rounds.")


def _broken(course: Course, path: Spline, known: Rules, buffer: float) -> Rules:
    """Return planes for the rules that the path breaks and that are not written down yet."""
    fresh: Rules = {}
    points = path.sample(_SAMPLES)
    for index, leg in enumerate(course.legs):
        a, b = course.points[index], course.points[index + 1]
        for number in within(leg.obstacles, points[index].min(axis=0), points[index].max(axis=0)):
            body = leg.obstacles[number]
            if ("body", index, number) not in known and body.clearance(points[index]).min() < 0.0:
                plane = body.plane(a, b)
                if plane is None:
                    raise Infeasible(f"{course.robot}: '{body.name}' meets the straight leg {index}.")
                slack = min(float(plane.normal @ a), float(plane.normal @ b)) - plane.offset
                fresh["body", index, number] = (Plane(plane.normal, plane.offset + min(buffer, 0.9 * slack)),)
        tubes = leg.bays if leg.tube is None else (leg.tube, *leg.bays)
        for number, tube in enumerate(tubes):
            if ("tube", index, number) not in known and _outside(tube, points[index]):
                fresh["tube", index, number] = _prism(tube, a, b)
            onward = tube.normal * np.sign((b - a) @ tube.normal)
            if ("onward", index, number) not in known and np.min(np.diff(points[index] @ onward)) < 0.0:
                fresh["onward", index, number] = (Plane(onward, 0.0, onward=True),)
        for axis in range(3):
            unit = np.eye(3)[axis]
            if ("low", index, axis) not in known and points[index, :, axis].min() < course.low[axis]:
                fresh["low", index, axis] = (Plane(unit, min(course.low[axis], a[axis], b[axis])),)
            if ("high", index, axis) not in known and points[index, :, axis].max() > course.high[axis]:
                fresh["high", index, axis] = (Plane(-unit, min(-course.high[axis], -a[axis], -b[axis])),)
    return fresh


def rows_of(piece: int, plane: Plane) -> list[Row]:
    """Return the inequalities by which a whole piece keeps a plane."""
    points = np.diff(_WHOLE, axis=0) if plane.onward else _WHOLE
    return [Row(piece, weights, plane.normal, plane.offset) for weights in points]


def _outside(tube: Tube, points: Floats) -> bool:
    offset = points - tube.centre
    along = offset @ tube.normal
    across = offset - along[:, None] * tube.normal
    return bool(np.linalg.norm(across, axis=1).max() > tube.radius)


def _prism(tube: Tube, a: Floats, b: Floats) -> tuple[Plane, ...]:
    """Return the sides of a prism inscribed in the tube (widened where an end of the leg needs it)."""
    first = np.cross(tube.normal, [0.0, 0.0, 1.0] if abs(tube.normal[2]) < 0.9 else [1.0, 0.0, 0.0])
    first /= np.linalg.norm(first)
    second = np.cross(tube.normal, first)
    sides = []
    for angle in np.arange(_SIDES) * (2 * np.pi / _SIDES):
        inward = -(np.cos(angle) * first + np.sin(angle) * second)
        offset = float(inward @ tube.centre) - tube.radius * np.cos(np.pi / _SIDES)
        sides.append(Plane(inward, min(offset, float(inward @ a), float(inward @ b))))
    return tuple(sides)
