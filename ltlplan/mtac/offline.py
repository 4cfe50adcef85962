"""MTAC-E, offline: who does what, by the costs of the very paths that would be flown (2022 paper, Algorithm 2).

    state p of the team automaton -> for each neighbour q: cost-to-go by cross-entropy, along the robot's own path so far
    q in the decomposition set    -> the other robots are asked as well; the cheapest goes on

What the printed algorithm leaves open is decided like this.

* It does not advance p when no robot is switched. Here each round takes the best neighbour, whoever it belongs to.
* It reads costs of robots that may not have been computed. Here a robot that has not flown yet costs what it costs to
  do nothing (0, or the way to its end point), and the cost of a choice is the team's: the sum, or the dearest robot's.
* Nothing tells it which neighbour leads to acceptance. Here the cost-to-go of a neighbour is the cross-entropy cost of the
  path up to it plus a lower bound on what is then left (`allocation.Outlook`), so a walk heads for acceptance.
* "The cheapest robot continues" is a walk without return. Here `width` walks go side by side; with 1 it is the paper's.
* Def. 4.7 hands over to robot r + 1 only. Here to any robot that has not flown: the order is part of the search.
* Pairwise decomposition does not make three tasks decompose, so a finished walk counts only if the words of all robots,
  idle ones too, hold in every order.
* With `every_robot` all robots are optimised again at each state, as the paper does. Otherwise a choice whose lower bound
  is above a known cost is not optimised; that changes no result.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.random import Generator

from ltlplan.mtac.allocation import Part, World
from ltlplan.mtac.beam_search import Options, Walker
from ltlplan.mtac.task_reader import Reader
from ltlplan.paths.costs import WeightedCost, cost_of, plan_cost
from ltlplan.paths.cross_entropy import Search, Watch, improve, minimise, options_of
from ltlplan.paths.final_hover import then_hovering, until_hover
from ltlplan.paths.hoops import route
from ltlplan.paths.path_problem import path_problem
from ltlplan.paths.path_result import candidate_plans
from verify.data import BadInput, Infeasible, Letter, Mission, Plan, RobotPlan, Word
from verify.data.mission import Point

if TYPE_CHECKING:
    from ltlplan.search.exact import Itinerary

Progress = Callable[[str, float], None]

RAMPS = (0.5, 1.0)
"""s more on the first and on the last segment that are tried."""

SPREAD = 0.06
"""m; the search's first standard deviation, as in `improve`."""


@dataclass(frozen=True, slots=True)
class Share:
    """One robot's part of an allocation, with the path that was found for it.

    Attributes:
        plan: Word, visits, waypoints, cost.
        history: Best cost after each round of cross-entropy.
    """

    plan: RobotPlan
    history: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Allocation:
    """What a walk found.

    Attributes:
        shares: One for each robot, in the mission's order.
        order: Robots in the order in which the walk handed over.
        cost: The objective.
        tried: How many paths were optimised.
        consulted: The costs compared at each step: (robot, region) and the cost of the robot's path up to it.
    """

    shares: dict[str, Share]
    order: tuple[str, ...]
    cost: float
    tried: int
    consulted: tuple[dict[tuple[str, str], float], ...] = ()


def allocate(mission: Mission, *, rng: Generator, progress: Progress | None = None, options: Options | None = None) -> Plan:
    """Share a mission among its robots so that the team's cost is low, and lay their paths.

    Handover is tried only in states of the decomposition set, where the rest of the mission may be done by another robot
    (2022 paper, Algorithm 2, lines 8 to 14).

    Args:
        mission: What is asked; `planner` gives objective, costs and the numbers of cross-entropy.
        rng: Source of every draw.
        progress: Told a sentence and the share done, 0 to 1.
        options: How to walk.

    Raises:
        Unsatisfiable: No assignment satisfies the formula; the message says why.
        Infeasible: An assignment exists, but no way between the hoops was found.
    """
    chosen = options or Options()
    found = walk(mission, rng=rng, progress=progress, options=chosen)
    plans = {name: share.plan for name, share in found.shares.items()}
    notes = [f"MTAC-E optimised {found.tried} paths; handed over in the order {', '.join(found.order) or 'of nobody'}."]
    bound = None
    if chosen.yardstick:
        gap, bound = yardstick(mission, plans)
        notes.append(gap)
    return Plan(
        mission=mission, robots=plans, method="mtac-e", seed=mission.planner.seed, cost=found.cost, lower_bound=bound,
        notes=tuple(notes),
    )  # fmt: skip


