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
* With `every_robot` all robots are optimised again at each state, as the paper does. Otherwise a choice whose lower bound
  is above a known cost is not optimised; that changes no result.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from numpy.random import Generator

from ltlplan.allocation import Allocation, Context, Itinerary
from ltlplan.mtac.admissible_heuristic import TeamModel
from ltlplan.mtac.agent_moves import World
from ltlplan.mtac.beam_search import BeamSearch, Options
from ltlplan.mtac.optimality_gap import optimality_gap, straight_line_costs
from ltlplan.mtac.robot_tasks import RobotTask
from ltlplan.mtac.task_reader import Reader
from ltlplan.paths.costs import cost_of, team_cost
from ltlplan.paths.flight_times import lasts_too_long, require_endurance
from ltlplan.paths.hoops import route_itinerary
from ltlplan.paths.improvement import ImprovedPath, improved_path, own_draws, searched_cost, with_ramped_times
from verify.data import BadInput, Infeasible, Mission, RobotPlan, Word
from verify.data.progress import Progress, silent


@dataclass(frozen=True, slots=True)
class Shared:
    """What the beam search found.

    Attributes:
        paths: One for each robot, in the mission's order.
        order: Robots in the order in which tasks were handed over.
        cost: The objective.
        stops: Of each robot, as in an itinerary.
        tried: How many paths were optimised.
        consulted: The costs compared at each step: (robot, region) and the cost of the robot's path up to it.
    """

    paths: dict[str, ImprovedPath]
    order: tuple[str, ...]
    cost: float
    stops: dict[str, tuple[int, ...]]
    tried: int
    consulted: tuple[dict[tuple[str, str], float], ...] = ()


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
    found = None if context.blocked else share_tasks(mission, rng=context.rng, progress=context.progress, options=chosen)
    if found is None:
        from ltlplan.paths.priced_words import exact

        answer = exact(mission, context)
        return replace(answer, notes=("MTAC-E finished no words; these are the exact search's.", *answer.notes))
    plans = {name: path.plan for name, path in found.paths.items()}
    notes = [f"MTAC-E optimised {found.tried} paths; handed over in the order {', '.join(found.order) or 'of nobody'}."]
    bound = None
    if chosen.optimality_gap:
        gap, bound = optimality_gap(mission, {name: tuple(plans[name].visits[k] for k in found.stops[name]) for name in plans})
        notes.append(gap)
    return Allocation(
        robots={
            name: Itinerary(plan.visits, plan.word, plan.cycle_visit, plan.cost, found.stops[name]) for name, plan in plans.items()
        },
        cost=found.cost, order=found.order, paths=plans, lower_bound=bound, notes=tuple(notes),
    )  # fmt: skip


def share_tasks(
    mission: Mission, *, rng: Generator, progress: Progress = silent, options: Options | None = None
) -> Shared | None:
    """Search the team automaton as `mtac_e` does, and return what was found with the costs that were compared.

    Args:
        mission: What is asked; `planner` gives objective, costs and the numbers of cross-entropy.
        rng: Source of every draw.
        progress: Told a sentence and the share done, 0 to 1.
        options: How to search.

    Returns:
        None where the beam finished no words.

    Raises:
        BadInput: The trace is infinite.
    """
    if mission.spec.trace == "infinite":
        raise BadInput("MTAC-E shares tasks that end; laps for ever are planned by `method: exact`.")
    world = World(mission)
    starts = {robot: world.start(robot) for robot in mission.agents}
    reader = Reader(world)
    paths = _Paths(mission, world, int(rng.integers(2**63)))

    def holds(tasks: Mapping[str, RobotTask]) -> bool:
        return reader.holds_in_every_order(
            {r: (world.letter(where), *tasks.get(r, RobotTask(where)).ahead) for r, where in starts.items()}
        )

    team = TeamModel(
        world, reader, starts, begun=frozenset({reader.initial}), takes_off=True,
        in_decomposition_set=reader.in_decomposition_set, metric=straight_line_costs(mission),
    )  # fmt: skip
    search = BeamSearch(team, price=paths.cost, holds=holds, options=options or Options())
    best = search.search(progress)
    if best is None:
        return None
    tasks = {robot: best.tasks.get(robot, RobotTask(where)) for robot, where in starts.items()}
    found = {robot: paths.best(robot, task) for robot, task in tasks.items()}
    stops = {robot: task.itinerary(world).stops or () for robot, task in tasks.items()}
    cost = team_cost(mission, [path.plan.cost for path in found.values()])
    return Shared(found, best.order, cost, stops, len(paths.tried), tuple(search.consulted))


class _Paths:
    """The paths that were optimised so far, each once, with draws of its own."""

    def __init__(self, mission: Mission, world: World, seed: int) -> None:
        self.mission, self.world, self.seed = mission, world, seed
        self.tried: dict[tuple[object, ...], tuple[RobotPlan, float]] = {}

    def cost(self, robot: str, task: RobotTask) -> float:
        """Cost-to-go (line 7): the cost of a robot's whole path so far, by cross-entropy; infinite where there is no way."""
        key = (robot, task.moves, task.leaves)
        if key not in self.tried:
            does = task.itinerary(self.world)
            try:
                nominal = with_ramped_times(route_itinerary(self.mission, robot, does), cost_of(self.mission, robot))
                require_endurance(self.mission, robot, nominal)
                cost = searched_cost(self.mission, robot, nominal, self.draws(robot, does.word))
            except Infeasible:
                return math.inf
            self.tried[key] = nominal, cost
        return self.tried[key][1]

    def best(self, robot: str, task: RobotTask) -> ImprovedPath:
        """Return the path whose cost was found, judged for all times."""
        does = task.itinerary(self.world)
        nominal = route_itinerary(self.mission, robot, does)
        found = improved_path(self.mission, robot, nominal, lambda: self.draws(robot, does.word))
        return ImprovedPath(nominal, found.history) if lasts_too_long(self.mission, found.plan) else found

    def draws(self, robot: str, word: Word) -> Generator:
        """Return a source that depends on nothing but the seed, the robot and what it does."""
        return own_draws(self.seed, robot, word)
