"""Usage of limits by a spline, from dense samples, as stretching and repairs need it. A filter, never a claim.

The checker proves limits for all times; here samples are dense enough that what they miss is far below the safety share.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refine.limits.flatness import flat_samples
from refine.limits.limits import LIMIT_NAMES, Limits
from refine.spline.basis import values
from refine.spline.spline import Spline
from verify.data import GRAVITY

Floats = NDArray[np.float64]

SAMPLES = 96
"""Samples a piece; a degree-7 piece has at most a handful of extremes of each quantity."""


@dataclass(frozen=True)
class Peak:
    """The sampled extreme of one limited quantity.

    Attributes:
        name: One of LIMIT_NAMES.
        value: In the limit's unit (thrusts over mass in m/s^2, rotors in N).
        limit: What it must keep.
        time: s from the spline's start.
        share: How much of the way from hovering to the limit is used; above 1 breaks the limit.
    """

    name: str
    value: float
    limit: float
    time: float
    share: float


def peaks(path: Spline, yaw: Spline | None, limits: Limits, samples: int = SAMPLES) -> tuple[Peak, ...]:
    """Return the sampled extreme of every limited quantity of a flight.

    Args:
        path: Three axes.
        yaw: One axis, same durations; None where yaw is 0 throughout.
        limits: Infinite ones are left out.
        samples: A piece.
    """
    times = (path.knots[:-1, None] + path.durations[:, None] * np.linspace(0, 1, samples)).ravel()
    return peaks_of(shares_used(path, yaw, limits, samples), times)


def peaks_of(uses: dict[str, tuple[Floats, float, Floats]], times: Floats | None = None) -> tuple[Peak, ...]:
    """Return the extreme of every limited quantity among samples.

    Args:
        uses: As `shares_used` returns them.
        times: Of the samples, s; 0 where left out. Shape (pieces * samples,).
    """
    found = []
    for name, (used, limit, share) in uses.items():
        index = int(np.argmax(share))
        at = 0.0 if times is None else float(times[index])
        found.append(Peak(name, float(used.flat[index]), limit, at, float(share.flat[index])))
    return tuple(found)


@dataclass(frozen=True, eq=False, slots=True)
class Samples:
    """A flight's derivatives at samples.

    Attributes:
        motion: Velocity to snap. Shapes (pieces, samples, 3), or of some samples (number, 3).
        yaw: Yaw and its first two derivatives. Shapes (pieces, samples), or (number,).
    """

    motion: tuple[Floats, ...]
    yaw: tuple[Floats, ...]

    @classmethod
    def of(cls, path: Spline, yaw: Spline | None, samples: int = SAMPLES, pieces: NDArray[np.intp] | None = None) -> Samples:
        """Return a flight's derivatives at even samples of each piece.

        Args:
            path: Three axes.
            yaw: One axis, same durations; None where yaw is 0 throughout.
            samples: A piece.
            pieces: Those that are sampled; all where None.
        """
        at, kept = np.linspace(0.0, 1.0, samples), slice(None) if pieces is None else pieces
        motion = tuple(_sampled(path, at, d, kept) for d in (1, 2, 3, 4))
        still = (np.zeros(motion[0].shape[:2]),) * 3
        return cls(motion, still if yaw is None else tuple(_sampled(yaw, at, d, kept)[..., 0] for d in (0, 1, 2)))

    def stretched(self, factor: float) -> Samples:
        """Return the samples of the same flight, so many times slower."""
        motion = tuple(values / factor**order for order, values in enumerate(self.motion, start=1))
        return Samples(motion, tuple(values / factor**order for order, values in enumerate(self.yaw)))

    def where(self, kept: NDArray[np.bool_]) -> Samples:
        """Return some of the samples, in one row.

        Args:
            kept: Whether each is one of them. Shape (pieces, samples).
        """
        return Samples(tuple(values[kept] for values in self.motion), tuple(values[kept] for values in self.yaw))

    def shares(self, limits: Limits) -> dict[str, tuple[Floats, float, Floats]]:
        """Return what `shares_used` does."""
        velocity, acceleration, jerk, snap = self.motion
        flat = flat_samples(acceleration, jerk, snap, *self.yaw)
        result: dict[str, tuple[Floats, float, Floats]] = {}

        def note(name: str, values: Floats, limit: float, rest: float = 0.0) -> None:
            if np.isfinite(limit):
                result[name] = (values, limit, (values - rest) / (limit - rest))

        note("speed", np.linalg.norm(velocity, axis=-1), limits.speed)
        note("acceleration", np.linalg.norm(acceleration, axis=-1), limits.acceleration)
        note("thrust_max", flat.thrust, limits.thrust_max, GRAVITY)
        if limits.thrust_min > 0:
            note("thrust_min", flat.thrust, limits.thrust_min, GRAVITY)
        note("tilt", flat.tilt, limits.tilt)
        note("body_rate", np.sqrt(flat.rates[0] ** 2 + flat.rates[1] ** 2), limits.body_rate)
        note("yaw_rate", np.abs(flat.rates[2]), limits.yaw_rate)
        if limits.rotors is not None:
            thrusts, hover = flat.rotor_thrusts(limits.rotors), limits.rotors.mass * GRAVITY / 4
            note("rotor_thrust_max", thrusts.max(axis=-1), limits.rotors.most, hover)
            note("rotor_thrust_min", thrusts.min(axis=-1), limits.rotors.least, hover)
        return {name: result[name] for name in LIMIT_NAMES if name in result}


def _sampled(path: Spline, at: Floats, derivative: int, pieces: slice | NDArray[np.intp]) -> Floats:
    return values(path.coefficients[pieces], path.durations[pieces, None] * at, derivative)


def shares_used(
    path: Spline, yaw: Spline | None, limits: Limits, samples: int = SAMPLES
) -> dict[str, tuple[Floats, float, Floats]]:
    """Return, for each limited quantity, its samples, its limit, and the share of the way from hovering to the limit.

    All arrays have shape (pieces, samples).

    Args:
        path: Three axes.
        yaw: One axis, same durations; None where yaw is 0 throughout.
        limits: Infinite ones are left out.
        samples: A piece.
    """
    return Samples.of(path, yaw, samples).shares(limits)


def worst(found: tuple[Peak, ...]) -> Peak | None:
    """Return the peak that uses the greatest share of its limit; None where nothing is limited."""
    return max(found, key=lambda peak: peak.share, default=None)
