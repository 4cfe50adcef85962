"""What several targets ask of a flight before they write it."""

from __future__ import annotations

from collections.abc import Iterable

from flight.exports.target import Request
from verify.data import DoesNotFit, Mission, Trajectory
from verify.data.vehicle import LIGHT


def require_crazyflie(request: Request) -> None:
    """Refuse a vehicle that is no Crazyflie by the size of its numbers.

    Raises:
        DoesNotFit: It weighs more than any Crazyflie can lift.
    """
    mission, light = request.mission, crazyflies(request.mission, request.team)
    for name in request.team:
        if name not in light:
            vehicle = mission.vehicle_of(name)
            who = "" if mission.of_one_kind else f"{name} flies another vehicle: "
            hint = f" Write {', '.join(light)} by `robots` (`--robots {','.join(light)}`)." if light else ""
            raise DoesNotFit(
                f"{who}the certificate is for '{vehicle.name}' of {vehicle.mass:g} kg, which is no Crazyflie.{hint}"
            )


def crazyflies(mission: Mission, robots: Iterable[str]) -> tuple[str, ...]:
    """Return those of some robots that may be Crazyflies by what they weigh.

    Args:
        mission: Says what they fly.
        robots: Their names.
    """
    return tuple(name for name in robots if mission.vehicle_of(name).mass <= LIGHT)


def require_float32(name: str, path: Trajectory) -> None:
    """Refuse numbers that the vehicle's float32 would change after they were certified.

    Raises:
        DoesNotFit: As said.
    """
    if not path.is_float32:
        raise DoesNotFit(f"{name}'s trajectory does not survive the vehicle's float32; round it before it is certified.")
