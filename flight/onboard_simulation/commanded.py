"""Laws of a controller that commands 50 times a second, and of the autopilot that follows its commands in between."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flight.control.controller import Controller
from flight.control.onboard_controller import ATTITUDE, GYRO, HEADING, POSITION, VELOCITY, Laws, Moment, OnBoardController
from flight.control.profiles import controller_of
from flight.model.airframe import Airframe
from flight.model.attitude import Floats
from flight.model.autopilot import Autopilot, Held
from flight.model.dynamics import QuadcopterDynamics
from flight.model.plant import Motion
from flight.model.timing import STEP

# Rows of the memory: what the autopilot holds to.
_RATES, _CHANGE, _THRUST, _THRUST_RATE, _ROTORS, _HELD = slice(0, 3), slice(3, 6), 6, 7, slice(8, 12), slice(12, 16)
_MEMORY = 16


class CommandedLaws:
    """A controller from the ground with the autopilot of the airframe model `full`, as laws on board."""

    traceable = True

    def __init__(self, controller: Controller, airframe: Airframe) -> None:
        """Take who commands what.

        Args:
            controller: Commands thrust and attitude.
            airframe: What it takes the vehicles for.
        """
        self._controller, self._airframe = controller, airframe
        self._autopilot = Autopilot(QuadcopterDynamics(airframe))
        self._turns = False  # nothing is commanded yet

    def at_first(self, setpoint: Floats) -> Floats:
        """Return the memory of vehicles that hover. Shape (16, n).

        Args:
            setpoint: Where they do. Shape (SETPOINT, n).
        """
        n = setpoint.shape[1]
        start = np.concatenate([setpoint[POSITION], setpoint[HEADING][None]])
        self._loop = self._controller.begin(self._airframe, start)
        memory = np.zeros((_MEMORY, n))
        memory[_THRUST], memory[_ROTORS] = self._airframe.vehicle.weight, self._airframe.hover_speed
        memory[12], memory[15] = np.cos(0.5 * setpoint[HEADING]), np.sin(0.5 * setpoint[HEADING])
        return memory

    def aim(self, flat: Floats | None, now: Moment, memory: Floats) -> Floats:
        """Take a new command every other time.

        Args:
            flat: The plan, or None in between.
            now: What is known.
            memory: Shape (16, n).
        """
        if flat is None:
            return memory
        known = now.known
        command = self._loop.command(flat, Motion(known[POSITION], known[VELOCITY], known[ATTITUDE], known[GYRO]))
        after = memory.copy()
        after[_RATES], after[_CHANGE], after[_THRUST], after[_THRUST_RATE] = (
            command.rates, command.rates_change, command.thrust, command.thrust_rate,
        )  # fmt: skip
        self._turns = command.attitude is not None
        if command.attitude is not None:
            after[_HELD] = command.attitude
        return after

    def thrusts(self, now: Moment, memory: Floats) -> tuple[Floats, Floats]:
        """Do what the autopilot does between commands.

        Args:
            now: What is known.
            memory: Shape (16, n).
        """
        attitude = memory[_HELD] if self._turns else None
        held = Held(attitude, memory[_RATES], memory[_CHANGE], memory[_THRUST], memory[_THRUST_RATE], memory[_ROTORS])
        asked, held = self._autopilot.rotor_commands(held, now.known[ATTITUDE], now.known[GYRO], now.ceiling, STEP)
        after = np.empty_like(memory)
        after[_RATES], after[_CHANGE], after[_THRUST], after[_THRUST_RATE], after[_ROTORS] = (
            held.rates, held.rates_change, held.thrust, held.thrust_rate, held.rotors,
        )  # fmt: skip
        after[_HELD] = memory[_HELD] if held.attitude is None else held.attitude
        return self._airframe.thrust_coefficient * (asked * asked), after


def laws_of(controller: Controller, airframe: Airframe) -> Laws:
    """Return a controller's laws for one airframe, whether it runs on board or on the ground.

    Args:
        controller: Who follows.
        airframe: What it takes the vehicles for.
    """
    return controller.laws(airframe) if isinstance(controller, OnBoardController) else CommandedLaws(controller, airframe)


@dataclass(frozen=True, slots=True)
class Profile(OnBoardController):
    """Each vehicle flown by the controller that its profile names, as its margin is meant."""

    def laws(self, airframe: Airframe) -> Laws:
        """Return the laws of the controller that the vehicle's profile names.

        Args:
            airframe: The vehicle.

        Raises:
            BadInput: There is no such controller.
        """
        return laws_of(controller_of(airframe.vehicle), airframe)


PROFILE = Profile()
