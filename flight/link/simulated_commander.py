"""The commander on board of simulated vehicles: it flies what was uploaded, brakes, lands and stops, as firmware does.

Vehicles wait on the ground, motors off. A flight begins at a common instant, ends in a hover, and goes on to the end whatever
happens to the link: that is what acts on board when the host is gone, and why a landing is uploaded before it is needed.
"""

from __future__ import annotations

import math

import numpy as np

from flight.model.attitude import Floats
from flight.monitoring.alarm_response import braking, smooth_step
from verify.data import Trajectory
from verify.data.trajectory import DEGREE

_MANY = 10_000_000
"""Control instants: more than anybody waits for."""
_FACTORS = np.array([[math.perm(power, order) for power in range(DEGREE + 1)] for order in range(5)], dtype=float)
_POWERS = np.array([[max(power - order, 0) for power in range(DEGREE + 1)] for order in range(5)])
"""What each power becomes in a derivative: a factor, and a lower power."""


class Commander:
    """One robot's commander.

    Attributes:
        spinning: Whether its motors turn.
        flying: The number of the flight that it is in; None where it hovers, lands or rests.
    """

    def __init__(self, place: Floats, brakes: float) -> None:
        """Begin on the ground.

        Args:
            place: x, y, z in m and heading in rad. Shape (4,).
            brakes: s that braking to a hover takes.
        """
        self._place, self._brakes = np.array(place, dtype=float), brakes
        self._stored: dict[int, Trajectory] = {}
        self._begin, self._length = 0.0, 0.0
        self._from, self._to = self._place, self._place
        self._brake: Floats | None = None
        self.spinning = False
        self.flying: int | None = None

    def store(self, number: int, path: Trajectory) -> None:
        """Take a flight.

        Args:
            number: From 0.
            path: Finite, as it is flown.
        """
        self._stored[number] = path

    def start(self, number: int, now: float) -> None:
        """Begin a stored flight at an instant, hovering where it begins until then; what is not stored is not flown."""
        if number in self._stored:
            self.flying = number
            self.spinning, self._begin, self._brake = True, now, None

    def hold(self, now: float) -> None:
        """Brake to a hover."""
        if not self.spinning or (self.flying is None and self._brake is not None):
            return
        flat = self.wanted(now)
        self._length = self._brakes
        self._brake = braking(flat, self._length)
        self.flying, self._begin = None, now
        self._from = self._to = flat[0] + sum(
            self._brake[k] * self._length ** (k + 1) / (k + 1) for k in range(len(self._brake))
        )

    def land(self, height: float, seconds: float, now: float) -> None:
        """Sink from where it is wanted now.

        Args:
            height: z in m where the landing ends.
            seconds: How long it takes.
            now: s of the link's clock.
        """
        if not self.spinning:
            return
        self._from = self.wanted(now)[0].copy()
        self._to = self._from.copy()
        self._to[2] = height
        self.flying, self._brake, self._begin, self._length = None, None, now, max(seconds, 0.1)

    def stop(self, now: float) -> None:
        """Stop motors."""
        self._from = self._to = self.wanted(now)[0].copy()
        self.spinning, self.flying, self._brake = False, None, None

    def wanted(self, now: float) -> Floats:
        """Return x, y, z, heading and four derivatives. Shape (5, 4)."""
        flat = np.zeros((5, 4))
        t = now - self._begin
        if self.flying is not None:
            path = self._stored[self.flying]
            if t < path.duration:
                return _flat(path, max(t, 0.0))
            self._from = self._to = path.evaluate(path.duration)
            self.flying = None
        if self._brake is not None and t < self._length:
            origin = self._to - sum(self._brake[k] * self._length ** (k + 1) / (k + 1) for k in range(len(self._brake)))
            flat[0] = origin + sum(self._brake[k] * t ** (k + 1) / (k + 1) for k in range(len(self._brake)))
            powers = self._brake
            for order in range(1, 5):
                flat[order] = sum(powers[k] * t**k for k in range(len(powers)))
                powers = np.stack([k * powers[k] for k in range(1, len(powers))])
            return flat
        if np.array_equal(self._from, self._to):
            flat[0] = self._to
            return flat
        step = smooth_step(t / self._length)
        flat[0] = self._from + (self._to - self._from) * step[0]
        for order in range(1, 5):
            flat[order] = (self._to - self._from) * step[order] / self._length**order
        return flat


def _flat(path: Trajectory, t: float) -> Floats:
    """Return a finite flight's x, y, z, heading and four derivatives before its end, all at once. Shape (5, 4)."""
    piece = min(int(np.searchsorted(path.knots, t, side="right")) - 1, len(path) - 1)
    local = t - float(path.knots[piece])
    return (_FACTORS * local**_POWERS) @ path.coefficients[piece].T


class Fleet:
    """All commanders together, as the simulation's guidance.

    Attributes:
        commanders: By robot.
    """

    def __init__(self, commanders: dict[str, Commander], step: float) -> None:
        """Take them.

        Args:
            commanders: By robot.
            step: s between control instants.
        """
        self.commanders, self._step = commanders, step

    @property
    def robots(self) -> tuple[str, ...]:
        """Names."""
        return tuple(self.commanders)

    @property
    def start(self) -> Floats:
        """Initial positions and headings. Shape (4, robots)."""
        return self.wanted(0)[0]

    @property
    def ticks(self) -> int:
        """As many as anybody waits for."""
        return _MANY

    def wanted(self, tick: int) -> Floats:
        """Return what they should do from a control instant on. Shape (5, 4, robots)."""
        now = tick * self._step
        return np.stack([commander.wanted(now) for commander in self.commanders.values()], axis=-1)

    def planned(self, step: int) -> None:
        """Return no plan: the live flight has it, not the vehicles."""
