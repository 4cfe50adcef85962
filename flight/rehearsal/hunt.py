"""The hunt: winds and errors of sensors that are made to push a team out of its tube, found from the loop's own response.

A hovering vehicle is blown at for 20 ms along each axis, or seen beside where it is, and how it moves is written down. Were the loop linear, one wind would
bring it farthest at an instant along a direction. That wind is as fast as it may be at all times, and turns as that response does read backwards. It brings it
there by the sum of the response's length (the l1 gain of the loop). So it is of errors. The flight is flown in them for several instants and directions; the
worst is flown at the ends of mass, thrust and latency, and at the worst of these again around its instant and direction. Nothing is proved by it: it finds
what chance does not.

A mission that states disturbances is hunted within these. Without them the air is aimed, and ends are those of `corners`.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from flight.conditions import CAMERAS, LABORATORY, Conditions, conditions_of
from flight.control.controller import CONTROLLERS
from flight.control.profiles import PROFILES, autopilot_of
from flight.mixed_fleet import kinds_of
from flight.model.airframe import Airframe, airframes_of
from flight.model.attitude import Floats
from flight.model.numbers import is_number
from flight.model.reference import Reference, flown, sample_reference
from flight.model.timing import CONTROL_STEP, STEP, SUBSTEPS
from flight.monitoring.tube import stray_between_steps
from flight.onboard_simulation.fleet import Differences, Fleet, Sight
from flight.random_streams import Draws
from flight.rehearsal.batches import Air, Chance, peaks
from flight.rehearsal.corners import intervals_of, said_of
from verify.certificate import Certificate
from verify.data import BadInput, Mission, Trajectory
from verify.data.progress import Progress, part_of, silent
from verify.recordings.planned_paths import planned_paths

FASTEST = 20.0
"""m/s, of a wind that is hunted with at most."""
_REMEMBERED = 10.0
"""s after which a loop has forgotten a gust."""
_PULSES = {"wind": 0.5, "position": 0.002, "velocity": 0.02, "attitude": 0.01, "gyroscope": 0.1}
"""m/s, m, m/s, rad and rad/s for one control step: small, so that the response is that of the linear loop."""
_ENDS = ("mass", "thrust", "latency")
"""What has two ends."""
_UNITS = {"position": "m", "velocity": "m/s", "attitude": "rad", "gyroscope": "rad/s"}
_ON_BOARD, _ON_GROUND = ("position", "attitude", "gyroscope"), ("position", "velocity", "gyroscope")
"""What is aimed of what an estimator on board sees, and of what a controller is given that has none."""
_INSTANTS = 6
_DIRECTIONS = tuple(sign * axis for axis in np.eye(3) for sign in (1.0, -1.0))


@dataclass(frozen=True, slots=True)
class Hunt:
    """Results of a hunt.

    Attributes:
        wind: Speed of the air at all times, m/s.
        errors: What else is aimed, and how far off it is: position in m, velocity in m/s, attitude in rad, gyroscope in rad/s.
        margin: Radius of the tube, m; None without one.
        linear: Each robot's largest distance if its loop were linear and hovered, m: l1 gains times the wind and errors.
        worst: Largest distance of any robot from its plan that was found, m; infinite where one was lost.
        robot: Whose.
        time: s of the flight at which that wind was aimed.
        ends: `least` or `most` of mass, thrust and latency there; empty where that was as the profile says.
        flights: How many were flown.
        left: How many of them drove a robot out of its tube; None without a margin.
        bound: That is proved of the robot, m; None where none is proved of what was hunted.
    """

    wind: float
    errors: Mapping[str, float]
    margin: float | None
    linear: Mapping[str, float]
    worst: float
    robot: str
    time: float
    ends: Mapping[str, str]
    flights: int
    left: int | None
    bound: float | None

    @property
    def sentence(self) -> str:
        """The results, for a person."""
        far = "a robot is lost" if self.worst == float("inf") else f"worst {1000 * self.worst:.1f} mm"
        kept = "" if self.left is None else f" {self.left} of {self.flights} left the tube of {self.margin:g} m;"
        also = "".join(f" and {name} errors of {size:g} {_UNITS[name]}" for name, size in self.errors.items())
        ends = f" with {said_of(self.ends)}" if self.ends else ""
        proved = "" if self.bound is None else f" The proved bound is {self.bound / self.worst:.1f} times that."
        if self.bound is not None and self.worst > self.bound:
            proved = f" That is outside the model: the proved bound is {1000 * self.bound:.1f} mm."
        return (
            f"Hunted with winds of {self.wind:g} m/s{also} that turn against the loop:{kept} {far} by {self.robot}, aimed at {self.time:.1f} s"
            f"{ends} ({1000 * self.linear[self.robot]:.0f} mm from what is aimed alone, were the loop linear).{proved} A hunt proves nothing."
        )

    def to_dict(self) -> dict[str, Any]:  # of any type: JSON nests
        """Return the findings as plain data; a lost robot's error is null."""
        tables = {name: dict(getattr(self, name)) for name in ("errors", "linear", "ends")}
        return {**asdict(self), **tables, "worst": None if self.worst == float("inf") else self.worst}


