"""MTAC-E, offline: who does what, by the costs of the very paths that would be flown (2022 paper, Algorithm 2).

    state p of the team automaton -> for each neighbour q: cost-to-go by cross-entropy, along the robot's own path so far
    q in the decomposition set    -> the other robots are asked as well; the cheapest goes on

What the printed algorithm leaves open is decided like this.

* It does not advance p when no robot is switched. Here each round takes the best neighbour, whoever it belongs to.
* It reads costs of robots that may not have been computed. Here a robot that has not flown yet costs what it costs to
  do nothing (0, or the way to its end point), and the cost of a choice is the team's: the sum, or the dearest robot's.
* Nothing tells it which neighbour leads to acceptance. Here the cost-to-go of a neighbour is the cross-entropy cost of the
  path up to it plus a lower bound on what is then left (`admissible_heuristic`), so a walk heads for acceptance.
* "The cheapest robot continues" is a walk without return. Here `width` walks go side by side; with 1 it is the paper's.
* Def. 4.7 hands over to robot r + 1 only. Here to any robot that has not flown: the order is part of the search.
* Pairwise decomposition does not make three tasks decompose, so a finished walk counts only if the words of all robots,
  idle ones too, hold in every order.
* Sets of tasks are as many as 2^n. From `many_tasks.MANY` tasks on tours are shared instead (`ltlplan.search.tours`), by the same costs.
* With `every_robot` all robots are optimised again at each state, as the paper does. Otherwise a choice whose lower bound
  is above a known cost is not optimised; that changes no result.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace

from numpy.random import Generator

from ltlplan.allocation import Allocation, Context, Itinerary
from ltlplan.logic.budget import DEFAULT_BUDGET, Budget
from ltlplan.mtac.admissible_heuristic import TeamModel
from ltlplan.mtac.agent_moves import RobotTask, World
from ltlplan.mtac.beam_search import BeamSearch, Options
from ltlplan.mtac.counting.tasks import is_shared_at_once, share_counted
from ltlplan.mtac.decomposable_task import Reader
from ltlplan.mtac.many_tasks import many_tasks, share_many
from ltlplan.mtac.optimality_gap import BestKnown, best_known, straight_cost, straight_line_costs
from ltlplan.mtac.priced_paths import PricedPaths
from ltlplan.paths.costs import team_cost
from ltlplan.paths.cross_entropy.cross_entropy import Improvement
from ltlplan.search.problem import TIES
from verify.data import BadInput, Infeasible, Mission
from verify.data.language.counting import require_plain
from verify.data.progress import Progress, silent

MOST_WALKED = 8
"""Conjuncts up to which the team automaton is walked where tours were not found."""


@dataclass(frozen=True, slots=True)
class Shared:
    """Result of the beam search.

    Attributes:
        paths: One for each robot, in the mission's order.
        order: Robots in the order in which tasks were handed over.
        cost: The objective.
        stops: Of each robot, as in an itinerary.
        tried: How many paths were optimised.
        prices: What paths cost, for more of them.
        least: Of many tasks: no assignment costs less, by straight lines or ways around obstacles.
    """

    paths: dict[str, Improvement]
    order: tuple[str, ...]
    cost: float
    stops: dict[str, tuple[int, ...]]
    tried: int
    prices: PricedPaths
    least: float | None = None

    @property
    def robots(self) -> dict[str, Itinerary]:
        """Itinerary of each robot along its path."""
        plans = ((name, path.plan) for name, path in self.paths.items())
        return {name: Itinerary(p.visits, p.word, p.cycle_visit, p.cost, self.stops[name]) for name, p in plans}


def mtac_e(mission: Mission, context: Context, *, options: Options | None = None) -> Allocation:
    """Share a mission among its robots so that the team's cost is low; the paths that words were priced by come with it.

    Handover is tried only in states of the decomposition set, where the rest of the mission may be done by another robot
    (2022 paper, Algorithm 2, lines 8 to 14). Where the beam finishes no words, those of the exact method are returned.

    Args:
        mission: What is asked; `planner` gives objective, costs and the numbers of cross-entropy.
        context: Source of draws, progress, legs that are blocked.
        options: How to search.

    Raises:
        BadInput: The trace is infinite.
        Unsatisfiable: No assignment satisfies the formula; the message says why.
        TooLarge: The exact search was asked, and used up its budget before it had an answer.
    """
    chosen = options or Options()
    if is_shared_at_once(mission):
        counted = None if context.blocked else share_counted(mission, context)
        if counted is None:
            return _exact(mission, context)
        return counted if mission.written.counts else _without_waits(mission, context, counted)
    budget = context.known.budget
    found = None
    if not context.blocked:
        found = share_tasks(mission, rng=context.rng, progress=context.progress, options=chosen, budget=budget)
    if found is None:
        return _exact(mission, context)
    known = best_known(mission, least=found.least, beside=budget) if chosen.optimality_gap else None
    exact = None if known is None or found.least is None else known.exact
    if exact is not None and exact.cost < straight_cost(mission, found.robots) - TIES:
        found = _by_exact_words(mission, exact, found.prices, found.cost, found.least) or found
    return _allocation(found, known)


def _exact(mission: Mission, context: Context) -> Allocation:
    """Return the exact method's allocation, with a note that it is not MTAC-E's."""
    from ltlplan.paths.k_best_words import exact

    answer = exact(mission, context)
    return replace(answer, notes=("MTAC-E finished no words; these are the exact search's.", *answer.notes))


def _by_exact_words(
    mission: Mission, exact: Allocation | None, paths: PricedPaths, below: float, least: float | None = None
) -> Shared | None:
    """Return the exact search's words with their very paths; None where robots wait in them, or these paths do not cost less."""
    if exact is None or exact.meetings or exact.precedences:  # paths of their own do not satisfy these
        return None
    with suppress(Infeasible):
        other = _shared(mission, paths, exact.robots, least=least)
        return other if other.cost < below else None
    return None


