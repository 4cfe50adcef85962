"""MTAC-E with counts and names, under `team: joint`: what several robots do at once by the exact search, and all else as tasks.

A conjunct such as `F a` is a task: whoever shows a has done it, whatever the others show. Conjuncts that count robots or name them
belong to several robots at one time, and no single robot's word brings them about. So two ways are tried, and what costs less by the
robots' very paths is taken:

* all conjuncts are planned by the search over numbers of robots (`ltlplan.search.counting`), as far as a small budget goes;
* the search plans the others alone, and tasks are put into its course as visits, each where it adds least to the objective; some are then taken
  out and put in anew, for a while. Only courses count that still do, letter by letter, what counts ask for.

Of either, who takes which part is then decided by paths (Algorithm 2, line 7): the price of each robot's path for each part that it could
take, shown by the same letters, and the cheapest assignment of parts to robots, by the sum or by the dearest. Robots of one kind
that are not named exchange parts that show the same letters (`taken_by_the_cheapest`).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.random import Generator

from ltlplan.allocation import Allocation, Context, Itinerary, Known
from ltlplan.logic.automaton import Automaton
from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.logic.conjunction import conjunct_automaton, conjuncts
from ltlplan.mtac.counting.move_sequences import CountedCourses, Course
from ltlplan.mtac.many_tasks import MANY
from ltlplan.paths.costs import team_cost
from ltlplan.paths.improvement import without_swings
from ltlplan.paths.nominal import lay_path
from ltlplan.paths.unnamed_regions import finished
from ltlplan.search.counting.capacities import small_rooms
from ltlplan.search.counting.counted_plans import CountedPlan, has_room, may_crowd
from ltlplan.search.counting.counting_propositions import Marks
from ltlplan.search.counting.planning import CourseSearch, plan_counts
from ltlplan.search.counting.stages import HoversOutside, waits_of
from ltlplan.search.counting.symmetry_classes import CountedTeam, Rooms, TeamClasses
from ltlplan.search.endurance import require_endurance
from ltlplan.search.itineraries import itinerary
from ltlplan.search.least_cost_matching import cheapest_assignment
from ltlplan.search.problem import TIES, Problem
from ltlplan.search.tours.shared_tours import Objective, improved
from ltlplan.systems.objective import is_counted_by_legs
from ltlplan.systems.robot_systems import interchangeable, unit_cost
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Formula, Infeasible, Letter, Mission
from verify.data.language.counting import atoms

_STATES = 200_000
"""Of the search over numbers of robots for conjuncts that are no tasks."""
_STATES_AT_ONCE = 4_000
"""Of that search for all conjuncts at once, where some are tasks, which can also be put in; of more than eight it falls with their square."""
_ROUNDS = 30
"""In which tasks are taken out of a course and put in anew."""
_TRIED = 200
"""Places for one visit that are held against the formula, cheapest first."""


def is_shared_at_once(mission: Mission) -> bool:
    """Tell whether a mission is shared by `share_counted`: one that counts robots or names them, or under `joint` one of many tasks.

    Args:
        mission: What is asked.
    """
    if len(mission.agents) < 2 or mission.spec.trace == "infinite" or mission.spec.team != "joint":
        return False
    return mission.written.counts or sum(bool(_visited(part)) for part in dict.fromkeys(conjuncts(mission.formula))) >= MANY


def share_counted(mission: Mission, context: Context) -> Allocation | None:
    """Share a mission whose formula counts robots or names them, or one of many tasks that are done by anybody.

    Args:
        mission: Of several robots, with a finite trace.
        context: Source of draws, progress.

    Returns:
        None where no plan was found in which robots wait in regions only; the exact method then says more.
    """
    context.progress("MTAC-E: who is where, by numbers of robots", 0.1)
    counted = _Counted(mission, context.known)
    found = [plan for plan in (counted.whole(), counted.in_parts(context.rng)) if plan is not None]
    context.progress("MTAC-E: pricing parts by their paths", 0.5)
    taken = [
        taken_by_the_cheapest(counted.systems, plan, counted.kinds, counted.price, longest=counted.longest) for plan in found
    ]
    allocations = [made for plan in (*taken, *found) if (made := counted.allocation(plan)) is not None]
    best = min(allocations, key=lambda made: made.cost, default=None)
    return best if best is not None and math.isfinite(best.cost) else None


class _Counted:
    """A mission's robots, and its conjuncts."""

    def __init__(self, mission: Mission, known: Known) -> None:
        problem, self._budget = Problem(mission), known.budget
        self.mission, self._systems, self.systems = mission, problem.systems, problem.each
        self._asked = tuple(dict.fromkeys(conjuncts(problem.asked)))
        self._atoms = {text: atom for part in self._asked for text, atom in atoms(part).items()}
        self._alike = tuple(interchangeable(mission).values())
        named = {atom.robot for atom in self._atoms.values()}  # robots of one key may take each other's parts
        self.kinds = [f"{mission.alike_as(name)} {name if name in named else ''}" for name in mission.agents]
        self._rooms = small_rooms(mission, self.systems, known.capacities)
        self._prices: dict[tuple[str, Itinerary], float] = {}
        self.longest = mission.planner.objective == "longest"
        self._least = 0.0

    def whole(self) -> CountedPlan | None:
        """Return a plan for all conjuncts at once; None where there is none, or none within the budget."""
        tasks = sum(bool(_visited(part)) for part in self._asked)
        found = self._planned(self._asked, max(1, _STATES_AT_ONCE * 64 // max(8, tasks) ** 2) if tasks else _STATES)
        self._least = 0.0 if found is None else found.bound
        return found

    def in_parts(self, rng: Generator) -> CountedPlan | None:
        """Return a plan of those conjuncts that are no tasks, with the tasks put in as visits; None where none was found."""
        tasks = [names for part in self._asked if (names := _visited(part))]
        others = [part for part in self._asked if not _visited(part)]
        if not tasks:
            return None
        still = tuple((system.initial,) for system in self.systems)
        core = self._planned(others, _STATES) if others else CountedPlan(still, (), (), 0.0, 0.0, 1)
        if core is None:
            return None
        self._least = max(self._least, core.bound)
        courses = CountedCourses(self.systems, self._marks(self._asked), self._marks(others))
        letters = [frozenset(label for system in self.systems for label in system.labels if label & names) for names in tasks]
        course = _Visits(courses, letters, Objective(self.longest), rng).cheapest(courses.of(core))
        plan = None if course is None else courses.plan(course, bound=core.bound, reached=core.reached)
        return plan if plan is not None and has_room(self.systems, plan, self._rooms) else None

    def _marks(self, parts: Sequence[Formula]) -> Marks:
        return Marks([conjunct_automaton(part) for part in parts], self._atoms)

    def _planned(self, parts: Sequence[Formula], states: int) -> CountedPlan | None:
        automata: list[Automaton] = [conjunct_automaton(part) for part in parts]
        with suppress(TooLarge):
            budget = self._budget.beside(Budget(states=states))
            return plan_counts(self.systems, self._alike, Marks(automata, self._atoms), budget, rooms=self._rooms)
        return None

    def price(self, robot: int, path: tuple[int, ...]) -> float:
        """Return what a robot's very path costs by the mission's terms; infinite where there is none."""
        name = self.systems[robot].robot
        does = itinerary(self.systems[robot], path)
        if (name, does) not in self._prices:
            self._prices[name, does] = self._laid(name, does)
        return self._prices[name, does]

    def _laid(self, name: str, does: Itinerary) -> float:
        try:
            path, _ = lay_path(self.mission, name, does)
        except Infeasible:
            return math.inf
        steady = finished(self.mission, name, does, path, lambda few, laid: without_swings(few, name, laid))
        return steady.cost  # as flown: nobody bends his into where another one waits

    @cached_property
    def _at_least(self) -> float:
        """A lower bound on the cost of any plan, by straight lines: from the searches so far, and from the goals that robots must reach."""
        team = CountedTeam(tuple(self.systems), self._alike, self._marks(self._asked), Rooms({}, passing=False), skips=True)
        classes = TeamClasses(team, stays=True, apart=True).made()
        found = self._least / (len(self.systems) if self.longest else 1)
        return max(0.0, found - TIES, CourseSearch(classes).least(longest=self.longest) - TIES)

    def allocation(self, plan: CountedPlan) -> Allocation | None:
        """Return an allocation with who waits for whom; None where a robot would have to hover outside regions, or flies too long."""
        names = tuple(self.mission.agents)
        robots = {name: itinerary(system, path) for name, system, path in zip(names, self.systems, plan.paths, strict=True)}
        try:
            crowded = may_crowd(self.systems, plan, self._rooms)
            marks = None if crowded or self.mission.formula.uses_next() else self._marks(self._asked)
            meetings, precedences = waits_of(self.systems, plan, marks)
            require_endurance(self.mission, self._systems, robots)
        except (HoversOutside, Infeasible):
            return None
        priced = [self.price(robot, path) for robot, path in enumerate(plan.paths)]
        straight = team_cost(self.mission, [does.cost for does in robots.values()]) * unit_cost(self.mission)
        least = self._at_least * unit_cost(self.mission) if is_counted_by_legs(self.mission) else None
        notes = [
            f"MTAC-E priced {len(self._prices)} paths of parts that robots could take: who is where together was planned by numbers."
        ]
        if least:
            gap = max(0.0, 100.0 * (straight / least - 1.0))
            notes.append(
                f"By straight lines this costs {straight:.3f}, and nothing less than {least:.3f}: a gap of at most {gap:.1f} %."
            )
        if meetings or precedences:
            notes.append("Robots wait for each other where the formula asks for it.")
        order = tuple(name for name, does in robots.items() if does.visits)
        return Allocation(
            robots=robots, cost=team_cost(self.mission, priced), order=order, lower_bound=least or None,
            notes=(*notes, *self._systems.unclear()), meetings=tuple(meetings), precedences=tuple(precedences),
        )  # fmt: skip


def _visited(part: Formula) -> frozenset[str]:
    """Return the names of which a task asks one to be shown, by anybody and at any time; none where a conjunct is no such task."""
    asked = list(part.arguments[0].nodes()) if part.operator == "F" else []
    plain = all(node.operator == "|" or (node.operator == "name" and not node.robot) for node in asked)
    return frozenset(node.name for node in asked if plain and node.operator == "name")


class _Visits:
    """Tasks as visits in a course."""

    def __init__(
        self, courses: CountedCourses, letters: Sequence[frozenset[Letter]], objective: Objective, rng: Generator
    ) -> None:
        self._courses, self._letters, self._objective, self._rng = courses, letters, objective, rng

    def cheapest(self, course: Course) -> Course | None:
        """Return a course with a visit for each task that it does not do anyway; None where one cannot be put in."""
        shown = {self._courses.systems[step.robot].labels[node] for step in course for node in step.path}
        shown |= {system.labels[system.initial] for system in self._courses.systems}
        tasks = [task for task, letters in enumerate(self._letters) if shown.isdisjoint(letters)]
        first = self._filled(course, tasks)
        if first is None or not tasks:
            return first

        def anew(now: Course) -> Course | None:
            taken = self._rng.permutation(tasks)[: int(self._rng.integers(1, min(4, len(tasks)) + 1))].tolist()
            other: Course | None = now
            for task in taken:
                other = None if other is None else self._courses.without(other, task)
            return None if other is None else self._filled(other, taken)

        return improved(first, anew, lambda found: self._objective(self._courses.costs(found)), rounds=_ROUNDS)[0]

    def _filled(self, course: Course, tasks: Sequence[int]) -> Course | None:
        """Put tasks in, each where it adds least to the objective, in the order given."""
        for task in tasks:
            costs = self._courses.costs(course)
            ways = [
                (self._objective.with_one(costs, robot, costs[robot] + more), number, made)
                for number, (more, robot, made) in enumerate(self._courses.insertions(course, task, self._letters[task]))
            ]
            ways.sort(key=lambda way: way[:2])
            found = next((made for _, _, made in ways[:_TRIED] if self._courses.keeps(made)), None)
            if found is None:
                return None
            course = found
        return course


def taken_by_the_cheapest(
    systems: Sequence[TransitionSystem],
    plan: CountedPlan,
    kinds: Sequence[str],
    price: Callable[[int, tuple[int, ...]], float],
    *,
    longest: bool,
) -> CountedPlan:
    """Return a plan whose parts are taken so that they cost least.

    A part may be taken by a robot of the same kind that shows the very letters of it, one after another, from its own start: then the
    team shows what it showed, and whatever counts ask for holds as before.

    Args:
        systems: One for each robot.
        plan: Whose parts are given out anew.
        kinds: For each robot a key that robots have in common which may take each other's parts.
        price: What a robot's path along nodes of its system costs.
        longest: Whether the dearest robot counts, not the sum.
    """
    robots = range(len(systems))
    paths = {
        (robot, part): found
        for robot in robots
        for part in robots
        if kinds[robot] == kinds[part] and (found := _path(systems, plan, robot, part)) is not None
    }
    prices = np.full((len(systems), len(systems)), math.inf)
    for (robot, part), path in paths.items():
        prices[robot, part] = price(robot, path)
    if not np.isfinite(prices[robots, robots]).all():
        return plan
    pairs = cheapest_assignment(prices, longest=longest)
    assert pairs is not None  # each may keep its own
    takes = [part for _, part in pairs]
    taker = {part: robot for robot, part in enumerate(takes)}
    if takes == list(robots):
        return plan
    return replace(
        plan,
        paths=tuple(paths[robot, takes[robot]] for robot in robots),
        turns=tuple((taker[part], begin, end) for part, begin, end in plan.turns),
    )


def _path(systems: Sequence[TransitionSystem], plan: CountedPlan, robot: int, part: int) -> tuple[int, ...] | None:
    """Return a robot's path for another one's part; None where it has no such path, or would show other letters on it."""
    own, other, path = systems[robot], systems[part], plan.paths[part]
    if robot == part:
        return path
    index = {node: number for number, node in enumerate(own.nodes)}
    start = other.nodes[other.initial]
    found = [own.initial]
    for number in path[1:]:
        node = other.nodes[number]
        if node.position == start.position and node.place == start.place:  # where it begins, seen from there
            here = own.nodes[own.initial]
            entered = here.entered if node.entered == start.entered else node.entered
            node = replace(node, position=here.position, place=here.place, entered=entered)
        if node not in index:
            return None
        found.append(index[node])
    shown = [own.labels[number] for number in found] == [other.labels[number] for number in path]
    joined = all(any(target == b for target, _ in own.edges[a]) for a, b in itertools.pairwise(found) if a != b)
    return tuple(found) if shown and joined else None
