"""Plans for a team whose robots are followed one after another: search, hold the plan against every order of the robots, refine, search again.

Every search returns a best plan among more than may be had: only for tracked conjuncts is it told apart what each robot's word does, so
that no order breaks them. Where some order breaks another conjunct, that one is tracked, too, and the search begins again
(counterexample-guided refinement). So each bound is one on the plan that is looked for, and the first plan that no order breaks is best.
"""

from __future__ import annotations

import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from functools import partial
from typing import Any, Self

from ltlplan.allocation import Allocation
from ltlplan.logic.automaton import Automaton
from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.search.endurance import over_endurance
from ltlplan.search.itineraries import path_cost, word_along
from ltlplan.search.problem import TIES, NoWords, Problem
from ltlplan.search.reduced_graph import ReducedGraph, Team, staying
from ltlplan.search.sequential_reading import Objective, SequentialReading
from ltlplan.search.team_reading import Found, least_highest, least_sum
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Unsatisfiable

MANY = 10
"""Robots from which on tasks are shared out before any search: where a bound is met there is nothing to search for."""

GREEDY = (1.5, 3.0)  # how much the rest counts where any run will do; with the first, runs are nearer the cheapest
_FEW = 10
"""Share of the states, one in so many, of a first search that tracks no conjuncts but those that orders broke."""
_MOSTLY = 2
"""Up to how many times the conjuncts that some order broke are tracked without such a search, with all that are like them."""
_ALONE = 6  # how much more may be spent on one robot by itself than on two
_ROUNDING = 1e-9  # by which sums of the same costs may differ
MAX_SINGLES = 20  # robots up to which each is tried as the only one that flies


class TeamTask(ABC):
    """A team and what it is to do, whose robots are followed one after another.

    Attributes:
        graph: The team's graph.
        share: Of the budget, one in so many states is spent on a search by sums.
        shapes: For each conjunct what it has in common with those whose automata differ from its own in names alone.
        alike: Whether conjuncts that are like a tracked one are tracked from the beginning, not only after a short search without them.
        automata: One for each conjunct.
        masks: The propositions of each of the team's letters, as bits.
    """

    graph: ReducedGraph
    share: int
    shapes: Sequence[object]
    alike: bool

    def __init__(self, systems: Sequence[TransitionSystem], automata: Sequence[Automaton]) -> None:
        """Number the propositions.

        Args:
            systems: One for each robot.
            automata: One for each conjunct.
        """
        self.automata, self._team = tuple(automata), Team(systems)
        names = sorted({name for automaton in automata for name in automaton.propositions})
        self._bit = {name: 1 << place for place, name in enumerate(names)}
        self.masks = [sum(self._bit.get(name, 0) for name in letter) for letter in self._team.letters]

    def flown_by(self, robots: Collection[int]) -> Self:
        """Return the task of the team with all but these robots, by index, staying where they start."""
        every = enumerate(self.graph.team.systems)
        return type(self)([system if robot in robots else staying(system) for robot, system in every], self.automata)

    @abstractmethod
    def reading(self, tracked: Collection[int] = (), objective: Objective = Objective(), /) -> SequentialReading[Any]:  # noqa: B008 - frozen
        """Return what a search walks over where these conjuncts, by index, are to hold in every order of the robots."""

    @abstractmethod
    def failing_orders(self, paths: Sequence[Sequence[int]], /) -> dict[int, tuple[int, ...]]:
        """Return, for each conjunct that some order of the robots breaks, such an order."""

    def shared_out(self, _objective: Objective, /) -> PlanningOutcome | None:
        """Return a plan with a low highest cost and a bound on that, found without a search; None where there is no such way."""
        return None


@dataclass(frozen=True, slots=True)
class TeamRun:
    """One path of the team automaton.

    Attributes:
        paths: The nodes of each robot's system, in the order of the systems.
        cost: The objective.
        reached: States that were seen.
    """

    paths: tuple[tuple[int, ...], ...]
    cost: float
    reached: int


