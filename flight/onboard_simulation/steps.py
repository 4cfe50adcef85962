"""The loop on board: set-points and estimator at 100 Hz, laws and dynamics at 500 Hz, for many runs at once.

As in `closed_loop`, whose place it takes for controllers that run on board, a run's random numbers come from its own seed alone and
all arithmetic is element by element.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from flight.mixed_fleet import kinds_of
from flight.model.attitude import Floats
from flight.model.sensing import MotionCapture
from flight.model.timing import CONTROL_STEP, FRAME_STEPS, SUBSTEPS
from flight.onboard_simulation.fleet import Differences, Fleet, Sight
from flight.random_streams import Draws
from flight.simulation_setup import Setup, Snapshot, farthest

_HALVES = SUBSTEPS // FRAME_STEPS
"""Frames between two control instants."""


def steps_on_board(setup: Setup, seeds: Sequence[int]) -> Iterator[Snapshot]:
    """Simulate all runs side by side and yield a snapshot every 10 ms, the first at time 0.

    Args:
        setup: The simulation.
        seeds: One seed a run.
    """
    guidance, conditions, runs = setup.guidance, setup.conditions, len(seeds)
    robots = len(guidance.robots)
    n = robots * runs
    wind, sensor = conditions.wind, conditions.noise
    airframes = setup.airframes if len(setup.airframes) == robots else setup.airframes * robots
    delay = None if sensor is None else np.full(n, sensor.delay)
    fleet = Fleet(kinds_of(airframes, runs), conditions.controller, np.tile(guidance.start, (1, runs)), Differences(delay))
    draws = Draws(conditions, seeds, robots)
    gusts = wind.at_first(draws.first()) if wind is not None else np.zeros((3, n))
    air: Floats | float = 0.0
    peak = np.zeros(n)  # squared
    measured: Floats | None = None
    for tick in range(guidance.ticks):
        draws.tick(tick)
        if wind is not None:
            gusts = wind.after(gusts, draws.gust(), CONTROL_STEP)
            air = np.array(wind.mean)[:, None] + gusts
        fleet.drain(CONTROL_STEP)
        flat = np.tile(guidance.wanted(tick), (1, 1, runs))
        for half in range(_HALVES):
            step = tick * SUBSTEPS + half * FRAME_STEPS
            if sensor is not None:
                measured = _look(fleet, seen(draws, sensor, half))
            yield _snapshot(fleet, step, measured, peak)
            flown = fleet.fly(flat, half, air)
            peak = np.maximum(peak, farthest(guidance, step, flown))
    if sensor is not None:
        measured = _look(fleet, seen(draws, sensor, 0))
    yield _snapshot(fleet, guidance.ticks * SUBSTEPS, measured, peak)


def seen(draws: Draws, sensor: MotionCapture, half: int) -> Sight:
    """Return what chance does in one frame: of faster cameras the last of its pictures is sent, of slower ones each is used once.

    Args:
        draws: Where chance comes from.
        sensor: Motion capture.
        half: 0 in the frame after a control instant, 1 in the next one.
    """
    attitude, gyro = draws.board()
    pictures = sensor.rate * FRAME_STEPS // 500 if sensor.rate >= 100 else 1 - half
    noise, found = np.zeros_like(gyro), np.zeros(gyro.shape[1], dtype=np.bool_)
    for _ in range(min(pictures, draws.frames_left)):  # behind the last control instant there is one
        noise, found = draws.sight()
    return Sight(sensor.noise * noise, sensor.attitude_noise * attitude, found, sensor.rate_noise * gyro)


def _look(fleet: Fleet, sight: Sight) -> Floats:
    """Tell a fleet what the cameras see, and return where they see it; NaN where they see nothing. Shape (3, n)."""
    fleet.look(sight)
    return np.where(sight.seen, fleet.state[:3] + sight.position, np.nan)


def _snapshot(fleet: Fleet, step: int, measured: Floats | None, peak: Floats) -> Snapshot:
    state, rotors = fleet.state, fleet.rotors
    thrust = rotors[0] + rotors[1] + rotors[2] + rotors[3]
    return Snapshot(
        step, state[:3], state[3:6], state[6:10], state[10:13], thrust, rotors, measured, fleet.known[:3], fleet.charge,
        np.sqrt(peak),
    )  # fmt: skip
