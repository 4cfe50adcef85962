"""Instants at which flights come nearest to what is asked, and how drones are spoken of."""

from __future__ import annotations

from dataclasses import dataclass

from verify.third_party.fleet import Fleet

TIGHTEST = 5
"""Instants that are told of each quantity."""


@dataclass(frozen=True, slots=True)
class Instant:
    """Instant at which one drone, or a pair, comes nearest to a limit.

    Attributes:
        robot: Name.
        other: The second drone of a pair.
        value: What is reached there, in the limit's unit.
        limit: What is asked.
        time: s.
    """

    robot: str
    other: str | None
    value: float
    limit: float
    time: float


def all_of(fleet: Fleet) -> str:
    """Return how a sentence about every drone begins.

    Args:
        fleet: The drones.
    """
    return f"All {len(fleet)} drones" if len(fleet) > 1 else f"The drone {fleet.names[0]}"