@dataclass(frozen=True, eq=False, slots=True)
class _Aim:
    """One flight of a hunt: when and where to it pushes, and 0 or 1 for the least and most of mass, thrust and latency."""

    time: float
    direction: Floats
    ends: tuple[int, ...] | None = None


def hunt(
    mission: Mission,
    team: Mapping[str, Trajectory],
    cert: Certificate | None,
    *,
    wind: float,
    seed: int = 0,
    progress: Progress | None = None,
) -> Hunt:
    """Fly a team in winds and errors that are made to push it out of its tube, by the controllers of its profiles.

    Args:
        mission: Who flies, and the disturbances that are stated.
        team: Its trajectories.
        cert: Its certificate, with the radius of the tube and what is proved of tracking; None for no tube.
        wind: Speed of the air, m/s.
        seed: Of the cameras' noise, where no disturbances are stated.
        progress: Called with a sentence and the share done.

    Raises:
        BadInput: There is no such wind.
    """
    require_wind(wind)
    reference = sample_reference(flown(mission, team), CONTROL_STEP, SUBSTEPS, onward=flown(mission, team, more_laps=1))
    hunted = _Hunted(reference, airframes_of(mission, mission.agents), _sizes(mission, wind), mission, seed)
    say, between = progress or silent, stray_between_steps(mission, planned_paths(mission, team), STEP)
    ends = np.linspace(0.0, float(reference.times[-1]), _INSTANTS + 1)[1:]
    aims, errors = list[_Aim](), np.zeros((0, len(reference.robots)))

    def fly(more: list[_Aim], low: float, high: float) -> _Aim:
        """Fly some more, and return the worst of all."""
        nonlocal errors
        aims.extend(more)
        errors = np.concatenate([errors, hunted.flown(more, part_of(say, low, high)) + between])
        return aims[int(np.argmax(errors.max(axis=1)))]

    best = fly([_Aim(float(end), direction) for end in ends for direction in _DIRECTIONS], 0.0, 0.4)
    best = fly([replace(best, ends=sides) for sides in itertools.product((0, 1), repeat=len(hunted.ends))], 0.4, 0.5)
    best = fly(_around(best, float(ends[1] - ends[0]), float(ends[-1])), 0.5, 1.0)
    robot = int(np.argmax(errors[aims.index(best)]))
    name, worst = reference.robots[robot], float(errors[aims.index(best), robot])
    margin = None if cert is None else float(cert.margin)
    left = None if margin is None else int(np.count_nonzero(np.max(errors, axis=1) >= margin))
    at = {} if best.ends is None else {what: ("least", "most")[end] for what, end in zip(hunted.ends, best.ends, strict=True)}
    told = mission.disturbance
    within = told is not None and wind <= told.wind
    claims = cert.claims if cert is not None and within else ()
    bound = next((claim.bound for claim in claims if (claim.name, claim.robot) == ("tracking", name)), None)
    other = {what: size for what, size in hunted.sizes.items() if what != "wind"}
    linear = dict(zip(reference.robots, hunted.linear(), strict=True))
    return Hunt(wind, other, margin, linear, worst, name, best.time, at, len(aims), left, bound)


def _sizes(mission: Mission, wind: float) -> dict[str, float]:
    """Return how large each input is that is aimed."""
    told = mission.disturbance
    if told is None:
        return {"wind": wind}
    names = _ON_GROUND if _on_ground(mission) else _ON_BOARD
    return {"wind": wind, **{name: size for name in names if (size := float(getattr(told, name))) > 0.0}}


