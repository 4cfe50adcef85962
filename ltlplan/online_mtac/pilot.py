"""One robot of an online team: what it still has to show, and when its course comes to where it shows it; and teams of such robots.

A pilot knows which letters are ahead of it, which of them cannot be interrupted once begun (a passage: entering a region,
acting there, leaving it), and when its course (`path_in_flight`) comes to the next region. Whether it may go there is the team's
decision. A `PilotedTeam` is what those work on who share tasks, lay ways and make room to pass.
"""

from __future__ import annotations

from abc import ABC
from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np
from numpy.random import Generator

from ltlplan.allocation import Itinerary
from ltlplan.mtac.agent_moves import AgentState, Move, RobotTask, World
from ltlplan.online_mtac.cross_entropy import OnlineSettings
from ltlplan.online_mtac.path_in_flight import CourseInFlight
from ltlplan.online_mtac.possible_states import can_finish
from ltlplan.online_mtac.team_in_flight import LocatedRobot, TeamInFlight
from ltlplan.paths.hoops import route_itinerary
from verify.data import Letter, Mission, RobotPlan, Word
from verify.data.language.counting import require_plain
from verify.data.sections import Action
from verify.data.shapes.inequalities import Point, point_of
from verify.data.shapes.region import Region

CLEARANCE = 0.08
"""m that robots keep beyond the mission's separation, for what the vehicles do not follow."""

_MIDDLES = (
    "sharing in flight hands tasks from one robot to the next, along courses through the middles of regions, where one robot waits for no other. "
    "Certified pieces are planned for such formulas: `ltlplan online MISSION --certified`, or before the flight `ltlplan run` with "
    "`planner.method: exact` or `mtac-e`"
)


_SPARE = 0.03
"""m beyond the distance that robots keep, by which a way leads around one that hovers."""
_NEAR = 0.05
"""m beyond the margin that a way's start keeps from what it leads around."""
_LEAST = 0.02
"""m; radius of the smallest body that is led around."""


class Pilot(LocatedRobot):
    """One robot in flight. It changes as it flies; `online_team.OnlineTeam` drives it.

    Attributes:
        name: The robot.
        where: Where it is in A = E x R, as it was last seen.
        moves: Visits that are not over, the present one first.
        shown: How many letters of the present visit it has shown.
        leaves: Whether it flies out of its last region.
        detour: Letters to show before the present visit's, after something unforeseen.
        way: What it flies, and where it is on it.
        arrivals: The regions to which its visits have led so far, in order.
        entered: Whether it is committed to the present passage.
        stop_number: Index of the present visit among the course's stops.
        stop: Whether to wait even within a passage, because its ring has moved.
    """

    def __init__(self, mission: Mission, world: World, name: str, where: AgentState, settings: OnlineSettings) -> None:
        self.world, self.name, self.where = world, name, where
        self.moves: tuple[Move, ...] = ()
        self.shown = 0
        self.leaves = True
        self.detour: tuple[Letter, ...] = ()
        self.way = CourseInFlight(mission, name, where, settings)
        self.arrivals: tuple[str, ...] = ()
        self.entered = False
        self.stop = False
        self.stop_number = 0

    @property
    def ahead(self) -> tuple[Letter, ...]:
        """The letters that it is still to show."""
        return (*self.chain, *self.rest)

    @property
    def chain(self) -> tuple[Letter, ...]:
        """The letters of the present passage that are still to come, up to and with the one of free flight after it.

        A way that leads from one region straight into the next belongs to the same passage.
        """
        later = (letter for k in range(1, self._passage) for letter in self._letters(k))
        return (*self.detour, *self._letters(0)[self.shown :], *later)

    @property
    def rest(self) -> tuple[Letter, ...]:
        """The letters of the visits after the present passage."""
        return tuple(letter for k in range(self._passage, len(self.moves)) for letter in self._letters(k))

    @property
    def done(self) -> bool:
        """Return whether it has nothing left to do but to fly its course to the end."""
        return not self.moves and not self.detour

    def _letters(self, k: int) -> tuple[Letter, ...]:
        if k >= len(self.moves):
            return ()
        move = self.moves[k]
        leaving = self.moves[k + 1].departs if k + 1 < len(self.moves) else move.left if self.leaves else None
        return move.letters if leaving is None else (*move.letters, leaving)

    @property
    def _passage(self) -> int:
        """Number of visits of the present passage."""
        return next((k for k in range(1, len(self.moves)) if self.moves[k].departs is not None), len(self.moves))

    def take(self, task: RobotTask, plan: RobotPlan, rng: Generator) -> None:
        """Begin a task along a plan that starts where the robot hovers.

        Args:
            task: The visits to make.
            plan: The way along them.
            rng: Source of the samples for the search that begins.
        """
        self.moves, self.leaves, self.shown, self.entered, self.stop = task.moves, task.leaves, 0, False, False
        starts_inside = bool(task.where.inside)
        in_place = bool(self.moves) and self.moves[0].in_place
        self.stop_number = 0 if in_place or not starts_inside else 1
        self.detour = tuple(move.departs for move in self.moves[:1] if move.departs is not None)
        self.way.take(plan, _newly(task), rng)

    def observe(self, letter: Letter, inside: frozenset[str]) -> bool:
        """Take note of a new letter; return whether it was the one that was to come next."""
        expected = self.chain[0] if self.chain else None
        self.where = self.where.seen_in(inside)
        if expected != letter:
            return False
        if self.detour:
            self.detour = self.detour[1:]
            return True
        self.shown += 1
        move = self.moves[0]
        if self.shown == len(move.letters) - len(move.visit.actions):
            self.arrivals = (*self.arrivals, move.visit.region)
        if self.shown == len(self._letters(0)):
            self.entered = self.entered and self._passage > 1
            self.moves, self.shown = self.moves[1:], 0
            self.stop_number += 1
        return True

    def surprised(self, inside: frozenset[str]) -> None:
        """Put what an unforeseen letter makes necessary before what was planned: to leave, or to come again."""
        free = self.world.free_letter(self.where.internal, self.where.kind)
        if self.moves and self.moves[0].visit.region in inside and self.shown:
            return  # it is where it should be; its letter differs by what it carries, which the plan already knows
        self.detour = (free,) if inside and (self.moves or self.leaves) else ()
        if not inside and self.shown:
            self.shown = 0  # it has left too early and comes again
        self.entered = bool(inside)

    def wants_to_act(self) -> Action | None:
        """Return the present visit's next action, once the robot is at the centre."""
        if self.detour or not self.moves:
            return None
        move = self.moves[0]
        entering = 0 if move.in_place else 1
        acted = self.shown - entering
        actions = move.visit.actions
        if not 0 <= acted < len(actions) or move.visit.region not in self.where.inside:
            return None
        if (
            self.stop_number < len(self.way.passages)
            and self.way.clock.time < self.way.passages[self.stop_number].centre - 1e-9
        ):
            return None
        return actions[acted]

    def comes_to_region(self, dt: float) -> bool:
        """Tell whether the robot must decide now whether to enter the next region: later it could not stop before it."""
        if self.entered or not self.moves or self.stop_number >= len(self.way.passages):
            return False
        if self.where.inside and self.moves[0].departs is None:  # from within a region straight into the next: when it sets out
            return not self.detour
        return self.way.clock.time + self.way.clock.run_on + 2 * dt >= self.way.passages[self.stop_number].enter


