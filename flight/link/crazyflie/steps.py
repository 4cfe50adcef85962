"""Steps that take a while: to reach vehicles, to set parameters, to store a flight, to arm. Each is repeated until it is confirmed, or rejected."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Collection, Mapping

from flight.exports.crazyflies.memory import Entry
from flight.exports.scripts.flying.checks import differing
from flight.exports.scripts.flying.supervisor import State
from flight.link.addresses import said_of
from flight.link.crazyflie.setting import set_on
from flight.link.crazyflie.vehicle import Vehicle
from flight.link.link import LinkLost
from flight.monitoring.thresholds import ARMING
from verify.data import DoesNotFit

SILENT = 5.0
"""s without a packet after which a vehicle that is asked for something does not answer."""
PATIENCE = 60.0
"""s that a vehicle has to tell what it has on board."""
ANSWER = 5.0
"""s that a vehicle has for anything else."""
_TOGETHER = 0.2
"""s to wait for others that fail for the same reason."""

Sleep = Callable[[float], None]


def connect(vehicles: Collection[Vehicle], values: Mapping[str, Mapping[str, float]], sleep: Sleep) -> None:
    """Reach all vehicles at once, set parameters and read them back, and have them report.

    Args:
        vehicles: Not reached yet.
        values: Parameters by robot, `group.name` to value.
        sleep: Waits for so many s.

    Raises:
        LinkLost: There is no radio, or a vehicle does not answer or lacks what is needed.
        DoesNotFit: It has no trajectory memory.
    """
    for vehicle in vehicles:
        vehicle.open()
    until(vehicles, lambda vehicle: vehicle.connected, "did not tell what it has on board", sleep, PATIENCE)
    lacking: list[str] = []
    ready: dict[str, Callable[[], bool]] = {}
    for vehicle in vehicles:
        if not vehicle.room:
            raise DoesNotFit(f"{vehicle.name} at {vehicle.uri} has no trajectory memory.")
        missing, ready[vehicle.name] = set_on(vehicle, values[vehicle.name])
        lacking += [f"{vehicle.name}'s firmware has no parameter {key}" for key in missing]
        lacking += [f"{vehicle.name}'s firmware has no log variable {key}" for key in vehicle.listen()]
    if lacking:
        raise LinkLost(f"{'; '.join(lacking)}: flash a newer one, or take another controller in the vehicle's profile.")
    until(vehicles, lambda vehicle: ready[vehicle.name](), "did not confirm its parameters", sleep, 2 * ANSWER)
    wrong = [f"{v.name} does not take a parameter: {found}" for v in vehicles for found in differing(v.board, values[v.name])]
    if wrong:
        raise LinkLost(f"{'; '.join(wrong)}: look whether the firmware takes them, and whether another program sets them.")
    until(vehicles, lambda vehicle: vehicle.reports.watched, "does not say where it is and how", sleep)


def store(vehicle: Vehicle, entry: Entry, sleep: Sleep) -> None:
    """Store a flight on board, and read its bytes from there.

    Args:
        vehicle: Reached.
        entry: The flight.
        sleep: Waits for so many s.

    Raises:
        LinkLost: The vehicle did not take it.
    """
    what = f"did not take flight {entry.trajectory_id}"
    vehicle.write(entry)
    until((vehicle,), lambda vehicle: vehicle.upload is not None, what, sleep, PATIENCE)
    if not vehicle.upload:
        raise LinkLost(f"{vehicle.name} at {vehicle.uri} {what}: what is read from its memory is not what was sent.")
    until((vehicle,), lambda vehicle: vehicle.define(entry), what, sleep)


def arm(vehicles: Collection[Vehicle], sleep: Sleep) -> None:
    """Arm those that have to be armed, and wait until all can fly.

    Args:
        vehicles: Reached.
        sleep: Waits for so many s.

    Raises:
        LinkLost: One does not arm, or its motors do not spin up.
    """
    asked: dict[str, float] = {}

    def arms(vehicle: Vehicle) -> bool:
        return armed(vehicle, asked) or State.ARMED in (vehicle.reports.state or State(0))

    until(vehicles, arms, "did not arm", sleep)
    up = "armed, but cannot fly (its motors did not spin up; look at what its supervisor says)"
    until(vehicles, lambda vehicle: armed(vehicle, asked), up, sleep, ARMING)


def armed(vehicle: Vehicle, asked: dict[str, float]) -> bool:
    """Ask a vehicle to arm that has to be armed; return whether it can fly.

    Current firmware spins motors up between being armed and being able to fly, and answers to what flies with EBUSY meanwhile.

    Args:
        vehicle: Reached.
        asked: When each was asked last, s; what is asked now is added.
    """
    state, now = vehicle.reports.state, vehicle.now()
    if state is None or State.CAN_FLY in state:
        return True
    if State.ARMED not in state and now - asked.get(vehicle.name, -math.inf) > 0.3:
        asked[vehicle.name] = now
        vehicle.arm()
    return False


def until(
    vehicles: Collection[Vehicle],
    done: Callable[[Vehicle], bool],
    otherwise: str,
    sleep: Sleep,
    patience: float = ANSWER,
) -> None:
    """Wait until something is done by all vehicles.

    Args:
        vehicles: All of them.
        done: Whether one has done it; may ask for it again.
        otherwise: What one has not done, for the message.
        sleep: Waits for so many s.
        patience: s.

    Raises:
        LinkLost: One has not done it, or cannot be reached.
    """
    end = time.monotonic() + patience
    while left := [vehicle for vehicle in vehicles if not done(vehicle)]:
        now = time.monotonic()
        if any(vehicle.failure for vehicle in left):
            time.sleep(_TOGETHER)  # what fails for one often fails for others, and is said once
            raise LinkLost(_unreachable(left))
        if silent := [vehicle for vehicle in left if vehicle.now() - vehicle.heard > SILENT]:
            which = "it on, and look at its address" if len(silent) == 1 else "them on, and look at their addresses"
            raise LinkLost(f"{said_of(_places(silent), 'does not answer')}: switch {which} and channel.")
        if now >= end:
            raise LinkLost(f"{said_of(_places(left), otherwise)} within {patience:g} s.")
        sleep(0.01)


def _places(vehicles: Collection[Vehicle]) -> list[str]:
    return [f"{vehicle.name} at {vehicle.uri}" for vehicle in vehicles]


def _unreachable(vehicles: Collection[Vehicle]) -> str:
    whom: dict[str, list[str]] = {}
    for vehicle in vehicles:
        if vehicle.failure:
            whom.setdefault(vehicle.failure, []).append(f"{vehicle.name} at {vehicle.uri}")
    return "; ".join(f"{', '.join(names)} cannot be reached: {reason}" for reason, names in whom.items()) + "."
