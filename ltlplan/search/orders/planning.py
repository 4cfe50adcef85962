"""Plans that hold under precedences between events, where none holds in every order of the robots, by the sum of costs or the robot with the highest.

First a cheapest course of events is looked for all of whose team words satisfy the formula; where there is none, no words and no
precedences do. Then few of the precedences of that course are kept, so that robots wait for each other only where they must.

Smaller systems are asked first that can do all that robots can, as far as the formula sees it (`alike_merged`): what they cannot do the robots
cannot. Nodes that look alike are one. Where a robot can come from one to another that only looks alike, its letter is read anew; so such
an event leads from a node to its twin.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

from ltlplan.allocation import Allocation
from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.search.counting.counting_propositions import Marks
from ltlplan.search.label_setting import distances
from ltlplan.search.orders.event_names import Event, Names
from ltlplan.search.orders.helped_robots import HelpedRobots
from ltlplan.search.orders.linearisations import Linearisations, needed_orders
from ltlplan.search.orders.one_after_another import OneAfterAnother
from ltlplan.search.orders.reading import Course, EventReading, Events, is_event, shown_by
from ltlplan.search.orders.state_sets import Reading, Shown, shown_at
from ltlplan.search.problem import TIES, Problem
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Infeasible
from verify.data.plan import Precedence

MOST_STATES = 10_000
"""States of a search over interleavings that are expanded before it says that it cannot tell."""
_SHARE = 4
"""Share of them, one in so many, that smaller systems are searched for: there are more events, and mostly they answer at once or not at all."""
_LARGE = 200_000
"""Nodes of all robots together, beyond which robots fly one after another if that is enough."""


@dataclass(frozen=True, slots=True)
class OrderedPlan:
    """Words of a team, and what is waited for.

    Attributes:
        paths: Nodes of each robot's system.
        precedences: All team words that keep them satisfy the formula.
        cost: Sum over the robots.
        reached: States that were seen.
        bound: No such plan costs less.
    """

    paths: tuple[tuple[int, ...], ...]
    precedences: tuple[Precedence, ...]
    cost: float
    reached: int
    bound: float


def plan(problem: Problem) -> Allocation | None:
    """Plan words that hold under precedences between events; None where none do.

    Raises:
        Infeasible: There are such words, but their precedences cannot be said of visits and their actions.
        TooLarge: The budget was used up; nothing is known.
    """
    whole = problem.budget
    budget = whole.of(min(MOST_STATES, whole.states // 50 if whole.courses is None else whole.courses))
    team = OrderedTeam(problem.each, Marks(problem.automata, problem.known), joint=problem.mission.spec.team == "joint")
    found = team.cheapest(budget)
    if found is None:
        return None

    def costs(plan: OrderedPlan) -> list[float]:
        return [robot.cost for robot in problem.itineraries(plan.paths).values()]

    total = sum(costs(found))
    least = max(0.0, min(total, found.bound) - TIES)
    notes = [
        "No words hold in every order of the robots; these hold under the plan's precedences: every team word that keeps them satisfies "
        f"the formula. The search reached {found.reached:,} states of all robots together."
    ]
    if problem.longest:
        better, least = team.of_least_highest(budget, max(costs(found)) - TIES)
        found, least = better or found, max(0.0, least - TIES)  # what breaks ties counts in `least`
        total = max(costs(found))
    complete = total <= least + 3 * TIES
    if not complete:
        notes.append(f"A plan {'whose dearest robot costs' if problem.longest else 'that costs'} less may exist.")
    robots, said = problem.itineraries(found.paths), (*notes, *problem.systems.unclear())
    return Allocation(
        robots=robots, cost=total, lower_bound=least, complete=complete, notes=said, precedences=found.precedences
    )


class OrderedTeam:
    """Robots, and how the formula reads their events. Each search says how many states may be expanded.

    Args:
        systems: One for each robot.
        marks: What the formula sees.
        joint: Whether it reads the letter of the whole team.
    """

    def __init__(self, systems: Sequence[TransitionSystem], marks: Marks, *, joint: bool) -> None:
        self._systems, self._marks, self._reading = systems, marks, Reading(marks, joint=joint)
        self._shown = shown_by(marks, systems)

    def is_possible(self, budget: Budget) -> bool:
        """Tell whether there are words all of whose team words satisfy the formula under some precedences.

        Raises:
            TooLarge: The budget was used up; nothing is known.
        """
        return self._may_be_possible(budget) and self._events(self._systems).cheapest(budget) is not None

    def _events(self, systems: Sequence[TransitionSystem]) -> EventReading:
        """Return the reading of these robots, or of ones that may end in fewer places."""
        return EventReading(systems, self._shown, self._reading)

    def _may_be_possible(self, budget: Budget) -> bool:
        """Tell whether smaller systems that can do more can do it; True where that takes too long to find out."""
        merged = [alike_merged(s, own, self._reading.is_idle) for s, own in zip(self._systems, self._shown, strict=True)]
        small, shown = [system for system, _ in merged], [own for _, own in merged]
        if not self._reading.some_word(shown):
            return False
        try:
            return EventReading(small, shown, self._reading).cheapest(budget.of(budget.states // _SHARE)) is not None
        except TooLarge:
            return True

    def cheapest(self, budget: Budget) -> OrderedPlan | None:
        """Return a plan with the least sum whose team words all satisfy the formula under some precedences; None where there is none.

        Raises:
            TooLarge: The budget was used up; nothing is known.
            Infeasible: There is such a plan, but its precedences cannot be said of visits and their actions.
        """
        is_large = math.prod(len(system.labels) for system in self._systems) > _LARGE
        if is_large and (found := self._one_after_another(budget)) is not None:
            return found
        if not self._may_be_possible(budget):
            return None
        try:
            course = self._events(self._systems).cheapest(budget)
        except TooLarge:
            if is_large or (found := self._one_after_another(budget)) is None:
                raise
            return found
        found = course and self._ordered(course)
        if course is None or found is not None:
            return found
        course = self._events([_leaving_after_actions(system) for system in self._systems]).cheapest(budget)
        found = course and self._ordered(course)
        if found is None:
            raise Infeasible(
                "Words satisfy the formula where one robot's event follows another's, but it is an action that nobody can wait for: one of several "
                "in its visit, or one of a visit that lasts to the end."
            )
        return found

    def _one_after_another(self, budget: Budget) -> OrderedPlan | None:
        """Return the cheapest plan found in which robots fly one after another, each of them as the last one; None where there is none.

        Raises:
            TooLarge: There are too many team words.
        """
        if self._reading.joint:
            return None
        systems, robots = [_leaving_after_actions(system) for system in self._systems], range(len(self._systems))
        orders = ([*(other for other in robots if other != last), last] for last in reversed(robots))
        turns = OneAfterAnother(systems, self._shown, self._reading)
        found = [turns.cheapest(order, budget) for order in orders]
        courses = sorted((course for course in found if course is not None), key=lambda course: course.cost)
        plans = (self._ordered(course, bound=self._least()) for course in courses)
        return next((plan for plan in plans if plan is not None), None)

    def _least(self) -> float:
        """Return what all robots pay at the least, each with the help of all others, under `own`."""
        begun = Events(self._systems, self._shown, self._reading).begin()
        if begun is None:
            return 0.0
        start, known = begun
        helped = HelpedRobots(self._systems, self._shown, self._reading)
        return sum(helped.left(robot, node, known) for robot, node in enumerate(start))

    def of_least_highest(self, budget: Budget, below: float) -> tuple[OrderedPlan | None, float]:
        """Return a plan whose robot with the highest cost pays less than a limit, if one is found, and what that is at the least in all."""
        course, bound = self._events(self._systems).of_least_highest(budget, below)
        return course and self._ordered(course), min(bound, below)

    def _ordered(self, course: Course, *, bound: float | None = None) -> OrderedPlan | None:
        """Return a course with few of its precedences; None where they cannot be said of visits and their actions."""
        words, order = words_and_order(self._marks, self._systems, course.steps)
        paths = [[system.initial] for system in self._systems]
        for robot, node in course.steps:
            paths[robot].append(node)
        names = Names(self._systems, paths)
        pairs = needed_orders(Linearisations(self._marks, words, joint=self._reading.joint), order, names)
        if pairs is None:
            return None
        kept = tuple(dict.fromkeys(pairs.values()))
        return OrderedPlan(tuple(map(tuple, paths)), kept, course.cost, course.reached, course.cost if bound is None else bound)


def _leaving_after_actions(system: TransitionSystem) -> TransitionSystem:
    """Return the system without ends in regions where it acts: an action is over for sure when its region is left."""
    acting = {action.at for action in system.actions}
    ends = {n: end for n in range(len(system.labels)) if (end := system.ending(n)) is not None}
    return replace(system, final={n: end for n, end in ends.items() if not acting & system.nodes[n].regions})


def words_and_order(
    marks: Marks, systems: Sequence[TransitionSystem], steps: Iterable[tuple[int, int]]
) -> tuple[list[list[Shown]], list[Event]]:
    """Return what each robot shows, letter by letter, along a course, and its events in their order.

    Args:
        marks: What the formula sees.
        systems: One for each robot.
        steps: Who moves, and to which node.
    """
    words = [[shown_at(marks, system, system.initial)] for system in systems]
    at = [system.initial for system in systems]
    order: list[Event] = []
    for robot, node in steps:
        if is_event(systems[robot], at[robot], node):
            words[robot].append(shown_at(marks, systems[robot], node))
            order.append((robot, len(words[robot]) - 1))
        at[robot] = node
    return words, order


def alike_merged(
    system: TransitionSystem, shown: Sequence[Shown], is_idle: Callable[[Shown], bool]
) -> tuple[TransitionSystem, list[Shown]]:
    """Return a system whose nodes are what a robot can show, and what each of them shows.

    Args:
        system: The robot's.
        shown: For each node what the formula sees there.
        is_idle: Whether it makes no difference that something is read again.
    """
    reached = distances([system.initial], lambda node: [(target, 1.0) for target, _ in system.edges[node]])
    order = list(dict.fromkeys(shown[node] for node in reached))
    number = {own: 2 * i for i, own in enumerate(order)}
    edges: list[dict[int, float]] = [{} for _ in range(2 * len(order))]

    def lower(source: int, target: int, cost: float) -> None:
        edges[source][target] = min(cost, edges[source].get(target, cost))

    for node in reached:
        here = number[shown[node]]
        for target, cost in system.edges[node]:
            there = number[shown[target]]
            if here != there:
                for twin in (0, 1):
                    lower(here + twin, there, cost)
            elif system.labels[target] != system.labels[node] and not is_idle(shown[node]):
                lower(here, here + 1, 0.0)
                lower(here + 1, here, 0.0)
    ending = (number[shown[node]] for node in reached if system.ending(node) is not None)
    ends = {at + twin: 0.0 for at in ending for twin in (0, 1)}
    labels = tuple(frozenset({f"{i}"}) for i in range(2 * len(order)))
    merged = replace(
        system,
        labels=labels,
        edges=tuple(tuple(sorted(own.items())) for own in edges),
        initial=0,
        final=ends,
        nodes=(),
        walls={},
    )
    return merged, [own for own in order for _ in (0, 1)]
