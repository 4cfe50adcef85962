"""The full model: body and rotors (`dynamics.py`), the autopilot on board and the battery.

Few vehicles are stepped by compiled arithmetic (`compiled.py`), many by that of arrays, with the same numbers.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from flight.model.airframe import Airframe
from flight.model.attitude import Floats, matrix
from flight.model.autopilot import Autopilot, Held
from flight.model.disturbances import BatteryState
from flight.model.dynamics import ATTITUDE, POSITION, RATES, STATES, VELOCITY, QuadcopterDynamics, hover_state, rotor_thrusts
from flight.model.plant import AirframeModel, Command, Motion, Plant
from flight.model.timing import CONTROL_STEP, STEP
from verify.data import GRAVITY

if TYPE_CHECKING:
    from flight.model.compiled import Compiled, CompiledFlight

_FEW = 40
"""So many vehicles are stepped sooner one number after the other than as arrays."""


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
        self._airframe, self._vehicle = airframe, _Vehicle(airframe)
        self._state = hover_state(airframe, flat[:3], flat[3])
        self._battery = BatteryState(airframe, n)
        self._strength, self._ceiling = self._battery.strength, self._battery.ceiling
        none, level = np.zeros((3, n)), np.full(n, airframe.vehicle.weight)
        self._held = Held(None, none, none, level, np.zeros(n), np.full((4, n), airframe.hover_speed))
        self._compiled: tuple[int, CompiledFlight] | None = None

    @property
    def position(self) -> Floats:
        return self._state[POSITION]

    @property
    def thrust(self) -> Floats:
        rotors = self.rotors
        return rotors[0] + rotors[1] + rotors[2] + rotors[3]

    @property
    def rotors(self) -> Floats:
        return rotor_thrusts(self._airframe, self._state)

    @property
    def charge(self) -> Floats:
        return self._battery.share

    def motion(self) -> Motion:
        state = self._state
        return Motion(state[POSITION], state[VELOCITY], state[ATTITUDE], state[RATES])

    def felt(self) -> Floats:
        """Return the acceleration that the autopilot's own model of the rotors gives, m/s^2."""
        turn = matrix(self._state[ATTITUDE])
        acceleration = turn[:, 2] * (self._vehicle.autopilot.thrust(self._held) / self._airframe.vehicle.mass)
        acceleration[2] -= GRAVITY
        return acceleration

    def follow(self, command: Command) -> None:
        self._battery.draw(self.rotors, CONTROL_STEP)
        self._strength, self._ceiling = self._battery.strength, self._battery.ceiling
        self._held = Held.of(command, self._held.rotors)

    def step(self, wind: Floats | float) -> None:
        self._state, self._held = self._vehicle.after(self._state, self._held, self._strength, self._ceiling, wind)

    def fly(self, wind: Floats | float, count: int) -> Floats:
        vehicles = self._state.shape[1]
        if vehicles > _FEW:
            return super().fly(wind, count)
        rows, acting = _packed(self._state, self._held), np.empty((5, vehicles))
        acting[0], acting[1], acting[2:] = self._strength, self._ceiling, wind
        if self._compiled is None or self._compiled[0] != len(rows):
            self._compiled = len(rows), _compiled(self._airframe, len(rows)).flight(vehicles)  # pyright: ignore[reportArgumentType]  # frozen values have one
        flown = self._compiled[1].steps(rows, acting, count)
        if not np.isfinite(flown[-1]).all():
            return super().fly(wind, count)
        self._state, self._held = _unpacked(flown[-1])
        return flown[:, POSITION]


class _Vehicle:
    """Body, rotors and autopilot of an airframe."""

    def __init__(self, airframe: Airframe) -> None:
        self.dynamics = QuadcopterDynamics(airframe)
        self.autopilot = Autopilot(self.dynamics)

    def after(self, state: Floats, held: Held, strength: Floats, ceiling: Floats, wind: Floats | float) -> tuple[Floats, Held]:
        """Return what they are after a step."""
        asked, held = self.autopilot.rotor_commands(held, state[ATTITUDE], state[RATES], ceiling, STEP)
        return self.dynamics.step(state, asked * strength, wind, STEP), held

    def rows_after(self, rows: Floats, acting: Floats) -> Floats:
        """Return them as rows of one array after a step, of which strength, ceiling and wind are rows of another."""
        return _packed(*self.after(*_unpacked(rows), acting[0], acting[1], acting[2:]))


def _packed(state: Floats, held: Held) -> Floats:
    rest = (held.rates, held.rates_change, held.thrust[None], held.thrust_rate[None], held.rotors)
    return np.concatenate((state, *rest) if held.attitude is None else (state, *rest, held.attitude))


def _unpacked(rows: Floats) -> tuple[Floats, Held]:
    rates, change, thrust, thrust_rate, rotors, attitude = (rows[a:b] for a, b in itertools.pairwise(_ENDS))
    return rows[:STATES], Held(attitude if len(attitude) else None, rates, change, thrust[0], thrust_rate[0], rotors)


_ENDS = [STATES + end for end in (0, 3, 6, 7, 8, 12, 16)]


@lru_cache(maxsize=32)
def _compiled(airframe: Airframe, rows: int) -> Compiled:
    from flight.model.compiled import Compiled

    return Compiled(_Vehicle(airframe).rows_after, rows, 5)
