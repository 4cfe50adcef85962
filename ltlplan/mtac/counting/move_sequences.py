"""Courses of a team whose formula counts robots or names them: moves one after another, into which visits are put and taken out.

A course comes from the exact search over numbers of robots. A visit that one more task asks for is put between two moves of one robot,
which then flies on from there to where it would have flown; the others do what they did, when they did it. Whether that does what is asked is
read off the team's letters again, so nothing is lost that counts ask for. In which stages it is flown, and who waits for whom, is decided of the
finished course.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

from ltlplan.search.counting.counted_plans import CountedPlan, Flown, in_stages, keep
from ltlplan.search.counting.counting_propositions import Marks, Sums
from ltlplan.search.counting.moves import RobotMoves
from ltlplan.search.itineraries import path_cost
from ltlplan.search.label_setting import BestFirst
from ltlplan.search.memoization import memoized
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Letter

_NEAREST = 3
"""Places that are tried for a visit, between two moves of one robot."""


Course = tuple[Flown, ...]


class CountedCourses:
    """The courses of a team.

    Attributes:
        systems: One for each robot.
        marks: What the whole formula sees.
    """

    def __init__(self, systems: Sequence[TransitionSystem], marks: Marks, asked: Marks) -> None:
        """Look at a team.

        Args:
            systems: One for each robot.
            marks: What the whole formula sees.
            asked: What its conjuncts see that no visit is put in for; these a course has to keep all the time.
        """
        self.systems, self.marks, self._asked = tuple(systems), marks, asked
        self._robots = [RobotMoves(s, partial(marks.of, s.robot), stays=False, skips=False) for s in systems]

    def of(self, plan: CountedPlan) -> Course:
        """Return the course of a plan.

        Args:
            plan: From the search over numbers of robots.
        """
        ways = [(robot, plan.paths[robot], before, after) for robot, before, after in plan.turns]
        return tuple(
            self._flown(robot, path[before:after], path_cost(self.systems[robot], path[before - 1 : after]))
            for robot, path, before, after in ways
        )

    def costs(self, course: Course) -> list[float]:
        """Return what each robot's moves cost."""
        return [sum((step.cost for step in course if step.robot == robot), 0.0) for robot in range(len(self.systems))]

    def insertions(self, course: Course, task: int, letters: frozenset[Letter]) -> Iterator[tuple[float, int, Course]]:
        """Yield courses with one more visit: what it adds to the robot's cost, the robot, and the course, whether or not it does what is asked.

        Args:
            course: So far.
            task: What the visit is for.
            letters: One of which the robot is to show.
        """
        for robot in range(len(self.systems)):
            own = [index for index, step in enumerate(course) if step.robot == robot]
            at = self.systems[robot].initial
            for index in (*own, len(course)):
                then = course[index] if index < len(course) else None
                for _, place in self._visits(robot, at, letters):
                    visit = self._way(robot, at, place, task)
                    on = None if then is None else self._way(robot, place, then.path[-1], then.task)
                    if visit is None or (then is not None and on is None):
                        continue
                    if then is None or on is None:
                        for after in dict.fromkeys(
                            (len(course), own[-1] + 1 if own else 0)
                        ):  # at the end, or as soon as it can
                            yield visit.cost, robot, (*course[:after], visit, *course[after:])
                    else:
                        yield visit.cost + on.cost - then.cost, robot, (*course[:index], visit, on, *course[index + 1 :])
                at = at if then is None else then.path[-1]

    def without(self, course: Course, task: int) -> Course | None:
        """Return a course without the visit of a task; None where its robot then finds no way on.

        Args:
            course: With the visit.
            task: What it is for.
        """
        index = next(i for i, step in enumerate(course) if step.task == task)
        robot = course[index].robot
        before = [step.path[-1] for step in course[:index] if step.robot == robot]
        at = before[-1] if before else self.systems[robot].initial
        after = next((i for i in range(index + 1, len(course)) if course[i].robot == robot), None)
        if after is None:
            return (*course[:index], *course[index + 1 :])
        on = self._way(robot, at, course[after].path[-1], course[after].task)
        return None if on is None else (*course[:index], *course[index + 1 : after], on, *course[after + 1 :])

    def keeps(self, course: Course) -> bool:
        """Tell whether a course, one move after another, does what conjuncts ask that no visit is put in for, and ends where it may."""
        ends = {step.robot: step.path[-1] for step in course}
        if not all(self._robots[robot].ends(ends.get(robot, system.initial)) for robot, system in enumerate(self.systems)):
            return False
        begin = [self._seen(robot, system.initial) for robot, system in enumerate(self.systems)]
        return keep(
            self._asked, begin, [(step.robot, tuple(map(partial(self._seen, step.robot), step.path))) for step in course]
        )

    def _seen(self, robot: int, node: int) -> Sums:
        """Return the marks that a robot makes at a node, of conjuncts that no visit is put in for."""
        return self._asked.of(self.systems[robot].robot, self.systems[robot].labels[node])

    def plan(self, course: Course, *, bound: float, reached: int) -> CountedPlan | None:
        """Return the robots' paths, in stages; None where the course, one move after another, violates the formula.

        Args:
            course: With all visits.
            bound: No plan costs less.
            reached: States that were seen.
        """
        plan = in_stages(self.systems, self.marks, course)
        return None if plan is None else replace(plan, bound=bound, reached=reached)

    def _visits(self, robot: int, at: int, letters: frozenset[Letter]) -> Iterator[tuple[float, int]]:
        """Yield the nearest places at which a robot shows one of some letters, at rest, with what the ways cost."""
        rests, labels = self._robots[robot].rests, self.systems[robot].labels
        if rests(at):
            ways = self._ways(robot, at).costs.items()
            there = ((cost, node) for node, cost in ways if labels[node] in letters and rests(node))
            yield from sorted(there)[:_NEAREST]

    @memoized
    def _way(self, robot: int, at: int, target: int, task: int | None) -> Flown | None:
        """Return the cheapest move from a node to another one; None where there is none."""
        ways = self._ways(robot, at)
        if target not in ways.costs or target == at:
            return None
        return self._flown(robot, tuple(ways.path(target)[1:]), ways.costs[target], task)

    def _flown(self, robot: int, path: tuple[int, ...], cost: float, task: int | None = None) -> Flown:
        """Return a move with what it shows."""
        marks = (self._robots[robot].marks[node] for node in path)
        return Flown(robot, path, tuple(shown for shown, _ in itertools.groupby(marks)), cost, task)

    @memoized
    def _ways(self, robot: int, at: int) -> BestFirst[int]:
        """Return the cheapest ways from a node, searched to their end."""
        return BestFirst([at], self.systems[robot].edges.__getitem__).walked()
