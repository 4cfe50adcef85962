"""The hunt: winds of a given speed that are made to push a team out of its tube, found from the loop's own response.

A hovering vehicle is blown at for 20 ms along each axis, and how it moves is written down. Were the loop linear, one wind would bring it farthest at
an instant along a direction. That wind is as fast as it may be at all times, and turns as that response does read backwards. It brings it there by
the sum of the response's length (the l1 gain of the loop). The flight is flown in such winds for several instants and directions, and again around
the worst of them. Nothing is proved by it: it finds what chance does not.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from flight.conditions import CAMERAS, LABORATORY, Conditions
from flight.control.controller import CONTROLLERS
from flight.control.profiles import PROFILES
from flight.mixed_fleet import kinds_of
from flight.model.airframe import Airframe, airframes_of
from flight.model.attitude import Floats
from flight.model.numbers import is_number
from flight.model.reference import Reference, flown, sample_reference
from flight.model.timing import CONTROL_STEP, STEP, SUBSTEPS
from flight.monitoring.tube import stray_between_steps
from flight.onboard_simulation.fleet import Differences, Fleet, Sight
from flight.random_streams import Draws
from flight.rehearsal.batches import Chance, peaks
from verify.data import BadInput, Mission, Trajectory
from verify.data.progress import Progress, part_of, silent
from verify.recordings.planned_paths import planned_paths

FASTEST = 20.0
"""m/s, of a wind that is hunted with at most."""
_REMEMBERED = 10.0
"""s after which a loop has forgotten a gust."""
_PULSE = 0.5
"""m/s for one control step: small, so that the response is that of the linear loop."""
_INSTANTS = 6
_DIRECTIONS = tuple(sign * axis for axis in np.eye(3) for sign in (1.0, -1.0))


@dataclass(frozen=True, slots=True)
class Hunt:
    """Results of a hunt.

    Attributes:
        wind: Speed of the air at all times, m/s.
        margin: Radius of the tube, m; None without one.
        linear: Each robot's largest distance if its loop were linear and hovered, m: the l1 gain times the wind.
        worst: Largest distance of any robot from its plan that was found, m; infinite where one was lost.
        robot: Whose.
        time: s of the flight at which that wind was aimed.
        flights: How many winds were flown.
        left: How many of them drove a robot out of its tube; None without a margin.
    """

    wind: float
    margin: float | None
    linear: Mapping[str, float]
    worst: float
    robot: str
    time: float
    flights: int
    left: int | None

    @property
    def sentence(self) -> str:
        """The results, for a person."""
        far = "a robot is lost" if self.worst == float("inf") else f"worst {1000 * self.worst:.1f} mm"
        kept = "" if self.left is None else f" {self.left} of {self.flights} left the tube of {self.margin:g} m;"
        return (
            f"Hunted with winds of {self.wind:g} m/s that turn against the loop:{kept} {far} by {self.robot}, aimed at {self.time:.1f} s "
            f"({1000 * self.linear[self.robot]:.0f} mm of it from the wind alone, were the loop linear). A hunt proves nothing."
        )

    def to_dict(self) -> dict[str, Any]:  # of any type: JSON nests
        """Return the findings as plain data; a lost robot's error is null."""
        return {**asdict(self), "linear": dict(self.linear), "worst": None if self.worst == float("inf") else self.worst}


def hunt(
    mission: Mission,
    team: Mapping[str, Trajectory],
    margin: float | None,
    *,
    wind: float,
    seed: int = 0,
    progress: Progress | None = None,
) -> Hunt:
    """Fly a team in winds that are made to push it out of its tube, by the controllers of its profiles.

    Args:
        mission: Who flies.
        team: Its trajectories.
        margin: Radius of the tube, m; None for none.
        wind: Speed of the air, m/s.
        seed: Of the cameras' noise.
        progress: Called with a sentence and the share done.

    Raises:
        BadInput: There is no such wind.
    """
    require_wind(wind)
    reference = sample_reference(flown(mission, team), CONTROL_STEP, SUBSTEPS, onward=flown(mission, team, more_laps=1))
    airframes, say = airframes_of(mission, mission.agents), progress or silent
    kernels = {airframe: response(airframe) for airframe in dict.fromkeys(airframes)}
    own = [kernels[airframe] for airframe in airframes]
    hunted = _Hunted(reference, airframes, own, wind, seed)
    between = stray_between_steps(mission, planned_paths(mission, team), STEP)
    ends = np.linspace(0.0, float(reference.times[-1]), _INSTANTS + 1)[1:]
    aims = [(float(end), direction) for end in ends for direction in _DIRECTIONS]
    errors = hunted.flown(aims, part_of(say, 0.0, 0.5)) + between
    best, _ = np.unravel_index(np.argmax(errors), errors.shape)
    near = ends[1] - ends[0] if len(ends) > 1 else ends[0]
    again = _around(aims[int(best)], float(near), float(ends[-1]))
    more = hunted.flown(again, part_of(say, 0.5, 1.0)) + between
    found, aims = np.concatenate([errors, more]), [*aims, *again]
    aim, robot = np.unravel_index(np.argmax(found), found.shape)
    linear = {name: wind * gain_of(kernel) for name, kernel in zip(reference.robots, own, strict=True)}
    left = None if margin is None else int(np.count_nonzero(np.max(found, axis=1) >= margin))
    return Hunt(wind, margin, linear, float(found[aim, robot]), reference.robots[robot], aims[aim][0], len(aims), left)


