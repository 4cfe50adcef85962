"""The cheapest way for a team to share a task: paths of the team automaton T (2022 paper, Defs. 4.6 and 4.7).

T is walked robot by robot, in one fixed order, and made as it is walked, over the nodes that matter (`reduced_graph`). Every plan
whose words keep the task in all orders is a path of T in the fixed order too, if robots may be switched in every state; so
a cheapest path is a lower bound, and it is the optimum as soon as its words pass in all orders. The decomposition set would
only let some of these switches pass without looking at the words. Where the cheapest path is refused, the search begins
again and also tracks what each robot's word does (its element of the transition monoid) to the conjuncts that some order
broke, so that no refused combination of elements comes twice.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Collection, Hashable, Iterator, Sequence
from dataclasses import dataclass, replace

from ltlplan.logic.automaton import DEAD
from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.logic.conjunct_automata import Deterministic
from ltlplan.logic.product_automaton import Task
from ltlplan.logic.transition_monoid import Element, OrderCheck, TransitionMonoid
from ltlplan.search.heuristics.heuristic import UNREACHABLE
from ltlplan.search.label_setting import BestFirst
from ltlplan.search.reduced_graph import ReducedGraph, Team, letter_classes
from ltlplan.search.team_states import SearchStates, TeamStates

GREEDY = (1.5, 3.0)  # how much the rest counts where any run will do; with the first, runs are nearer the cheapest
_COMPLETE = 1 << 62  # taken off the key of a state at which a path is complete: of equal bounds these come first
_ALONE = 6  # how much more may be spent on one robot by itself than on two
_ROUNDING = 1e-9  # by which sums of the same costs may differ
MAX_SINGLES = 20  # robots up to which each is tried as the only one that flies


@dataclass(frozen=True, slots=True)
class TeamRun:
    """One path of the team automaton.

    Attributes:
        paths: The nodes of each robot's system, in the order of the systems.
        cost: Sum of the edges' costs and preferences.
        explored: States that were expanded.
        reached: States that were seen.
    """

    paths: tuple[tuple[int, ...], ...]
    cost: float
    explored: int
    reached: int


@dataclass(frozen=True, slots=True)
class PlanningOutcome:
    """The outcome of planning for a team.

    Attributes:
        run: The cheapest run whose words keep the task in every order, or None; where `stopped`, any such run.
        first: The cheapest run in the fixed order, or None.
        tried: Complete plans that were checked in all orders.
        refused: For the first refused plan, the order that broke it.
        bound: No plan costs less.
        stopped: The budget that ended the search before `run` was known to be the cheapest; None where it was exhausted.
    """

    run: TeamRun | None
    first: TeamRun | None
    tried: int
    refused: tuple[int, ...] | None
    bound: float
    stopped: TooLarge | None = None


@dataclass(frozen=True, slots=True)
class WalkOutcome:
    """What a walk over the team automaton found.

    Attributes:
        run: A run whose words keep the tracked conjuncts in every order; None where there is none, or none was found.
        tried: Complete plans that were looked at.
        bound: No such run costs less; infinite where there is none.
        stopped: The budget that ended the walk; None where it was exhausted.
    """

    run: TeamRun | None
    tried: int
    bound: float
    stopped: TooLarge | None = None


@dataclass(frozen=True, slots=True)
class SearchSpace:
    """What a search for a team walks over.

    Attributes:
        graph: The team's graph.
        states_for: The search's states when these conjuncts, by index, are tracked.
    """

    graph: ReducedGraph
    states_for: Callable[[Sequence[int]], SearchStates]


def plan_team(team: Team, task: Task, budget: Budget) -> PlanningOutcome:
    """Return the cheapest team run that keeps the task in every order of the robots.

    Args:
        team: Whose graph.
        task: What is to be done.
        budget: Bounds on the search.

    Raises:
        TooLarge: A budget was used up before any plan was found.
    """
    classes = letter_classes(task)
    everything, check = TransitionMonoid(task), OrderCheck(task)
    shapes = [part.automaton.shape if isinstance(part, Deterministic) else index for index, part in enumerate(task.parts)]

    def elements_of(run: TeamRun) -> list[Element]:
        return [everything.of(letters) for letters in team.letters_of(run.paths)]

    def space(flying: Collection[int]) -> SearchSpace:
        graph = ReducedGraph(team.flown_by(flying), *classes)
        return SearchSpace(graph, lambda tracked: TeamStates(graph, task, tracked))

    return refined_until_kept(
        space,
        len(team),
        lambda run: with_alike(shapes, check.failing_parts(elements_of(run))),
        lambda run: check.failing_order(elements_of(run)),
        budget,
    )


def with_alike(shapes: Sequence[Hashable], broken: Collection[int]) -> tuple[int, ...]:
    """Return conjuncts, by index, with all that have the shape of one of them: what some order broke, it may break of these next.

    Args:
        shapes: Of each conjunct's automaton.
        broken: The conjuncts that are.
    """
    found = {shapes[index] for index in broken}
    return tuple(index for index, shape in enumerate(shapes) if shape in found)


def refined_until_kept(
    space: Callable[[Collection[int]], SearchSpace],
    robots: int,
    broken: Callable[[TeamRun], Sequence[int]],
    failing: Callable[[TeamRun], tuple[int, ...] | None],
    budget: Budget,
) -> PlanningOutcome:
    """Search, and search again with what words do to the conjuncts that were broken tracked, until a run is kept by all.

    Every search returns a cheapest run among more and more that are left out for being broken, so its cost is a lower bound,
    and the first run that no order breaks is a cheapest one. Where a budget ends this, any run that every order keeps
    is looked for, greedily.

    Args:
        space: What is walked over where only these robots, by index, leave their starts.
        robots: How many there are.
        broken: The conjuncts that some order of a run's words breaks.
        failing: An order in which a run's words break the task; None where every order keeps it.
        budget: Bounds on each search.

    Raises:
        TooLarge: A budget was used up before any run was found that every order keeps.
    """
    tracked: set[int] = set()
    first: TeamRun | None = None
    refused: tuple[int, ...] | None = None
    bound, tried = 0.0, 0
    whole = space(range(robots))
    while True:
        try:
            found = search_team(whole.graph, whole.states_for(sorted(tracked)), budget)
            more = () if found.run is None else broken(found.run)
        except TooLarge as error:  # of trying orders
            found, more = WalkOutcome(None, 0, bound, error), ()
        bound, tried = max(bound, found.bound), tried + found.tried
        first = first or found.run
        if found.stopped is not None:
            stopped = PlanningOutcome(None, first, tried, refused, bound, found.stopped)
            return _any_run(space, robots, broken, tracked, stopped, budget)
        if found.run is None or not more:
            return PlanningOutcome(found.run, first, tried, refused, bound)
        refused = refused or failing(found.run)
        tracked.update(more)


def _any_run(  # as many as the search has that was stopped
    space: Callable[[Collection[int]], SearchSpace],
    robots: int,
    broken: Callable[[TeamRun], Sequence[int]],
    tracked: Collection[int],
    stopped: PlanningOutcome,
    budget: Budget,
) -> PlanningOutcome:
    """Look for runs that every order keeps, where the search for a cheapest one was stopped, and take the cheapest that is found.

    First each robot flies by itself, then the best of these with each other one, then those that fly in the cheapest run of the
    fixed order, at last all. Where that is too much, too, the estimate of the rest counts for more than what was spent
    (weighted A*, Pohl 1970). Of each, the conjuncts are tracked that orders break of what is found; of many robots, `tracked` from
    the beginning.

    Raises:
        TooLarge: None was found; the error that stopped the search.
    """
    assert stopped.stopped is not None
    third = replace(budget, states=max(1, budget.states // 3))
    few = replace(budget, states=max(1, third.states // robots))
    some = replace(budget, states=min(budget.states, _ALONE * few.states))

    def cheapest(flying: Collection[int], limit: Budget, weight: float, kept: set[int]) -> TeamRun | None:
        among = space(flying)
        with contextlib.suppress(TooLarge):  # of trying orders; another way may need fewer
            while (run := search_team(among.graph, among.states_for(sorted(kept)), limit, weight=weight).run) is not None:
                more = broken(run)
                if not more:
                    return run
                kept.update(more)
        return None

    found: list[TeamRun] = []
    if robots <= MAX_SINGLES:
        alone = {robot: run for robot in range(robots) if (run := cheapest({robot}, some, 1.0, set())) is not None}
        best = min(alone, key=lambda robot: alone[robot].cost, default=None)
        others = [] if best is None else [cheapest({best, robot}, few, 1.0, set()) for robot in range(robots) if robot != best]
        found += [*alone.values(), *(run for run in others if run is not None)]
    teams = [range(robots)]
    if stopped.first is not None:
        active = [robot for robot, path in enumerate(stopped.first.paths) if len(path) > 1]
        teams = [active, *teams] if len(active) < robots else teams
    for weight in GREEDY:
        for flying in teams:
            run = cheapest(flying, third, weight, set(tracked))
            found += [] if run is None else [run]
        if found:
            break
    if not found:
        raise stopped.stopped
    run = min(found, key=lambda run: run.cost)
    sure = run.cost <= stopped.bound + _ROUNDING
    return replace(stopped, run=run, first=stopped.first or run, stopped=None if sure else stopped.stopped)


def cheapest_path(team: Team, task: Task, budget: Budget) -> TeamRun | None:
    """Return a cheapest path of the team automaton with switches everywhere, in the systems' order, or None.

    Args:
        team: Whose graph.
        task: What is to be done.
        budget: Bound on the states.

    Raises:
        TooLarge: The budget of states was used up.
    """
    graph = ReducedGraph(team, *letter_classes(task))
    found = search_team(graph, TeamStates(graph, task), budget)
    if found.stopped is not None:
        raise found.stopped
    return found.run


def moves(graph: ReducedGraph, states: SearchStates, robot: int, node: int, at: int) -> Iterator[tuple[int, int, float]]:
    """Yield what the robot that flies may do next: (node, state, cost), without steps that gain nothing.

    Args:
        graph: The team's graph.
        states: The search's states.
        robot: The robot that flies.
        node: Where it is.
        at: The state.
    """
    label = graph.label[robot]
    for target, step in graph.successors(robot, node).edges:
        after = states.after(at, label[target])
        if after != DEAD and not (after == at and graph.redundant(robot, node, target, step)):
            yield target, after, step


def search_team(graph: ReducedGraph, states: SearchStates, budget: Budget, *, weight: float = 1.0) -> WalkOutcome:
    """Return a cheapest run whose words keep the tracked conjuncts in every order.

    This is A* (Hart, Nilsson and Raphael 1968); the estimates never fall by more than a step costs, so no state comes twice.

    Args:
        graph: The team's graph.
        states: What is remembered besides where the robots are.
        budget: Bounds on the states expanded and the complete plans looked at.
        weight: How much the estimate of the rest counts; with more than 1 some run is found sooner, not the cheapest.
    """
    robots, width = len(graph.start), graph.width
    begin = states.after(states.initial, graph.label[0][graph.start[0]])
    if begin == DEAD:
        return WalkOutcome(None, 0, UNREACHABLE)
    rest, places = states.rest, robots * width

    def successors(key: int) -> Iterator[tuple[int, float]]:
        if key < 0:  # the path is complete
            return
        at, place = divmod(key, places)
        robot, node = divmod(place, width)
        for target, after, step in moves(graph, states, robot, node, at):
            yield (after * robots + robot) * width + target, step
        ending = graph.successors(robot, node).ending
        if ending is not None and robot + 1 < robots:
            target = graph.start[robot + 1]
            between = states.handed_over(at)
            after = DEAD if between == DEAD else states.after(between, graph.label[robot + 1][target])
            if after != DEAD:
                yield (after * robots + robot + 1) * width + target, ending
        elif ending is not None and states.is_accepting(at):
            yield key - _COMPLETE, ending

    def heuristic(key: int) -> float:
        if key < 0:
            return 0.0
        at, place = divmod(key, places)
        return rest(at, *divmod(place, width))

    search = BestFirst([begin * places + graph.start[0]], successors, heuristic, weight=weight)
    tried = explored = 0
    for key, _, bound in search:
        if key < 0:
            tried += 1
            if states.holds_in_every_order((key + _COMPLETE) // places):
                reached = sum(1 for other in search.costs if other >= 0)
                run = TeamRun(_paths(graph, search.path(key)[:-1]), bound, explored, reached)
                return WalkOutcome(run, tried, bound if weight == 1.0 else 0.0)
            if tried >= budget.candidates:
                few = TooLarge("Finding a plan that holds in every order takes", tried + 1, "complete plans", budget.candidates)
                return WalkOutcome(None, tried, bound, few)
            continue
        explored += 1
        if explored > budget.states:
            return WalkOutcome(None, tried, bound, TooLarge("The search needs", explored, "states", budget.states))
    return WalkOutcome(None, tried, UNREACHABLE)


def _paths(graph: ReducedGraph, keys: Sequence[int]) -> tuple[tuple[int, ...], ...]:
    """Return each robot's nodes along a path."""
    robots = len(graph.start)
    paths: list[list[int]] = [[] for _ in range(robots)]
    for key in keys:
        robot, node = divmod(key % (robots * graph.width), graph.width)
        paths[robot].append(node)
    return tuple(graph.expand(robot, path) for robot, path in enumerate(paths))
