"""Requirements that several targets have on a flight before they write it."""

from __future__ import annotations

from collections.abc import Iterable

from flight.exports.target import Request
from verify.data import DoesNotFit, Mission, Trajectory
from verify.data.trajectory import PIECES
from verify.data.vehicle import LIGHT


def require_crazyflie(request: Request) -> None:
    """Reject a vehicle that is no Crazyflie by the size of its numbers.

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
    """Reject numbers that the vehicle's float32 would change after they were certified.

    Raises:
        DoesNotFit: As said.
    """
    if not path.is_float32:
        raise DoesNotFit(f"{name}'s trajectory does not survive the vehicle's float32; round it before it is certified.")


def held_at_once(mission: Mission, name: str) -> int:
    """Return how many uncompressed pieces a robot's trajectory memory holds, or fewer where the mission says so (`pieces`).

    Args:
        mission: Says what it flies.
        name: The robot's.
    """
    return min(PIECES, mission.limits_of(name).pieces or PIECES)


def require_held(mission: Mission, name: str, path: Trajectory, part: str = "") -> None:
    """Reject more pieces than are held at once.

    Args:
        mission: Says what the robot flies.
        name: The robot's.
        path: What is uploaded at once.
        part: What its file is called behind the robot's name.

    Raises:
        DoesNotFit: As said.
    """
    held = held_at_once(mission, name)
    if len(path) <= held:
        return
    holds = f"{name}{part} has {len(path)} pieces; the vehicle's memory holds {held}"
    if mission.timed_parts:
        raise DoesNotFit(f"{holds}. Bounds in seconds count no pause between parts, so that it is one: stream it (px4, ros2).")
    if held == PIECES:
        raise DoesNotFit(
            f"{holds}. Plan it for that many (`pieces` of the vehicle's profile or of `limits`), so that it is cut into parts, or stream it."
        )
    raise DoesNotFit(f"{holds} by the mission's `pieces`. Stream it (px4, ros2), or write how many pieces it does hold.")
