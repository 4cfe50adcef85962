"""Plans with counts: from numbers of robots to what each of them does, and who waits for whom."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ltlplan.logic.automaton import Automaton
from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.search.counts.capacities import most_that_show
from ltlplan.search.counts.classes import Classes, ClassMove, Crowd, numbers_of
from ltlplan.search.counts.marks import Marks, Sums
from ltlplan.search.counts.moves import Move, RobotMoves
from ltlplan.search.counts.numbers import Course, NumberSearch, UsedUp
from ltlplan.search.counts.stages import Turn, stages
from ltlplan.systems.transition_systems import Node, TransitionSystem
from verify.data import Formula, InternalError
from verify.data.language.counting import Atom

_TIES = 1e-6  # m
_STATES_OUTSIDE = 8_000
"""Of the search whether a plan would be cheaper in which robots stay where nobody can be waited for, which is seldom so."""

_Class = tuple[object, ...]
"""What robots at rest have in common that can do the same and are not told apart."""
_Way = tuple[Node, bool, tuple[Sums, ...]]
"""A move's target, whether the robot stays there, and what it shows on the way."""


@dataclass(frozen=True, slots=True)
class CountedPlan:
    """What robots do, and who waits for whom.

    Attributes:
        paths: Nodes of each robot's system.
        turns: In an order that does what is asked: (robot, places in its path before and after that move).
        stages: Turns, by index, that are made at the same time; those of one stage begin when all of the one before have ended.
        cost: Sum over the robots.
        bound: No plan that makes one move after another costs less.
        reached: States that were seen.
    """

    paths: tuple[tuple[int, ...], ...]
    turns: tuple[tuple[int, int, int], ...]
    stages: tuple[tuple[int, ...], ...]
    cost: float
    bound: float
    reached: int


def plan_counts(
    systems: Sequence[TransitionSystem],
    kinds: Sequence[str],
    automata: Sequence[Automaton],
    atoms: dict[str, Atom],
    budget: Budget,
    *,
    rooms: Mapping[str, int] | None = None,
) -> CountedPlan | None:
    """Return a cheapest plan for a formula that counts robots, or None where there is none.

    Small regions hold no more robots at rest than they have room for. Where no such plan is found, and it is not sure either that there
    is none, the plan is one without regard to that: refinement may find places where they were not expected.

    Args:
        systems: One for each robot.
        kinds: For each robot a key that robots have in common which can do the same.
        automata: One for each conjunct; their propositions are names and the texts of `atoms`.
        atoms: The formula's propositions of the whole team.
        budget: Bounds on the search.
        rooms: How many robots small regions hold; others hold all.

    Raises:
        TooLarge: The budget was used up before any plan was found.
    """
    marks, anywhere = Marks(automata, atoms), _Rooms({}, passing=False)
    found = None
    with suppress(TooLarge):
        found = _plan(systems, kinds, marks, budget, anywhere, skips=True, leaves=not rooms)
        if found is None or not rooms or _ways_are_free(systems, found, rooms):
            return found
    for passing in (True, False) if rooms else ():
        try:
            roomy = _plan(systems, kinds, marks, budget, _Rooms(rooms or {}, passing))
        except TooLarge:
            continue
        if roomy is not None:  # where nobody may pass another one, a cheaper plan is not ruled out
            return roomy if passing else replace(roomy, bound=0.0 if found is None else found.bound)
    if rooms and not _any_course(systems, kinds, Marks(automata, atoms, _between(systems, atoms, rooms)), budget):
        return None
    return found or _plan(systems, kinds, marks, budget, anywhere)


def _plan(
    systems: Sequence[TransitionSystem],
    kinds: Sequence[str],
    marks: Marks,
    budget: Budget,
    rooms: _Rooms,
    *,
    skips: bool = False,
    leaves: bool = True,
) -> CountedPlan | None:  # as many as a search has, and which of all moves and ends there are
    """Return a cheapest plan in which no small region is too full where robots wait for others; None where none was found."""
    for stays in (False, True):  # to stay for good where nobody can be waited for is seldom needed, and doubles the places
        task = _Task(systems, kinds, marks, stays=stays, skips=skips)
        course = task.search(rooms).cheapest(budget)
        if course is None:
            continue
        plan = task.plan(course)
        if not _has_room(systems, plan, rooms.most):
            return None
        if stays:
            return plan
        leaving = _Task(systems, kinds, marks, stays=True, skips=skips)
        return _beside_leaving(plan, leaving, rooms, allowed=leaves and not rooms.most)
    return None


