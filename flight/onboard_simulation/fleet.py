"""Vehicles of several kinds with what flies them on board, moved a frame of 10 ms at a time.

At the start of each frame the estimator predicts and takes what motion capture saw a while ago; the laws aim; then they fly for five
steps on that estimate, with gyroscopes of their own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flight.control.controller import Controller
from flight.control.onboard_controller import setpoint_of
from flight.control.profiles import autopilot_of
from flight.mixed_fleet import Kind, joined
from flight.model.airframe import Drag
from flight.model.attitude import Floats, quaternion_rate, unit
from flight.model.ekf import ROWS, SENSED, ExtendedKalman
from flight.model.timing import FRAME_STEPS, STEP
from flight.onboard_simulation.commanded import laws_of
from flight.onboard_simulation.rotor_plant import RotorPlant
from verify.data.autopilot import FilterNoise

if TYPE_CHECKING:
    from flight.model.compiled import Compiled

_FRAME = FRAME_STEPS * STEP


@dataclass(frozen=True, eq=False, slots=True)
class Sight:
    """Random draws of one frame. Vehicles along the last axis.

    Attributes:
        position: Error of motion capture's position, m. Shape (3, n).
        attitude: Error of its attitude, rad. Shape (3, n).
        seen: Whether it saw a vehicle. Shape (n,).
        gyro: Error of the gyroscopes, rad/s. Shape (3, n).
        velocity: Error of the velocity that a controller without an estimator is given, m/s. Shape (3, n).
    """

    position: Floats
    attitude: Floats
    seen: NDArray[np.bool_]
    gyro: Floats
    velocity: Floats | float = 0.0


@dataclass(frozen=True, eq=False, slots=True)
class Differences:
    """Ways in which vehicles are not what their controllers take them for. Vehicles along the last axis.

    Attributes:
        delay: s from a frame of motion capture to its use on board; None where they know the truth. Shape (n,).
        mass: What each weighs as a share of its airframe's mass; None for 1. Shape (n,).
        thrust: Thrust of each over the thrust that is commanded; None for 1. Shape (n,).
        drag: Which drag those have whose drag was not measured.
        age: s, of the position and velocity that a controller is given which has no estimator; None for 0. Shape (n,).
    """

    delay: Floats | None = None
    mass: Floats | None = None
    thrust: Floats | None = None
    drag: Drag = "profile"
    age: Floats | None = None

    def of(self, own: NDArray[np.intp]) -> Differences:
        """Return those of some vehicles.

        Args:
            own: Which.
        """
        parts = (self.delay, self.mass, self.thrust, self.age)
        delay, mass, thrust, age = (None if part is None else part[own] for part in parts)
        return Differences(delay, mass, thrust, self.drag, age)


class Fleet:
    """Vehicles side by side: each kind flies as if it were alone."""

    def __init__(self, kinds: Sequence[Kind], controller: Controller, start: Floats, differences: Differences) -> None:
        """Let vehicles hover.

        Args:
            kinds: Which vehicles are of which airframe.
            controller: Who flies them.
            start: x, y, z in m and heading in rad. Shape (4, n).
            differences: Of the vehicles.
        """
        self._columns = tuple(kind.columns for kind in kinds)
        self._crews = tuple(_Crew(kind, controller, start, differences.of(kind.columns)) for kind in kinds)

    @property
    def state(self) -> Floats:
        """Position, velocity, attitude, body rates and rotor speeds. Shape (17, n)."""
        return self._joined([crew.plant.state for crew in self._crews])

    @property
    def known(self) -> Floats:
        """Position, velocity and attitude as they are known on board. Shape (10, n)."""
        return self._joined([crew.known for crew in self._crews])

    @property
    def rotors(self) -> Floats:
        """Each rotor's thrust, N. Shape (4, n)."""
        return self._joined([crew.plant.rotors for crew in self._crews])

    @property
    def charge(self) -> Floats:
        """Battery voltage over its voltage in hover at full charge. Shape (n,)."""
        return self._joined([crew.plant.charge for crew in self._crews])

    def drain(self, dt: float) -> None:
        """Draw from the batteries what flying for a while takes.

        Args:
            dt: s.
        """
        for crew in self._crews:
            crew.plant.drain(dt)

    def look(self, sight: Sight | None) -> None:
        """Begin a frame: predict, and take motion capture's measurement; None where all know the truth.

        Args:
            sight: What chance does.
        """
        for crew in self._crews:
            crew.look(sight)

    def fly(self, flat: Floats, half: int, wind: Floats | float) -> Floats:
        """Fly a frame and return where all are after each step, m. Shape (FRAME_STEPS, 3, n).

        Args:
            flat: The plan at the last control instant, as for `ControlLoop.command`.
            half: 0 in the frame after that, 1 in the next one.
            wind: m/s, world frame. Shape (3, n).
        """
        return self._joined([crew.fly(flat, half, wind) for crew in self._crews])

    def _joined(self, parts: Sequence[Floats]) -> Floats:
        return parts[0] if len(parts) == 1 else joined(parts, self._columns)


