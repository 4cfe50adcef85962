"""One robot of an online team: what it still has to show, and when its course comes to where it shows it.

A pilot knows which letters are ahead of it, which of them cannot be interrupted once begun (a passage: entering a region,
acting there, leaving it), and when its course (`course_in_flight`) comes to the next region. Whether it may go there is the team's
decision.
"""

from __future__ import annotations

from numpy.random import Generator

from ltlplan.mtac.agent_moves import Move, World
from ltlplan.mtac.agent_states import AgentState
from ltlplan.mtac.robot_tasks import RobotTask
from ltlplan.online_mtac.cross_entropy import OnlineSettings
from ltlplan.online_mtac.path_in_flight import CourseInFlight
from verify.data import Letter, Mission, RobotPlan
from verify.data.sections import Action


class Pilot:
    """One robot in flight. It changes as it flies; `sharing.team.OnlineTeam` drives it.

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
        """Whether it has nothing left to do but to fly its course to the end."""
        return not self.moves and not self.detour

    def _letters(self, k: int) -> tuple[Letter, ...]:
        if k >= len(self.moves):
            return ()
        move = self.moves[k]
        leaving = self.moves[k + 1].departs if k + 1 < len(self.moves) else move.left if self.leaves else None
        return move.letters if leaving is None else (*move.letters, leaving)

    @property
    def _passage(self) -> int:
        """How many visits the present passage makes."""
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
