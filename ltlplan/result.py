"""Result of a run, from the plan to the simulated flight: the value that the pipeline returns and the report shows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from verify.data import Mission, Plan, Trajectory

if TYPE_CHECKING:
    from flight import FlightLog
    from flight.rehearsal.corners import Corners
    from verify import Certificate, ProofVerdict
    from verify.aborts import AbortVerdict


@dataclass(frozen=True)
class Result:
    """Result of a run.

    Attributes:
        mission: What was asked, with the seed that was used.
        plan: Words, assignment, waypoints, cost.
        team: One trajectory a robot, in the mission's order; float32-exact.
        certificate: The proof.
        log: The simulated flight.
        rounds: How many times refinement ran until the certificate held.
        files: What was written, if anything.
        proof: What the kernel says of the files that were written.
    """

    mission: Mission
    plan: Plan
    team: dict[str, Trajectory]
    certificate: Certificate
    log: FlightLog
    rounds: int
    files: tuple[Path, ...] = ()
    proof: ProofVerdict | None = None
    _aborts: list[AbortVerdict] = field(default_factory=list["AbortVerdict"], repr=False, compare=False)
    _corners: list[Corners] = field(default_factory=list["Corners"], repr=False, compare=False)

    def __repr__(self) -> str:
        rounds = f"{self.rounds} {'round' if self.rounds == 1 else 'rounds'} of refinement"
        lines = [
            f"<Result of '{self.mission.name}', seed {self.plan.seed}, {rounds}",
            f"  {self.plan}",
            f"  {self.certificate}",
        ]
        lines += [f"  {name}: {flight}" for name, flight in self.team.items()]
        return "\n".join([*lines, f"  {self.log}", f"  {len(self.files)} files>"])

    @property
    def abort(self) -> AbortVerdict:
        """Verdict on braking to a hover from every instant; computed at its first use."""
        if not self._aborts:
            self._aborts.append(aborts_of(self.mission, self.team, self.certificate))
        return self._aborts[0]

    @property
    def corners(self) -> Corners | None:
        """Flights at the corners of what vehicles' profiles do not know (`uncertain`), at their first use; None where they say nothing of that."""
        if not any(self.mission.vehicle_of(name).uncertain is not None for name in self.mission.agents):
            return None
        if not self._corners:
            from flight.rehearsal.corners import fly_corners

            margin, seed = float(self.certificate.margin), self.plan.seed
            self._corners.append(fly_corners(self.mission, self.team, margin, seeds=(seed,)))
        return self._corners[0]


def aborts_of(mission: Mission, team: Mapping[str, Trajectory], cert: Certificate) -> AbortVerdict:
    """Check braking to a hover as vehicles do it: at the certificate's margin and clock error.

    Args:
        mission: The world, and who flies.
        team: Its trajectories.
        cert: Their certificate.
    """
    from flight.monitoring.alarm_response import braking_length
    from verify.aborts import judge_aborts

    return judge_aborts(mission, team, length=braking_length(mission), margin=cert.margin, clock_error=cert.clock_error)
