"""State of a team in flight, however its robots are led: their positions, the letters shown, and the states that those led to.

`OnlineTeam` leads robots along sampled paths, `ltlplan.online.segments.certified_team.CertifiedTeam` along certified trajectories. Both see letters
change, take in changes of the world, let everybody come to rest, and then share what is left again; that much is here. How robots
are led, when one has come to rest and how what is left is shared is theirs to say.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

import numpy as np

from ltlplan.logic.automaton import DEAD
from ltlplan.mtac.agent_moves import AgentState, World
from ltlplan.mtac.decomposable_task import Reader
from ltlplan.online_mtac.formula_progression import mission_left
from ltlplan.online_mtac.possible_states import Belief, after_events, at_start
from verify.data import BadInput, Letter, LtlplanError, Mission
from verify.data.arrays import Floats
from verify.data.events import RobotJoins, RobotLeaves, WorldEvent
from verify.data.sections import Action, Agent
from verify.data.shapes.inequalities import Point, point_of

PERIOD = 0.02
"""s between two steps: 50 Hz, as in the paper's experiment."""

_OTHER_TEAM = (
    "The formula counts robots or names them, and the team is not the one that took off: what such a formula asks of a team that others left "
    "or joined is not planned in flight, so the robots hold their positions."
)


@dataclass(frozen=True, slots=True)
class Desired:
    """Setpoints of the robots now, and the state of their task.

    Attributes:
        flat: x, y, z, yaw and their derivatives up to the fourth. Shape (5, 4, robots).
        satisfied: Whether what was shown so far satisfies the formula if nobody's letter changes any more.
        finished: Whether moreover everybody has come to rest at the end of a course.
        holding: A sentence where the team holds position because nothing is left that could satisfy the formula.
        switched: Sentences about tasks that changed hands in this step, and about robots that make way for each other.
    """

    flat: Floats
    satisfied: bool
    finished: bool
    holding: str | None
    switched: tuple[str, ...] = ()


@dataclass(slots=True, eq=False)
class LocatedRobot:
    """A robot of which no more than its place is known. It changes as the robot flies.

    Attributes:
        name: The robot.
        where: Where it is in A = E x R, as it was last seen.
    """

    name: str
    where: AgentState


Robot = TypeVar("Robot", bound=LocatedRobot)


