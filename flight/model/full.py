"""The full model: body and rotors (`dynamics.py`), the autopilot on board and the battery."""

from __future__ import annotations

from dataclasses import dataclass

from flight.model.airframe import Airframe
from flight.model.attitude import Floats, matrix
from flight.model.autopilot import Autopilot
from flight.model.disturbances import BatteryState
from flight.model.dynamics import ATTITUDE, POSITION, RATES, VELOCITY, QuadcopterDynamics, hover_state, rotor_thrusts
from flight.model.plant import AirframeModel, Command, Motion, Plant
from flight.model.timing import CONTROL_STEP, STEP
from verify.data import GRAVITY


@dataclass(frozen=True, slots=True)
class FullModel(AirframeModel):
    """Twelve states of the body, rotors with lag and drag, autopilot, battery."""

    def begin(self, airframe: Airframe, flat: Floats) -> Plant:
        """Return vehicles that hover; arguments as said there."""
        return _FullPlant(airframe, flat)


FULL = FullModel()


class _FullPlant(Plant):
    def __init__(self, airframe: Airframe, flat: Floats) -> None:
        n = flat.shape[-1]
        self._dynamics = QuadcopterDynamics(airframe)
        self._state = hover_state(airframe, flat[:3], flat[3])
        self._autopilot = Autopilot(self._dynamics, n)
        self._battery = BatteryState(airframe, n)
        self._strength, self._ceiling = self._battery.strength, self._battery.ceiling

    @property
    def position(self) -> Floats:
        return self._state[POSITION]

    @property
    def thrust(self) -> Floats:
        rotors = self.rotors
        return rotors[0] + rotors[1] + rotors[2] + rotors[3]

    @property
    def rotors(self) -> Floats:
        return rotor_thrusts(self._dynamics.airframe, self._state)

    @property
    def charge(self) -> Floats:
        return self._battery.share

    def motion(self) -> Motion:
        state = self._state
        return Motion(state[POSITION], state[VELOCITY], state[ATTITUDE], state[RATES])

    def felt(self) -> Floats:
        """Return the acceleration that the autopilot's own model of the rotors gives, m/s^2."""
        turn = matrix(self._state[ATTITUDE])
        acceleration = turn[:, 2] * (self._autopilot.thrust / self._dynamics.airframe.vehicle.mass)
        acceleration[2] -= GRAVITY
        return acceleration

    def follow(self, command: Command) -> None:
        self._battery.draw(self.rotors, CONTROL_STEP)
        self._strength, self._ceiling = self._battery.strength, self._battery.ceiling
        self._autopilot.follow(command)

    def step(self, wind: Floats | float) -> None:
        state = self._state
        asked = self._autopilot.rotor_commands(state[ATTITUDE], state[RATES], self._ceiling, STEP)
        self._state = self._dynamics.step(state, asked * self._strength, wind, STEP)
