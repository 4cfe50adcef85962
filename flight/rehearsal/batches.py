"""Flights of a rehearsal, all combinations of one controller side by side."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from flight.conditions import Conditions
from flight.control.controller import CONTROLLERS
from flight.mixed_fleet import kinds_of
from flight.model.airframe import Airframe, Drag
from flight.model.attitude import Floats
from flight.model.disturbances import Wind
from flight.model.reference import Reference
from flight.model.sensing import MotionCapture
from flight.model.timing import CONTROL_STEP, FRAME_STEPS, SUBSTEPS
from flight.onboard_simulation.fleet import Differences, Fleet, Sight
from flight.onboard_simulation.steps import seen
from flight.random_streams import Draws
from verify.data.progress import Progress


@dataclass(frozen=True, slots=True)
class Job:
    """Settings that all flights of a rehearsal have in common.

    Attributes:
        reference: The plan, sampled.
        airframes: Of each robot, as the profile says.
        sensor: Motion capture, but for its latency.
        masses: Shares of the profile's mass that are flown.
        latencies: s.
        winds: Those flown in.
    """

    reference: Reference
    airframes: tuple[Airframe, ...]
    sensor: MotionCapture
    masses: tuple[float, ...]
    latencies: tuple[float, ...]
    winds: tuple[Wind, ...]

    @property
    def combinations(self) -> list[tuple[float, float, int]]:
        """Mass, latency and index of the wind of each cell, in order."""
        return list(itertools.product(self.masses, self.latencies, range(len(self.winds))))


def worst_errors(job: Job, part: tuple[str, Drag, range], report: Progress) -> Floats:
    """Fly every combination with some seeds, and return each robot's largest distance from its plan at any step.

    Args:
        job: What all have in common.
        part: Name of the controller, drag, and seeds.
        report: Told how far it is.

    Returns:
        m; infinite where a robot was lost. Shape (cells, seeds, robots).
    """
    controller, drag, seeds = part
    reference, cells = job.reference, job.combinations
    robots, runs = len(reference.robots), len(seeds)
    beside = runs * robots  # vehicles of one cell
    mass = None if job.masses == (1.0,) else np.repeat([mass for mass, _, _ in cells], beside)
    delay = np.repeat([latency for _, latency, _ in cells], beside)
    flights = len(cells) * runs
    fleet = Fleet(
        kinds_of(job.airframes, flights), CONTROLLERS.find(controller), np.tile(reference.start, (1, flights)),
        Differences(delay, mass, drag=drag),
    )  # fmt: skip
    draws = Draws(Conditions(Wind((1.0, 0.0, 0.0), 1.0), job.sensor), seeds, robots)
    air = Air(job.winds, draws, [wind for _, _, wind in cells])
    return peaks(reference, fleet, Chance(draws, job.sensor, air, len(cells)), report)


class Blowing(Protocol):
    """Air at every vehicle, one control step after the other."""

    def after(self, draw: Floats, /) -> Floats:
        """Return the air's velocity in the next control step, m/s, from standard normal draws. Shape (3, n)."""
        ...


class View(Protocol):
    """Air and view of many flights."""

    @property
    def draws(self) -> Draws:
        """Source of chance, for one cell."""
        ...

    @property
    def air(self) -> Blowing:
        """Air of all cells."""
        ...

    @property
    def cells(self) -> int:
        """Number of cells."""
        ...

    def sight(self, half: int, /) -> Sight:
        """Return what is seen in one frame, 0 for the one after a control instant and 1 for the next."""
        ...


@dataclass(frozen=True, eq=False, slots=True)
class Chance:
    """Air and view of many flights, each cell's the same.

    Attributes:
        draws: Where chance comes from, for one cell.
        sensor: Motion capture.
        air: Of all cells.
        cells: How many.
        noise: Each vehicle's noise over the sensor's; None for 1. Shape (n,).
    """

    draws: Draws
    sensor: MotionCapture
    air: Blowing
    cells: int
    noise: Floats | None = None

    def sight(self, half: int) -> Sight:
        """Return what is seen in one frame.

        Args:
            half: As for `seen`.
        """
        sight = _in_every_cell(seen(self.draws, self.sensor, half), self.cells)
        return sight if self.noise is None else replace(sight, position=sight.position * self.noise)


def peaks(reference: Reference, fleet: Fleet, chance: View, report: Progress) -> Floats:
    """Fly all to the end, and return each robot's largest distance from its plan at any step.

    Args:
        reference: The plan, sampled.
        fleet: Cell by cell, run by run, robot by robot.
        chance: Air and view.
        report: Told how far it is.

    Returns:
        m; infinite where a robot was lost. Shape (cells, runs, robots).
    """
    vehicles, robots = fleet.state.shape[1], len(reference.robots)
    flights, peak = vehicles // robots, np.zeros(vehicles)
    with np.errstate(all="ignore"):  # a robot that is lost may be anywhere
        for tick in range(reference.ticks):
            chance.draws.tick(tick)
            wind = chance.air.after(chance.draws.gust())
            fleet.drain(CONTROL_STEP)
            flat = np.tile(reference.wanted(tick), (1, 1, flights))
            for half in range(SUBSTEPS // FRAME_STEPS):
                fleet.look(chance.sight(half))
                flown = fleet.fly(flat, half, wind)
                first = tick * SUBSTEPS + half * FRAME_STEPS + 1
                planned = reference.fine[first : first + FRAME_STEPS]
                away = flown.reshape(FRAME_STEPS, 3, flights, robots) - planned[:, :, None]
                away *= away
                far = np.max(away[:, 0] + away[:, 1] + away[:, 2], axis=0).reshape(-1)
                peak = np.maximum(peak, np.where(np.isnan(far), np.inf, far))
            if tick % 25 == 0:
                report("rehearsing", tick / reference.ticks)
    report("rehearsing", 1.0)
    return np.sqrt(peak).reshape(chance.cells, flights // chance.cells, robots)


def _in_every_cell(sight: Sight, cells: int) -> Sight:
    """Return the same chance for as many cells."""
    position, attitude, gyro = (np.tile(chance, cells) for chance in (sight.position, sight.attitude, sight.gyro))
    return Sight(position, attitude, np.tile(sight.seen, cells), gyro)


class Air:
    """Winds of all cells: each cell of one wind has the same gusts, seed by seed."""

    def __init__(self, winds: tuple[Wind, ...], draws: Draws, of_cells: list[int]) -> None:
        first = draws.first()
        self._winds, self._of_cells = winds, of_cells
        self._gusts = [wind.at_first(first) for wind in winds]

    def after(self, draw: Floats) -> Floats:
        """Return the air's velocity at every vehicle, m/s. Shape (3, n)."""
        pairs = zip(self._winds, self._gusts, strict=True)
        self._gusts = [wind.after(gust, draw, CONTROL_STEP) for wind, gust in pairs]
        blown = [np.array(wind.mean)[:, None] + gust for wind, gust in zip(self._winds, self._gusts, strict=True)]
        return np.concatenate([blown[wind] for wind in self._of_cells], axis=1)
