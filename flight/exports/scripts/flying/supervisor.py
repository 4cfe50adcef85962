"""Reports of a Crazyflie's supervisor, battery and estimator, as its firmware has them: for the live link and the exported script. Standard library only; copied into exports."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from enum import IntFlag

from .checks import Health, battery_left, no_battery

LOW_POWER = 3  # `pm.state` of an empty battery; higher ones switch off
ENOUGH = 5  # reports of variances by which the estimator is known


class State(IntFlag):
    """Bits of `supervisor.info`."""

    CAN_ARM = 1 << 0
    ARMED = 1 << 1
    CAN_FLY = 1 << 3
    FLYING = 1 << 4
    TUMBLED = 1 << 5
    LOCKED = 1 << 6
    CRASHED = 1 << 7
    ACTIVE = 1 << 8
    FINISHED = 1 << 9


_BLOCKED = State.TUMBLED | State.LOCKED | State.CRASHED


def health_of(state: State | None, settled: bool | None, charge: float | None, endurance: float | None) -> Health:
    """Return what a vehicle says of itself.

    Args:
        state: What its supervisor last said; None where it says nothing.
        settled: Whether its estimator has settled; None where it does not say.
        charge: Share of its battery's charge; None where it does not say.
        endurance: s that a full battery lasts; None where its profile does not say.
    """
    why = {
        "ready": "no `status` is reported of it",
        "estimator": "its variances are not reported",
        "battery": no_battery(charge),
    }
    lasts = battery_left(charge, endurance)
    if state is None:
        return Health(None, settled, lasts, why=why)
    blocked, able = state & _BLOCKED, state & (State.CAN_FLY | State.CAN_ARM)
    fault = "has tumbled, or is locked" if blocked else ""
    return Health(bool(able and not blocked), settled, lasts, State.FLYING in state, fault, why)


def charge_of(power: float, level: float | None) -> float | None:
    """Return the share of a battery's charge.

    Args:
        power: `pm.state`.
        level: `pm.batteryLevel`, percent; None where it is not reported.
    """
    return 0.0 if power >= LOW_POWER else None if level is None else level / 100.0


def is_settled(variances: Collection[Sequence[float]], limits: Mapping[str, float]) -> bool | None:
    """Tell whether the variances of an estimated position stay as they are; None where none was reported.

    Args:
        variances: The last ones, m^2 by axis.
        limits: The numbers: `settled`.
    """
    if not variances:
        return None
    steady = (max(axis) - min(axis) < limits["settled"] for axis in zip(*variances, strict=True))
    return len(variances) >= ENOUGH and all(steady)
