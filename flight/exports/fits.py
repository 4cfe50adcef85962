"""What several targets ask of a flight before they write it."""

from __future__ import annotations

from flight.exports.target import Request
from verify.data import DoesNotFit, Trajectory


def require_crazyflie(request: Request) -> None:
    """Refuse a vehicle that is no Crazyflie by the size of its numbers.

    Raises:
        DoesNotFit: It weighs more than any Crazyflie can lift.
    """
    vehicles = {name: request.mission.vehicle_of(name) for name in request.team}
    heavy = {name: vehicle for name, vehicle in vehicles.items() if vehicle.mass > 0.1}
    for name, vehicle in heavy.items():
        who = "" if request.mission.of_one_kind else f"{name} flies another vehicle: "
        hint = f" Write {', '.join(vehicles.keys() - heavy.keys())} by `robots`." if len(heavy) < len(vehicles) else ""
        raise DoesNotFit(f"{who}the certificate is for '{vehicle.name}' of {vehicle.mass:g} kg, which is no Crazyflie.{hint}")


def require_float32(name: str, path: Trajectory) -> None:
    """Refuse numbers that the vehicle's float32 would change after they were certified.

    Raises:
        DoesNotFit: As said.
    """
    if not path.is_float32:
        raise DoesNotFit(f"{name}'s trajectory does not survive the vehicle's float32; round it before it is certified.")
