"""Disturbances from outside and inside: wind with gusts, and a battery that sags."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flight.model.airframe import Airframe
from flight.model.attitude import Floats
from flight.model.numbers import is_number
from verify.data import BadInput


@dataclass(frozen=True, slots=True)
class Wind:
    """A steady wind and gusts around it, each robot in gusts of its own.

    A gust is a first-order Gauss-Markov process on each axis (the longitudinal form of Dryden's model), with half the
    strength in z.

    Attributes:
        mean: m/s, world frame, where the air goes to.
        gust: Standard deviation of the horizontal gusts, m/s.
        scale: Length over which gusts change, m; with the wind's speed (at least 1 m/s) it gives their time.
    """

    mean: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gust: float = 0.0
    scale: float = 2.0

    def __post_init__(self) -> None:
        if len(self.mean) != 3 or not all(map(is_number, self.mean)):
            raise BadInput(f"a wind's mean is three finite numbers in m/s, not {self.mean}.")
        if not (is_number(self.gust) and self.gust >= 0 and is_number(self.scale) and self.scale > 0):
            raise BadInput(
                f"a wind's gust must be 0 m/s or more and its scale above 0 m, not {self.gust!r} and {self.scale!r}."
            )
        if max(self.speed, self.gust) > 50.0:
            raise BadInput(f"a wind of {max(self.speed, self.gust):g} m/s is a storm; speeds are in m/s, at most 50.")

    @classmethod
    def parse(cls, text: str | float) -> Wind:
        """Read `1.5` (m/s along x), `1,0.5,0` (a vector), each with `+0.4` behind it for gusts.

        Raises:
            BadInput: The text is none of these.
        """
        steady, plus, gusts = str(text).strip().partition("+")
        try:
            numbers = [float(part) for part in steady.split(",")]
            gust = float(gusts) if plus else 0.0
        except ValueError:
            numbers, gust = [], 0.0
        if len(numbers) == 1:
            numbers += [0.0, 0.0]
        if len(numbers) != 3:
            raise BadInput(f"'{text}' is no wind: write 1.5, 1,0.5,0 or either with gusts as in 1.5+0.4, all in m/s.")
        return cls(mean=(numbers[0], numbers[1], numbers[2]), gust=gust)

    @property
    def speed(self) -> float:
        """Speed of the steady wind, m/s."""
        return math.hypot(*self.mean)

    @property
    def still(self) -> bool:
        """True if there is no wind at all."""
        return self.speed == 0.0 and self.gust == 0.0

    def after(self, gusts: Floats, draws: Floats, dt: float) -> Floats:
        """Return the gusts `dt` seconds later, from as many standard normal draws. Shape (3, n).

        Args:
            gusts: m/s, now. Shape (3, n).
            draws: Standard normal numbers. Shape (3, n).
            dt: s.
        """
        keep = np.exp(-dt * max(self.speed, 1.0) / self.scale)
        strength = np.array([self.gust, self.gust, 0.5 * self.gust])[:, None]
        return keep * gusts + np.sqrt(1.0 - keep * keep) * strength * draws

    def at_first(self, draws: Floats) -> Floats:
        """Return gusts as they are at any time, from as many standard normal draws. Shape (3, n)."""
        return np.array([self.gust, self.gust, 0.5 * self.gust])[:, None] * draws


class BatteryState:
    """The cells of many vehicles while they fly.

    Attributes:
        drained: Charge taken so far, C. Shape (n,).
        share: Voltage over the voltage in hover with a full cell. Shape (n,).
    """

    def __init__(self, airframe: Airframe, vehicles: int) -> None:
        self._cell, self._hover = airframe.battery, airframe.vehicle.weight / 4.0
        self._reference = self._cell.full - self._cell.resistance * self._cell.hover_current
        self.drained = np.zeros(vehicles)
        self.share = np.ones(vehicles)

    def draw(self, thrusts: Floats, dt: float) -> None:
        """Drain the cells for `dt` seconds at these rotor thrusts in N. Shape (4, n)."""
        cell, relative = self._cell, thrusts / self._hover
        power = relative * np.sqrt(relative)
        current = (cell.hover_current / 4.0) * (power[0] + power[1] + power[2] + power[3])
        self.drained = self.drained + current * dt
        level = np.maximum(1.0 - self.drained / cell.charge, 0.0)
        voltage = cell.empty + (cell.full - cell.empty) * level - cell.resistance * current
        self.share = voltage / self._reference

    @property
    def strength(self) -> Floats:
        """Share of a commanded rotor speed that is reached, after the firmware's compensation. Shape (n,)."""
        return 1.0 - (1.0 - self._cell.compensation) * (1.0 - self.share)

    @property
    def ceiling(self) -> Floats:
        """Greatest rotor speed over the greatest at full charge, at most 1. Shape (n,)."""
        return np.minimum(self.share, 1.0)
