"""Greatest values over time, proved: branch and bound on polynomials, on quotients of them, on anything enclosable.

`peaks` takes many polynomial pieces at once, sorted into groups (a robot's pieces, say), and returns for each group
bounds that hold for all times, with the place where the greatest value is. It halves only what may still hold the
greatest value of its group. Nothing here trusts a float: see `balls` and `intervals` for why the bounds are bounds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from verify.arithmetic.balls import Balls, Floats, halves

Indices = NDArray[np.intp]

MAX_DEPTH = 48
MAX_OPEN = 1024
MAX_ITEMS = 100_000
"""More open intervals than this, of one piece or of all, keep the (sound, looser) bounds that they have."""


_FINEST = 1e-13


@dataclass(frozen=True, slots=True)
class Peaks:
    """For each group: nothing is above `upper`; `lower` is reached, or nearly, at `place` of piece `item`.

    Attributes:
        upper: Proved upper bound. Shape (groups,). -inf for a group without pieces.
        lower: Proved to be reached or passed. Shape (groups,).
        item: Index of the piece where. Shape (groups,).
        place: Where in that piece, from 0 to 1. Shape (groups,).
    """

    upper: Floats
    lower: Floats
    item: Indices
    place: Floats


def peaks(
    numerator: Balls,
    groups: Indices,
    count: int,
    *,
    slack: Floats,
    critical: Floats | None = None,
    denominator: Balls | None = None,
) -> Peaks:
    """Bound the greatest value of polynomials, or of quotients of them, group by group.

    Args:
        numerator: Pieces on [0, 1]. Shape (k, n + 1).
        groups: Group of each piece. Shape (k,).
        count: How many groups there are.
        slack: How much each group's upper bound may stay above its lower one. Shape (count,).
        critical: See `search`.
        denominator: Of the same degree; where it cannot be shown to be positive the quotient counts as
            infinite. None for 1. The quotient lies between the least and greatest quotients of coefficients,
            because it is their mean weighted by the (positive) terms of the denominator.
    """
    if denominator is None:
        return search(
            (numerator,), lambda state, _: _bounds(state[0].high, state[0].low), groups, count, slack=slack, critical=critical
        )
    assert denominator.degree == numerator.degree
    return search(
        (numerator, denominator), lambda state, _: quotient_bounds(*state), groups, count, slack=slack, critical=critical
    )


# eight parameters: four say what is enclosed, the rest how closely, each by its keyword
@np.errstate(all="ignore")
def search(
    state: tuple[Balls, ...],
    enclose: Callable[[tuple[Balls, ...], Indices], tuple[Floats, Floats, Floats]],
    groups: Indices,
    count: int,
    *,
    slack: Floats,
    critical: Floats | None = None,
    depth: int = MAX_DEPTH,
    stride: int = 1,
) -> Peaks:
    """Bound the greatest value of any function of polynomials that can be enclosed on a part of a piece.

    Args:
        state: Polynomials that the function is made of, each of shape (pieces, ..., n + 1).
        enclose: Takes them on parts of pieces (k of them), and which pieces those are; returns an upper bound over
            each part, and lower bounds on the values at its start and at its end. Shape (k,) each.
        groups: Group of each piece. Shape (pieces,).
        count: How many groups there are.
        slack: How much each group's upper bound may stay above its lower one. Shape (count,).
        critical: A value for each group that matters: where it lies between the bounds they are driven together
            until it no longer does, or to the floats' resolution. Shape (count,).
        depth: At most so many halvings.
        stride: How many halvings to make at once: more where enclosing costs much by the call and little by the part.
    """
    items = np.arange(len(groups))
    starts = np.zeros(len(groups))
    found = Peaks(np.full(count, -np.inf), np.full(count, -np.inf), np.zeros(count, dtype=np.intp), np.zeros(count))
    width = 1.0
    for level in range(0, depth + 1, stride):
        high, first, last = enclose(state, items)
        group = groups[items]
        _raise_lower(found, first, starts, items, group)
        _raise_lower(found, last, starts + width, items, group)
        room = slack[group]
        if critical is not None:
            between = (found.lower[group] <= critical[group]) & (high > critical[group])
            room = np.where(between, np.minimum(_FINEST * np.abs(critical[group]), room), room)
        open_ = ~(high <= found.lower[group] + room)
        open_ &= np.bincount(items[open_], minlength=len(groups))[items] <= MAX_OPEN
        if level + stride > depth or 2 * np.count_nonzero(open_) > MAX_ITEMS:
            open_[:] = False
        np.maximum.at(found.upper, group[~open_], np.where(np.isnan(high), np.inf, high)[~open_])
        keep = np.flatnonzero(open_)
        if len(keep) == 0:
            break
        state, items, starts = tuple(part[keep] for part in state), items[keep], starts[keep]
        for _ in range(stride):
            state = tuple(halves(part) for part in state)
            width /= 2
            items = np.concatenate([items, items])
            starts = np.concatenate([starts, starts + width])
    return found


def quotient_bounds(top: Balls, under: Balls) -> tuple[Floats, Floats, Floats]:
    """Return upper bounds of quotients on each piece, and lower bounds of their values at start and end."""
    return _bounds(*_quotients(top, under))


def _bounds(high: Floats, low: Floats) -> tuple[Floats, Floats, Floats]:
    """Return an upper bound of each piece and lower bounds of its values at start and end."""
    return high.max(-1), low[:, 0], low[:, -1]


def _quotients(top: Balls, under: Balls) -> tuple[Floats, Floats]:
    """Bound the quotients of coefficients from above and below; infinite where the denominator may vanish."""
    high, low, most, least = top.high, top.low, under.high, under.low
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        above = np.nextafter(np.where(high >= 0, high / least, high / most), np.inf)
        below = np.nextafter(np.where(low >= 0, low / most, low / least), -np.inf)
    positive = least > 0
    return np.where(positive, above, np.inf), np.where(positive, below, -np.inf)


def _raise_lower(found: Peaks, values: Floats, places: Floats, items: Indices, group: Indices) -> None:
    """Take over the best value of each group where it beats what is known; NaN never does."""
    better = np.flatnonzero(values > found.lower[group])
    if len(better) == 0:
        return
    order = better[np.argsort(values[better], kind="stable")]
    found.lower[group[order]] = values[order]  # the greatest of each group is written last
    found.item[group[order]] = items[order]
    found.place[group[order]] = places[order]
