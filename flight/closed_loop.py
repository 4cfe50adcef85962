"""The closed loop: guidance, sensors, controller at 50 Hz, autopilot and dynamics at 500 Hz, for many runs at once.

`flight.fly` simulates one run and returns its log; campaigns use `steps` with many seeds. A run's random numbers come from its own
seed alone and all arithmetic is element-wise, so run 17 of a campaign is, bit for bit, the flight with that seed.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from flight.mixed_fleet import begin, kinds_of
from flight.model.attitude import Floats, quaternion_rate, unit
from flight.model.plant import Motion, Plant
from flight.model.sensing import Kalman, MotionCapture
from flight.model.timing import CONTROL_STEP, FRAME_STEPS, STEP, SUBSTEPS
from flight.onboard_simulation.steps import steps_on_board
from flight.random_streams import Draws
from flight.simulation_setup import Setup, Snapshot, farthest


def steps(setup: Setup, seeds: Sequence[int]) -> Iterator[Snapshot]:
    """Simulate all runs side by side and yield a snapshot every 10 ms, the first at time 0.

    Args:
        setup: The simulation.
        seeds: One seed a run.
    """
    if setup.conditions.on_board:
        yield from steps_on_board(setup, seeds)
        return
    guidance, robots = setup.guidance, len(setup.guidance.robots)
    wind, sensor, model = setup.conditions.wind, setup.conditions.noise, setup.conditions.model
    runs = len(seeds)
    start = np.tile(guidance.start, (1, runs))
    n = robots * runs
    airframes = setup.airframes if len(setup.airframes) == robots else setup.airframes * robots
    plant, controller = begin(kinds_of(airframes, runs), model, setup.conditions.controller, start)
    draws = Draws(setup.conditions, seeds, robots)
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
            peak = np.maximum(peak, farthest(guidance, step, flown))
    if senses is not None:
        senses.frame()
    yield _snapshot(plant, ticks * SUBSTEPS, None if senses is None else senses.measured, estimated, np.sqrt(peak))


def _snapshot(plant: Plant, step: int, measured: Floats | None, estimated: Floats, peak: Floats) -> Snapshot:
    now = plant.motion()
    return Snapshot(
        step, now.position, now.velocity, now.attitude, now.rates, plant.thrust, plant.rotors, measured, estimated, plant.charge,
        peak,
    )  # fmt: skip


class _Senses:
    """Motion capture, its filter, and the sensors on board."""

    def __init__(self, sensor: MotionCapture, draws: Draws, plant: Plant) -> None:
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
