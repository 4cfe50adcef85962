"""The closed loop: reference, sensors, controller at 50 Hz, autopilot and dynamics at 500 Hz, for many runs at once.

`flight.fly` simulates one run and returns its log; campaigns use `steps` with many seeds. A run's random numbers come from its own
seed alone and all arithmetic is element-wise, so run 17 of a campaign is, bit for bit, the flight with that seed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from flight.control.controllers import (
    CONTROL_STEP,
    Autopilot,
    Command,
    ControllerName,
    Estimate,
    GeometricController,
    PaperController,
)
from flight.model.airframe import Airframe
from flight.model.attitude import Floats, error_vector, from_euler, matrix, quaternion_rate, to_world, unit
from flight.model.disturbances import BatteryState, Wind
from flight.model.dynamics import (
    ANGLES,
    ATTITUDE,
    PAPER_STATES,
    POSITION,
    RATES,
    VELOCITY,
    FullModel,
    hover_state,
    paper_step,
    rotor_thrusts,
)
from flight.model.reference import Reference
from flight.model.sensing import CLIP, Kalman, MotionCapture
from verify.data import GRAVITY, BadInput

ModelName = Literal["full", "paper"]

SUBSTEPS = 10
"""Steps of the dynamics between two commands: 500 Hz."""
STEP = CONTROL_STEP / SUBSTEPS
FRAME_STEPS = 5
"""Steps of the dynamics between two entries of the log: 100 Hz."""
_BLOCK = 50
"""Control instants whose random numbers are drawn together."""


@dataclass(frozen=True, slots=True)
class Setup:
    """Everything about a simulation but its seeds.

    Attributes:
        airframe: What flies.
        reference: What it should fly.
        wind: None for still air.
        sensor: None for perfect knowledge of position, velocity and attitude.
        model: `full`, or `paper` for eqs. (1) to (3).
        controller: `geometric`, or `paper`.
        override: Called with the index of the control instant before each command; may return another flat
            reference, shape (5, 4, robots), for what a team does when its monitor raises the alarm. For single runs.
    """

    airframe: Airframe
    reference: Reference
    wind: Wind | None = None
    sensor: MotionCapture | None = None
    model: ModelName = "full"
    controller: ControllerName = "geometric"
    override: Callable[[int], Floats | None] | None = None

    @property
    def varies(self) -> bool:
        """Whether seeds make a difference: still or steady air and perfect sensors leave nothing to chance."""
        return (self.wind is not None and self.wind.gust > 0.0) or (self.sensor is not None and self.sensor.varies)

    def __post_init__(self) -> None:
        if self.model not in ("full", "paper"):
            raise BadInput(f"model must be 'full' or 'paper', not {self.model!r}.")
        if self.controller not in ("geometric", "paper"):
            raise BadInput(f"controller must be 'geometric' or 'paper', not {self.controller!r}.")


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
        rotors: N, or None for the papers' model. Shape (4, n).
        measured: m, what motion capture saw; NaN where it lost the robot; None without one. Shape (3, n).
        estimated: m, what the controller took for the position at the last command. Shape (3, n).
        charge: Battery voltage over its voltage in hover at full charge. Shape (n,).
        peak: Largest distance from the reference at any step so far, m. Shape (n,).
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
    reference, robots = setup.reference, len(setup.reference.robots)
    runs = len(seeds)
    flat0 = np.tile(reference.flat[0], (1, 1, runs))
    plant = (_FullPlant if setup.model == "full" else _PaperPlant)(setup.airframe, flat0[0])
    n = robots * runs
    controller = (
        GeometricController(setup.airframe, n, compensate_drag=setup.model == "full")
        if setup.controller == "geometric"
        else PaperController(setup.airframe, n, flat0[0, :3])
    )
    draws = _Draws(setup, seeds, robots)
    gusts = setup.wind.at_first(draws.first()) if setup.wind is not None else np.zeros((3, n))
    senses = None if setup.sensor is None else _Senses(setup.sensor, draws, plant)
    peak = np.zeros(n)  # squared
    frames = None if setup.sensor is None else round(1.0 / (setup.sensor.rate * STEP))
    ticks = len(reference.times) - 1
    estimated = plant.position
    for tick in range(ticks):
        draws.tick(tick)
        if setup.wind is not None:
            gusts = setup.wind.after(gusts, draws.gust(), CONTROL_STEP)
            plant.wind = np.array(setup.wind.mean)[:, None] + gusts
        for sub in range(SUBSTEPS):
            step = tick * SUBSTEPS + sub
            if senses is not None and frames is not None and sub % frames == 0:
                senses.frame()
            if sub == 0:
                now = plant.truth() if senses is None else senses.estimate()
                estimated = now.position
                planned = np.tile(reference.flat[tick], (1, 1, runs))
                if setup.override is not None:
                    other = setup.override(tick)
                    planned = planned if other is None else other
                plant.follow(controller.command(planned, now))
            if step % FRAME_STEPS == 0:
                yield plant.snapshot(step, None if senses is None else senses.measured, estimated, np.sqrt(peak))
            if senses is not None and frames is not None and sub % frames == 0:
                senses.advance()
            plant.step()
            away = (plant.position.reshape(3, runs, robots) - reference.fine[step + 1][:, None]).reshape(3, n)
            away *= away
            peak = np.maximum(peak, away[0] + away[1] + away[2])
    if senses is not None:
        senses.frame()
    yield plant.snapshot(ticks * SUBSTEPS, None if senses is None else senses.measured, estimated, np.sqrt(peak))


class _Draws:
    """Random numbers of all runs, each run's from its own seed, a second of flight at a time."""

    def __init__(self, setup: Setup, seeds: Sequence[int], robots: int) -> None:
        self._windy, self._sensor, self._robots = setup.wind is not None, setup.sensor, robots
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

    def __init__(self, sensor: MotionCapture, draws: _Draws, plant: _Plant) -> None:
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

    def estimate(self) -> Estimate:
        attitude_draw, rate_draw = self._draws.board()
        position, velocity = self._filter.estimate()
        truth = self._plant.truth()
        attitude = truth.attitude + quaternion_rate(truth.attitude, self._sensor.attitude_noise * attitude_draw)
        attitude = unit(attitude)
        rates = truth.rates + self._sensor.rate_noise * rate_draw
        return Estimate(position, velocity, attitude, matrix(attitude), rates)


