"""The closed loop: guidance, sensors, controller at 50 Hz, autopilot and dynamics at 500 Hz, for many runs at once.

`flight.fly` simulates one run and returns its log; campaigns use `steps` with many seeds. A run's random numbers come from its own
seed alone and all arithmetic is element-wise, so run 17 of a campaign is, bit for bit, the flight with that seed.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from flight.conditions import CALM, Conditions
from flight.model.airframe import Airframe
from flight.model.attitude import Floats, quaternion_rate, unit
from flight.model.plant import Motion, Plant
from flight.model.sensing import CLIP, Kalman, MotionCapture
from flight.model.timing import CONTROL_STEP, FRAME_STEPS, STEP, SUBSTEPS
from flight.side_by_side import begin, kinds_of

_BLOCK = 50
"""Control instants whose random numbers are drawn together."""


class Guidance(Protocol):
    """Where the robots should be: a plan that was sampled (`Reference`), or one that is made while they fly."""

    @property
    def robots(self) -> tuple[str, ...]:
        """Names."""
        ...

    @property
    def start(self) -> Floats:
        """Where they hover at first: x, y, z in m and heading in rad. Shape (4, robots)."""
        ...

    @property
    def ticks(self) -> int:
        """Control instants that are flown at most."""
        ...

    def wanted(self, tick: int) -> Floats:
        """Return what they should do from a control instant on, asked once for each in order.

        Args:
            tick: Its index.

        Returns:
            x, y, z, heading and four derivatives, in m, rad and s. Shape (5, 4, robots).
        """
        ...

    def planned(self, step: int) -> Floats | None:
        """Return where they should be at a step of the dynamics, m; None where nobody planned that. Shape (3, robots)."""
        ...


@dataclass(frozen=True, slots=True)
class Setup:
    """Everything about a simulation but its seeds.

    Attributes:
        airframes: What flies, of each robot of the guidance; one for all where they are alike.
        guidance: What they should fly.
        conditions: Wind, sensors, model and controller; of their airframe those above were made.
    """

    airframes: tuple[Airframe, ...]
    guidance: Guidance
    conditions: Conditions = CALM


@dataclass(frozen=True, slots=True)
class Snapshot:
    """The state of all vehicles at one entry of the log. Vehicles along the last axis: run by run, robot by robot.

    Attributes:
        step: Index of the dynamics' step.
        position: m. Shape (3, n).
        velocity: m/s. Shape (3, n).
        attitude: Quaternion w x y z. Shape (4, n).
        rates: Body rates, rad/s. Shape (3, n).
        thrust: Collective, N. Shape (n,).
        rotors: N, or None where the model has none. Shape (4, n).
        measured: m, what motion capture saw; NaN where it lost the robot; None without one. Shape (3, n).
        estimated: m, what the controller took for the position at the last command. Shape (3, n).
        charge: Battery voltage over its voltage in hover at full charge. Shape (n,).
        peak: Largest distance from what was planned at any step so far, m. Shape (n,).
    """

    step: int
    position: Floats
    velocity: Floats
    attitude: Floats
    rates: Floats
    thrust: Floats
    rotors: Floats | None
    measured: Floats | None
    estimated: Floats
    charge: Floats
    peak: Floats


def steps(setup: Setup, seeds: Sequence[int]) -> Iterator[Snapshot]:
    """Simulate all runs side by side and yield a snapshot every 10 ms, the first at time 0.

    Args:
        setup: The simulation.
        seeds: One seed a run.
    """
    guidance, robots = setup.guidance, len(setup.guidance.robots)
    wind, sensor, model = setup.conditions.wind, setup.conditions.noise, setup.conditions.model
    runs = len(seeds)
    start = np.tile(guidance.start, (1, runs))
    n = robots * runs
    airframes = setup.airframes if len(setup.airframes) == robots else setup.airframes * robots
    plant, controller = begin(kinds_of(airframes, runs), model, setup.conditions.controller, start)
    draws = _Draws(setup.conditions, seeds, robots)
    gusts = wind.at_first(draws.first()) if wind is not None else np.zeros((3, n))
    air: Floats | float = 0.0
    senses = None if sensor is None else _Senses(sensor, draws, plant)
    peak = np.zeros(n)  # squared
    frames = None if sensor is None else round(1.0 / (sensor.rate * STEP))
    stops = [sub for sub in range(SUBSTEPS + 1) if not sub % FRAME_STEPS or (frames is not None and not sub % frames)]
    ticks = guidance.ticks
    estimated = plant.position
    for tick in range(ticks):
        draws.tick(tick)
        if wind is not None:
            gusts = wind.after(gusts, draws.gust(), CONTROL_STEP)
            air = np.array(wind.mean)[:, None] + gusts
        for sub, end in itertools.pairwise(stops):
            step = tick * SUBSTEPS + sub
            if senses is not None and frames is not None and sub % frames == 0:
                senses.frame()
            if sub == 0:
                now = plant.motion() if senses is None else senses.estimate()
                estimated = now.position
                plant.follow(controller.command(np.tile(guidance.wanted(tick), (1, 1, runs)), now))
            if step % FRAME_STEPS == 0:
                yield _snapshot(plant, step, None if senses is None else senses.measured, estimated, np.sqrt(peak))
            if senses is not None and frames is not None and sub % frames == 0:
                senses.advance()
            flown = plant.fly(air, end - sub)
            planned = [guidance.planned(step + k) for k in range(1, end - sub + 1)]
            known = [k for k, place in enumerate(planned) if place is not None]
            if known:
                at = np.array([planned[k] for k in known])
                away = (flown[known].reshape(-1, 3, runs, robots) - at[:, :, None]).reshape(-1, 3, n)
                away *= away
                peak = np.maximum(peak, np.max(away[:, 0] + away[:, 1] + away[:, 2], axis=0))
    if senses is not None:
        senses.frame()
    yield _snapshot(plant, ticks * SUBSTEPS, None if senses is None else senses.measured, estimated, np.sqrt(peak))


def _snapshot(plant: Plant, step: int, measured: Floats | None, estimated: Floats, peak: Floats) -> Snapshot:
    now = plant.motion()
    return Snapshot(
        step, now.position, now.velocity, now.attitude, now.rates, plant.thrust, plant.rotors, measured, estimated, plant.charge,
        peak,
    )  # fmt: skip


class _Draws:
    """Random numbers of all runs, each run's from its own seed, a second of flight at a time."""

    def __init__(self, conditions: Conditions, seeds: Sequence[int], robots: int) -> None:
        self._windy, self._sensor, self._robots = conditions.wind is not None, conditions.noise, robots
        self._gusts = [np.random.default_rng([seed, 1]) for seed in seeds]
        self._sights = [np.random.default_rng([seed, 2]) for seed in seeds]
        self._lost = np.zeros(robots * len(seeds), dtype=np.bool_)
        self._frame, self._seen_at_all = 0, False

    def first(self) -> Floats:
        return self._normal(self._gusts, 1)[0]

    def tick(self, tick: int) -> None:
        if tick % _BLOCK:
            return
        self._start, self._frame = tick, 0
        if self._windy:
            self._wind_draws = self._normal(self._gusts, _BLOCK)
        if self._sensor is not None:
            count = _BLOCK * self._sensor.rate // 50 + 1
            self._position_draws = np.clip(self._normal(self._sights, count), -CLIP, CLIP)
            self._loss_draws = np.concatenate([rng.random((count, self._robots)) for rng in self._sights], axis=-1)
            self._board_draws = np.concatenate(
                [rng.standard_normal((_BLOCK, 6, self._robots)) for rng in self._sights], axis=-1
            )
        self._index = -1

    def gust(self) -> Floats:
        self._index += 1
        return self._wind_draws[self._index]

    def sight(self) -> tuple[Floats, NDArray[np.bool_]]:
        """Return noise of one frame in standard deviations, and which vehicles were seen."""
        assert self._sensor is not None
        sensor, uniform = self._sensor, self._loss_draws[self._frame]
        into = sensor.dropout / (sensor.burst * (1.0 - sensor.dropout))
        if self._seen_at_all:
            self._lost = np.where(self._lost, uniform < 1.0 - 1.0 / sensor.burst, uniform < into)
        self._seen_at_all = True  # nobody starts before all robots are seen
        noise = self._position_draws[self._frame]
        self._frame += 1
        return noise, ~self._lost

    def board(self) -> tuple[Floats, Floats]:
        """Return standard normal draws for attitude and rates at one command. Shapes (3, n)."""
        assert self._sensor is not None
        row = self._board_draws[min(self._frame * 50 // self._sensor.rate, _BLOCK - 1)]
        return row[:3], row[3:]

    def _normal(self, generators: list[np.random.Generator], count: int) -> Floats:
        return np.concatenate([rng.standard_normal((count, 3, self._robots)) for rng in generators], axis=-1)


class _Senses:
    """Motion capture, its filter, and the sensors on board."""

    def __init__(self, sensor: MotionCapture, draws: _Draws, plant: Plant) -> None:
        self._sensor, self._draws, self._plant = sensor, draws, plant
        self._filter = Kalman(sensor, plant.position)
        self.measured = plant.position

    def frame(self) -> None:
        noise, seen = self._draws.sight()
        seen_at = self._plant.position + self._sensor.noise * noise
        self._filter.frame(seen_at, seen, self._plant.felt())
        self.measured = np.where(seen, seen_at, np.nan)

    def advance(self) -> None:
        """Leave a frame behind; until the next one nothing is measured."""
        self._filter.advance()
        self.measured = np.full_like(self.measured, np.nan)

    def estimate(self) -> Motion:
        attitude_draw, rate_draw = self._draws.board()
        position, velocity = self._filter.estimate()
        truth = self._plant.motion()
        attitude = truth.attitude + quaternion_rate(truth.attitude, self._sensor.attitude_noise * attitude_draw)
        attitude = unit(attitude)
        rates = truth.rates + self._sensor.rate_noise * rate_draw
        return Motion(position, velocity, attitude, rates)