def walk(mission: Mission, *, rng: Generator, progress: Progress | None = None, options: Options | None = None) -> Allocation:
    """Walk over the team automaton as `allocate` does, and return what was found with the costs that were compared."""
    if mission.spec.trace == "infinite":
        raise BadInput("MTAC-E shares tasks that end; an infinite trace belongs to one robot: use `method: exact`.")
    world = World(mission)
    starts = {robot: world.start(robot) for robot in mission.agents}
    reader = Reader(world)
    paths = _Paths(mission, world, int(rng.integers(2**63)))

    def holds(parts: Mapping[str, Part]) -> bool:
        return reader.holds_in_every_order(
            {r: (world.letter(where), *parts.get(r, Part(where)).ahead(world)) for r, where in starts.items()}
        )

    walker = Walker(
        mission, world, reader, starts, begun=frozenset({reader.initial}), takes_off=True,
        divides=reader.divides, metric=metric(mission), price=paths.cost, holds=holds, options=options or Options(),
    )  # fmt: skip
    best = walker.search(progress or (lambda _sentence, _share: None))
    if best is None:
        return paths.by_exact_search(tuple(walker.consulted))
    shares = {robot: paths.share(robot, best.parts.get(robot, Part(where))) for robot, where in starts.items()}
    cost = objective(mission, [share.plan.cost for share in shares.values()])
    return Allocation(shares, best.order, cost, len(paths.tried), tuple(walker.consulted))


class _Paths:
    """The paths that were optimised so far, each once, with draws of its own."""

    def __init__(self, mission: Mission, world: World, seed: int) -> None:
        self.mission, self.world, self.seed = mission, world, seed
        self.tried: dict[tuple, tuple[RobotPlan, float]] = {}

    def cost(self, robot: str, part: Part) -> float:
        """Cost-to-go (line 7): the cost of a robot's whole path so far, by cross-entropy; infinite where there is no way."""
        key = (robot, part.moves, part.leaves)
        if key not in self.tried:
            word = self.word(part)
            try:
                nominal = calmed(route(self.mission, robot, part.visits, word=word), cost_of(self.mission, robot))
                cost = searched_cost(self.mission, robot, nominal, self.draws(robot, word))
            except Infeasible:
                return math.inf
            self.tried[key] = nominal, cost
        return self.tried[key][1]

    def share(self, robot: str, part: Part) -> Share:
        """Return the path whose cost was found, judged for all times."""
        word = self.word(part)
        nominal = route(self.mission, robot, part.visits, word=word)
        return improved(self.mission, robot, nominal, lambda: self.draws(robot, word))

    def word(self, part: Part) -> Word:
        """Return the word of a robot that does this from its start."""
        return Word(_merged((self.world.letter(part.where), *part.ahead(self.world))))

    def draws(self, robot: str, word: Word) -> Generator:
        """Return a source that depends on nothing but the seed, the robot and what it does."""
        return np.random.default_rng([self.seed, zlib.crc32(f"{robot} {word}".encode())])

    def by_exact_search(self, consulted: tuple[dict[tuple[str, str], float], ...]) -> Allocation:
        """Return the cheapest assignment whose paths can be laid, optimised, where no walk of the beam was finished.

        Raises:
            Unsatisfiable: There is none.
            Infeasible: There is one, but no way between the hoops.
        """
        from ltlplan.search.next_best import lay_cheapest

        def lay(robot: str, itinerary: Itinerary) -> RobotPlan:
            return route(self.mission, robot, itinerary.visits, itinerary.cycle_visit, word=itinerary.word)

        nominal = lay_cheapest(self.mission, lay).robots
        shares = {
            robot: improved(self.mission, robot, path, lambda i=index: np.random.default_rng([self.seed, i]))
            for index, (robot, path) in enumerate(nominal.items())
        }
        cost = objective(self.mission, [share.plan.cost for share in shares.values()])
        flown = tuple(robot for robot, share in shares.items() if share.plan.visits)
        return Allocation(shares, flown, cost, len(self.tried) + len(shares), consulted)


def searched_cost(mission: Mission, robot: str, nominal: RobotPlan, rng: Generator) -> float:
    """Return the least cost that the mission's rounds of cross-entropy find; sampled paths only, no plan is made of them."""
    function = cost_of(mission, robot)
    known = plan_cost(nominal, function)
    if len({w.position for w in nominal.waypoints}) < 3:
        return known
    problem = path_problem(mission, nominal, function)
    first = float(problem.costs(problem.mean[None])[0])
    search = Search.start(problem.mean, problem.covariance(SPREAD), options_of(mission), first)
    return min(known, minimise(problem.costs, search, rng=rng)[0].best_cost)


