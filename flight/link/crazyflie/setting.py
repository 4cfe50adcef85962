"""Settings on board before a flight, read back: the controller, its mass, and how far motion capture is trusted."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from flight.exports.crazyflies.fits import crazyflies
from flight.exports.crazyflies.inventory import checked_weight
from flight.exports.crazyflies.parameters import cannot_fly, parameters_read
from flight.link.crazyflie.vehicle import Vehicle
from verify.data import DoesNotFit, Mission

_IF_THERE = {"commander.enHighLevel": 1.0}
"""Asked of firmware that has it: newer firmware takes the high-level commander without."""


def wanted(mission: Mission, masses: Mapping[str, float]) -> dict[str, dict[str, float]]:
    """Return what every robot has to have on board: `group.name` to value.

    Args:
        mission: Says what they fly.
        masses: kg as robots were weighed; others have their profile's.

    Raises:
        DoesNotFit: A robot is no Crazyflie, or weighs much more or less than what it was certified for, or has gains that nothing sets on board.
    """
    able = crazyflies(mission, mission.agents)
    found: dict[str, dict[str, float]] = {}
    for name in mission.agents:
        vehicle = mission.vehicle_of(name)
        if name not in able:
            raise DoesNotFit(f"{name} flies '{vehicle.name}' of {vehicle.mass:g} kg, which is no Crazyflie.")
        if why := cannot_fly(vehicle):
            raise DoesNotFit(f"{name}: no vehicle flies as it was simulated: {why}. Take the firmware's for them.")
        found[name] = parameters_read(vehicle, checked_weight(name, vehicle, masses.get(name)))
    return found


def set_on(vehicle: Vehicle, values: Mapping[str, float]) -> tuple[list[str], Callable[[], bool]]:
    """Set parameters on one vehicle, and read them back.

    Args:
        vehicle: Connected.
        values: `group.name` to value.

    Returns:
        What its firmware does not have, in which case nothing is set; and whether all were read back by now.
    """
    if missing := [key for key in values if not vehicle.has(key)]:
        return missing, lambda: False
    due: dict[str, int] = {}
    for key, value in {**{key: value for key, value in _IF_THERE.items() if vehicle.has(key)}, **values}.items():
        due[key] = vehicle.reads.get(key, 0) + 2
        vehicle.set(key, value)
    return [], lambda: all(vehicle.reads.get(key, 0) >= count for key, count in due.items())