def _on_ground(mission: Mission) -> bool:
    """Return whether controllers have no estimator, as in the proof of one on the ground."""
    return mission.disturbance is not None and conditions_of(mission).noise is None


def require_wind(wind: float) -> None:
    """Reject a speed that nothing is hunted with.

    Args:
        wind: m/s.

    Raises:
        BadInput: It is no number, not above 0, or above `FASTEST`.
    """
    if not (is_number(wind) and 0.0 < wind <= FASTEST):
        raise BadInput(f"a hunt's wind is above 0 m/s and at most {FASTEST:g}, not {wind!r}.")


def response(airframe: Airframe, to: str = "wind", *, estimated: bool = True) -> Floats:
    """Return how a hovering vehicle moves that was blown at, or seen wrongly, by 1 for one control step, m.

    Args:
        airframe: With the controller that its profile names.
        to: What was 1: `wind` in m/s, `position` in m or `attitude` in rad as cameras see them, `gyroscope` in rad/s, `velocity` in m/s as it is given.
        estimated: Whether it flies on the estimator on board; else it is given what is true.

    Returns:
        At each control step after it began; by its axis, then by the motion's. Shape (steps, 3, 3).
    """
    start = np.zeros((4, 3))
    flat = np.zeros((5, 4, 3))
    autopilot = autopilot_of(airframe)
    linear = autopilot.changed(
        ekf=autopilot.ekf.changed(least_turn=0.0)
    )  # what a filter drops of small corrections is not linear
    airframe = airframe.changed(vehicle=airframe.vehicle.changed(autopilot=linear))
    delay = np.full(3, CAMERAS.delay) if estimated else None
    fleet = Fleet(kinds_of((airframe,), 3), CONTROLLERS.find(PROFILES), start, Differences(delay))
    settled, count = round(1.0 / CONTROL_STEP), round(_REMEMBERED / CONTROL_STEP)
    moved, at_rest, pulse = np.empty((count, 3, 3)), np.zeros((3, 3)), _PULSES[to] * np.eye(3)
    for tick in range(settled + count):
        if tick == settled:
            at_rest = fleet.state[:3].copy()
        given = {to: pulse} if tick == settled else {}
        for half in range(2):
            fleet.look(_sight(given, 3))
            fleet.fly(flat, half, given.get("wind", np.zeros((3, 3))))
        if tick >= settled:
            moved[tick - settled] = (fleet.state[:3] - at_rest).T
    return moved / _PULSES[to]


def _sight(errors: Mapping[str, Floats], n: int) -> Sight:
    """Return what is seen with errors of cameras and gyroscopes, 0 where there are none."""
    position, attitude, gyro, velocity = (
        errors.get(name, np.zeros((3, n))) for name in ("position", "attitude", "gyroscope", "velocity")
    )
    return Sight(position, attitude, np.ones(n, dtype=np.bool_), gyro, velocity)


def gain_of(kernel: Floats) -> float:
    """Return the largest distance along an axis that an input of 1, such as a wind of 1 m/s, can make of a linear loop, m.

    Args:
        kernel: As from `response`.
    """
    return float(np.max(np.sum(np.linalg.norm(kernel, axis=1), axis=0)))


def input_towards(kernel: Floats, direction: Floats, ticks: int, until: float) -> Floats:
    """Return the input of length 1 that brings a linear loop farthest along a direction at an instant. Shape (ticks, 3).

    Args:
        kernel: As from `response`.
        direction: Of length 1. Shape (3,).
        ticks: Of the flight.
        until: That instant, s.
    """
    push = kernel @ direction  # (steps, the input's axis)
    last, found = round(until / CONTROL_STEP), np.zeros((ticks, 3))
    for tick in range(min(last, ticks)):
        found[tick] = push[min(last - 1 - tick, len(push) - 1)]
    length = np.linalg.norm(found, axis=1, keepdims=True)
    return np.where(length > 0.0, found / np.maximum(length, 1e-300), direction)


def _around(aim: _Aim, near: float, end: float) -> list[_Aim]:
    """Return aims around the worst, at instants and along directions beside its own."""
    turns = [np.roll(np.eye(3)[0], k) for k in range(3)]
    leaning = [aim.direction, *(aim.direction + sign * 0.6 * turn for turn in turns for sign in (1.0, -1.0))]
    times = [min(max(aim.time + share * near, 0.2), end) for share in (-0.5, -0.25, 0.0, 0.25, 0.5)]
    ways = [way / np.linalg.norm(way) for way in leaning if np.linalg.norm(way) > 0.1]
    return [replace(aim, time=at, direction=way) for at in times for way in ways]