def improved(
    mission: Mission, robot: str, nominal: RobotPlan, draws: Callable[[], Generator], watch: Watch | None = None
) -> Share:
    """Return the path that the mission's rounds of cross-entropy make of a nominal one, judged for all times.

    The search begins at the calmed path. Where nothing better that keeps clear is found it begins at the nominal path
    itself, which was judged. `watch` is told of each round, for pictures.
    """
    function = cost_of(mission, robot)
    if nominal.hovers:
        share = improved(mission, robot, until_hover(nominal), draws, watch)
        plan = then_hovering(share.plan)
        return Share(plan.model_copy(update={"cost": plan_cost(plan, function)}), share.history)
    calm = calmed(nominal, function)
    found = improve(mission, robot, calm, rng=draws(), options=options_of(mission), watch=watch)
    if calm is nominal or found.cost < found.nominal:
        return Share(found.plan, found.history)
    problem = path_problem(mission, calm, function)
    judged = candidate_plans(mission, calm, problem, problem.nominal, found.nominal)
    if judged:
        best = min(judged, key=lambda plan: plan_cost(plan, function))
        return Share(best.model_copy(update={"cost": plan_cost(best, function)}), found.history)
    found = improve(mission, robot, nominal, rng=draws(), options=options_of(mission), watch=watch)
    return Share(found.plan, found.history)


def calmed(plan: RobotPlan, cost: WeightedCost) -> RobotPlan:
    """Return a plan with more time to get going and to come to rest, where that makes its spline cheaper.

    At one speed on every segment a spline that begins and ends at rest swings to and fro around its waypoints.
    """
    if len(plan.waypoints) < 3:
        return plan
    spans = np.diff(plan.times)
    best, least = plan, plan_cost(plan, cost)
    for ramp in RAMPS:
        longer = spans.copy()
        longer[0] += ramp
        longer[-1] += ramp
        other = plan.model_copy(update={"times": (0.0, *(float(t) for t in np.cumsum(longer)))})
        value = plan_cost(other, cost)
        if value < least * (1 - 1e-3):
            best, least = other, value
    return best


def metric(mission: Mission) -> Callable[[str, Point, str], float]:
    """Return a lower bound on the cost of one leg under each robot's own weights: metres of a straight line, and their time."""
    centres = {name: np.array(region.center) for name, region in mission.all_regions.items()}
    weights = {}
    for robot in mission.agents:
        cost = dict(cost_of(mission, robot).weights)
        weights[robot] = cost.get("length", 0.0) + cost.get("time", 0.0) / mission.planner.speed

    around = {name: 2.0 * min(region.radii) for name, region in mission.all_regions.items()}

    def leg(robot: str, position: Point, region: str) -> float:
        metres = float(np.linalg.norm(np.array(position) - centres[region]))
        return weights[robot] * (metres or around[region])  # a region that was just left is at least a way out and back

    return leg


def yardstick(mission: Mission, plans: Mapping[str, RobotPlan]) -> tuple[str, float | None]:
    """Compare an assignment with the exact one by straight lines.

    Returns:
        A sentence for a person, and the exact search's lower bound where it has one.
    """
    from ltlplan.search.exact import assign

    exact = assign(mission)
    ours = straight_cost(mission, plans)
    gap = 100.0 * (ours / exact.cost - 1.0) if exact.cost > 0 else 0.0
    sentence = f"By straight lines this assignment costs {ours:.3f}, the {'best' if exact.complete else 'best known'} one {exact.cost:.3f}"
    return f"{sentence}: a gap of {gap:.1f} %.", exact.lower_bound


def straight_cost(mission: Mission, plans: Mapping[str, RobotPlan]) -> float:
    """Return the objective of an assignment when every leg is a straight line, as the exact search counts."""
    costs = []
    leg = metric(mission)
    for robot, plan in plans.items():
        position, total = mission.agents[robot].start, 0.0
        for visit in plan.visits:
            inside = float(mission.all_regions[visit.region].level(np.array(position))) <= 1.0
            total += 0.0 if inside else leg(robot, position, visit.region)
            position = mission.all_regions[visit.region].center if not inside else position
        costs.append(total)
    return objective(mission, costs)


def objective(mission: Mission, costs: Collection[float]) -> float:
    """Return the team's cost: the sum of the robots', or the dearest robot's."""
    return max(costs) if mission.planner.objective == "longest" else sum(costs)


def _merged(letters: Iterable[Letter]) -> tuple[Letter, ...]:
    """Return letters without immediate repetitions."""
    result: list[Letter] = []
    for letter in letters:
        if not result or result[-1] != letter:
            result.append(letter)
    return tuple(result)
