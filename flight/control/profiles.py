"""Onboard software in vehicles' profiles: the controller that margins are meant for, and the table of gains."""

from __future__ import annotations

from flight.control.controller import CONTROLLERS, Controller
from flight.model.airframe import Airframe
from verify.data import BadInput, Vehicle
from verify.data.autopilot import Autopilot, load_autopilot

PROFILES = "profile"
"""The name under which each vehicle is flown by the controller that its profile names."""
STOCK = "crazyflie-2"
"""The autopilot that a vehicle is taken to have where its profile names none."""


def controller_name(vehicle: Vehicle) -> str:
    """Return the name of the controller that a vehicle's margin is meant for."""
    return "geometric" if vehicle.controller is None else vehicle.controller


def controller_of(vehicle: Vehicle) -> Controller:
    """Return the controller that a vehicle's margin is meant for.

    Args:
        vehicle: Its profile names it.

    Raises:
        BadInput: The profile names none that there is, or refers to itself.
    """
    name = controller_name(vehicle)
    if name == PROFILES:
        names = ", ".join(known for known in CONTROLLERS.names() if known != PROFILES)
        raise BadInput(
            f"vehicle '{vehicle.name}': its controller is '{name}', whom the vehicle's profile names. Name one: {names}."
        )
    try:
        return CONTROLLERS.find(name)
    except BadInput as error:
        raise BadInput(f"vehicle '{vehicle.name}': {error}") from None


def autopilot_of(airframe: Airframe) -> Autopilot:
    """Return what is on board: what the vehicle's profile names, or the stock table."""
    return autopilot_of_vehicle(airframe.vehicle)


def autopilot_of_vehicle(vehicle: Vehicle) -> Autopilot:
    """Return what is on board of a vehicle, as `autopilot_of` says."""
    return vehicle.autopilot or load_autopilot(STOCK)