def _beside_leaving(plan: CountedPlan, task: _Task, rooms: _Rooms, *, allowed: bool) -> CountedPlan:
    """Return a plan whose bound holds of plans, too, in which robots end just outside regions or where they act, or such a one that is cheaper.

    One in which nobody waits for another, and no region is too small, that is: where to hover outside regions beside others, and to
    wait there, is not planned. `task` has these plans; they are taken where that is `allowed`.
    """
    try:
        other = task.search(rooms).cheapest(Budget(states=min(_STATES_OUTSIDE, 4 * plan.reached + 1_000)))
    except UsedUp as spent:
        return replace(plan, bound=min(plan.bound, spent.bound))
    if other is None:
        return plan
    if allowed and other.cost < plan.bound - _TIES:
        cheaper = task.plan(other)
        if cheaper.cost < plan.cost - _TIES and len(cheaper.stages) == 1:
            return cheaper
    return replace(plan, bound=min(plan.bound, other.bound))


def _any_course(systems: Sequence[TransitionSystem], kinds: Sequence[str], marks: Marks, budget: Budget) -> bool:
    """Tell whether there may be a course, whatever it costs."""
    try:
        return _plan(systems, kinds, marks, budget, _Rooms({}, passing=False), skips=True) is not None
    except TooLarge:
        return True


def _between(
    systems: Sequence[TransitionSystem], atoms: dict[str, Atom], rooms: Mapping[str, int]
) -> dict[str, tuple[int, int]]:
    """Return for what is counted, by its text, how few and how many robots show it at once, as far as small regions say so."""
    found: dict[str, tuple[int, int]] = {}
    for counted in (atom.counted for atom in atoms.values() if not atom.robot):
        shown, not_shown = (most_that_show(asked, systems, rooms) for asked in (counted, Formula("!", (counted,))))
        few = 0 if not_shown is None else max(0, len(systems) - not_shown[0])
        found[str(counted)] = few, len(systems) if shown is None else shown[0]
    return found


def _has_room(systems: Sequence[TransitionSystem], plan: CountedPlan, rooms: Mapping[str, int]) -> bool:
    """Tell whether small regions hold all robots that rest in them between two stages, and at the end."""
    at = [path[0] for path in plan.paths]
    for stage in plan.stages if rooms else ():
        for robot, _, after in (plan.turns[turn] for turn in stage):
            at[robot] = plan.paths[robot][after - 1]
        resting = Counter(region for system, node in zip(systems, at, strict=True) for region in system.nodes[node].regions)
        if any(resting[region] > most for region, most in rooms.items()):
            return False
    return True


def _ways_are_free(systems: Sequence[TransitionSystem], plan: CountedPlan, rooms: Mapping[str, int]) -> bool:
    """Tell whether small regions hold all robots that rest in them, and nobody flies through one that those who wait fill."""
    at = [path[0] for path in plan.paths]
    for stage in plan.stages:
        moving = {plan.turns[turn][0] for turn in stage}
        waiting = Counter(
            region for robot, node in enumerate(at) if robot not in moving for region in systems[robot].nodes[node].regions
        )
        for robot, before, after in (plan.turns[turn] for turn in stage):
            on_the_way = {region for node in plan.paths[robot][before:after] for region in systems[robot].nodes[node].regions}
            if any(waiting[region] >= rooms[region] for region in on_the_way & rooms.keys()):
                return False
            at[robot] = plan.paths[robot][after - 1]
    return _has_room(systems, plan, rooms)


@dataclass(frozen=True, slots=True)
class _Rooms:
    """What small regions hold, and whether one robot may come to a full one while another one leaves it."""

    most: Mapping[str, int]
    passing: bool