class _View:
    """Air and view of all flights that are aimed: inputs of every vehicle at each control step, in place of chance or beside it."""

    def __init__(self, inputs: Mapping[str, Floats], chance: Chance, *, told: bool) -> None:
        self._inputs, self._chance, self._told, self._tick = inputs, chance, told, -1
        self.draws, self.cells, self.air = chance.draws, chance.cells, self

    def after(self, _: Floats) -> Floats:
        """Return the air's velocity at every vehicle in the next control step, m/s. Shape (3, n)."""
        self._tick += 1
        return self._inputs["wind"][self._tick]

    def sight(self, half: int) -> Sight:
        """Return what is seen in one frame."""
        given = {name: values[self._tick] for name, values in self._inputs.items()}
        return _sight(given, given["wind"].shape[1]) if self._told else self._chance.sight(half)


class _Hunted:
    """A team in winds and errors that are aimed.

    Attributes:
        sizes: Of what is aimed.
        ends: What has two ends.
    """

    def __init__(
        self, reference: Reference, airframes: Sequence[Airframe], sizes: Mapping[str, float], mission: Mission, seed: int
    ) -> None:
        self._reference, self._airframes, self.sizes = reference, tuple(airframes), sizes
        self._told, self._seed = mission.disturbance, seed
        self._truth = _on_ground(mission)
        self._controller = conditions_of(mission).controller if self._truth else CONTROLLERS.find(PROFILES)
        self.ends = _ENDS
        kinds = dict.fromkeys(airframes)
        found = {(kind, name): response(kind, name, estimated=not self._truth) for kind in kinds for name in sizes}
        self._kernels = {name: [found[airframe, name] for airframe in airframes] for name in sizes}

    def linear(self) -> list[float]:
        """Return how far all that is aimed would bring each robot, were its loop linear, m."""
        return [
            sum(size * gain_of(self._kernels[name][k]) for name, size in self.sizes.items())
            for k in range(len(self._airframes))
        ]

    def _ends(self, name: str, aims: Sequence[_Aim]) -> Floats:
        """Return mass, thrust or latency of every vehicle. Shape (n,)."""
        usual = CAMERAS.delay if name == "latency" else 1.0
        if self._told is None:
            ends = [intervals_of(airframe)[name] for airframe in self._airframes]
        else:
            share = 0.0 if name == "latency" else float(getattr(self._told, name))
            ends = [self._told.latency if name == "latency" else (1.0 - share, 1.0 + share)] * len(self._airframes)
            usual = sum(self._told.latency) / 2.0 if name == "latency" else 1.0
        at = self.ends.index(name)
        return np.array([usual if aim.ends is None else end[aim.ends[at]] for aim in aims for end in ends])

    def flown(self, aims: Sequence[_Aim], report: Progress) -> Floats:
        """Return each robot's largest distance from its plan in each flight, m. Shape (flights, robots).

        Args:
            aims: Of each flight.
            report: Told how far it is.
        """
        reference, robots, ticks = self._reference, len(self._reference.robots), self._reference.ticks
        inputs = {
            name: size
            * np.stack(
                [input_towards(own, aim.direction, ticks, aim.time) for aim in aims for own in self._kernels[name]], axis=-1
            )
            for name, size in self.sizes.items()
        }
        late = self._ends("latency", aims)
        delay, age = (None, late) if self._truth else (late, None)
        differences = Differences(delay, self._ends("mass", aims), self._ends("thrust", aims), age=age)
        start = np.tile(reference.start, (1, len(aims)))
        if self._told is not None:  # they begin off the plan, along what is aimed
            start[:3] += self._told.start * np.repeat(np.stack([aim.direction for aim in aims], axis=1), robots, axis=1)
        fleet = Fleet(kinds_of(self._airframes, len(aims)), self._controller, start, differences)
        draws = Draws(Conditions(LABORATORY, CAMERAS), (self._seed,), robots)
        chance = Chance(draws, CAMERAS, Air((LABORATORY,), draws, [0] * len(aims)), len(aims))
        view = _View(inputs, chance, told=self._told is not None)
        return peaks(reference, fleet, view, report)[:, 0]
