"""Robots in classes: robots that can do the same, and that the formula does not name, are one class wherever they rest."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np

from ltlplan.search.counting.classes import Classes, ClassMove, Crowd
from ltlplan.search.counting.counted_plans import CountedPlan, Flown, in_stages
from ltlplan.search.counting.counting_propositions import Marks, Sums
from ltlplan.search.counting.moves import Move, RobotMoves
from ltlplan.search.counting.reading import Course
from ltlplan.search.least_cost_matching import cheapest_assignment
from ltlplan.search.numbering import Numbers
from ltlplan.systems.transition_systems import Node, TransitionSystem
from verify.data import InternalError

_Class = tuple[object, ...]
"""What robots at rest have in common that can do the same and are not told apart."""
_Way = tuple[Node, bool, tuple[Sums, ...]]
"""A move's target, whether the robot stays there, and what it shows on the way."""


@dataclass(frozen=True, slots=True)
class Rooms:
    """Capacities of small regions.

    Attributes:
        most: How many robots, by region.
        passing: Whether one robot may come to a full one while another one leaves it.
    """

    most: Mapping[str, int]
    passing: bool


@dataclass(frozen=True, eq=False, slots=True)
class CountedTeam:
    """Robots of a team, and the formula required of them.

    Attributes:
        systems: One for each robot.
        kinds: For each robot a key that robots have in common which can do the same.
        marks: What the formula sees.
        rooms: Which regions are small.
        skips: Whether rests are left out of which the formula sees nothing.
        longest: Whether the dearest robot's cost counts, not the sum.
    """

    systems: tuple[TransitionSystem, ...]
    kinds: tuple[str, ...]
    marks: Marks
    rooms: Rooms
    skips: bool
    longest: bool = False


