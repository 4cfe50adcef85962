"""What a run makes, from the plan to the simulated flight: the value that the pipeline returns and the report shows."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from verify.data import Mission, Plan, Trajectory

if TYPE_CHECKING:
    from flight import FlightLog
    from verify import Certificate


@dataclass(frozen=True)
class Result:
    """What a run made.

    Attributes:
        mission: What was asked, with the seed that was used.
        plan: Words, assignment, waypoints, cost.
        team: One trajectory a robot, in the mission's order; float32-exact.
        certificate: The proof.
        log: The simulated flight.
        rounds: How many times refinement ran until the certificate held.
        files: What was written, if anything.
    """

    mission: Mission
    plan: Plan
    team: dict[str, Trajectory]
    certificate: Certificate
    log: FlightLog
    rounds: int
    files: tuple[Path, ...] = ()
