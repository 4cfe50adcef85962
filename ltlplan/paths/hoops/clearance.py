"""Whether a planned path keeps clear, for all times: of regions that it may not enter, of rings, obstacles and the walls.

A polynomial is above zero on an interval where all its Bernstein coefficients are; where that does not decide, the interval
is halved (`kept_clear` says what there is to keep clear of). Arithmetic is in floats: the planner's own judgement of its spline, with room to spare, never a certificate.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np

from ltlplan.free_space.inflated_obstacles import Solid, Solids
from ltlplan.paths.hoops.keep_out import KeptRegion, Room
from verify.data.arrays import Floats
from verify.data.shapes.convex_parts import ConvexBody

Kind = Literal["region", "ring", "plane", "again", "workspace", "obstacle"]

_DEGREE = 14  # of a squared distance along a piece of degree 7
_HALVINGS = 14


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
    nodes, to_bernstein = _interpolation()
    scaled = coefficients * durations[:, None, None] ** np.arange(coefficients.shape[2])
    path = np.einsum("pak,nk->pna", scaled, nodes[:, None] ** np.arange(coefficients.shape[2]))
    orders = np.arange(1, coefficients.shape[2])
    velocity = np.einsum("pak,nk->pna", scaled[:, :, 1:] * orders, nodes[:, None] ** (orders - 1))
    claims, labels = [], []
    for piece, name, kind, first, second in _claims(path, velocity, where, permitted):
        claims.append((first, second))
        labels.append((piece, kind, name))
    found = _refuted(np.array(claims) @ to_bernstein.T) if claims else []
    result = [Conflict(labels[i][0], share, labels[i][1], labels[i][2]) for i, share in found]
    for region, body in [(one, body) for one in where.regions.values() for body in one.grown]:
        pieces, outside = _outside_region(path, region, body, permitted)
        met = _refuted(outside @ to_bernstein.T) if len(pieces) else []
        result += [Conflict(pieces[i], share, "region", region.name) for i, share in met]
    for solid, piece in _near_solids(path, where.solids):
        holes = [hole for hole in solid.holes if hole.hoop in permitted[piece]]
        outside = np.array(
            [
                *_above_zero_outside(path[piece][None], solid.body.convex)[0],
                *(hole.inner**2 - hole.off_axis(path[piece]) for hole in holes),
            ]
        )
        result += [Conflict(piece, share, "obstacle", solid.body.name) for _, share in _refuted(outside[None] @ to_bernstein.T)]
    return sorted(result, key=lambda c: (c.piece, c.share))


def blocked(start: Floats, end: Floats, where: Room, permitted: Collection[str] = ()) -> Conflict | None:
    """Return the first obstacle on the straight line between two points, or None.

    Args:
        start: m. Shape (3,).
        end: m. Shape (3,).
        where: What there is to keep clear of.
        permitted: Regions that the line may enter.
    """
    line = np.zeros((1, 3, 8))
    line[0, :, 0], line[0, :, 1] = start, end - start
    found = conflicts(line, np.ones(1), where, [permitted])
    return found[0] if found else None


def _claims(
    path: Floats, velocity: Floats, where: Room, permitted: Sequence[Collection[str]]
) -> Iterator[tuple[int, str, Kind, Floats, Floats]]:
    """Yield (piece, name, kind, f, g): f > 0 or g > 0 must hold at every instant, given by values at the nodes."""
    never = np.full(path.shape[1], -1.0)
    every = range(len(path))
    hull = np.einsum("mn,pna->pma", _interpolation()[1], path)  # a polynomial lies in the box of its Bernstein coefficients
    near = where.near(hull.min(axis=1), hull.max(axis=1))
    obstacles = list(where.regions.values())
    for index in np.flatnonzero(near.any(axis=0)):
        obstacle, pieces = obstacles[index], np.flatnonzero(near[:, index]).tolist()
        offset = path - obstacle.centre
        level = np.einsum("pna,ab,pnb->pn", offset, obstacle.matrix, offset)
        enters = [obstacle.name in allowed for allowed in permitted]
        for piece in pieces:
            if not enters[piece] and obstacle.measures is None:
                yield piece, obstacle.name, "region", level[piece] - obstacle.level, never
        if obstacle.normal is None:
            continue
        along = (offset @ obstacle.normal) ** 2
        across = np.einsum("pna,pna->pn", offset, offset) - along
        sides = path[:, [0, -1]] @ obstacle.normal - obstacle.centre @ obstacle.normal
        for piece in pieces:
            if enters[piece] and _stays_on_its_side(sides[piece], obstacle.near):
                ahead = np.sign(sides[piece, 0]) * (offset[piece] @ obstacle.normal)
                yield piece, obstacle.name, "plane", ahead - obstacle.near, never
            elif enters[piece]:  # towards where this piece ends, as long as it is near the plane
                ahead = np.sign((path[piece, -1] - path[piece, 0]) @ obstacle.normal) * (velocity[piece] @ obstacle.normal)
                yield piece, obstacle.name, "plane", ahead, along[piece] - obstacle.height**2
            past = across[piece] - obstacle.outer**2
            yield (
                piece,
                obstacle.name,
                "ring",
                along[piece] - obstacle.height**2,
                obstacle.inner**2 - across[piece] if enters[piece] else past,
            )
    for axis in range(3):
        for piece in every:
            yield piece, "workspace", "workspace", path[piece, :, axis] - where.low[axis], never
            yield piece, "workspace", "workspace", where.high[axis] - path[piece, :, axis], never


def _near_solids(path: Floats, solids: Solids) -> Iterator[tuple[Solid, int]]:
    """Yield solid parts and the pieces whose boxes reach into theirs."""
    if not solids.parts:
        return
    hull = np.einsum("mn,pna->pma", _interpolation()[1], path)
    for part, piece in np.argwhere(solids.near(hull.min(axis=1), hull.max(axis=1))).tolist():
        yield solids.parts[part], piece


def _outside_region(
    path: Floats, region: KeptRegion, body: ConvexBody, permitted: Sequence[Collection[str]]
) -> tuple[list[int], Floats]:
    """Return the pieces near a convex body that may not enter it, and for each the functions of which one is above zero outside.

    Returns:
        Pieces, and values at the nodes. Shape (pieces, inequalities, nodes).
    """
    hull = np.einsum("mn,pna->pma", _interpolation()[1], path)
    low, high = hull.min(axis=1) - region.centre, hull.max(axis=1) - region.centre
    beside = np.linalg.norm(np.maximum(np.maximum(low, -high), 0.0), axis=1)
    pieces = [i for i in np.flatnonzero(beside <= region.reach).tolist() if region.name not in permitted[i]]
    return pieces, _above_zero_outside(path[pieces] - region.centre, body)


def _above_zero_outside(points: Floats, body: ConvexBody) -> Floats:
    """Return functions of which one is above zero outside of a body. Shape (pieces, nodes, 3) to (pieces, inequalities, nodes)."""
    rows = [np.einsum("pna,fa->pfn", points, body.normals) - body.distances[:, None]]
    for matrix, centre, root in zip(body.matrices, body.centres, body.roots, strict=True):
        rows.append((np.einsum("pna,ab,pnb->pn", points - centre, matrix, points - centre) - root**2)[:, None])
    return np.concatenate(rows, axis=1)


def _stays_on_its_side(ends: Floats, near: float) -> bool:
    """Tell whether a piece within a hoop's region has both ends on one side of the opening, clear of it: it does not pass there."""
    return bool(np.min(ends) >= near or np.max(ends) <= -near)