class TeamClasses:
    """The robots' moves, put into classes: as a search over numbers has them, and back from its courses to what each robot does.

    Args:
        team: Who there is.
        stays: Whether robots also rest just outside regions that they have left, and stay for good where they have acted.
        apart: Whether robots whose first moves cost them differently are distinguished; otherwise all that can do the same go at the cost
            of the nearest.
        robots: Their moves, where they are known.
    """

    def __init__(self, team: CountedTeam, *, stays: bool, apart: bool = False, robots: Sequence[RobotMoves] = ()) -> None:
        self.team, self.systems, self.marks, self._apart = team, team.systems, team.marks, apart
        self.robots = tuple(robots) or tuple(
            RobotMoves(system, partial(self.marks.of, system.robot), stays=stays, skips=team.skips) for system in team.systems
        )
        self._stays = stays
        self.kinds = [
            kind if system.robot not in self.marks.named else f"{kind} {system.robot}"
            for kind, system in zip(team.kinds, team.systems, strict=True)
        ]
        self.classes = Numbers[_Class]()
        self.member: list[tuple[int, int]] = []  # of each class a robot and a node of it
        self._last: list[bool] = []
        self.start = [self._class(robot, system.initial) for robot, system in enumerate(self.systems)]

    def _class(self, robot: int, node: int, *, last: bool = False) -> int:
        """Return the number of the class of a robot at a node, where it may have come to stay."""
        system = self.systems[robot]
        key: _Class = (self.kinds[robot], system.nodes[node], last)
        if node == system.initial:
            moves = self.robots[robot].of(node)
            ways = frozenset((self._way(robot, move), round(move.cost, 6) if self._apart else 0.0) for move in moves)
            key = self.kinds[robot], system.labels[node], ways, self.robots[robot].ends(node)
        found = self.classes[key]
        if found == len(self.member):
            self.member.append((robot, node))
            self._last.append(last)
        return found

    def _way(self, robot: int, move: Move) -> _Way:
        return self.systems[robot].nodes[move.target], move.last, move.shown

    def distinguished(self) -> TeamClasses:
        """Return the classes of robots that are distinguished by the costs of their first moves."""
        return TeamClasses(self.team, stays=self._stays, apart=True, robots=self.robots)

    def made(self) -> Classes:
        """Return all classes that can be reached."""
        costs: dict[tuple[int, object], float] = {}
        for robot, at in enumerate(self.start):
            for move in self.robots[robot].of(self.systems[robot].initial):
                key = at, self._way(robot, move)
                costs[key] = min(move.cost, costs.get(key, float("inf")))
        moves: list[list[ClassMove]] = []
        for number, (robot, node) in enumerate(self.member):  # grows while it is walked
            found: list[ClassMove] = []
            for move in () if self._last[number] else self.robots[robot].of(node):
                key = self._way(robot, move)
                marks = move.shown or (self.robots[robot].marks[move.target],)
                cost = costs.get((number, key), move.cost)
                found.append(ClassMove(number, self._class(robot, move.target, last=move.last), marks, cost, key))
            moves.append(found)
        resting = [self.robots[robot].marks[node] for robot, node in self.member]
        ends = [self.robots[robot].ends(node) for robot, node in self.member]
        within = {
            region: frozenset(
                number for number, (robot, node) in enumerate(self.member) if region in self.systems[robot].nodes[node].regions
            )
            for region in self.team.rooms.most
        }
        crowds = tuple(Crowd(within[region], most, self.team.rooms.passing) for region, most in self.team.rooms.most.items())
        begin = tuple(self.start.count(number) for number in range(len(self.classes)))
        names = (self.systems[robot].robot for robot, _ in self.member)
        owners = tuple(name if name in self.marks.named else "" for name in names)
        return Classes(self.marks, tuple(resting), tuple(ends), tuple(map(tuple, moves)), begin, owners, crowds)

    def cost(self, course: Course) -> float:
        """Return what a course costs with the robots that begin it.

        Args:
            course: Found in a search over these classes.
        """
        flown = self._flown(course)
        own = [sum(move.cost for who, move in flown if who == robot) for robot in range(len(self.systems))]
        return max(own) if self.team.longest else sum(own)

    def plan(self, course: Course) -> CountedPlan:
        """Return what each robot does in a course, and the stages.

        Args:
            course: Found in a search over these classes.

        Raises:
            InternalError: The course violates the formula: a bug of ours.
        """
        flown = self._flown(course)
        steps = [
            Flown(robot, move.path, step.marks, move.cost) for (robot, move), step in zip(flown, course.moves, strict=True)
        ]
        found = in_stages(self.systems, self.marks, steps)
        if found is None:
            raise InternalError("The words of a plan with counts do not keep the formula. This is a bug of ltlplan's.")
        return replace(
            found,
            cost=self.cost(course),
            stays=any(move.last for _, move in flown) or self._acts_again_and_rests_outside(flown),
        )

    def _acts_again_and_rests_outside(self, flown: list[tuple[int, Move]]) -> bool:
        """Tell whether some robot rests outside regions where one acts twice in a visit: no robot can wait for the first of these actions."""
        if not any(self.systems[robot].nodes[move.target].flying for robot, move in flown):
            return False
        at = [system.initial for system in self.systems]
        for robot, move in flown:
            nodes = [self.systems[robot].nodes[node] for node in (at[robot], *move.path)]
            at[robot] = move.target
            acts = [a.internal != b.internal and a.place == b.place for a, b in pairwise(nodes)]
            if sum(acts) > 1:
                return True
        return False

    def _flown(self, course: Course) -> list[tuple[int, Move]]:
        """Return each move of a course as the robot's that makes it."""
        at = [system.initial for system in self.systems]
        found: list[tuple[int, Move]] = []
        for robot, step in zip(course.robots or self._robots(course), course.moves, strict=True):
            found.append((robot, next(move for move in self.robots[robot].of(at[robot]) if self._way(robot, move) == step.key)))
            at[robot] = found[-1][1].target
        return found

    def _robots(self, course: Course) -> list[int]:
        """Return which robot makes each move: first moves from starts go to robots at the least cost, all others in turn."""
        waiting: dict[int, deque[int]] = {}
        roles: list[tuple[int, ClassMove]] = []  # of each role its start's class and first move
        made: list[int] = []
        for move in course.moves:
            queue = waiting.setdefault(move.source, deque())
            if queue:
                role = queue.popleft()
            else:
                role = len(roles)
                roles.append((move.source, move))
            made.append(role)
            waiting.setdefault(move.target, deque()).append(role)
        robot_of: dict[int, int] = {}
        for at in sorted({place for place, _ in roles}):
            mine = [robot for robot, place in enumerate(self.start) if place == at]
            asked = [role for role, (place, _) in enumerate(roles) if place == at]
            prices = np.array([[self._price(robot, roles[role][1]) for role in asked] for robot in mine])
            robot_of |= {asked[column]: mine[row] for row, column in cheapest_assignment(prices, longest=False) or ()}
        return [robot_of[role] for role in made]

    def _price(self, robot: int, step: ClassMove) -> float:
        moves = self.robots[robot].of(self.systems[robot].initial)
        return min(move.cost for move in moves if self._way(robot, move) == step.key)
