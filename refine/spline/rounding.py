"""To float32, the vehicle's own numbers, with joints repaired.

Rounding coefficients one by one opens small gaps at the joints. Here each piece is rounded in order: its first four
coefficients are the rounded state of the node, the others are computed anew so that its end meets the next node's rounded
state, and the next piece starts at the float32 nearest to where this one really ends. Position then jumps by at most half
a float32 ulp; a lap's closing joint may stay open by an ulp of its last piece's largest term, where nothing nearer can be
written in float32. The jumps of the derivatives are reported.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from refine.spline.basis import HERMITE, ORDER, SIZE, bernstein_matrix, derivative_weights
from refine.spline.spline import Spline
from verify.data import BadInput, DoesNotFit, InternalError, Trajectory

Floats = NDArray[np.float64]

_STEPS = np.array([1e-3, 1e-3, 1e-3, np.radians(0.1)])
_LARGEST, _LARGEST_UNSIGNED = 32767, 65535
_NANOMETRE = Fraction(1, 10**9)
"""How far a lap's closing joint may stay open where the coordinate is so near zero that half an ulp is less than this."""
_NUDGES = 4
"""Ulps by which a coefficient may be moved to close a lap."""
_FACTORIALS = np.array([1.0, 1.0, 2.0, 6.0])


def quantise(path: Spline, *, cycle: int | None = None) -> Trajectory:
    """Return a flight in exact float32 values.

    Args:
        path: x, y, z and yaw: four axes.
        cycle: Piece at which the cycle begins; the last node repeats that piece's start.

    Raises:
        BadInput: The spline has other axes than four.
        InternalError: A cycle's joint stays open by more than float32 accounts for.
    """
    wanted = (len(path) + 1, ORDER, 4)
    if path.states.shape != wanted:
        raise BadInput(
            f"a flight has four axes: x, y, z and yaw; the spline's states have shape {path.states.shape}, wanted is {wanted}."
        )
    durations = round32(path.durations)
    nodes = round32(path.states / _FACTORIALS[:, None])  # c0..c3 at every node
    turns = 0.0
    if cycle is not None:  # yaw may have turned full circles in a lap
        turns = 2 * np.pi * round((path.states[-1, 0, 3] - path.states[cycle, 0, 3]) / (2 * np.pi))
        nodes[-1] = nodes[cycle]
        nodes[-1, 0, 3] = round32(nodes[cycle, 0, 3] + turns)
    pieces = len(path)
    coefficients = np.zeros((pieces, 4, SIZE))
    start = nodes[0].copy()
    for piece in range(pieces):
        end = nodes[piece + 1]
        hover = not start[1:].any() and not end[1:].any() and np.array_equal(path.states[piece], path.states[piece + 1])
        coefficients[piece, :, 0] = start[0]
        if not hover:
            coefficients[piece] = _rounded_piece(start, end, durations[piece])
        if piece + 1 < pieces:
            start = nodes[piece + 1].copy()
            for axis in range(4):
                start[0, axis] = nearest32(exact_end(coefficients[piece, axis], durations[piece]))
        elif cycle is not None:
            for axis in range(4):
                target = float(coefficients[cycle, axis, 0]) + (turns if axis == 3 else 0.0)
                _close(coefficients[piece, axis], durations[piece], target)
    return Trajectory(durations, coefficients, cycle=cycle)


def round32(values: Floats) -> Floats:
    """Round to float32, kept as float64."""
    return np.asarray(values, dtype=np.float64).astype(np.float32).astype(np.float64)


def nearest32(value: Fraction) -> float:
    """Return the float32 nearest to an exact number (through float64; a double rounding can move a tie by 2^-53)."""
    near = np.float32(float(value))
    around = (near, np.nextafter(near, np.float32(-np.inf)), np.nextafter(near, np.float32(np.inf)))
    return min((float(option) for option in around), key=lambda option: abs(Fraction(option) - value))


def exact_end(coefficients: Floats, duration: float, derivative: int = 0) -> Fraction:
    """Return one axis of a piece, or a derivative of it, at its end, exactly.

    Args:
        coefficients: Ascending powers of local time. Shape (8,).
        duration: s.
        derivative: Which one.
    """
    time = Fraction(float(duration))
    weights = derivative_weights(derivative)
    total = Fraction(0)
    for power in range(SIZE - 1, derivative - 1, -1):
        total = total * time + Fraction(float(coefficients[power])) * int(weights[power])
    return total


def _rounded_piece(start: Floats, end: Floats, duration: float) -> Floats:
    """Return one piece's coefficients from rounded c0..c3 at both ends. Shapes (4, axes), (4, axes) to (axes, 8)."""
    powers = duration ** np.arange(SIZE)
    scale = (_FACTORIALS * powers[:ORDER])[:, None]
    unit = HERMITE @ np.concatenate([start * scale, end * scale])
    coefficients = (unit / powers[:, None]).T
    coefficients[:, :ORDER] = start.T
    return round32(coefficients)