def _without_waits(mission: Mission, context: Context, waiting: Allocation) -> Allocation:
    """Return an allocation in which robots may wait, or the exact search's words without waits where their very paths cost less.

    A robot that is waited for flies the path that was planned together with the others'; the paths of words without waits are improved.
    """
    known = best_known(mission, least=waiting.lower_bound or 0.0, beside=context.known.budget)
    paths = PricedPaths(mission, int(context.rng.integers(2**63)))
    other = _by_exact_words(mission, known.exact, paths, waiting.cost - TIES)
    if other is None:
        return waiting
    found = _allocation(other, known)
    said = f"The exact search's words, in which nobody waits, cost {other.cost:.3f} by their improved paths, not {waiting.cost:.3f}."
    return replace(found, notes=(*waiting.notes[:1], said, *found.notes))


def _allocation(found: Shared, known: BestKnown | None) -> Allocation:
    plans = {name: path.plan for name, path in found.paths.items()}
    notes = [f"MTAC-E optimised {found.tried} paths; handed over in the order {', '.join(found.order) or 'of nobody'}."]
    if known is not None:
        notes.append(known.gap(found.robots))
    return Allocation(
        robots=found.robots, cost=found.cost, order=found.order, paths=plans, lower_bound=None if known is None else known.bound, notes=tuple(notes),
    )  # fmt: skip


def share_tasks(
    mission: Mission,
    *,
    rng: Generator,
    progress: Progress = silent,
    options: Options | None = None,
    budget: Budget = DEFAULT_BUDGET,
) -> Shared | None:
    """Search the team automaton as `mtac_e` does, or share many tasks in tours, and return what was found.

    Args:
        mission: What is asked; `planner` gives objective, costs and the numbers of cross-entropy.
        rng: Source of every draw.
        progress: Told a sentence and the share done, 0 to 1.
        options: How to search.
        budget: Where its watch asks for an end, the best walk so far is taken.

    Returns:
        None where the beam finished no words.

    Raises:
        BadInput: The trace is infinite, or the formula counts robots or names them (see `counted_tasks`).
    """
    if mission.spec.trace == "infinite":
        raise BadInput("MTAC-E shares tasks that end; laps for ever are planned by `method: exact`.")
    require_plain(mission.formula, "walks and tours of MTAC-E give each task to one robot and do not plan that")
    chosen, many = options or Options(), many_tasks(mission)
    if many is not None:
        paths = PricedPaths(mission, int(rng.integers(2**63)))
        shared = share_many(many, paths, rng=rng, width=chosen.width, progress=progress)
        if shared is not None:
            return _shared(mission, paths, shared, least=many.least())
        if len(many.own.task.parts) > MOST_WALKED:
            return None
    world = World(mission)
    starts = {robot: world.start(robot) for robot in mission.agents}
    reader = Reader(world)
    paths = PricedPaths(mission, int(rng.integers(2**63)))

    def price(robot: str, task: RobotTask) -> float:
        return paths.cost(robot, (task.moves, task.leaves), lambda: task.itinerary(world))

    def holds(tasks: Mapping[str, RobotTask]) -> bool:
        return reader.holds_in_every_order(
            {r: (world.letter(where), *tasks.get(r, RobotTask(where)).ahead) for r, where in starts.items()}
        )

    team = TeamModel(world, reader, starts, straight_line_costs(mission))
    best = BeamSearch(team, price=price, holds=holds, options=chosen).search(progress, budget)
    if best is None:
        return None
    tasks = {robot: best.tasks.get(robot, RobotTask(where)) for robot, where in starts.items()}
    return _shared(mission, paths, {robot: task.itinerary(world) for robot, task in tasks.items()}, best.order)


def _shared(
    mission: Mission,
    paths: PricedPaths,
    does: Mapping[str, Itinerary],
    order: tuple[str, ...] | None = None,
    least: float | None = None,
) -> Shared:
    """Return what robots do with their paths, judged for all times; by default all that visit something, in the mission's order."""
    order = tuple(robot for robot, own in does.items() if own.visits) if order is None else order
    found = {robot: paths.best(robot, own) for robot, own in does.items()}
    stops = {robot: own.stops or () for robot, own in does.items()}
    cost = team_cost(mission, [path.plan.cost for path in found.values()])
    return Shared(found, order, cost, stops, len(paths.tried), paths, least)
