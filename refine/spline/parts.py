"""A flight that the vehicle's memory cannot hold at once, as consecutive flights between rests."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from refine.spline.rounding import exact_end, nearest32
from verify.data import BadInput, DoesNotFit, Trajectory
from verify.data.trajectory import HOVER, PIECES

Floats = NDArray[np.float64]

REST = (1e-6, 1e-5, 1e-4, 1e-3)
"""Jump of position (m, rad) and sizes of velocity, acceleration and jerk below which a joint is a rest: what rounding to
float32 leaves of one."""


def split(trajectory: Trajectory, max_pieces: int = PIECES) -> tuple[Trajectory, ...]:
    """Cut a finite flight at joints where it rests, into as few parts as fit.

    A flight has such joints where its waypoints or its plan's waits make it rest; `refine(plan, too_long="rest")` puts them in.

    Each part is a flight of its own whose clock starts at zero: it begins and ends hovering, to be uploaded and flown one
    after the other, and certified one by one (visits that end in an earlier part are not seen by the certificate of a later
    one). Robots of a team hover for different times between their parts, so a team's parts keep its separation only if all
    robots rest at that time. A part that would have a single piece is followed by a hover of 1 s.

    Args:
        trajectory: A finite flight; for a lasso, `trajectory.flattened(laps)`.
        max_pieces: Pieces that the target holds for one robot, at least 2.

    Returns:
        The parts in order; the flight itself where it fits.

    Raises:
        BadInput: The flight is a lasso, or `max_pieces` is below 2.
        DoesNotFit: Some stretch without a rest is longer than `max_pieces`; says how many parts would do, and where rests
            are missing.
    """
    if trajectory.cycle is not None:
        raise BadInput("a lasso has no end to be split at; flatten it to a number of laps first.")
    if max_pieces < 2:
        raise BadInput(f"max_pieces must be at least 2, not {max_pieces}.")
    cuts = _cuts_at_rests(trajectory, max_pieces)
    if not cuts:
        return (trajectory,)
    return tuple(_part(trajectory, begin, end) for begin, end in itertools.pairwise((0, *cuts, len(trajectory))))


def _cuts_at_rests(trajectory: Trajectory, max_pieces: int) -> tuple[int, ...]:
    """Return the pieces with which parts begin, so that each fits; none where the flight fits whole.

    Args:
        trajectory: A finite flight.
        max_pieces: Pieces that the target holds for one robot, at least 2.

    Raises:
        DoesNotFit: Some stretch without a rest is longer.
    """
    if len(trajectory) <= max_pieces:
        return ()
    joints = [*rests(trajectory), len(trajectory)]
    cuts = [0]
    while cuts[-1] < len(trajectory):
        within = [joint for joint in joints if cuts[-1] < joint <= cuts[-1] + max_pieces]
        if not within:
            raise _without_rest(trajectory, joints, cuts, max_pieces)
        cuts.append(within[-1])
    return tuple(cuts[1:-1])


def rests(trajectory: Trajectory) -> tuple[int, ...]:
    """Return the joints, as the index of the piece that begins there, at which a flight comes to rest."""
    found = []
    for piece in range(1, len(trajectory)):
        before = [_end(trajectory, piece - 1, order) for order in range(4)]
        after = [trajectory.derivative_coefficients(order)[piece, :, 0] for order in range(4)]
        jump = np.abs(after[0] - before[0]).max()
        moving = [max(np.abs(before[order]).max(), np.abs(after[order]).max()) for order in (1, 2, 3)]
        if all(value <= most for value, most in zip((jump, *moving), REST, strict=True)):
            found.append(piece)
    return tuple(found)


def _end(trajectory: Trajectory, piece: int, derivative: int) -> Floats:
    coefficients = trajectory.derivative_coefficients(derivative)[piece]
    return coefficients @ trajectory.durations[piece] ** np.arange(coefficients.shape[1])


def _part(trajectory: Trajectory, begin: int, end: int) -> Trajectory:
    durations, coefficients = trajectory.durations[begin:end], trajectory.coefficients[begin:end]
    if end - begin == 1:
        hover = np.zeros((1, 4, 8))
        duration = float(durations[0])
        hover[0, :, 0] = [nearest32(exact_end(coefficients[0, axis], duration)) for axis in range(4)]
        durations, coefficients = np.append(durations, HOVER), np.concatenate([coefficients, hover])
    return Trajectory(durations, coefficients)


def _without_rest(trajectory: Trajectory, joints: list[int], cuts: list[int], max_pieces: int) -> DoesNotFit:
    """Return the error that says where the flight has no rest, and how many parts would do with rests or with more memory."""
    begin = cuts[-1]
    end = next(joint for joint in joints if joint > begin)
    parts = -(-len(trajectory) // max_pieces)
    longest = max(after - before for before, after in itertools.pairwise([0, *joints]))
    return DoesNotFit(
        f"The flight has {len(trajectory)} pieces and would do in {parts} parts of at most {max_pieces}, but from piece {begin} "
        f"to piece {end - 1} ({end - begin} pieces, {trajectory.knots[begin]:.2f} to {trajectory.knots[end]:.2f} s) it never "
        f"rests. Let it rest within (`refine(plan, too_long='rest')` does that), or use a target that holds {longest} pieces."
    )