class _Crew:
    """Vehicles of one kind, their laws and their estimator."""

    def __init__(self, kind: Kind, controller: Controller, start: Floats, own_differences: Differences) -> None:
        self._own = own = kind.columns
        laws = laws_of(controller, kind.airframe)
        mass, delay = own_differences.mass, own_differences.delay
        weights = None if mass is None else kind.airframe.vehicle.mass * mass
        at_rest = np.zeros((5, 4, len(own)))
        at_rest[0] = start[:, own]
        airframe, at_first = kind.airframe.with_drag(own_differences.drag), setpoint_of(at_rest, 0.0)
        self.plant = RotorPlant(airframe, laws, start[:, own], at_first, weights, own_differences.thrust)
        self._gyro: Floats | float = 0.0
        self._estimator = None if delay is None else _Estimator(self.plant, delay)
        self._aged = None if own_differences.age is None else _Aged(self.plant.state[:6], own_differences.age)
        self._off: Floats | None = None  # position and velocity that are given, less the true ones

    @property
    def known(self) -> Floats:
        return self.plant.state[:10] if self._estimator is None else self._estimator.known

    def look(self, sight: Sight | None) -> None:
        if sight is None:
            return
        own = self._own
        self._gyro = sight.gyro[:, own]
        if self._estimator is None:
            self._off = np.concatenate([sight.position[:, own], np.broadcast_to(sight.velocity, sight.position.shape)[:, own]])
            return
        self._estimator.look(Sight(sight.position[:, own], sight.attitude[:, own], sight.seen[own], self._gyro))

    def fly(self, flat: Floats, half: int, wind: Floats | float) -> Floats:
        own = self._own
        flat = flat[..., own]
        setpoint = setpoint_of(flat, half * _FRAME)
        plant, estimator = self.plant, self._estimator
        known = plant.truth().copy()
        known[10:] += self._gyro
        if estimator is not None:
            known[:10] = estimator.known
        else:
            known[:6] = known[:6] if self._aged is None else self._aged.given()
            known[:6] += 0.0 if self._off is None else self._off
        plant.aim(None if half else flat, setpoint, known)
        air = wind if isinstance(wind, float | int) else wind[:, own]
        flown = plant.fly(setpoint, None if estimator is None else estimator.known, self._gyro, air, FRAME_STEPS)
        for memory in filter(None, (estimator, self._aged)):
            memory.remember(flown)
        return flown[:, :3]


class _Aged:
    """Positions and velocities of the last steps, for controllers that are given them late."""

    def __init__(self, now: Floats, age: Floats) -> None:
        late = age / STEP
        self._whole, self._vehicles = np.floor(late).astype(np.intp), np.arange(len(age))
        self._part = (late - self._whole)[:, None]
        self._past = np.repeat(now[None], 2 + int(np.max(self._whole)), axis=0)

    def remember(self, flown: Floats) -> None:
        """Keep where the vehicles were after each step of a frame. Shape (FRAME_STEPS, 10, n)."""
        self._past = np.concatenate([self._past, flown[:, :6]])[-len(self._past) :]

    def given(self) -> Floats:
        """Return position and velocity as old as they are given. Shape (6, n)."""
        near, far = (self._past[at - self._whole, :, self._vehicles] for at in (-1, -2))
        return (near + self._part * (far - near)).T