class _FullPlant:
    """The full model with its autopilot and batteries."""

    def __init__(self, airframe: Airframe, flat: Floats) -> None:
        n = flat.shape[-1]
        self._model = FullModel(airframe)
        self._state = hover_state(airframe, flat[:3], flat[3])
        self._autopilot = Autopilot(self._model, n)
        self._battery = BatteryState(airframe, n)
        self.wind: Floats | float = 0.0
        self._strength, self._ceiling = self._battery.strength, self._battery.ceiling

    @property
    def position(self) -> Floats:
        return self._state[POSITION]

    def truth(self) -> Estimate:
        state = self._state
        return Estimate(state[POSITION], state[VELOCITY], state[ATTITUDE], matrix(state[ATTITUDE]), state[RATES])

    def felt(self) -> Floats:
        """Return the acceleration that the autopilot's own model of the rotors gives, m/s^2."""
        turn = matrix(self._state[ATTITUDE])
        acceleration = turn[:, 2] * (self._autopilot.thrust / self._model.airframe.vehicle.mass)
        acceleration[2] -= GRAVITY
        return acceleration

    def follow(self, command: Command) -> None:
        self._battery.draw(rotor_thrusts(self._model.airframe, self._state), CONTROL_STEP)
        self._strength, self._ceiling = self._battery.strength, self._battery.ceiling
        self._autopilot.follow(command)

    def step(self) -> None:
        state = self._state
        asked = self._autopilot.rotor_commands(state[ATTITUDE], state[RATES], self._ceiling, STEP)
        self._state = self._model.step(state, asked * self._strength, self.wind, STEP)

    def snapshot(self, step: int, measured: Floats | None, estimated: Floats, peak: Floats) -> Snapshot:
        state, rotors = self._state, rotor_thrusts(self._model.airframe, self._state)
        return Snapshot(
            step, state[POSITION], state[VELOCITY], state[ATTITUDE], state[RATES], rotors[0] + rotors[1] + rotors[2] + rotors[3],
            rotors, measured, estimated, self._battery.share, peak,
        )  # fmt: skip


class _PaperPlant:
    """The papers' model: commanded thrust and body rates act at once. Wind and battery do not enter it."""

    def __init__(self, airframe: Airframe, flat: Floats) -> None:
        n = flat.shape[-1]
        self._airframe, self._mass = airframe, airframe.vehicle.mass
        self._state = np.zeros((PAPER_STATES, n))
        self._state[POSITION] = flat[:3]
        self._state[8] = flat[3]
        self._thrust, self._rates = np.full(n, airframe.vehicle.weight), np.zeros((3, n))
        self.wind: Floats | float = 0.0
        self._command: Command | None = None

    @property
    def position(self) -> Floats:
        return self._state[POSITION]

    def truth(self) -> Estimate:
        attitude = from_euler(self._state[ANGLES])
        return Estimate(self._state[POSITION], self._state[VELOCITY], attitude, matrix(attitude), self._rates)

    def felt(self) -> Floats:
        lift = np.stack([np.zeros_like(self._thrust), np.zeros_like(self._thrust), self._thrust / self._mass])
        acceleration = to_world(matrix(from_euler(self._state[ANGLES])), lift)
        acceleration[2] -= GRAVITY
        return acceleration

    def follow(self, command: Command) -> None:
        self._command, self._thrust, self._rates = command, command.thrust, command.rates
        self._attitude = command.attitude
        self._wanted_rates = command.rates

    def step(self) -> None:
        command = self._command
        assert command is not None, "follow() comes before step()"
        if self._attitude is not None:  # the autopilot's attitude loop, without inertia: rates follow at once
            off = error_vector(self._attitude, from_euler(self._state[ANGLES]))
            self._rates = self._wanted_rates - self._airframe.gains.angle * off
            self._attitude = unit(self._attitude + STEP * quaternion_rate(self._attitude, self._wanted_rates))
            self._wanted_rates = self._wanted_rates + STEP * command.rates_change
        self._state = paper_step(self._state, self._thrust, self._rates, self._mass, STEP)
        if self._attitude is not None:
            self._thrust = self._thrust + STEP * command.thrust_rate

    def snapshot(self, step: int, measured: Floats | None, estimated: Floats, peak: Floats) -> Snapshot:
        state = self._state
        full = np.ones(state.shape[1])
        return Snapshot(
            step, state[POSITION], state[VELOCITY], from_euler(state[ANGLES]), self._rates, self._thrust, None, measured,
            estimated, full, peak,
        )  # fmt: skip


_Plant = _FullPlant | _PaperPlant
