"""Random numbers of many runs, each run's from its own seed alone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flight.conditions import Conditions
from flight.model.attitude import Floats
from flight.model.sensing import CLIP

_BLOCK = 50
"""Control instants whose random numbers are drawn together."""


class Draws:
    """Random numbers of all runs, each run's from its own seed, a second of flight at a time."""

    def __init__(self, conditions: Conditions, seeds: Sequence[int], robots: int) -> None:
        """Begin to draw.

        Args:
            conditions: Say what chance has a part in.
            seeds: One a run.
            robots: Of each run.
        """
        self._windy, self._sensor, self._robots = conditions.wind is not None, conditions.noise, robots
        self._gusts = [np.random.default_rng([seed, 1]) for seed in seeds]
        self._sights = [np.random.default_rng([seed, 2]) for seed in seeds]
        self._lost = np.zeros(robots * len(seeds), dtype=np.bool_)
        self._frame, self._seen_at_all = 0, False

    def first(self) -> Floats:
        """Return standard normal draws for the gusts at time 0. Shape (3, n)."""
        return self._normal(self._gusts, 1)[0]

    def tick(self, tick: int) -> None:
        """Come to a control instant; asked for each in order.

        Args:
            tick: Its index.
        """
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
        """Return standard normal draws for the gusts of a control instant. Shape (3, n)."""
        self._index += 1
        return self._wind_draws[self._index]

    @property
    def frames_left(self) -> int:
        """Frames of motion capture that `sight` can still tell of before the next draws."""
        return len(self._position_draws) - self._frame

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
