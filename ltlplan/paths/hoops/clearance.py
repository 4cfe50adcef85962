"""Clearance of a planned path, for all times: from regions that it may not enter, rings, obstacles and the walls.

A polynomial is above zero on an interval where all its Bernstein coefficients are; where that does not decide, the interval
is halved (`keep_out` says what there is to keep clear of). Arithmetic is in floats: the planner's own judgement of its spline, with room to spare, never a certificate.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ltlplan.paths.hoops.keep_out import Room
from verify.data.arrays import Floats
from verify.data.shapes.convex_parts import ConvexBody

Kind = Literal["region", "ring", "plane", "again", "workspace", "obstacle"]

_DEGREE = 14  # of a squared distance along a piece of degree 7
_HALVINGS = 14
_ORDERS = np.arange(_DEGREE + 1)
_BINOMIALS = np.array([[math.comb(n, k) for k in range(_DEGREE + 1)] for n in range(_DEGREE + 1)], dtype=np.float64)
_NODES = 0.5 - 0.5 * np.cos(np.pi * _ORDERS / _DEGREE)
_TO_BERNSTEIN = np.linalg.inv(_BINOMIALS[_DEGREE] * _NODES[:, None] ** _ORDERS * (1.0 - _NODES[:, None]) ** (_DEGREE - _ORDERS))
"""From values at the nodes in [0, 1] to Bernstein coefficients. Shape (15, 15)."""
_LEFT = _BINOMIALS / 2.0 ** _ORDERS[:, None]
_RIGHT = _LEFT[::-1, ::-1].copy()
"""From Bernstein coefficients on [0, 1] to those on its halves (de Casteljau). Shape (15, 15)."""


@dataclass(frozen=True, slots=True)
class Conflict:
    """One place where a path comes too near.

    Attributes:
        piece: Index of the piece.
        share: Where on it, 0 to 1.
        obstacle: "region", "ring" (or the opening of a hoop that is not flown through here), "plane" (the path turns back
            within the hoop that it flies through), "again" (it comes twice in one visit), "obstacle" (it is solid) or "workspace".
        name: The region's or obstacle's name; "workspace" for the walls.
    """

    piece: int
    share: float
    obstacle: Kind
    name: str


def conflicts(coefficients: Floats, durations: Floats, where: Room, permitted: Sequence[Collection[str]]) -> list[Conflict]:
    """Find where a path comes too near, in order along it; an empty list means that it keeps clear for all times.

    Args:
        coefficients: Ascending powers of local time, m. Shape (pieces, 3, 8).
        durations: s. Shape (pieces,).
        where: Obstacles and walls.
        permitted: For each piece, the regions that it may enter; a hoop among them is flown through its opening.

    Returns:
        At most one conflict a piece and obstacle.
    """
    orders = np.arange(coefficients.shape[2])
    scaled = coefficients * durations[:, None, None] ** orders
    path = np.einsum("pak,nk->pna", scaled, _NODES[:, None] ** orders)
    velocity = np.einsum("pak,nk->pna", scaled[:, :, 1:] * orders[1:], _NODES[:, None] ** orders[:-1])
    hull = np.einsum("mn,pna->pma", _TO_BERNSTEIN, path)  # a polynomial lies in the box of its Bernstein coefficients
    boxes = hull.min(axis=1), hull.max(axis=1)
    claims = [*_claims(path, velocity, boxes, where, permitted), *_outside_bodies(path, boxes, where, permitted)]
    values = np.full((len(claims), max((len(functions) for _, functions in claims), default=0), len(_NODES)), -1.0)
    for row, (_, functions) in zip(values, claims, strict=True):
        row[: len(functions)] = functions
    found = [replace(claims[i][0], share=share) for i, share in _refuted(values @ _TO_BERNSTEIN.T)]
    return sorted(found, key=lambda conflict: (conflict.piece, conflict.share))


def blocked(start: Floats, end: Floats, where: Room, permitted: Collection[str] = ()) -> Conflict | None:
    """Return the first obstacle on the straight line between two points, or None.

    Args:
        start: m. Shape (3,).
        end: m. Shape (3,).
        where: What there is to keep clear of.
        permitted: Regions that the line may enter.
    """
    return next(iter(on_lines(start, end[None], where, permitted)), None)


def on_lines(starts: Floats, ends: Floats, where: Room, permitted: Collection[str]) -> list[Conflict]:
    """Find where straight lines come too near; which line is the conflict's piece.

    Args:
        starts: m. Shape (lines, 3), or (3,) for all.
        ends: m. Shape (lines, 3).
        where: What there is to keep clear of.
        permitted: Regions that the lines may enter.
    """
    lines = np.zeros((len(ends), 3, 8))
    lines[:, :, 0], lines[:, :, 1] = starts, ends - starts
    return conflicts(lines, np.ones(len(lines)), where, [permitted] * len(lines))


_Claim = tuple[Conflict, list[Floats]]
"""A conflict that is not there where one of the functions, given by values at the nodes, is above zero at every instant of the piece."""


def _claims(
    path: Floats, velocity: Floats, boxes: tuple[Floats, Floats], where: Room, permitted: Sequence[Collection[str]]
) -> Iterator[_Claim]:
    """Yield the claims about ellipsoids, rings and walls."""
    near = where.near(*boxes)
    obstacles = list(where.regions.values())
    for index in np.flatnonzero(near.any(axis=0)):
        obstacle, pieces = obstacles[index], np.flatnonzero(near[:, index]).tolist()
        name, offset = obstacle.name, path - obstacle.centre
        level = np.einsum("pna,ab,pnb->pn", offset, obstacle.matrix, offset)
        enters = [name in allowed for allowed in permitted]
        for piece in pieces:
            if not enters[piece] and obstacle.measures is None:
                yield Conflict(piece, 0.0, "region", name), [level[piece] - obstacle.level]
        if obstacle.normal is None:
            continue
        along = (offset @ obstacle.normal) ** 2
        across = np.einsum("pna,pna->pn", offset, offset) - along
        sides = path[:, [0, -1]] @ obstacle.normal - obstacle.centre @ obstacle.normal
        for piece in pieces:
            beyond = along[piece] - obstacle.height**2
            # with both ends on one side of the opening, clear of it, a piece does not pass there
            if enters[piece] and (np.min(sides[piece]) >= obstacle.near or np.max(sides[piece]) <= -obstacle.near):
                ahead = np.sign(sides[piece, 0]) * (offset[piece] @ obstacle.normal)
                yield Conflict(piece, 0.0, "plane", name), [ahead - obstacle.near]
            elif enters[piece]:  # towards where this piece ends, as long as it is near the plane
                ahead = np.sign((path[piece, -1] - path[piece, 0]) @ obstacle.normal) * (velocity[piece] @ obstacle.normal)
                yield Conflict(piece, 0.0, "plane", name), [ahead, beyond]
            past = obstacle.inner**2 - across[piece] if enters[piece] else across[piece] - obstacle.outer**2
            yield Conflict(piece, 0.0, "ring", name), [beyond, past]
    for axis in range(3):
        for piece, inside in enumerate(path[:, :, axis]):
            yield Conflict(piece, 0.0, "workspace", "workspace"), [inside - where.low[axis]]
            yield Conflict(piece, 0.0, "workspace", "workspace"), [where.high[axis] - inside]


def _outside_bodies(
    path: Floats, boxes: tuple[Floats, Floats], where: Room, permitted: Sequence[Collection[str]]
) -> Iterator[_Claim]:
    """Yield the claims about regions that are no ellipsoids, and about obstacles: outside of a convex body, or in an opening through it."""
    low, high = boxes
    for region in where.regions.values():
        beside = np.linalg.norm(np.maximum(np.maximum(low - region.centre, region.centre - high), 0.0), axis=1)
        for body in region.grown:
            for piece in np.flatnonzero(beside <= region.reach).tolist():
                if region.name not in permitted[piece]:
                    yield Conflict(piece, 0.0, "region", region.name), _above_zero_outside(path[piece] - region.centre, body)
    for index, piece in np.argwhere(where.solids.near(low, high)).tolist():
        solid = where.solids.parts[index]
        openings = [hole.inner**2 - hole.off_axis(path[piece]) for hole in solid.holes if hole.hoop in permitted[piece]]
        outside = [*_above_zero_outside(path[piece], solid.body.convex), *openings]
        yield Conflict(piece, 0.0, "obstacle", solid.body.name), outside


def _above_zero_outside(points: Floats, body: ConvexBody) -> list[Floats]:
    """Return functions of which one is above zero outside of a body. Shape (nodes, 3) to (nodes,) each."""
    round_faces = (
        np.einsum("na,ab,nb->n", points - centre, matrix, points - centre) - root**2
        for matrix, centre, root in zip(body.matrices, body.centres, body.roots, strict=True)
    )
    return [*np.einsum("na,fa->fn", points, body.normals) - body.distances[:, None], *round_faces]


def _refuted(claims: Floats) -> list[tuple[int, float]]:
    """Return (claim, share of the piece) for each claim that is false or cannot be decided. Shape (claims, functions, 15)."""
    number, start, width = np.arange(len(claims)), np.zeros(len(claims)), 1.0
    found: dict[int, float] = {}
    for step in range(_HALVINGS + 1):
        undecided = ~np.any(np.all(claims > 0, axis=2), axis=1)
        claims, number, start = claims[undecided], number[undecided], start[undecided]
        for end, at in ((0, start), (-1, start + width)):
            for i in np.flatnonzero(np.all(claims[:, :, end] <= 0, axis=1)):
                found[int(number[i])] = min(found.get(int(number[i]), 2.0), float(at[i]))
        if step == _HALVINGS:
            for i, at in zip(number, start, strict=True):
                found.setdefault(int(i), float(at))
        open_still = ~np.isin(number, list(found))
        claims, number, start = claims[open_still], number[open_still], start[open_still]
        if not len(claims):
            break
        width /= 2
        claims = np.concatenate([claims @ _LEFT.T, claims @ _RIGHT.T])
        number, start = np.concatenate([number, number]), np.concatenate([start, start + width])
    return sorted(found.items())
