"""Reports of a Crazyflie's supervisor, battery and estimator, as its firmware has them: for the live link and the exported script. Standard library only; copied into exports."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from enum import IntFlag

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


def ready(state: State | None) -> bool | None:
    """Tell whether a vehicle would take off, or can be armed; None where its supervisor says nothing."""
    return None if state is None else not state & _BLOCKED and bool(state & (State.CAN_FLY | State.CAN_ARM))


def flying(state: State | None) -> bool | None:
    """Tell whether a vehicle says that it flies; None where its supervisor says nothing."""
    return None if state is None else State.FLYING in state


def fault_of(state: State | None) -> str:
    """Return that a supervisor blocks its vehicle, as of it alone; empty where it does not, or says nothing."""
    return "has tumbled, or is locked" if state is not None and state & _BLOCKED else ""


def charge(power: float, level: float | None) -> float | None:
    """Return the share of a battery's charge.

    Args:
        power: `pm.state`.
        level: `pm.batteryLevel`, percent; None where it is not reported.
    """
    return 0.0 if power >= LOW_POWER else None if level is None else level / 100.0


def settled(variances: Collection[Sequence[float]], limits: Mapping[str, float]) -> bool | None:
    """Tell whether the variances of an estimated position stay as they are; None where none was reported.

    Args:
        variances: The last ones, m^2 by axis.
        limits: The numbers: `settled`.
    """
    if not variances:
        return None
    steady = (max(axis) - min(axis) < limits["settled"] for axis in zip(*variances, strict=True))
    return len(variances) >= ENOUGH and all(steady)
