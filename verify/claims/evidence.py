"""Properties of a team's paths at every margin, computed once and on first use."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

from verify.data.language.word import Word
from verify.data.mission import Mission
from verify.data.plan import Plan, RobotPlan, Waypoint
from verify.data.trajectory import Trajectory
from verify.model_checking.timeline import Relations
from verify.motion.continuity import Jump, jumps
from verify.motion.limits import Extreme, extremes
from verify.motion.membership.bodies import Span
from verify.motion.membership.polynomials import MembershipPolynomials, membership_polynomials
from verify.motion.membership.statuses import statuses
from verify.motion.obstacles.approaches import Approach, SolidWorld
from verify.motion.passages import Clearance, HoopFrames, clearances, hoop_frames
from verify.motion.paths import TeamPaths, read_team
from verify.motion.regions import relations
from verify.motion.separation import MinimumDistance, PairwiseDistances, minimum_distances, pairwise_distances, walls
from verify.motion.shifted_distances import ShiftedDistances


@dataclass(frozen=True, eq=False)
class Evidence:
    """Properties of a team's paths at every margin, computed on first use.

    Attributes:
        plan: What was planned; carries the mission.
        paths: What is flown.
    """

    plan: Plan
    paths: TeamPaths

    @classmethod
    def of(cls, plan: Plan, team: Mapping[str, Trajectory]) -> Evidence:
        """Read a team's trajectories."""
        return cls(plan, read_team(plan.mission, team))

    @classmethod
    def unplanned(cls, world: Mission, team: Mapping[str, Trajectory]) -> Evidence:
        """Read trajectories for which nothing was planned; the mission's agents are those that fly, with their starts."""
        word = Word((frozenset(),))
        idle = {
            name: RobotPlan(word=word, waypoints=(Waypoint(position=agent.start, role="start"),), times=(0.0,))
            for name, agent in world.agents.items()
        }
        return cls(Plan(mission=world, robots=idle), read_team(world, team))

    @cached_property
    def membership(self) -> MembershipPolynomials:
        """Membership polynomials."""
        return membership_polynomials(self.paths)

    @cached_property
    def nominal(self) -> dict[str, dict[str, tuple[Span, ...]]]:
        """Spans of the nominal paths themselves, for each robot and region."""
        return statuses(self.membership, Fraction(0))

    @cached_property
    def relations(self) -> Relations:
        """Proved relations of the regions."""
        return relations(self.plan.mission)

    @cached_property
    def frames(self) -> HoopFrames:
        """Paths as seen from the hoops."""
        return hoop_frames(self.paths)

    @cached_property
    def rims(self) -> list[Clearance]:
        """Nearest approach to each rim."""
        return clearances(self.frames)

    @cached_property
    def solids(self) -> SolidWorld:
        """The paths and what is solid around them."""
        return SolidWorld.of(self.paths)

    @cached_property
    def approaches(self) -> dict[str, tuple[Approach, ...]]:
        """Nearest approach of each robot to what is solid, and to all that it comes nearer to than the mission's margin allows."""
        mission = self.plan.mission
        return self.solids.approaches({robot: mission.vehicle_of(robot).radius + mission.margin for robot in self.paths.robots})

    @cached_property
    def walls(self) -> list[MinimumDistance]:
        """Nearest approach to the walls."""
        return walls(self.paths)

    @cached_property
    def pairwise_distances(self) -> PairwiseDistances:
        """Squared distances of all pairs."""
        return pairwise_distances(self.paths)

    @cached_property
    def minimum_distances(self) -> list[MinimumDistance]:
        """Nearest approach of each pair."""
        return minimum_distances(self.pairwise_distances)

    @cached_property
    def shifted_distances(self) -> ShiftedDistances:
        """Nearest approaches of pairs whose clocks differ."""
        return ShiftedDistances(self.pairwise_distances)

    @cached_property
    def extremes(self) -> list[Extreme]:
        """Extremes of all limited quantities."""
        return extremes(self.paths)

    @cached_property
    def jumps(self) -> list[Jump]:
        """Greatest jump of each robot."""
        return jumps(self.paths)
