"""The walk of MTAC-E over the team automaton, whatever a path costs (Algorithm 2).

`BeamSearch` is the frame: neighbours of a walk, hand-over where the automaton's states may be divided, the best walks of a round.
What a path costs, and when a team's tasks count as finished, is handed in: `offline` prices paths by cross-entropy.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from ltlplan.logic.automaton import DEAD
from ltlplan.logic.budget import DEFAULT_BUDGET, Budget
from ltlplan.mtac.admissible_heuristic import AdmissibleHeuristic, TeamModel
from ltlplan.mtac.agent_moves import Key, RobotTask
from ltlplan.mtac.decomposable_task import States
from verify.data import BadInput
from verify.data.progress import Progress
from verify.data.shapes.region import Hoop

Tasks = Mapping[str, RobotTask]

MAX_ROUNDS = 400
"""Visits that one walk may make in all; far beyond any plan that a beam finds."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """Options of the beam search.

    Attributes:
        width: Walks that go side by side; 1 is the printed algorithm.
        every_robot: Optimise all robots again at each state, as the paper does.
        optimality_gap: Also ask the exact search for the best assignment by straight lines, and report the gap.
    """

    width: int = 3
    every_robot: bool = False
    optimality_gap: bool = True

    def __post_init__(self) -> None:
        if self.width < 1:
            raise BadInput(f"width must be at least 1, not {self.width}.")


@dataclass(frozen=True, slots=True)
class BeamNode:
    """A walk so far: one robot is under way, others have finished or have not begun.

    Attributes:
        states: The automaton's states inside the last visited region.
        order: Robots that have flown, in order; the last one is under way.
        tasks: Their itineraries.
        costs: Every robot's cost so far.
        score: Cost of the team plus a lower bound on what is left.
        passed: States of the team automaton that the robot under way has passed; it never comes back to one.
    """

    states: States
    order: tuple[str, ...] = ()
    tasks: Mapping[str, RobotTask] = field(default_factory=dict)
    costs: Mapping[str, float] = field(default_factory=dict)
    score: float = 0.0
    passed: frozenset[tuple[States, Key]] = frozenset()

    @property
    def key(self) -> tuple[object, ...]:
        """Walks with the same key differ only in the order in which robots flew."""
        return (self.states, self.order[-1:], tuple(sorted((name, task.moves) for name, task in self.tasks.items())))


class BeamSearch:
    """A team, what it may do, and how good that is.

    Attributes:
        heuristic: What is surely left to fly, a lower bound.
    """

    def __init__(
        self,
        team: TeamModel,
        *,
        price: Callable[[str, RobotTask], float],
        holds: Callable[[Tasks], bool],
        options: Options,
    ) -> None:
        """Prepare a search.

        Args:
            team: The robots, what they may do, and the formula.
            price: Cost of a robot's whole path; infinite where there is no way.
            holds: Whether the team may stop with these tasks done (robots that are not named do nothing).
            options: How to search.
        """
        self.mission, self.world, self.starts, self.options = team.world.mission, team.world, team.starts, options
        self.reader = team.reader
        self.cost, self.holds = price, holds
        self.heuristic = AdmissibleHeuristic(team)
        self.everybody = frozenset(team.starts)

    def search(self, say: Progress, budget: Budget = DEFAULT_BUDGET) -> BeamNode | None:
        """Walk on until no walk that is left can be better than the best finished one; None where none was finished.

        Args:
            say: Receives a sentence and the share done, 0 to 1.
            budget: Where its watch asks for an end, the best finished walk so far is taken.
        """
        idle = {robot: self.cost(robot, RobotTask(where)) for robot, where in self.starts.items()}
        first = BeamNode(frozenset({self.reader.initial}), costs=idle)
        beam = [replace(first, score=self.score(idle, 0.0))]
        best, walked = None, 0
        for step in range(MAX_ROUNDS):
            walked += len(beam)
            for one in beam:
                best = min((node for node in (best, *self.finished(one)) if node is not None), key=_score, default=None)
            bound = math.inf if best is None else best.score
            beam = self.next_beam([one for one in beam if one.score < bound], bound)
            say(f"MTAC-E: {step + 1} visits shared", min(0.9, 0.1 + 0.1 * step))
            if not beam or (best is not None and budget.is_ended(walked)):
                break
        return best

    def score(self, costs: Mapping[str, float], rest: float) -> float:
        """Return the objective so far, with a lower bound on the rest in it."""
        total = sum(costs.values()) + rest
        if self.mission.planner.objective == "sum":
            return total
        return max(max(costs.values()), total / len(costs))

    def finished(self, one: BeamNode) -> Iterator[BeamNode]:
        """Yield the walk as a finished one, if all robots' words hold in every order when it stops here."""
        for leaves in self.endings(one):
            tasks = {**one.tasks, **{robot: replace(one.tasks[robot], leaves=leaves) for robot in one.order[-1:]}}
            if self.holds(tasks):
                costs = {**one.costs, **{robot: self.cost(robot, tasks[robot]) for robot in one.order[-1:]}}
                score = self.score(costs, 0.0)
                if math.isfinite(score):
                    yield replace(one, tasks=tasks, costs=costs, score=score)
                return

    def endings(self, one: BeamNode) -> Iterator[bool]:
        """Yield whether the last robot leaves its region at the end; the usual choice for that region first."""
        if not one.order:
            if self.heuristic.accepts(one.states):
                yield True
            return
        task = one.tasks[one.order[-1]]
        usual = isinstance(self.mission.all_regions[task.moves[-1].visit.region], Hoop)
        for leaves in (usual, not usual):
            if may_end(task, leaves) and self.heuristic.accepts(self.over(one.states, task, leaves)):
                yield leaves

    def over(self, states: States, task: RobotTask, leaves: bool) -> States:
        """Return the states after a robot's last visit.

        Args:
            states: The automaton's states inside the last region.
            task: What the robot has done.
            leaves: Whether it flies out of that region.
        """
        left = task.moves[-1].left
        return self.reader.read(states, [left]) if leaves and left is not None else states

    def next_beam(self, beam: Sequence[BeamNode], bound: float) -> list[BeamNode]:
        """Return the best neighbours of some walks, their paths optimised (lines 6 to 19)."""
        choices: dict[tuple[object, ...], tuple[float, BeamNode]] = {}
        for one in beam:
            for guess, choice in self.neighbours(one):
                if choice.key not in choices or guess < choices[choice.key][0]:
                    choices[choice.key] = (guess, choice)
        chosen: list[BeamNode] = []
        for guess, choice in sorted(choices.values(), key=lambda pair: pair[0]):
            full = len(chosen) >= self.options.width
            if not self.options.every_robot and (guess >= bound or (full and guess >= chosen[-1].score)):
                break  # neither this nor any later one can be among the best
            robot = choice.order[-1]
            task = choice.tasks[robot]
            cost = self.cost(robot, task)
            if not math.isfinite(cost):
                continue
            costs = {**choice.costs, robot: cost}
            rest = self.heuristic.bound(choice.states, task.end, self.everybody - set(choice.order))
            chosen.append(replace(choice, costs=costs, score=self.score(costs, rest)))
            chosen = sorted(chosen, key=_score)[: self.options.width]
        return [one for one in chosen if one.score < bound]

    def neighbours(self, one: BeamNode) -> Iterator[tuple[float, BeamNode]]:
        """Yield (lower bound, walk) for one more visit by the robot under way, or by another where D allows it."""
        states, tasks = one.states, one.tasks
        if one.order:
            robot = one.order[-1]
            yield from self.continued(one, states, robot, tasks[robot], first=False)
            usual = tasks[robot].leaves
            # the last region is left, or not, as is usual for it, unless only the other choice divides the task
            choices = [
                leaves
                for leaves in (usual, not usual)
                if may_end(tasks[robot], leaves) and self.reader.in_decomposition_set(self.over(states, tasks[robot], leaves))
            ]
            if not choices:
                return
            states = self.over(states, tasks[robot], choices[0])
            tasks = {**tasks, robot: replace(tasks[robot], leaves=choices[0])}
        for other in sorted(self.everybody - set(one.order)):
            where = self.starts[other]
            begun = self.reader.read(states, [self.world.letter(where)])
            handed = replace(one, order=(*one.order, other), tasks={**tasks, other: RobotTask(where)}, passed=frozenset())
            yield from self.continued(handed, begun, other, RobotTask(where), first=True)

    def continued(
        self, one: BeamNode, states: States, robot: str, task: RobotTask, *, first: bool
    ) -> Iterator[tuple[float, BeamNode]]:
        """Yield the walks in which a robot makes one more visit, each with a lower bound on what it comes to.

        Args:
            one: The walk so far; its last robot is the one under way.
            states: The automaton's states where that robot goes on.
            robot: Its name.
            task: What it has done so far.
            first: Whether this is its first visit.
        """
        where = task.end
        free = self.everybody - set(one.order)
        for move in self.world.moves(where, first=first):
            after = self.reader.read(states, move.shown)
            node = (after, move.key)
            if DEAD in after or node in one.passed:
                continue
            leaves = move.visit.region in self.mission.hoops and move.left is not None
            longer = replace(task, moves=(*task.moves, move), leaves=leaves)
            rest = self.heuristic.bound(after, move.end, free)
            if not math.isfinite(rest):
                continue
            known = one.costs[robot] + self.heuristic.leg(robot, where.position, move.visit.region)
            guess = self.score({**one.costs, robot: known}, rest)
            passed = frozenset({node}) if first else one.passed | {node}
            yield guess, replace(one, states=after, tasks={**one.tasks, robot: longer}, passed=passed)


def may_end(task: RobotTask, leaves: bool) -> bool:
    """Tell whether a robot may end like that: out of its last region only where it is clear what it is in then.

    Args:
        task: Its visits.
        leaves: Whether it flies out of the last region.
    """
    return not leaves or task.moves[-1].left is not None


def _score(node: BeamNode) -> float:
    return node.score
