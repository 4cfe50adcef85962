"""Parameters of a Crazyflie that make it fly as it was simulated: controller, mass, and trust in motion capture."""

from __future__ import annotations

from flight.control.profiles import autopilot_of_vehicle, controller_name
from verify.data import Vehicle
from verify.data.autopilot import MellingerGains

NUMBERS = {"pid": 1, "mellinger": 2, "lee": 5}
"""`stabilizer.controller` of each that the firmware has and simulation too. For any other Mellinger's is set, which crazyswarm2 takes for
trajectories; exports say then that it was not rehearsed."""
KALMAN = 2
"""`stabilizer.estimator`."""
_OF_CONTROLLERS = {"ctrlMel": 2, "ctrlLee": 5}
"""Groups of parameters that only one controller reads, and its number."""


def firmware_parameters(vehicle: Vehicle, mass: float | None = None) -> dict[str, dict[str, float]]:
    """Return the firmware's parameters for a vehicle, by group and name.

    Args:
        vehicle: Its profile: mass, controller and autopilot.
        mass: kg as it was weighed; None takes the profile's.
    """
    autopilot, flown = autopilot_of_vehicle(vehicle), vehicle.mass if mass is None else mass
    return {
        "stabilizer": {"estimator": KALMAN, "controller": NUMBERS.get(controller_name(vehicle), NUMBERS["mellinger"])},
        "ctrlMel": {"mass": flown, "massThrust": autopilot.gains(MellingerGains).thrust_to_pwm},
        "ctrlLee": {"mass": flown},
        "locSrv": {"extPosStdDev": autopilot.ekf.position_noise, "extQuatStdDev": autopilot.ekf.attitude_noise},
    }


def parameters_read(vehicle: Vehicle, mass: float | None = None) -> dict[str, float]:
    """Return those of `firmware_parameters` that are read by whom the vehicle flies with, by `group.name`.

    Args:
        vehicle: Its profile.
        mass: kg as it was weighed; None takes the profile's.
    """
    groups = firmware_parameters(vehicle, mass)
    flown = groups["stabilizer"]["controller"]
    return {
        f"{group}.{key}": float(value)
        for group, values in groups.items()
        if _OF_CONTROLLERS.get(group, flown) == flown
        for key, value in values.items()
    }


def sentence(vehicle: Vehicle) -> str:
    """Return what the parameters of a vehicle are set to, for the note.

    Args:
        vehicle: Its profile.
    """
    set_to = "; ".join(
        f"{group}.{name} {value:g}" for group, values in firmware_parameters(vehicle).items() for name, value in values.items()
    )
    return f"The margin is meant for {controller_name(vehicle)}; {vehicle.name} flies with {set_to}."
