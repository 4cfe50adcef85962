"""Stretches of a team's flight from rest to rest, put on a common clock so that they begin and end together to the last bit.

Whoever has arrived hovers until the others have. For that all durations are whole multiples of a fraction of a millisecond that
float32 holds exactly.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from refine.coordination.team_flights import Together
from refine.single_robot.task import RobotFlight
from refine.spline.rounding import quantise
from refine.spline.spline import Spline
from verify.data import Mission, Plan, Trajectory

TICK = 2.0**-15
"""s; every duration is a multiple of it, so that sums of them are exact and a hover of the difference is too."""
LONGEST = 256.0
"""s of one hover, which float32 still holds to a tick."""
SHORTEST = 0.25
"""s of the shortest hover in which a robot waits for the others: coefficients of much shorter pieces drown in float32."""


@dataclass(frozen=True, slots=True)
class Pieces:
    """One robot's pieces in a part of the flight; none where it never moves."""

    durations: tuple[float, ...]
    coefficients: tuple[np.ndarray, ...]

    @property
    def length(self) -> Fraction:
        """Its exact length, in s."""
        return sum(map(Fraction, self.durations), Fraction(0))


@dataclass(frozen=True, slots=True)
class Stretch:
    """A team's flight from rest to rest, of one length for all; in parts where it is cut.

    Attributes:
        length: Exact, in s; 0 where nobody moves.
        pieces: Each robot's.
        cuts: For each robot the pieces with which new parts begin.
    """

    length: Fraction
    pieces: dict[str, Pieces]
    cuts: dict[str, tuple[int, ...]]

    def then(self, other: Stretch) -> Stretch:
        """Return this stretch and behind it another one, uncut between them."""
        return Stretch(
            self.length + other.length,
            {
                name: Pieces(
                    (*own.durations, *other.pieces[name].durations), (*own.coefficients, *other.pieces[name].coefficients)
                )
                for name, own in self.pieces.items()
            },
            {
                name: (*cuts, *(cut + len(self.pieces[name].durations) for cut in other.cuts[name]))
                for name, cuts in self.cuts.items()
            },
        )

    def flights(self) -> dict[str, Trajectory]:
        """Return one finite flight a robot."""
        return {
            name: Trajectory(own.durations, np.stack(own.coefficients), cuts=self.cuts[name])
            for name, own in self.pieces.items()
        }

    def fits(self, held: Mapping[str, int | None]) -> bool:
        """Return whether all vehicles hold the whole stretch at once.

        Args:
            held: Pieces that each vehicle holds; None for any number.
        """
        return all((most := held[name]) is None or len(own.durations) <= most for name, own in self.pieces.items())


def from_rest(plan: Plan, team: Together, least: float = 0.0) -> Stretch:
    """Return a finite flight as one stretch.

    Args:
        plan: Who visits what.
        team: Its robots with their paths, and their departures, s.
        least: s that it lasts where nobody moves.
    """
    robots, starts = team
    flown = {
        name: Pieces((), ()) if _never_moves(robot) else _pieces(as_flown(robot, plan.mission.agents[name].yaw, starts[name]))
        for name, robot in robots.items()
    }
    return _together(plan, flown, least)


def waiting(plan: Plan, least: float = 0.0) -> Stretch:
    """Return a stretch in which nobody moves.

    Args:
        plan: Says where robots are.
        least: s that it lasts.
    """
    return _together(plan, dict.fromkeys(plan.robots, Pieces((), ())), least)


def _together(plan: Plan, flown: Mapping[str, Pieces], least: float) -> Stretch:
    places = {name: robot.waypoints[-1].position for name, robot in plan.robots.items()}
    length, pieces = _on_common_clock(flown, places, plan.mission, least)
    return Stretch(length, pieces, dict.fromkeys(pieces, ()))


def _never_moves(robot: RobotFlight) -> bool:
    return (
        robot.corridor is None and not robot.path.states[:, 1:].any() and np.ptp(robot.path.states[:, 0], axis=0).max() == 0.0
    )


def as_flown(robot: RobotFlight, start_yaw: float, departure: float) -> Spline:
    """Return x, y, z and yaw of a robot's flight, with the hover before it departs.

    Args:
        robot: Its path.
        start_yaw: Its heading where that is constant, rad.
        departure: When it departs, s; less than a tick is no hover.
    """
    path = robot.path
    yaw = np.zeros((len(path) + 1, 4, 1)) if robot.yaw is None else robot.yaw.states
    if robot.yaw is None:
        yaw[:, 0] = start_yaw
    states, durations = np.concatenate([path.states, yaw], axis=2), path.durations
    if departure >= TICK:
        states = np.concatenate([states[:1], states])
        durations = np.concatenate([[departure], durations])
    return Spline(durations, states)


def _pieces(path: Spline) -> Pieces:
    ticks = np.maximum(np.round(path.durations / TICK), 1.0) * TICK
    flown = quantise(Spline(ticks, path.states))
    return Pieces(tuple(flown.durations.tolist()), tuple(flown.coefficients))


def end_of(pieces: Pieces) -> np.ndarray:
    """Return where a robot comes to rest, in float32: x, y, z in m and yaw in rad. Shape (4,).

    Args:
        pieces: What it flies, at least one.
    """
    powers = pieces.durations[-1] ** np.arange(8)
    return (pieces.coefficients[-1] @ powers).astype(np.float32).astype(np.float64)


def _on_common_clock(
    flown: Mapping[str, Pieces], places: Mapping[str, tuple[float, ...]], mission: Mission, least: float
) -> tuple[Fraction, dict[str, Pieces]]:
    """Return how long a part lasts, in s, and each robot's pieces with a hover at its end, if it has to wait for the others.

    A part in which nobody moves lasts `least` s; where those rest that never move is in `places`, in m.
    """
    length = max((pieces.length for pieces in flown.values()), default=Fraction(0))
    if not length:
        length = Fraction(least)
    if any(0 < length - pieces.length < Fraction(SHORTEST) for pieces in flown.values()):
        length += Fraction(SHORTEST)
    found: dict[str, Pieces] = {}
    for name, pieces in flown.items():
        here = np.array([*places[name], mission.agents[name].yaw], dtype=np.float32).astype(np.float64)
        if pieces.durations:
            here = end_of(pieces)
        hover = np.zeros((4, 8))
        hover[:, 0] = here
        waits = _waits(length - pieces.length)
        found[name] = Pieces((*pieces.durations, *waits), (*pieces.coefficients, *(hover,) * len(waits)))
    return length, found


def _waits(left: Fraction) -> tuple[float, ...]:
    """Return hovers of this length in all, in s, each of whole ticks and not too long for float32."""
    ticks = left / Fraction(TICK)
    assert ticks.denominator == 1
    count = max(1, math.ceil(left / Fraction(LONGEST))) if left else 0
    share, more = divmod(ticks.numerator, count) if count else (0, 0)
    return tuple(float((share + (index < more)) * Fraction(TICK)) for index in range(count))