@dataclass(frozen=True, slots=True)
class PlanningOutcome:
    """The outcome of planning for a team.

    Attributes:
        run: The best run whose words keep the task in every order, or None; where `stopped`, any such run.
        first: The best run in the fixed order, or None.
        tried: Complete plans that were checked in all orders.
        refused: For the first refused plan, the order that broke it.
        bound: No plan has a lower objective.
        stopped: The budget that ended the search before `run` was known to be the best; None where it was exhausted.
        beyond: The cheapest run, where none is within the limits on robots.
        tracked: Conjuncts, by index, that some order broke.
    """

    run: TeamRun | None
    first: TeamRun | None
    tried: int
    refused: tuple[int, ...] | None = None
    bound: float = 0.0
    stopped: TooLarge | None = None
    beyond: TeamRun | None = None
    tracked: frozenset[int] = frozenset()


def plan_team(task: TeamTask, budget: Budget, objective: Objective = Objective()) -> PlanningOutcome:  # noqa: B008 - frozen
    """Return the best plan that keeps the task in every order of the robots.

    Where the highest cost counts, a tenth of the budget of states is spent on a search; what does not suffice for that is left to
    tasks shared in tours, or else to the plan with the least sum, if it is within the limits.

    Args:
        task: What is to be done.
        budget: Bounds on each search.
        objective: The order on plans, and limits on robots.

    Raises:
        TooLarge: A budget was used up before any plan was found, or any within the limits.
    """
    if not objective.longest:
        found = _least_sum(task, budget, told=True)
        if found.run is None or _is_within(objective, task, found.run):
            return found
        within = _least_within(task, budget, objective)
        if within.stopped is not None:
            raise _limits_too_large(budget)
        return within if within.run is not None else replace(within, beyond=found.run)
    robots = len(task.graph.start)
    first = task.shared_out(objective) if robots >= MANY else None
    if first is not None and first.run is not None:
        if first.run.cost <= first.bound + TIES:
            return first
        budget = budget.of(max(1, budget.states // robots**2))  # each of which has as many ways on
    found = _least_within(task, budget, objective, told=True)
    if found.stopped is None:
        beyond = None if found.run is not None or objective.most is None else _least_sum(task, budget).run
        return replace(found, beyond=beyond)
    shared = first or task.shared_out(objective)
    if shared is not None:
        return replace(shared, bound=max(found.bound, shared.bound), stopped=found.stopped)
    cheapest = _least_sum(task, budget)
    if cheapest.run is None:
        return cheapest
    if not _is_within(objective, task, cheapest.run):
        raise _limits_too_large(budget)
    return replace(cheapest, bound=found.bound, stopped=found.stopped)


def least_in_one_order(task: TeamTask, budget: Budget) -> TeamRun | None:
    """Return a cheapest run in the systems' order, with switches everywhere; None where there is none.

    Args:
        task: What is to be done.
        budget: Bound on the states.

    Raises:
        TooLarge: The budget of states was used up.
    """
    reading = task.reading((), Objective())
    found = least_sum(reading, budget)
    if found.stopped is not None:
        raise _shortage(found)
    return _run_of(reading, found)


def _least_sum(task: TeamTask, budget: Budget, *, told: bool = False) -> PlanningOutcome:
    """Return the plan with the least sum; where a budget ends the search for it, any plan.

    Args:
        task: What is to be done.
        budget: Bounds on the search.
        told: Whether the sum is what counts, so that bounds on it are told.

    Raises:
        TooLarge: The budget was used up before any plan was found.
    """
    budget = budget.of(max(1, budget.states // task.share))
    search = partial(least_sum, budget=budget, told=told)
    first = None if task.alike else partial(least_sum, budget=budget.of(max(1, budget.states // _FEW)))
    found = _refined(task, search, Objective(), first=first)
    if found.stopped is None:
        return found
    return _any_run(task, found, found.stopped, budget.rest())


def _least_within(task: TeamTask, budget: Budget, objective: Objective, *, told: bool = False) -> PlanningOutcome:
    """Return the best plan whose robots are within their limits, for a tenth of the budget of states."""
    search = partial(least_highest, budget=budget.of(max(1, budget.states // 10)), told=told)
    return _refined(task, search, objective)


def _refined(
    task: TeamTask,
    search: Callable[[SequentialReading[Any]], Found],
    objective: Objective,
    tracked: Collection[int] = (),
    *,
    alike: bool = True,
    first: Callable[[SequentialReading[Any]], Found] | None = None,
) -> PlanningOutcome:
    """Search, and search again with the conjuncts tracked that some order broke, until a plan is kept by all orders.

    Args:
        task: What is to be done.
        search: Returns the best plan of a reading.
        objective: The order on plans, and limits on robots.
        tracked: Conjuncts, by index, to begin with.
        alike: Whether a search for the least sum tracks those that are like them, too.
        first: A shorter search, for which these are not tracked, while they are many.
    """
    found = PlanningOutcome(None, None, 0, tracked=frozenset(tracked))
    while True:
        among = _with_alike(task, found.tracked) if alike and objective == Objective() else sorted(found.tracked)
        short = None if len(among) <= _MOSTLY * len(found.tracked) else first
        try:
            reading = task.reading(sorted(found.tracked) if short else among, objective)
            answer = (short or search)(reading)
            run = _run_of(reading, answer)
            failing = {} if run is None else task.failing_orders(run.paths)
        except TooLarge as error:  # of trying orders
            if not short:
                return replace(found, stopped=error)
            first = None
            continue
        found = replace(found, first=found.first or run, tried=found.tried + answer.tried, bound=max(found.bound, answer.bound))
        if answer.stopped is not None and short:
            first = None
            continue
        if answer.stopped is not None:
            return replace(found, stopped=_shortage(answer))
        if not failing:
            return replace(found, run=run)
        found = replace(found, refused=found.refused or next(iter(failing.values())), tracked=found.tracked.union(failing))


def _with_alike(task: TeamTask, tracked: Collection[int]) -> list[int]:
    """Return conjuncts with all that are like them: what some order broke of one, it may break of these next."""
    shapes = {task.shapes[index] for index in tracked}
    return [index for index, shape in enumerate(task.shapes) if shape in shapes]


def _any_run(task: TeamTask, found: PlanningOutcome, stopped: TooLarge, budget: Budget) -> PlanningOutcome:
    """Look for runs that every order keeps, where the search for a cheapest one was stopped, and take the cheapest that is found.

    First each robot flies by itself, then the best of these with each other one, then those that fly in the cheapest run of the
    fixed order, at last all. Where that is too much, too, the estimate of the rest counts for more than what was spent
    (weighted A*, Pohl 1970). Of each, the conjuncts are tracked that orders break of what is found; of many robots, those of the
    search that was stopped from the beginning.

    Raises:
        TooLarge: None was found; the error that stopped the search.
    """
    robots = range(len(task.graph.start))
    third = max(1, budget.states // 3)
    few = max(1, third // len(robots))

    def cheapest(
        flying: Collection[int], most: int, weight: float = 1.0, tracked: Collection[int] = (), *, alike: bool = True
    ) -> list[TeamRun]:
        search = partial(least_sum, budget=budget.of(most), weight=weight)
        flown = task if len(flying) == len(robots) else task.flown_by(flying)
        among = _refined(flown, search, Objective(), tracked, alike=alike)
        return [] if among.run is None else [among.run]

    runs: list[TeamRun] = []
    if len(robots) <= MAX_SINGLES:
        alone = {robot: run for robot in robots for run in cheapest({robot}, min(budget.states, _ALONE * few))}
        best = min(alone, key=lambda robot: alone[robot].cost, default=None)
        pairs = [] if best is None else [{best, robot} for robot in robots if robot != best]
        runs += [*alone.values(), *(run for pair in pairs for run in cheapest(pair, few))]
    active = robots if found.first is None else [robot for robot in robots if len(found.first.paths[robot]) > 1]
    teams = [active, robots] if len(active) < len(robots) else [robots]
    for alike, weight in itertools.product((task.alike, not task.alike), GREEDY):
        runs += [run for flying in teams for run in cheapest(flying, third, weight, found.tracked, alike=alike)]
        if runs:
            break
    if not runs:
        raise stopped
    run = min(runs, key=lambda run: run.cost)
    sure = run.cost <= found.bound + _ROUNDING
    return replace(found, run=run, first=found.first or run, stopped=None if sure else stopped)


def _run_of(reading: SequentialReading[Any], found: Found) -> TeamRun | None:
    return TeamRun(reading.paths(found.states), found.cost, found.reached) if found.states else None


def _is_within(objective: Objective, task: TeamTask, run: TeamRun) -> bool:
    """Tell whether no robot costs more than it may."""
    costs = map(path_cost, task.graph.team.systems, run.paths)
    return all(objective.allows(robot, cost) for robot, cost in enumerate(costs))


def _shortage(found: Found) -> TooLarge:
    """Return the error that says which budget ended a search."""
    if found.stopped == "states":
        return TooLarge("The search needs", found.explored, "states", found.explored - 1)
    return TooLarge("Finding a plan that holds in every order takes", found.tried + 1, "complete plans", found.tried)


def _limits_too_large(budget: Budget) -> TooLarge:
    """Return the error of a search that kept limits on robots and was not exhausted."""
    return TooLarge("Keeping every vehicle's endurance needs", budget.states // 10, "states", budget.states // 10)


def assigned(problem: Problem, task: TeamTask) -> Allocation:
    """Return the best plan of a team's task as an assignment.

    Args:
        problem: What is asked.
        task: The same, as it is read.

    Raises:
        NoWords: No words hold in every order of the robots.
        Infeasible: None are within a vehicle's endurance.
        TooLarge: A budget was used up before any plan was found.
    """
    longest, most = problem.longest, problem.systems.most_costs()
    found = plan_team(task, problem.budget, Objective(longest, most))
    if found.beyond is not None:
        raise over_endurance(problem.mission, problem.systems, problem.itineraries(found.beyond.paths))
    if found.run is None:
        raise NoWords(partial(_no_plan, problem, found))
    robots = problem.itineraries(found.run.paths)
    cost = (max if longest else sum)(robot.cost for robot in robots.values())
    notes: list[str] = []
    if found.tried > 1:
        notes.append(f"{found.tried} plans were tried; the cheaper ones hold in some orders of the robots, but not in all.")
    if found.stopped is not None and longest:
        notes.append(
            "Finding the cheapest dearest robot takes too many states; a plan whose dearest robot costs less may exist."
        )
    elif found.stopped is not None:
        notes.append(f"{found.stopped.shortage} This plan holds in every order of the robots; a cheaper one may exist.")
    if len(robots) > 1:
        size = math.prod(len(a.edges) for a in problem.automata) * math.prod(len(system.labels) for system in problem.each)
        many = f"{size:,}" if size < 1_000_000 else f"{Decimal(size):.1e}"
        notes.append(
            f"The search reached {found.run.reached:,} states of the team automaton; the product of all robots has {many}."
        )
    least = cost if found.stopped is None else max(0.0, found.bound - TIES)
    said = (*notes, *problem.systems.unclear())
    return Allocation(
        robots=robots, cost=cost, lower_bound=least, complete=found.stopped is None, tried=max(found.tried, 1), notes=said
    )


def _no_plan(problem: Problem, found: PlanningOutcome) -> Unsatisfiable:
    """Return the error that says why there is no plan: the order of the robots, if any, that breaks the best plan of the fixed order."""
    if found.first is None:
        return problem.explain(problem, ())
    names = tuple(problem.mission.agents)
    words = [word_along(system, path) for system, path in zip(problem.each, found.first.paths, strict=True)]
    return problem.explain(problem, [(names[robot], words[robot]) for robot in found.refused or range(len(names))])
