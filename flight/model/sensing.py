"""Sensing in flight: motion capture with noise, delay and drop-outs, and a Kalman filter on it."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flight.model.attitude import Floats
from flight.model.numbers import is_number
from verify.data import BadInput

CLIP = 4.0
"""Noise is cut at this many standard deviations on each axis, so that a measurement's error has a bound."""


@dataclass(frozen=True, slots=True)
class MotionCapture:
    """Cameras that see every robot's position, and the sensors on board.

    Attributes:
        rate: Frames a second; a multiple of 50 that divides 500.
        noise: Standard deviation of a position, on each axis, m; cut at four of it.
        delay: s from a frame to its use.
        dropout: Share of frames that lose a robot.
        burst: Mean number of frames that a robot stays lost.
        attitude_noise: Standard deviation of the attitude on board, rad.
        rate_noise: Standard deviation of the gyroscopes at 50 Hz, rad/s.
    """

    rate: int = 100
    noise: float = 0.001
    delay: float = 0.01
    dropout: float = 0.002
    burst: float = 2.0
    attitude_noise: float = 0.002
    rate_noise: float = 0.01

    def __post_init__(self) -> None:
        if self.rate not in (50, 100, 250, 500) or not isinstance(self.rate, int):  # pyright: ignore[reportUnnecessaryIsInstance]  # a caller may err
            raise BadInput(f"motion capture runs at 50, 100, 250 or 500 Hz, a whole number, not {self.rate!r}.")
        for name in ("noise", "delay", "dropout", "attitude_noise", "rate_noise"):
            value = getattr(self, name)
            if not (is_number(value) and value >= 0):
                raise BadInput(f"motion capture: {name} must be a number, 0 or more, not {value!r}.")
        if self.noise > 0.2:
            raise BadInput(f"motion capture: a noise of {self.noise:g} m is no motion capture; it is given in metres.")
        if self.delay > 0.2:
            raise BadInput(f"motion capture: a delay of {self.delay:g} s cannot be flown; it is given in seconds.")
        if self.dropout > 0.5 or not (is_number(self.burst) and self.burst >= 1.0):
            raise BadInput("motion capture: dropout must be at most 0.5, and burst at least 1 frame.")

    @classmethod
    def parse(cls, text: str | float) -> MotionCapture:
        """Read `0.001`: the noise in m, everything else as usual; `off` is not read here.

        Raises:
            BadInput: The text is no number, or no noise that there can be.
        """
        try:
            return cls(noise=float(text))
        except ValueError:
            raise BadInput(f"'{text}' is no noise: write the standard deviation of a position in m, such as 0.001.") from None

    @property
    def varies(self) -> bool:
        """True if chance has any part in what is measured."""
        return any((self.noise, self.dropout, self.attitude_noise, self.rate_noise))

    @property
    def bound(self) -> float:
        """Greatest distance between a measured and a true position, m."""
        return CLIP * self.noise * float(np.sqrt(3.0))

    @property
    def delay_frames(self) -> int:
        """Whole frames by which a measurement is late when it is used."""
        return int(np.ceil(round(self.delay * self.rate, 9)))


class Kalman:
    """A filter of position, velocity and disturbance on each axis, driven by the thrust that the autopilot reports.

    All three axes share one covariance, which differs from vehicle to vehicle only because frames are lost. A
    measurement is used `delay_frames` late: the filter lives at that time and looks ahead from there with the thrusts
    since then.
    """

    JERK = 6.0
    """Standard deviation of unmodelled acceleration, m/s^2 per root of a second's frames."""
    DRIFT = 2.0
    """Random walk of the disturbance, m/s^2 per root second."""

    def __init__(self, sensor: MotionCapture, position: Floats) -> None:
        vehicles = position.shape[1]
        self._dt = 1.0 / sensor.rate
        self._late = sensor.delay_frames
        self._variance = max(sensor.noise, 1e-6) ** 2
        self._state = np.zeros((3, 3, vehicles))
        self._state[0] = position
        self._spread = np.zeros((3, 3, vehicles))
        self._spread[0, 0], self._spread[1, 1], self._spread[2, 2] = self._variance, 1e-4, 1e-2
        self._frames: deque[tuple[Floats, NDArray[np.bool_], Floats]] = deque()

    def frame(self, measured: Floats, seen: NDArray[np.bool_], acceleration: Floats) -> None:
        """Take one frame: measured positions, which vehicles were seen, and the acceleration commanded from now on.

        Args:
            measured: m. Shape (3, n).
            seen: Boolean. Shape (n,).
            acceleration: R f/m - g e3, m/s^2, held until the next frame. Shape (3, n).
        """
        self._frames.append((measured, seen, acceleration))
        if len(self._frames) > self._late:
            measured, seen, _ = self._frames[0]
            self._correct(measured, seen)

    def estimate(self) -> tuple[Floats, Floats]:
        """Return position in m and velocity in m/s at the time of the last frame. Shapes (3, n)."""
        position, velocity, disturbance = self._state
        for _, _, acceleration in list(self._frames)[:-1]:
            push = acceleration + disturbance
            position = position + self._dt * velocity + (0.5 * self._dt**2) * push
            velocity = velocity + self._dt * push
        return position, velocity

    def advance(self) -> None:
        """Move the filter to its next frame."""
        if len(self._frames) <= self._late:
            return
        _, _, acceleration = self._frames.popleft()
        dt, (position, velocity, disturbance) = self._dt, self._state
        push = acceleration + disturbance
        self._state = np.stack([position + dt * velocity + (0.5 * dt * dt) * push, velocity + dt * push, disturbance])
        p = self._spread
        # A P A' with A = [[1, dt, dt^2/2], [0, 1, dt], [0, 0, 1]], then the process noise.
        left = np.stack([p[0] + dt * p[1] + (0.5 * dt * dt) * p[2], p[1] + dt * p[2], p[2]])
        q = np.stack(
            [left[:, 0] + dt * left[:, 1] + (0.5 * dt * dt) * left[:, 2], left[:, 1] + dt * left[:, 2], left[:, 2]], axis=1
        )
        rough = (self.JERK * dt) ** 2 * dt
        q[0, 0] += 0.25 * dt * dt * rough
        q[0, 1] += 0.5 * dt * rough
        q[1, 0] += 0.5 * dt * rough
        q[1, 1] += rough
        q[2, 2] += self.DRIFT**2 * dt
        self._spread = q

    def _correct(self, measured: Floats, seen: NDArray[np.bool_]) -> None:
        p = self._spread
        gain = np.where(seen, p[:, 0] / (p[0, 0] + self._variance), 0.0)
        self._state = self._state + gain[:, None] * (measured - self._state[0])
        self._spread = p - gain[:, None] * p[0]
