"""A way around what stands between two points: around one body at a time, or where that does not get through, over a roadmap."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refine.corridor.legs import Space, TimedWaypoint, refused, show
from refine.corridor.ways_around import way_around
from refine.obstacles.keep_out_bodies import Ball, GrownRegion, Obstacle, blocking, convex_parts, within
from refine.obstacles.solid_body import SolidBody

Floats = NDArray[np.float64]

_DEPTH = 3
_ANGLES = np.arange(16) * (np.pi / 8)
_BESIDE = 0.05
"""m by which a detour passes clear of what it goes around."""
_NEARER = (_BESIDE, 0.01, 0.002)
"""m by which a leg is pushed out of an obstacle, as much as there is room for."""
_REACH = np.arange(1, 61) * 0.05
_EXITS = 6
_STEPS = 101
"""Places along a direction at which it is looked for where a region is left, where no formula gives it."""
_TURNS = np.arange(64) + 0.5
_DIRECTIONS = np.stack(
    [
        np.sqrt(1.0 - (1.0 - _TURNS / 32) ** 2) * np.cos(np.pi * (1.0 + np.sqrt(5.0)) * _TURNS),
        np.sqrt(1.0 - (1.0 - _TURNS / 32) ** 2) * np.sin(np.pi * (1.0 + np.sqrt(5.0)) * _TURNS),
        1.0 - _TURNS / 32,
    ],
    axis=1,
)
"""Unit vectors spread evenly (a Fibonacci sphere). Shape (64, 3)."""


@dataclass(frozen=True, eq=False)
class Barriers:
    """Bodies that a path between two points stays out of.

    Attributes:
        obstacles: What all of its legs stay out of.
        left: Regions around the first point alone: once left, they are not entered again.
        entered: Regions around the second point alone: once entered, they are not left again.
    """

    obstacles: tuple[Obstacle, ...]
    left: tuple[GrownRegion, ...]
    entered: tuple[GrownRegion, ...]


def detour(
    space: Space, a: Floats, b: Floats, barriers: Barriers, *, to: TimedWaypoint
) -> list[tuple[Floats, tuple[Obstacle, ...]]]:
    """Return the points after one up to another, each with what the straight leg that leads there stays out of.

    Args:
        space: What the robot flies in.
        a: m. Shape (3,).
        b: m. Shape (3,).
        barriers: What it stays out of.
        to: The point of its plan that the robot is on its way to.

    Raises:
        Infeasible: None were found; names the robot, the body in the way and the point.
    """
    obstacles, left, entered = barriers.obstacles, barriers.left, barriers.entered
    low, high = space.low, space.high
    blocked = blocking(a, b, obstacles)
    if blocked is None:
        return [(b, obstacles)]
    around = _along_solids(a, b, obstacles, low, high, _DEPTH) if isinstance(blocked, SolidBody) else None
    if around is None:
        around = _around(a, b, obstacles, low, high, _DEPTH)
    if around is None:
        around = way_around(a, b, obstacles, low, high)
    legs = None if around is None else _without_return([a, *around, b], barriers)
    if legs is not None:
        return legs
    everything = (*obstacles, *(part for region in (*left, *entered) for part in convex_parts(region)))
    exits = _outside(a, b, left, obstacles, low, high) if left else [a]
    entries = _outside(b, a, entered, obstacles, low, high) if entered else [b]
    for p, q in itertools.product(exits, entries) if left or entered else ():
        way = [] if blocking(p, q, everything) is None else way_around(p, q, everything, low, high)
        if way is not None:
            nodes = [a, *([p] if left else []), *way, *([q] if entered else []), b]
            legs = _without_return(nodes, barriers)
            if legs is not None:
                return legs
    back = "" if around is None else f" that does not come back into '{(*left, *entered)[0].name}'"
    raise refused(
        "visits",
        space.name,
        to,
        f"{space.name}: '{blocked.name}' is in the way from {show(a)} to {show(b)}, and no way around was found{back}.",
    )


def _without_return(nodes: list[Floats], barriers: Barriers) -> list[tuple[Floats, tuple[Obstacle, ...]]] | None:
    """Return the legs of a way, each out of the regions that it has left or not entered yet; None where it comes back."""
    last, left, entered = len(nodes) - 1, barriers.left, barriers.entered
    bodies = [barriers.obstacles] * last
    for region in (*left, *entered):
        meets = [region.meets(nodes[leg], nodes[leg + 1]) for leg in range(last)]
        inside = [float(region.signed_distance(node)) <= 0.0 for node in nodes]
        if region in entered:
            meets, inside = meets[::-1], inside[::-1]
        legs = sum(meets)
        if not all(meets[:legs]) or not all(inside[:legs]):
            return None
        out = range(legs, last) if region in left else range(last - legs)
        bodies = [(*body, *convex_parts(region)) if leg in out else body for leg, body in enumerate(bodies)]
    return list(zip(nodes[1:], bodies, strict=True))


def _outside(
    point: Floats, other: Floats, regions: tuple[GrownRegion, ...], obstacles: tuple[Obstacle, ...], low: Floats, high: Floats
) -> list[Floats]:
    """Return places just outside the regions around a point, to which straight legs are free: the ones on the way first."""
    reach = np.zeros(len(_DIRECTIONS))
    for region in regions:  # where |root (point + t direction - centre)| = 1
        if not isinstance(region, Ball):
            reach = np.maximum(reach, _left_at(point, region))
            continue
        step, offset = _DIRECTIONS @ region.root.T, region.root @ (point - region.centre)
        square, along = np.sum(step**2, axis=1), step @ offset
        reach = np.maximum(reach, (np.sqrt(along**2 + square * (1.0 - offset @ offset)) - along) / square)
    places = point + (reach[:, None] + _BESIDE) * _DIRECTIONS
    clear = np.all((places >= low) & (places <= high), axis=1)
    for body in (*obstacles, *regions):
        clear &= body.signed_distance(places) > 0.0
    lengths = np.linalg.norm(places - point, axis=1) + np.linalg.norm(places - other, axis=1)
    order = [int(k) for k in np.argsort(lengths, kind="stable") if clear[k]]
    return [places[k] for k in order if blocking(point, places[k], obstacles) is None][:_EXITS]


def _left_at(point: Floats, region: GrownRegion) -> Floats:
    """Return how far along each direction a region is left for good, m; a step more than needed at most."""
    far = np.linspace(0.0, float(np.linalg.norm(point - region.centre)) + region.reach, _STEPS)
    inside = region.signed_distance(point + far[:, None, None] * _DIRECTIONS) <= 0.0
    last = _STEPS - 1 - np.argmax(inside[::-1], axis=0)
    return np.where(inside.any(axis=0), far[np.minimum(last + 1, _STEPS - 1)], 0.0)


def _along_solids(
    a: Floats, b: Floats, obstacles: tuple[Obstacle, ...], low: Floats, high: Floats, depth: int
) -> list[Floats] | None:
    """Return via points from a to b where the straight leg only comes too near to obstacles; None where that does not do.

    A planner's path that keeps clear as a curve may be laid through points whose straight legs cut a corner a little.
    """
    body = blocking(a, b, obstacles)
    if body is None:
        return []
    if depth == 0 or not isinstance(body, SolidBody):
        return None
    for by in _NEARER:
        via = body.pushed_out(a, b, by)
        if via is None or np.any(via < low) or np.any(via > high):
            continue
        if any(obstacles[index].signed_distance(via) <= 0.0 for index in within(obstacles, via, via)):
            continue
        before = _along_solids(a, via, obstacles, low, high, depth - 1)
        after = None if before is None else _along_solids(via, b, obstacles, low, high, depth - 1)
        if before is not None and after is not None:
            return [*before, via, *after]
    return None


def _around(
    a: Floats, b: Floats, obstacles: tuple[Obstacle, ...], low: Floats, high: Floats, depth: int
) -> list[Floats] | None:
    """Return via points from a to b, the shortest of the sides that work first; None where none does."""
    body = blocking(a, b, obstacles)
    if body is None:
        return []
    if depth == 0:
        return None
    step = (b - a) / max(float(np.linalg.norm(b - a)), 1e-9)
    foot = a + np.clip((body.centre - a) @ step, 0.0, np.linalg.norm(b - a)) * step
    first = np.cross(step, [0.0, 0.0, 1.0] if abs(step[2]) < 0.9 else [1.0, 0.0, 0.0])
    first /= np.linalg.norm(first)
    second = np.cross(step, first)
    sides = np.cos(_ANGLES)[:, None] * first + np.sin(_ANGLES)[:, None] * second
    lines = foot + _REACH[:, None] * sides[:, None, :]
    clear = np.all((lines >= low) & (lines <= high), axis=2)
    for index in within(obstacles, lines.min(axis=(0, 1)) - _BESIDE, lines.max(axis=(0, 1)) + _BESIDE):
        clear &= obstacles[index].signed_distance(lines) >= _BESIDE
    vias = [lines[index, int(np.argmax(clear[index]))] for index in np.flatnonzero(clear.any(axis=1))]
    lengths = [float(np.linalg.norm(via - a) + np.linalg.norm(b - via)) for via in vias]
    for index in np.argsort(lengths, kind="stable")[:6]:
        via = vias[index]
        before = _around(a, via, obstacles, low, high, depth - 1)
        after = None if before is None else _around(via, b, obstacles, low, high, depth - 1)
        if before is not None and after is not None:
            return [*before, via, *after]
    return None
