"""A controller that is sent set-points over a stream: of some age, rounded, and without derivatives above some order."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from flight.control.controller import Controller, ControlLoop
from flight.model.airframe import Airframe
from flight.model.attitude import Floats
from flight.model.plant import Command, Motion
from flight.model.timing import CONTROL_STEP
from verify.data.disturbance import StreamedSetpoints


@dataclass(frozen=True)
class StreamedController(Controller):
    """Another controller, whose set-points are as old as a mission lets them be, and rounded as coarsely.

    Attributes:
        follower: Flies on them.
        name: Its name.
        sent: What set-points are off by.
    """

    setpoints: ClassVar[float] = 1.0 / CONTROL_STEP

    follower: Controller
    name: str
    sent: StreamedSetpoints

    @property
    def orders(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]  # of the stream's
        """The highest derivative of a planned position that it takes."""
        return min(self.follower.orders, self.sent.orders)

    def __repr__(self) -> str:
        return f"{self.name} on streamed set-points"

    def begin(self, airframe: Airframe, flat: Floats) -> ControlLoop:
        """Return a loop for vehicles that hover; arguments as said there."""
        return _StreamedLoop(self.follower.begin(airframe, flat), self.sent, flat)


class _StreamedLoop:
    def __init__(self, loop: ControlLoop, sent: StreamedSetpoints, start: Floats) -> None:
        self._loop, self._sent = loop, sent
        whole = math.floor(sent.age[1] / CONTROL_STEP + 1e-9)
        self._since = max(sent.age[1] - whole * CONTROL_STEP, 0.0)
        hover = np.zeros((5, *start.shape))
        hover[0] = start
        self._past = deque([hover] * (whole + 1), maxlen=whole + 1)
        self._ticks = 0
        self._steps = [2.0 * size / math.sqrt(3.0) for size in sent.rounding]  # of each axis

    def command(self, flat: Floats, now: Motion) -> Command:
        """Return the command of the controller for what it is sent of a set-point."""
        self._past.append(flat)
        self._ticks += 1
        return self._loop.command(self._rounded(self._aged()), now)

    def _aged(self) -> Floats:
        """Return the set-point that was sent some time ago; before the first one all hover."""
        then, since = self._past[0], self._since
        if not since:
            return then.copy()
        if self._ticks <= len(self._past):
            then = np.concatenate([then[:1], np.zeros_like(then[1:])])
        factors = [
            [(-since) ** (k - order) / math.factorial(k - order) if k >= order else 0.0 for k in range(5)] for order in range(5)
        ]
        return np.einsum("ok,kan->oan", np.array(factors), then)

    def _rounded(self, flat: Floats) -> Floats:
        flat[self._sent.orders + 1 :] = 0.0
        for order, step in enumerate(self._steps[: self._sent.orders + 1]):
            if step:
                flat[order, :3] = step * np.rint(flat[order, :3] / step)
        if step := 2.0 * self._sent.heading:
            flat[0, 3] = step * np.rint(flat[0, 3] / step)
        return flat
