"""Vehicles of one kind that laws on board fly rotor by rotor: body, rotors, laws and what sensors add up, 500 times a second.

Few vehicles are stepped by compiled arithmetic where the laws allow it (`compiled.py`), many by that of arrays, with the same numbers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flight.control.onboard_controller import KNOWN, SETPOINT, AimingLaws, Laws, Moment
from flight.model.airframe import Airframe
from flight.model.attitude import Floats
from flight.model.disturbances import BatteryState
from flight.model.dynamics import ATTITUDE, RATES, STATES, VELOCITY, QuadcopterDynamics, hover_state, rotor_thrusts
from flight.model.timing import STEP
from verify.data import GRAVITY

if TYPE_CHECKING:
    from flight.model.compiled import CompiledFlight

_FEW = 40
"""So many vehicles are stepped sooner one number after the other than as arrays."""
_GYRO, _LIFT = slice(STATES, STATES + 3), STATES + 3
_MEMORY = STATES + 4
"""Rows: the state, sums of gyroscopes and of the acceleration along the body's z, then the laws' memory."""
_ESTIMATED = SETPOINT
_NOISE = _ESTIMATED + KNOWN - 3
_STRENGTH = _NOISE + 3
_CEILING, _WIND = _STRENGTH + 1, slice(_STRENGTH + 2, _STRENGTH + 5)
_ACTING = _STRENGTH + 5
"""Rows of what acts: the set-point, the estimate, noise of the gyroscopes, strength and ceiling of the battery, wind."""


class RotorPlant:
    """Vehicles of one airframe under one controller's laws."""

    # six parameters: what flies, and each way in which it is not what its laws take it for
    def __init__(
        self,
        airframe: Airframe,
        laws: Laws,
        start: Floats,
        setpoint: Floats,
        mass: Floats | None = None,
        thrust: Floats | None = None,
    ) -> None:
        """Let vehicles hover.

        Args:
            airframe: What they are.
            laws: Who flies them.
            start: x, y, z in m and heading in rad. Shape (4, n).
            setpoint: Where they hover. Shape (SETPOINT, n).
            mass: What each weighs, kg, where that is not the airframe's. Shape (n,).
            thrust: Thrust of each over the thrust that is commanded; None for 1. Shape (n,).
        """
        n = start.shape[1]
        self.airframe, self.laws = airframe, laws
        self._aiming = laws if isinstance(laws, AimingLaws) else None
        self._dynamics = QuadcopterDynamics(airframe, mass)
        memory = laws.at_first(setpoint)
        self._rows = np.zeros((_MEMORY + len(memory), n))
        self._rows[:STATES] = hover_state(airframe, start[:3], start[3])
        if mass is not None:
            self._rows[STATES - 4 : STATES] *= np.sqrt(mass / airframe.vehicle.mass)
        self._rows[_MEMORY:] = memory
        self._battery = BatteryState(airframe, n)
        self._pushed = np.sqrt(np.ones(n) if thrust is None else thrust)
        self._acting = np.zeros((_ACTING, n))
        self._compilable = laws.traceable and mass is None and n <= _FEW
        self._compiled: dict[bool, CompiledFlight] = {}

    @property
    def state(self) -> Floats:
        """Position, velocity, attitude, body rates and rotor speeds. Shape (17, n)."""
        return self._rows[:STATES]

    @property
    def rotors(self) -> Floats:
        """Each rotor's thrust, N. Shape (4, n)."""
        return rotor_thrusts(self.airframe, self.state)

    @property
    def charge(self) -> Floats:
        """Battery voltage over its voltage in hover at full charge. Shape (n,)."""
        return self._battery.share

    def truth(self) -> Floats:
        """Return what sensors without fault would tell. Shape (KNOWN, n)."""
        return self._rows[:KNOWN]

    def drain(self, dt: float) -> None:
        """Draw from the batteries what flying for a while takes.

        Args:
            dt: s.
        """
        self._battery.draw(self.rotors, dt)

    def aim(self, flat: Floats | None, setpoint: Floats, known: Floats) -> None:
        """Do what the laws do 100 times a second, where they do.

        Args:
            flat: The plan, every other time; None in between. Shape (5, 4, n).
            setpoint: Shape (SETPOINT, n).
            known: Shape (KNOWN, n).
        """
        if self._aiming is not None:
            now = Moment(setpoint, known, self._battery.ceiling)
            self._rows[_MEMORY:] = self._aiming.aim(flat, now, self._rows[_MEMORY:])

    def fly(
        self, setpoint: Floats, estimated: Floats | None, noise: Floats | float, wind: Floats | float, count: int
    ) -> Floats:
        """Take some steps and return position, velocity and attitude after each. Shape (count, 10, n).

        Args:
            setpoint: Shape (SETPOINT, n).
            estimated: Position, velocity and attitude as the laws know them; None where they know the truth. Shape (10, n).
            noise: Of the gyroscopes, rad/s. Shape (3, n).
            wind: m/s, world frame. Shape (3, n).
            count: How many.
        """
        acting = self._acting
        acting[:SETPOINT], acting[_NOISE : _NOISE + 3], acting[_WIND] = setpoint, noise, wind
        acting[_STRENGTH], acting[_CEILING] = self._battery.strength * self._pushed, self._battery.ceiling
        perfect = estimated is None
        if estimated is not None:
            acting[_ESTIMATED:_NOISE] = estimated
        if self._compilable:
            flown = self._compiled_flight(perfect).steps(self._rows, acting, count)
            if np.isfinite(flown[-1]).all():
                self._rows = flown[-1].copy()
                return flown[:, :10]
        motion = np.empty((count, 10, self._rows.shape[1]))
        for k in range(count):
            self._rows = self._after(self._rows, acting, perfect)
            motion[k] = self._rows[:10]
        return motion

    def sensed(self, count: int) -> tuple[Floats, Floats]:
        """Return the means of gyroscopes and of the acceleration along the body's z since the last call. Shapes (3, n), (n,).

        Args:
            count: Steps since then.
        """
        gyro, lift = self._rows[_GYRO] / count, self._rows[_LIFT] / count
        self._rows[_GYRO], self._rows[_LIFT] = 0.0, 0.0
        return gyro, lift

    def _compiled_flight(self, perfect: bool) -> CompiledFlight:
        if perfect not in self._compiled:
            from flight.model.compiled import Compiled

            def after(rows: Floats, acting: Floats) -> Floats:
                return self._after(rows, acting, perfect)

            self._compiled[perfect] = Compiled(after, len(self._rows), _ACTING).flight(self._rows.shape[1])
        return self._compiled[perfect]

    def _after(self, rows: Floats, acting: Floats, perfect: bool) -> Floats:
        """Return the rows after a step."""
        frame, state = self.airframe, rows[:STATES]
        known = np.empty_like(rows, shape=(KNOWN, rows.shape[1]))
        known[:10] = state[:10] if perfect else acting[_ESTIMATED:_NOISE]
        known[10:] = state[RATES] + acting[_NOISE : _NOISE + 3]
        thrusts, memory = self.laws.thrusts(Moment(acting[:SETPOINT], known, acting[_CEILING]), rows[_MEMORY:])
        speeds = np.sqrt(thrusts / frame.thrust_coefficient) * acting[_STRENGTH]
        after = np.empty_like(rows)
        after[:STATES] = self._dynamics.step(state, speeds, acting[_WIND], STEP)
        q = after[ATTITUDE]
        felt = (after[VELOCITY] - rows[VELOCITY]) / STEP
        up = 2.0 * (q[1] * q[3] + q[0] * q[2]), 2.0 * (q[2] * q[3] - q[0] * q[1]), 1.0 - 2.0 * (q[1] * q[1] + q[2] * q[2])
        after[_GYRO] = rows[_GYRO] + known[10:]
        after[_LIFT] = rows[_LIFT] + (up[0] * felt[0] + up[1] * felt[1] + up[2] * (felt[2] + GRAVITY))
        after[_MEMORY:] = memory
        return after
