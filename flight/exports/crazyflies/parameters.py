"""Parameters of a Crazyflie that make it fly as it was simulated: controller, mass, and trust in motion capture."""

from __future__ import annotations

from flight.control.profiles import autopilot_of_vehicle, controller_name
from verify.data import Vehicle
from verify.data.autopilot import Autopilot, MellingerGains, load_autopilot, shipped_autopilots
from verify.data.vehicle import load_vehicle, shipped_vehicles

NUMBERS = {"pid": 1, "mellinger": 2, "lee": 5}
"""`stabilizer.controller` of each that the firmware has and simulation too. For any other Mellinger's is set, which crazyswarm2 takes for
trajectories; exports say then that it was not rehearsed."""
KALMAN = 2
"""`stabilizer.estimator`."""
_OF_CONTROLLERS = {"ctrlMel": 2, "ctrlLee": 5}
"""Groups of parameters that only one controller reads, and its number."""
_MELLINGER = {
    "kp": "position",
    "kd": "velocity",
    "ki": "integral",
    "i_range": "integral_limit",
    "kR": "attitude",
    "kw": "rate",
    "ki_m": "attitude_integral",
    "i_range_m": "attitude_integral_limit",
}
"""Parameters of `ctrlMel`, each with `_xy` and `_z`, and the gains that they are."""


def _firmware_tables(vehicle: Vehicle) -> list[Autopilot]:
    """Return the tables that firmware of a vehicle has by itself: its own where it is shipped, else all."""
    if vehicle.name in shipped_vehicles() and (own := load_vehicle(vehicle.name).autopilot) is not None:
        return [own]
    return [load_autopilot(name) for name in shipped_autopilots()]


def own_gains(vehicle: Vehicle) -> dict[str, float]:
    """Return the parameters of `ctrlMel` that make gains of a profile's own fly; nothing where they are the firmware's.

    Args:
        vehicle: Its profile.
    """
    autopilot = autopilot_of_vehicle(vehicle)
    if controller_name(vehicle) != "mellinger" or autopilot.mellinger in [own.mellinger for own in _firmware_tables(vehicle)]:
        return {}
    gains = autopilot.gains(MellingerGains)
    found = {f"{key}_{axis}": getattr(gains, name)[k] for key, name in _MELLINGER.items() for axis, k in (("xy", 0), ("z", 2))}
    return {**found, "kd_omega_rp": gains.rate_change[0]}


def cannot_fly(vehicle: Vehicle) -> str:
    """Return which numbers of a vehicle's autopilot no parameter sets on board, in a sentence; empty where it can fly as it was simulated.

    Args:
        vehicle: Its profile.
    """
    autopilot, controller, tables = autopilot_of_vehicle(vehicle), controller_name(vehicle), _firmware_tables(vehicle)
    other: list[str] = []
    if controller in ("pid", "lee") and getattr(autopilot, controller) not in [getattr(own, controller) for own in tables]:
        other.append(f"gains of `{controller}`")
    if own_gains(vehicle):
        gains = autopilot.gains(MellingerGains)
        other += [
            f"`{name}` along x and y" for name in (*_MELLINGER.values(), "rate_change") if len({*getattr(gains, name)[:2]}) > 1
        ]
        other += ["`rate_change` about z"] if gains.rate_change[2] else []
        limits = [own.mellinger.moment_limit for own in tables if own.mellinger is not None]
        other += [] if gains.moment_limit in limits else ["`moment_limit`"]
    settable = {"position_noise": 1.0, "attitude_noise": 1.0}
    if autopilot.ekf.changed(**settable) not in [own.ekf.changed(**settable) for own in tables]:
        other.append("numbers of `ekf` other than `position_noise` and `attitude_noise`")
    return f"its autopilot has {', '.join(other)} that no parameter sets on board" if other else ""


def firmware_parameters(vehicle: Vehicle, mass: float | None = None) -> dict[str, dict[str, float]]:
    """Return the firmware's parameters for a vehicle, by group and name.

    Args:
        vehicle: Its profile: mass, controller and autopilot.
        mass: kg as it was weighed; None takes the profile's.
    """
    autopilot, flown = autopilot_of_vehicle(vehicle), vehicle.mass if mass is None else mass
    return {
        "stabilizer": {"estimator": KALMAN, "controller": NUMBERS.get(controller_name(vehicle), NUMBERS["mellinger"])},
        "ctrlMel": {"mass": flown, "massThrust": autopilot.gains(MellingerGains).thrust_to_pwm, **own_gains(vehicle)},
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