def _refuted(claims: Floats) -> list[tuple[int, float]]:
    """Return (claim, share of the piece) for each claim that is false or cannot be decided. Shape (claims, 2, 15)."""
    left, right = _halving()
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
        claims = np.concatenate([claims @ left.T, claims @ right.T])
        number, start = np.concatenate([number, number]), np.concatenate([start, start + width])
    return sorted(found.items())


@cache
def _interpolation() -> tuple[Floats, Floats]:
    """Nodes in [0, 1] and the matrix from values there to Bernstein coefficients. Shapes (15,), (15, 15)."""
    nodes = 0.5 - 0.5 * np.cos(np.pi * np.arange(_DEGREE + 1) / _DEGREE)
    choose = _binomials()[_DEGREE]
    k = np.arange(_DEGREE + 1)
    basis = choose * nodes[:, None] ** k * (1.0 - nodes[:, None]) ** (_DEGREE - k)
    return nodes, np.linalg.inv(basis)


@cache
def _halving() -> tuple[Floats, Floats]:
    """Matrices from Bernstein coefficients on [0, 1] to those on its halves (de Casteljau). Shapes (15, 15)."""
    left = np.array([_binomials()[i] / 2.0**i for i in range(_DEGREE + 1)])
    return left, left[::-1, ::-1].copy()


@cache
def _binomials() -> Floats:
    table = np.zeros((_DEGREE + 1, _DEGREE + 1))
    table[:, 0] = 1.0
    for n in range(1, _DEGREE + 1):
        table[n, 1:] = table[n - 1, 1:] + table[n - 1, :-1]
    return table
