"""A team whose robots each have a pilot: what may be asked of it by those who share tasks, lay ways and make room to pass.

`sharing.sharing_out` and `sharing.room_to_pass` work on such a team; `sharing.team.OnlineTeam` is one that they help to lead.
"""

from __future__ import annotations

from abc import ABC
from collections.abc import Iterable, Mapping
from dataclasses import replace

from numpy.random import Generator

from ltlplan.allocation import Itinerary
from ltlplan.mtac.robot_tasks import RobotTask
from ltlplan.online_mtac.cross_entropy import OnlineSettings
from ltlplan.online_mtac.detours import WayAhead, led_around
from ltlplan.online_mtac.pilot import Pilot
from ltlplan.online_mtac.possible_states import can_finish
from ltlplan.online_mtac.team_in_flight import TeamInFlight
from verify.data import Letter, Mission, RobotPlan, Word
from verify.data.language.counting import require_plain
from verify.data.sections import Action
from verify.data.shapes.inequalities import Point

CLEARANCE = 0.08
"""m that robots keep beyond the mission's separation, for what the vehicles do not follow."""

_MIDDLES = (
    "sharing in flight hands tasks from one robot to the next, along courses through the middles of regions, where one robot waits for no other. "
    "Certified pieces are planned for such formulas: `ltlplan online MISSION --certified`, or before the flight `ltlplan run` with "
    "`planner.method: exact` or `mtac-e`"
)


class PilotedTeam(TeamInFlight[Pilot], ABC):
    """A team in flight whose robots glide along courses that they look for themselves.

    Attributes:
        rng: Source of every draw.
        every_order: Whether the words are to hold in every order of the robots, not only in some.
    """

    def __init__(self, mission: Mission, settings: OnlineSettings, *, rng: Generator, every_order: bool) -> None:
        """Prepare a team at its starts.

        Args:
            mission: What is asked.
            settings: Numbers of online cross-entropy.
            rng: Source of every draw.
            every_order: Whether the words are to hold in every order of the robots, not only in some.

        Raises:
            BadInput: The trace is infinite, there is a sequence, or N <= 1 / rho.
        """
        require_plain(mission.formula, _MIDDLES)
        super().__init__(mission, lambda asked, world, name, where: Pilot(asked, world, name, where, settings))
        self.rng, self.every_order = rng, every_order

    @property
    def distance(self) -> float:
        """M between robots' centres that they keep in flight, from where they should be."""
        return self.mission.separation + CLEARANCE

    def ahead(self) -> dict[str, tuple[Letter, ...]]:
        """Return the letters that each robot is to show."""
        return {name: pilot.ahead for name, pilot in self.pilots.items()}

    def keeps(self, ahead: Mapping[str, tuple[Letter, ...]]) -> bool:
        """Tell whether the team can finish by these letters: in some order from now on, or if asked, in every order from the start."""
        if not self.every_order:
            return can_finish(self.belief, ahead)
        return self.reader.holds_in_every_order({robot: (*self.word(robot), *letters) for robot, letters in ahead.items()})

    def plan_for(self, pilot: Pilot, task: RobotTask, around: Iterable[Point] = ()) -> RobotPlan:
        """Lay the way of one robot from where it hovers, around places where others do.

        Args:
            pilot: The robot.
            task: What it is to do.
            around: Where others hover, m.

        Raises:
            Infeasible: There is none.
        """
        does = task.itinerary(self.world) if task.moves else Itinerary((), Word((self.world.letter(pilot.where),)))
        return led_around(self.mission, WayAhead(pilot.name, pilot.where.position, does), around, self.distance)

    def rests(self, pilot: Pilot, now: float) -> bool:
        """Tell whether a robot hovers, so that it can begin another course."""
        if self.waits_to_share and pilot.entered and not pilot.stop and not pilot.way.arrived:
            return False
        return (pilot.way.arrived or pilot.way.clock.resting) and not pilot.way.course.gliding(now)

    def root(self, pilot: Pilot, now: float) -> None:
        """Let a robot's state be where it hovers, so that its next course begins without a jump."""
        x, y, z = (float(v) for v in pilot.way.course.flat(pilot.way.clock, now)[0])
        pilot.where = replace(pilot.where, position=(x, y, z))

    def acts(self, pilot: Pilot) -> Action | None:
        """Return a robot's next planned action, once it is at its region's centre."""
        return pilot.wants_to_act()
