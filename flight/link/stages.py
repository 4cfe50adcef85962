"""What is flown one after another: certified flights, each from a hover to a hover."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from flight.certified import require_certificate
from flight.model.reference import flown
from flight.monitoring.letters import planned_actions
from flight.monitoring.monitor import Monitor
from verify.certificate import Certificate
from verify.data import Plan, Trajectory, check_plan, check_trajectories
from verify.recordings.planned_paths import PlannedPath, planned_paths

FLIGHT = "flight"
"""Name of the stage that the claim is about."""


@dataclass(frozen=True, eq=False, slots=True)
class Watched:
    """A flight that can be watched.

    Attributes:
        name: What it is called.
        paths: What each robot flies, finite.
        margin: delta, m.
        monitor: Sees it from its beginning, or from when on it is watched.
    """

    name: str
    paths: Mapping[str, Trajectory]
    margin: float
    monitor: Monitor

    @property
    def duration(self) -> float:
        """S until the last robot has finished."""
        return max(path.duration for path in self.paths.values())


@dataclass(frozen=True, eq=False)
class Stage:
    """One certified flight of a team.

    Attributes:
        name: `climb`, `way`, `flight`, `landing` or another one's.
        plan: Carries the mission.
        team: As certified.
        certificate: Theirs.
    """

    name: str
    plan: Plan
    team: Mapping[str, Trajectory]
    certificate: Certificate

    def __post_init__(self) -> None:
        plan, team = check_plan(self.plan), check_trajectories(self.team)
        require_certificate(self.certificate, plan, team)
        object.__setattr__(self, "plan", plan)
        object.__setattr__(self, "team", {name: team[name] for name in plan.mission.agents})

    @property
    def margin(self) -> float:
        """delta, m."""
        return float(self.certificate.margin)

    @cached_property
    def paths(self) -> dict[str, Trajectory]:
        """What each robot flies: laps repeated."""
        return flown(self.plan.mission, self.team)

    @property
    def duration(self) -> float:
        """S until the last robot has finished."""
        return max(path.duration for path in self.paths.values())

    @cached_property
    def planned(self) -> dict[str, PlannedPath]:
        """The paths with bounds for all times."""
        return planned_paths(self.plan.mission, self.team)

    def watched(self, accuracy: float) -> Watched:
        """Return this flight as it is watched.

        Args:
            accuracy: Bound on a measured position's error, m.
        """
        monitor = Monitor(
            self.plan.mission,
            planned_actions(self.plan, self.team, self.certificate),
            margin=self.margin,
            measurement=accuracy,
            planned_acceleration=max(path.acceleration for path in self.planned.values()),
            planned=self.planned,
        )
        return Watched(self.name, self.paths, self.margin, monitor)