class _Estimator:
    """The filter on board of some vehicles, and what motion capture saw of them lately."""

    def __init__(self, plant: RotorPlant, delay: Floats) -> None:
        self._plant, n = plant, len(delay)
        noise = autopilot_of(plant.airframe).ekf
        self._filter = ExtendedKalman(noise, _FRAME)
        self._after: Callable[[Floats, Floats], Floats] = self._filter.after
        self._sensed: Callable[[Floats, Floats], Floats] = _sensed
        repeated = None
        if n <= _FEW:
            filtering, sensing = _compiled_filter(noise), _compiled_sensing()  # pyright: ignore[reportArgumentType]  # frozen models are hashable
            self._after, self._sensed = filtering.flight(n).step, sensing.flight(n).step
            repeated = filtering.repeated
        late = delay / STEP
        self._whole = np.floor(late).astype(np.intp)
        self._part = late - self._whole
        self._vehicles = np.arange(n)
        state = plant.state
        length = FRAME_STEPS * (2 + int(np.max(self._whole)) // FRAME_STEPS)
        self._past = np.repeat(_pose(state)[None], length, axis=0)
        self._blank, self._seen = np.zeros((SENSED, n)), np.empty((_SEEN, n))
        self._seen[14] = self._part
        self._newest = 0
        self._rows = self._filter.at_first(state[:3], state[6:10], repeated)
        self.known = self._filter.known(self._rows)
        self._begun = False

    def remember(self, flown: Floats) -> None:
        """Keep where the vehicles were after each step of a frame. Shape (FRAME_STEPS, 10, n)."""
        length = len(self._past)
        for k in range(len(flown)):
            self._newest = (self._newest + 1) % length
            self._past[self._newest] = _pose(flown[k])

    def look(self, sight: Sight) -> None:
        """Predict over the frame that is past, and take the measurement that arrives now."""
        if not self._begun:
            self._begun = True  # before anything was flown there is nothing to predict from
            return
        sensed, seen = self._blank, self._seen
        sensed[:3], sensed[3] = self._plant.sensed(FRAME_STEPS)
        sensed[11] = sight.seen
        length = len(self._past)
        at = (self._newest - self._whole) % length
        seen[:7] = self._past[at, :, self._vehicles].T
        seen[7:14] = self._past[(at - 1) % length, :, self._vehicles].T
        seen[15:18], seen[18:] = sight.position, sight.attitude
        self._rows = self._after(self._rows, self._sensed(sensed, seen))
        self.known = self._filter.known(self._rows)


_SEEN = 21
"""Rows: poses of motion capture's picture, at the step after it and at the one before, shares of the way between, and its errors."""
_FEW = 40
"""So many vehicles are estimated sooner one number after the other than as arrays."""


def _sensed(sensed: Floats, seen: Floats) -> Floats:
    """Return what is sensed with motion capture's picture in it. Shapes (SENSED, n) and (_SEEN, n)."""
    near, far = seen[:7], seen[7:14]
    pose = near + seen[14] * (far - near)
    attitude = unit(pose[3:])
    found = np.empty_like(sensed)
    found[:4], found[11] = sensed[:4], sensed[11]
    found[4:7] = pose[:3] + seen[15:18]
    found[7:11] = unit(attitude + quaternion_rate(attitude, seen[18:]))
    return found


@cache
def _compiled_filter(noise: FilterNoise) -> Compiled:
    from flight.model.compiled import Compiled

    return Compiled(ExtendedKalman(noise, _FRAME).after, ROWS, SENSED)


@cache
def _compiled_sensing() -> Compiled:
    from flight.model.compiled import Compiled

    return Compiled(_sensed, SENSED, _SEEN)


def _pose(rows: Floats) -> Floats:
    """Return position and attitude of rows that begin with position, velocity and attitude. Shape (7, n)."""
    return np.concatenate([rows[:3], rows[6:10]])
