"""A patrol's end: behind its last lap the robot brakes along one more piece, which is proved before it is written.

A lap that is flown through begins and ends in full flight, and a vehicle that has nothing more to fly stops where its memory ends, 0.15 m
too late at 1 m/s. Its velocity is led to zero by the polynomial of degree 5 that begins with its velocity, acceleration and jerk; how quickly,
and after how many pieces of one more lap, is tried until the checker has no objection and it rests where a flight may begin: not in a hoop's opening, from
where nobody lands. The laps themselves stay as they are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from verify.data import BadInput, Mission, Trajectory
from verify.data.trajectory import PIECES
from verify.data.validation.agents import misplaced
from verify.flight_segments import judge_braking
from verify.motion.continuity import JUMPS

Floats = NDArray[np.float64]

LENGTHS = (0.5, 0.7, 1.0, 1.4, 2.0, 2.8)
"""s that braking takes, as they are tried."""
_MORE = 8
"""Pieces of one more lap after which it is tried at the most."""

Join = Callable[[str, Trajectory, Trajectory], Trajectory | None]
"""Puts the braking piece of a robot of that name behind its flight, as a target holds it; None where there is no room for it."""


@dataclass(frozen=True, slots=True)
class Braked:
    """A patrol that comes to rest.

    Attributes:
        flown: All laps and the braking.
        since: s, when it begins to brake.
        more: Pieces of one more lap that are flown before.
    """

    flown: Trajectory
    since: float
    more: int


@dataclass(frozen=True, slots=True)
class AtMost:
    """Puts pieces together as they are, up to a number: a `Join`.

    Attributes:
        pieces: What the target holds; None for any number.
    """

    pieces: int | None = PIECES

    def __call__(self, name: str, flown: Trajectory, last: Trajectory) -> Trajectory | None:
        """Return a flight with its last piece behind it; None where there is no room for it.

        Args:
            name: The robot's; it is all the same here.
            flown: The flight.
            last: The piece.
        """
        del name
        if self.pieces is not None and len(flown) + len(last) > self.pieces:
            return None
        return Trajectory(
            np.concatenate([flown.durations, last.durations]), np.concatenate([flown.coefficients, last.coefficients])
        )


def ends_in_flight(path: Trajectory) -> bool:
    """Return whether a robot still moves where its last lap ends.

    Args:
        path: Its flight.
    """
    if path.cycle is None:
        return False
    return any(np.abs(path.evaluate(path.duration, order)).max() > JUMPS[order] for order in (1, 2, 3))


def braked(mission: Mission, name: str, path: Trajectory, join: Join) -> Braked | None:
    """Return a patrol's laps with a proved braking behind them; None where nothing that was tried is proved and fits.

    Args:
        mission: The patrol's, with the margin that is to be proved.
        name: The robot's.
        path: Its certified laps, which end in flight.
        join: Puts pieces together.
    """
    return next(brakings(mission, name, path, join), None)


def brakings(mission: Mission, name: str, path: Trajectory, join: Join) -> Iterator[Braked]:
    """Yield a patrol's laps with a proved braking behind them, one after another of those that are tried.

    Args:
        mission: The patrol's, with the margin that is to be proved.
        name: The robot's.
        path: Its certified laps, which end in flight.
        join: Puts pieces together.
    """
    laps = path.flattened(mission.spec.repeat)
    for more, before in _longer(path, laps):
        since = sum(map(Fraction, before.durations.tolist()), Fraction(0))
        for length in LENGTHS:
            flown = join(name, before, _to_rest(before, length))
            if flown is None:
                return
            if not _may_begin(mission, name, flown):
                continue
            try:
                claims = judge_braking(mission, name, path, flown, since)
            except BadInput:
                continue
            if all(claim.outcome == "holds" for claim in claims):
                yield Braked(flown, float(since), more)


def _may_begin(mission: Mission, name: str, flown: Trajectory) -> bool:
    """Return whether a mission in this world could begin where a flight ends."""
    x, y, z = flown.evaluate(flown.duration)[:3].tolist()
    world = {key: getattr(mission, key) for key in ("workspace", "margin", "hoops", "regions")}
    return not any(misplaced((x, y, z), world, mission.vehicle_of(name)))


def _longer(path: Trajectory, laps: Trajectory) -> Iterator[tuple[int, Trajectory]]:
    """Yield all laps, and all laps with ever more pieces of another one."""
    yield 0, laps
    begin = path.cycle or 0
    for more in range(1, min(_MORE, len(path) - begin - 1) + 1):
        part = slice(begin, begin + more)
        yield (
            more,
            Trajectory(
                np.concatenate([laps.durations, path.durations[part]]),
                np.concatenate([laps.coefficients, path.coefficients[part]]),
            ),
        )


def _to_rest(flown: Trajectory, length: float) -> Trajectory:
    """Return one piece that leads from a flight's end to rest, rounded to float32."""
    begin = np.stack([flown.evaluate(flown.duration, order) for order in range(4)])  # (4 orders, 4 axes)
    length = float(np.float32(length))
    # In shares u of the length: speed w(u) = sum w_k u^k with w, w', w'' given at 0 and zero at 1.
    known = np.stack([begin[1] * length, begin[2] * length**2, begin[3] * length**3 / 2])
    at_one = np.array([[1.0, 1.0, 1.0], [3.0, 4.0, 5.0], [6.0, 12.0, 20.0]])
    sums = np.stack([known.sum(axis=0), known[1] + 2 * known[2], 2 * known[2]])
    speed = np.concatenate([known, np.linalg.solve(at_one, -sums)])
    coefficients = np.zeros((1, 4, 8))
    coefficients[0, :, 0] = begin[0]
    for power in range(6):
        coefficients[0, :, power + 1] = speed[power] / (power + 1) / length ** (power + 1)
    rounded: Floats = coefficients.astype(np.float32).astype(np.float64)
    return Trajectory([length], rounded)