class TeamInFlight(ABC, Generic[Robot]):
    """A team in flight. It changes with each step.

    Attributes:
        mission: What is asked now; `change` replaces it.
        world: What robots can do in it.
        reader: Its formula.
        pilots: One for each robot in the air, in the mission's order.
        belief: Letters held, and the automaton's states that may have been reached.
        first_letters: What each robot showed first.
        shown: Every change of a letter: (s, {robot: letter}); replayed when the world changes.
        holding: Why the team holds position, or None.
        waits_to_share: Whether what is left is to be shared again once all have come to rest.
        steps: How many steps were done.
    """

    def __init__(self, mission: Mission, pilot: Callable[[Mission, World, str, AgentState], Robot]) -> None:
        """Place a team at its starts; nothing is shared yet.

        Args:
            mission: What is asked.
            pilot: Makes what leads one robot, from the mission, its world, the robot's name and where it is.

        Raises:
            BadInput: The trace is infinite, or there is a sequence.
        """
        if mission.spec.trace == "infinite":
            raise BadInput("online MTAC-E shares tasks that end; an infinite trace is flown from a plan, by `ltlplan run`.")
        if mission.sequence is not None:
            raise BadInput("online MTAC-E chooses what is flown; a sequence is flown exactly from a plan, by `ltlplan run`.")
        self.mission = mission
        self.world = World(mission)
        self.reader = Reader(self.world)
        self._pilot = pilot
        self.pilots = {name: pilot(mission, self.world, name, self.world.start(name)) for name in mission.agents}
        self.first_letters = {name: self.world.letter(robot.where) for name, robot in self.pilots.items()}
        self.belief: Belief = at_start(self.reader, self.first_letters, reading=mission.spec.team)
        self.shown: list[tuple[float, dict[str, Letter]]] = []
        self.holding: str | None = None
        self.waits_to_share = False
        self.steps = 0
        self._other_team = False

    # -- how robots are led --------------------------------------------------------------------------------

    @property
    @abstractmethod
    def cost(self) -> float:
        """The summed cost of what the robots fly."""

    @abstractmethod
    def allocate(self) -> None:
        """Share what is left among robots that hover; on success `holding` is None.

        Raises:
            LtlplanError: What is left cannot be shared, or not be flown.
        """

    @abstractmethod
    def step(self, now: float, positions: Mapping[str, Point]) -> Desired:
        """Do one step.

        Args:
            now: Flight time, s.
            positions: Measured position of each robot in the air, m.

        Returns:
            Where each robot in the air should be, in the mission's order.
        """

    @abstractmethod
    def rests(self, pilot: Robot, now: float) -> bool:
        """Tell whether a robot hovers, so that it can begin another course."""

    @abstractmethod
    def root(self, pilot: Robot, now: float) -> None:
        """Let a robot's state be where it hovers, so that its next course begins without a jump."""

    @abstractmethod
    def acts(self, pilot: Robot) -> Action | None:
        """Return the action that a robot is to make now, where it is in the action's region; None where it does not act."""

    # -- what was flown ------------------------------------------------------------------------------------

    def note(self, now: float, events: dict[str, Letter]) -> None:
        """Remember letters that have changed, and where they lead.

        Args:
            now: Flight time, s.
            events: The new letter of each robot that shows another one.
        """
        self.shown.append((now, events))
        self.belief = after_events(self.belief, events)

    def labelled(self, positions: Mapping[str, Point]) -> tuple[dict[str, Letter], dict[str, frozenset[str]]]:
        """Return the letters that have changed, and the regions that each robot is in; planned actions happen here."""
        events: dict[str, Letter] = {}
        inside: dict[str, frozenset[str]] = {}
        where = self.world.graph.layout.regions_at(
            np.array([positions[name] for name in self.pilots], dtype=np.float64).reshape(-1, 3)
        )
        for (name, pilot), here in zip(self.pilots.items(), where, strict=True):
            inside[name] = here
            pilot.where = replace(pilot.where, position=point_of(positions[name]))
            action = self.acts(pilot) if here else None
            if action is not None and action.at in here:
                pilot.where = replace(pilot.where, internal=action.target)
            letter = self.world.free_letter(pilot.where.internal, pilot.where.kind) | here
            if letter != self.belief.held[name]:
                events[name] = letter
        return events, inside

    def word(self, robot: str) -> list[Letter]:
        """Return the letters that a robot has shown so far."""
        return [self.first_letters[robot], *(events[robot] for _, events in self.shown if robot in events)]

    # -- changes of the world ------------------------------------------------------------------------------

    def change(self, event: WorldEvent, now: float) -> None:
        """Take note of a change in the world: progress is kept, robots wait, and what is left is shared again.

        Args:
            event: What has changed.
            now: Flight time, s.
        """
        self.mission = event.apply(self.mission)
        self.world = World(self.mission)
        self.reader = Reader(self.world)
        if isinstance(event, RobotLeaves):
            del self.pilots[event.robot]
        if isinstance(event, RobotJoins):
            where = self.world.start(event.robot)
            self.pilots[event.robot] = self._pilot(self.mission, self.world, event.robot, where)
            self.first_letters = {**self.first_letters, event.robot: self.world.letter(where)}
        # the whole flown word counts: the new automaton reads it from its beginning
        flown = (events for _, events in self.shown)
        self.belief = at_start(self.reader, self.first_letters, flown, reading=self.mission.spec.team)
        # no matter how: that is known at once, whatever else turns out when what is left is shared
        lost = ", and what was flown cannot be completed to satisfy what is asked now" if DEAD in self.belief.states else ""
        self.hold(f"at {now:.2f} s {event}{lost}")
        self._other_team = self._other_team or isinstance(event, RobotLeaves | RobotJoins)
        if self._other_team and self.mission.written.counts:
            self.give_up(_OTHER_TEAM)

    def hold(self, reason: str) -> None:
        """Let everybody wait on their courses; what is left is shared again once all have come to rest."""
        self.holding, self.waits_to_share = f"Waiting: {reason}.", True

    def give_up(self, reason: str) -> None:
        """Let everybody hover for good."""
        self.holding, self.waits_to_share = reason, False

    def share_again(self, now: float) -> None:
        """Share what is left when all robots hover; where that cannot be done they go on hovering, and say why."""
        if not self.waits_to_share or not all(self.rests(pilot, now) for pilot in self.pilots.values()):
            return
        self.waits_to_share = False
        for pilot in self.pilots.values():
            self.root(pilot, now)
        if not self.pilots:
            self.holding = "No robot is left in the air."
            return
        self.holding = None
        try:
            self.allocate()
        except LtlplanError as error:
            self.holding = self.holding or str(error)

    # -- what is left --------------------------------------------------------------------------------------

    def left(self) -> Mission:
        """Return what is left as a mission of its own, from where the robots hover, but for conjuncts that are bounded in seconds.

        Raises:
            Unsatisfiable: Nothing that comes can make the formula true.
        """
        agents = {name: self.agent(pilot) for name, pilot in self.pilots.items()}
        return mission_left(self.mission, agents, self.reader, self.first_letters, self.shown)

    def agent(self, pilot: Robot) -> Agent:
        """Return a robot as it hovers now, with what it brings from before."""
        where = pilot.where
        been = where.vertex if not where.inside and where.vertex in self.mission.all_regions else None
        return self.mission.agents[pilot.name].model_copy(
            update={"start": where.position, "internal": where.internal, "visited": been}
        )