def _newly(task: RobotTask) -> tuple[frozenset[str], ...]:
    """Return, for each stop of a task, the regions that are entered on the way there."""
    inside, found = task.where.inside, [task.where.inside] if task.where.inside else []
    for move in task.moves:
        if not move.in_place:
            new = frozenset[str]()
            for regions in move.regions:
                new, inside = new | (regions - inside), regions
            found.append(new)
    return tuple(found)


class PilotedTeam(TeamInFlight[Pilot], ABC):
    """A team in flight whose robots glide along courses that they look for themselves.

    Attributes:
        rng: Source of every draw.
        every_order: Whether the words are to hold in every order of the robots, not only in some.
    """

    def __init__(self, mission: Mission, settings: OnlineSettings, *, rng: Generator, every_order: bool) -> None:
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
        return led_around(self.mission, pilot.name, pilot.where.position, does, around, self.distance)

    def rests(self, pilot: Pilot, now: float) -> bool:
        """Tell whether a robot hovers, so that it can begin another course."""
        if self.waits_to_share and pilot.entered and not pilot.stop and not pilot.way.arrived:
            return False
        return (pilot.way.arrived or pilot.way.clock.resting) and not pilot.way.course.gliding(now)

    def root(self, pilot: Pilot, now: float) -> None:
        """Let a robot's state be where it hovers, so that its next course begins without a jump."""
        pilot.where = replace(pilot.where, position=point_of(pilot.way.course.flat(pilot.way.clock, now)[0]))

    def acts(self, pilot: Pilot) -> Action | None:
        """Return a robot's next planned action, once it is at its region's centre."""
        return pilot.wants_to_act()


def way_from(mission: Mission, robot: str, start: Point, does: Itinerary, end: Point | None = None) -> RobotPlan:
    """Lay the way of a robot that hovers, as if it were alone.

    Args:
        mission: What to keep clear of.
        robot: Who flies.
        start: m, where it hovers.
        does: What it visits and shows; regions that it begins in are visits, too.
        end: m, where the robot is to hover at last; by default where the mission says.

    Raises:
        Infeasible: There is none.
    """
    changes = {"start": start} if end is None else {"start": start, "end": end}
    agent = mission.agents[robot].model_copy(update=changes)
    return route_itinerary(mission.model_copy(update={"agents": {robot: agent}}), robot, does)


# six parameters: who flies what from where, around whom
def led_around(
    mission: Mission, robot: str, start: Point, does: Itinerary, hovering: Iterable[Point], distance: float
) -> RobotPlan:
    """Lay one robot's way around places where others hover, as far from them as `distance`, or as the start allows.

    Args:
        mission: What is asked.
        robot: Who flies.
        start: m, where it hovers.
        does: What it visits and shows.
        hovering: m, where others hover.
        distance: m.

    Raises:
        Infeasible: There is no way around, or somebody hovers where the robot is to go.
    """
    bodies: dict[str, Region] = {}
    for index, place in enumerate(hovering):
        away = float(np.linalg.norm(np.array(place) - np.array(start)))
        radius = min(distance + _SPARE, away - _NEAR) - mission.margin
        if radius > _LEAST:
            bodies[f" robot {index} "] = Region(center=place, radii=(radius, radius, radius))
    return way_from(mission.model_copy(update={"regions": {**mission.regions, **bodies}}), robot, start, does)