def require_wind(wind: float) -> None:
    """Reject a speed that nothing is hunted with.

    Args:
        wind: m/s.

    Raises:
        BadInput: It is no number, not above 0, or above `FASTEST`.
    """
    if not (is_number(wind) and 0.0 < wind <= FASTEST):
        raise BadInput(f"a hunt's wind is above 0 m/s and at most {FASTEST:g}, not {wind!r}.")


def response(airframe: Airframe) -> Floats:
    """Return how a hovering vehicle moves that was blown at by 1 m/s for one control step, m.

    Args:
        airframe: With the controller that its profile names, on the estimator on board.

    Returns:
        At each control step after the gust began; by the gust's axis, then by the motion's. Shape (steps, 3, 3).
    """
    start = np.zeros((4, 3))
    flat = np.zeros((5, 4, 3))
    fleet = Fleet(kinds_of((airframe,), 3), CONTROLLERS.find(PROFILES), start, Differences(np.full(3, CAMERAS.delay)))
    clear = Sight(np.zeros((3, 3)), np.zeros((3, 3)), np.ones(3, dtype=np.bool_), np.zeros((3, 3)))
    settled, count = round(1.0 / CONTROL_STEP), round(_REMEMBERED / CONTROL_STEP)
    moved, at_rest = np.empty((count, 3, 3)), np.zeros((3, 3))
    for tick in range(settled + count):
        if tick == settled:
            at_rest = fleet.state[:3].copy()
        air = _PULSE * np.eye(3) if tick == settled else np.zeros((3, 3))
        for half in range(2):
            fleet.look(clear)
            fleet.fly(flat, half, air)
        if tick >= settled:
            moved[tick - settled] = (fleet.state[:3] - at_rest).T
    return moved / _PULSE


def gain_of(kernel: Floats) -> float:
    """Return the largest distance along an axis that a wind of 1 m/s can make of a linear loop, m per m/s.

    Args:
        kernel: As from `response`.
    """
    return float(np.max(np.sum(np.linalg.norm(kernel, axis=1), axis=0)))


def wind_towards(kernel: Floats, direction: Floats, ticks: int, until: float) -> Floats:
    """Return the wind of 1 m/s that brings a linear loop farthest along a direction at an instant. Shape (ticks, 3).

    Args:
        kernel: As from `response`.
        direction: Of length 1. Shape (3,).
        ticks: Of the flight.
        until: That instant, s.
    """
    push = kernel @ direction  # (steps, gust's axis)
    last, found = round(until / CONTROL_STEP), np.zeros((ticks, 3))
    for tick in range(min(last, ticks)):
        found[tick] = push[min(last - 1 - tick, len(push) - 1)]
    length = np.linalg.norm(found, axis=1, keepdims=True)
    return np.where(length > 0.0, found / np.maximum(length, 1e-300), direction)


def _around(aim: tuple[float, Floats], near: float, end: float) -> list[tuple[float, Floats]]:
    """Return instants and directions around the worst."""
    time, direction = aim
    turns = [np.roll(np.eye(3)[0], k) for k in range(3)]
    leaning = [direction, *(direction + sign * 0.6 * turn for turn in turns for sign in (1.0, -1.0))]
    times = [min(max(time + share * near, 0.2), end) for share in (-0.5, -0.25, 0.0, 0.25, 0.5)]
    return [(at, way / np.linalg.norm(way)) for at in times for way in leaning if np.linalg.norm(way) > 0.1]


class _Aimed:
    """Air that is aimed: a wind for every vehicle and control step."""

    def __init__(self, winds: Floats) -> None:
        self._winds, self._tick = winds, -1

    def after(self, _: Floats) -> Floats:
        """Return the air's velocity at every vehicle in the next control step, m/s. Shape (3, n)."""
        self._tick += 1
        return self._winds[self._tick]


@dataclass(frozen=True, slots=True)
class _Hunted:
    """A team in winds that are aimed."""

    reference: Reference
    airframes: Sequence[Airframe]
    kernels: Sequence[Floats]
    wind: float
    seed: int

    def flown(self, aims: Sequence[tuple[float, Floats]], report: Progress) -> Floats:
        """Return each robot's largest distance from its plan in each wind, m. Shape (winds, robots).

        Args:
            aims: An instant, s, and a direction of each.
            report: Told how far it is.
        """
        reference, robots, ticks = self.reference, len(self.reference.robots), self.reference.ticks
        winds = np.stack(
            [wind_towards(kernel, direction, ticks, time) for time, direction in aims for kernel in self.kernels], axis=-1
        )
        n = len(aims) * robots
        start = np.tile(reference.start, (1, len(aims)))
        differences = Differences(np.full(n, CAMERAS.delay))
        fleet = Fleet(kinds_of(tuple(self.airframes), len(aims)), CONTROLLERS.find(PROFILES), start, differences)
        draws = Draws(Conditions(LABORATORY, CAMERAS), (self.seed,), robots)
        return peaks(reference, fleet, Chance(draws, CAMERAS, _Aimed(self.wind * winds), len(aims)), report)[:, 0]