class _Task:
    """The robots' moves, put into classes."""

    def __init__(
        self, systems: Sequence[TransitionSystem], kinds: Sequence[str], marks: Marks, *, stays: bool, skips: bool
    ) -> None:
        self.systems, self.marks = tuple(systems), marks
        self.robots = [RobotMoves(system, partial(marks.of, system.robot), stays=stays, skips=skips) for system in systems]
        self.kinds = [
            kind if system.robot not in marks.named else f"{kind} {system.robot}"
            for kind, system in zip(kinds, systems, strict=True)
        ]
        self.index: list[dict[Node, int]] = [{node: i for i, node in enumerate(system.nodes)} for system in systems]
        self.classes: list[_Class] = []
        self.member: list[tuple[int, int]] = []  # of each class a robot and a node of it
        self.stays: list[bool] = []
        self._numbers: dict[_Class, int] = {}
        self.start = [self._class(robot, system.initial) for robot, system in enumerate(systems)]

    def _class(self, robot: int, node: int, *, last: bool = False) -> int:
        """Return the number of the class of a robot at a node, where it may have come to stay."""
        system = self.systems[robot]
        key: _Class = (self.kinds[robot], system.nodes[node], last)
        if node == system.initial:
            ways = frozenset(self._way(robot, move) for move in self.robots[robot].of(node))
            key = self.kinds[robot], system.labels[node], ways, self.robots[robot].ends(node)
        found = self._numbers.get(key)
        if found is None:
            found = self._numbers[key] = len(self.classes)
            self.classes.append(key)
            self.member.append((robot, node))
            self.stays.append(last)
        return found

    def _way(self, robot: int, move: Move) -> _Way:
        return self.systems[robot].nodes[move.target], move.last, move.shown

    def search(self, rooms: _Rooms) -> NumberSearch:
        """Return the search over all classes that can be reached."""
        costs: dict[tuple[int, object], float] = {}
        for robot, at in enumerate(self.start):
            for move in self.robots[robot].of(self.systems[robot].initial):
                key = at, self._way(robot, move)
                costs[key] = min(move.cost, costs.get(key, float("inf")))
        moves: list[list[ClassMove]] = []
        for number, (robot, node) in enumerate(self.member):  # grows while it is walked
            found: list[ClassMove] = []
            for move in () if self.stays[number] else self.robots[robot].of(node):
                key = self._way(robot, move)
                marks = move.shown or (self._marks(robot, move.target),)
                cost = costs.get((number, key), move.cost)
                found.append(ClassMove(number, self._class(robot, move.target, last=move.last), marks, cost, key))
            moves.append(found)
        resting = [self._marks(robot, node) for robot, node in self.member]
        ends = [self.robots[robot].ends(node) for robot, node in self.member]
        within = {
            region: frozenset(
                number for number, (robot, node) in enumerate(self.member) if region in self.systems[robot].nodes[node].regions
            )
            for region in rooms.most
        }
        crowds = tuple(Crowd(within[region], most, rooms.passing) for region, most in rooms.most.items())
        begin = numbers_of(self.start, len(self.classes))
        return NumberSearch(Classes(self.marks, tuple(resting), tuple(ends), tuple(map(tuple, moves)), begin, crowds))

    def _marks(self, robot: int, node: int) -> Sums:
        return self.robots[robot].marks[node]

    def plan(self, course: Course) -> CountedPlan:
        """Return what each robot does in a course, and the stages.

        Raises:
            InternalError: The course does not do what is asked: a bug of ours.
        """
        who = self._who(course)
        paths = [[system.initial] for system in self.systems]
        turns: list[Turn] = []
        places: list[tuple[int, int, int]] = []
        cost = 0.0
        for robot, step in zip(who, course.moves, strict=True):
            path, at = paths[robot], paths[robot][-1]
            move = next(m for m in self.robots[robot].of(at) if self._way(robot, m) == step.key)
            before = len(path)
            path += move.path
            places.append((robot, before, len(path)))
            cost += move.cost
            turns.append(Turn(robot, (self._marks(robot, at), *step.marks)))
        begin = [self._marks(robot, system.initial) for robot, system in enumerate(self.systems)]
        together = stages(self.marks, begin, turns)
        if together is None:
            raise InternalError("The words of a plan with counts do not keep the formula. This is a bug of ltlplan's.")
        return CountedPlan(
            tuple(map(tuple, paths)),
            tuple(places),
            tuple(map(tuple, together)),
            cost,
            course.bound,
            course.reached,
        )

    def _who(self, course: Course) -> list[int]:
        """Return which robot makes each move: first moves from starts go to robots at the least cost, all others in turn."""
        waiting: dict[int, deque[int]] = {}
        roles: list[tuple[int, ClassMove]] = []  # of each role its start's class and first move
        made: list[int] = []
        started = [0] * len(self.classes)
        for move in course.moves:
            queue = waiting.setdefault(move.source, deque())
            if queue:
                role = queue.popleft()
            else:
                role = len(roles)
                roles.append((move.source, move))
                started[move.source] += 1
            made.append(role)
            waiting.setdefault(move.target, deque()).append(role)
        from scipy.optimize import linear_sum_assignment  # here: it takes long to load, and few plans need it

        robot_of: dict[int, int] = {}
        for at in sorted({place for place, _ in roles}):
            mine = [robot for robot, place in enumerate(self.start) if place == at]
            asked = [role for role, (place, _) in enumerate(roles) if place == at]
            prices = np.array([[self._price(robot, roles[role][1]) for role in asked] for robot in mine])
            for row, column in zip(*linear_sum_assignment(prices), strict=True):
                robot_of[asked[column]] = mine[row]
        return [robot_of[role] for role in made]

    def _price(self, robot: int, step: ClassMove) -> float:
        moves = self.robots[robot].of(self.systems[robot].initial)
        return min(move.cost for move in moves if self._way(robot, move) == step.key)