def _close(coefficients: Floats, duration: float, target: float) -> None:
    """Move coefficients by a few ulps, in place, so that the end comes as near to `target` as half an ulp (or a nanometre).

    Where the duration is near a power of two, the ends that can be reached lie on a grid that may be coarser than that: its
    step is an ulp of the piece's terms there, which are larger than the coordinate where they cancel. Then the nearest end
    found is taken, and an ulp of the largest term bounds how far it can be, because the last coefficient alone gets that near.
    """
    time, aim = Fraction(float(duration)), Fraction(target)
    half = max(Fraction(float(np.spacing(np.float32(abs(target))))) / 2, _NANOMETRE)
    best = coefficients.copy()
    for nudge in range(64):
        trial = coefficients.copy()
        for power in (1 + nudge % 7,) if nudge else ():
            step = np.float32((nudge // 7 + 1) * (-1) ** nudge)
            trial[power] = float(np.float32(trial[power]) + step * np.spacing(np.float32(abs(trial[power]))))
        for power in range(ORDER, SIZE):
            miss = aim - exact_end(trial, duration)
            trial[power] = nearest32(Fraction(float(trial[power])) + miss / time**power)
        if abs(aim - exact_end(trial, duration)) < abs(aim - exact_end(best, duration)):
            best = trial
        if abs(aim - exact_end(best, duration)) <= half:
            coefficients[:] = best
            return
    trials = [best, *_nudged(best, duration, float(aim - exact_end(best, duration)))]
    coefficients[:] = min(trials, key=lambda trial: abs(aim - exact_end(trial, duration)))
    miss = float(abs(aim - exact_end(coefficients, duration)))
    largest = np.abs(coefficients * duration ** np.arange(SIZE)).max()
    if miss > np.spacing(np.float32(largest)):
        raise InternalError(f"The cycle's joint stays {miss:.3g} m open in float32.")


def _nudged(coefficients: Floats, duration: float, miss: float) -> list[Floats]:
    """Return coefficients moved by a few ulps together, those first whose end moves most nearly by `miss`.

    Long pieces have coarse ulps at their ends, so closing them finely takes a combination of several.
    """
    powers = np.arange(2, SIZE)
    steps = np.spacing(np.abs(coefficients[powers]).astype(np.float32)).astype(np.float64) * duration**powers
    counts = np.array(np.meshgrid(*([np.arange(-_NUDGES, _NUDGES + 1)] * len(powers)), indexing="ij")).reshape(len(powers), -1)
    off = np.abs(miss - steps @ counts)
    best = np.argsort(off, kind="stable")[:16]
    trials = np.repeat(coefficients[None], len(best), axis=0)
    trials[:, powers] = round32(trials[:, powers] + (counts[:, best].T * steps) / duration**powers)
    return list(trials)


def on_grid(path: Spline | Trajectory) -> Trajectory:
    """Return a flight on the grid of the compressed trajectory format: ms, and Bezier points in mm and tenths of a degree.

    The pieces share their joints' points, so position and yaw are continuous, but every other point is off by up to half a
    step, which moves the path by up to half a millimetre and lets velocity jump by millimetres per second and more in short
    pieces (see `jumps`). It is this flight that has to be certified, not the one that it was made from, and where the jumps are
    more than a certificate allows, it is rejected; `flight.quantised` fits pieces to the grid that join smoothly.

    Args:
        path: x, y, z and yaw: four axes; or a flight, whose cycle is kept.

    Raises:
        DoesNotFit: A coordinate is beyond 32.767 m, or a piece lasts less than 1 ms or more than 65.535 s.
    """
    durations = np.rint(path.durations * 1e3)
    if durations.min() < 1 or durations.max() > _LARGEST_UNSIGNED:
        piece = int(np.argmax(np.maximum(durations, 1.0 / np.maximum(durations, 1e-9))))
        raise DoesNotFit(f"piece {piece} lasts {path.durations[piece]:g} s; the compressed format holds 0.001 to 65.535 s.")
    unit = path.coefficients * path.durations[:, None, None] ** np.arange(SIZE)
    points = np.rint((unit @ bernstein_matrix().T) / _STEPS[:, None])
    if np.abs(points).max() > _LARGEST:
        where = np.unravel_index(int(np.argmax(np.abs(points))), points.shape)
        value = points[where] * _STEPS[where[1]]
        raise DoesNotFit(
            f"piece {where[0]} reaches {value:.3f} on axis {where[1]}; the compressed format holds 16-bit millimetres and 0.1 degrees."
        )
    points[1:, :, 0] = points[:-1, :, -1]
    cycle = path.cycle if isinstance(path, Trajectory) else None
    if cycle is not None:
        points[-1, :3, -1] = points[cycle, :3, 0]  # the heading may have gained whole turns
    coefficients = np.linalg.solve(bernstein_matrix(), (points * _STEPS[:, None]).transpose(0, 2, 1)).transpose(0, 2, 1)
    seconds = durations / 1e3
    return Trajectory(seconds, coefficients / seconds[:, None, None] ** np.arange(SIZE), cycle=cycle)


@dataclass(frozen=True)
class Jumps:
    """Greatest jumps at the joints of a flight, over all axes, computed exactly and rounded up.

    Attributes:
        position: m, or rad for yaw.
        ulps: The same in units of the float32 spacing there.
        velocity: m/s.
        acceleration: m/s^2.
        jerk: m/s^3.
    """

    position: float
    ulps: float
    velocity: float
    acceleration: float
    jerk: float


def jumps(flight: Trajectory) -> Jumps:
    """Measure the joints of a flight, the cycle's closing one included."""
    greatest = [0.0] * ORDER
    ulps = 0.0
    pairs = [(piece, piece + 1) for piece in range(len(flight) - 1)]
    if flight.cycle is not None:
        pairs.append((len(flight) - 1, flight.cycle))
    for before, after in pairs:
        for axis in range(4):
            for derivative in range(ORDER):
                end = exact_end(flight.coefficients[before, axis], float(flight.durations[before]), derivative)
                begin = Fraction(float(flight.coefficients[after, axis, derivative])) * int(_FACTORIALS[derivative])
                gap = abs(end - begin)
                greatest[derivative] = max(greatest[derivative], float(np.nextafter(float(gap), np.inf)) if gap else 0.0)
                if derivative == 0 and gap:
                    spacing = float(np.spacing(np.float32(abs(float(begin)))))
                    ulps = max(ulps, float(gap) / spacing)
    return Jumps(greatest[0], ulps, *greatest[1:])
