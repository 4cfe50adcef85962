"""Cross-entropy optimisation of a nominal path (Algorithm 2 of the 2019 paper), a whole round at a time.

`Search` (`ltlplan.paths.cross_entropy.gaussian`) is one Gaussian, asked for candidates and told their costs; `Tournament` is several that share
a round, of which the best one stays. `minimise` is their loop over any cost of arrays; `improve` builds the path problem
from one robot's plan: the Gaussian is over n equidistant points of the nominal path, and only paths whose labels show the
planned word, through every hoop on the planned side, count. Paths that are kept are judged for all times before they are
returned.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from ltlplan.paths.costs import Cost, cost_of, plan_cost
from ltlplan.paths.cross_entropy.gaussian import Options, Search, Tournament
from ltlplan.paths.final_hover import then_hovering
from ltlplan.paths.path_result import candidate_plans, has_room_for_waits
from ltlplan.paths.sampling.least_snap_spline import LeastSnapSpline
from ltlplan.paths.sampling.path_problem import PathProblem, path_problem
from verify.data import Mission, RobotPlan
from verify.data.arrays import Floats

SPREAD = 0.06
"""m; standard deviation of each coordinate with which a search begins."""

_SHORTLIST = 24  # at most this many of the best candidates are judged for all times
_LARGE = 180  # coordinates
_SAME = 5e-3  # a plan with fewer waypoints is preferred where it costs at most this share more


@dataclass(frozen=True, eq=False)
class Improvement:
    """Result of the search for one robot's plan.

    Attributes:
        plan: The improved plan with its cost, or the nominal one where nothing better was found.
        nominal: The nominal plan's cost.
        history: Best cost after each round, the nominal plan's at most.
        kept: Share of each round's paths that counted.
    """

    plan: RobotPlan
    nominal: float
    history: tuple[float, ...]
    kept: tuple[float, ...]

    @property
    def cost(self) -> float:
        """The plan's cost."""
        return self.plan.cost

    def with_hover(self, nominal: RobotPlan, cost: Cost) -> Improvement:
        """Return the improvement of a lasso that hovers at its end, of which this is that of the flight up to the hover.

        Args:
            nominal: The lasso.
            cost: Named terms or any function of sampled paths.
        """
        plan = then_hovering(self.plan)
        plan = plan.model_copy(update={"cost": plan_cost(plan, cost)})
        hover = plan.cost - self.cost
        return Improvement(plan, plan_cost(nominal, cost), tuple(each + hover for each in self.history), self.kept)


Watch = Callable[[int, PathProblem, Floats, Floats], None]
"""Told of a round: its number, the problem, its candidates and their costs (infinite: does not count)."""


def minimise(
    cost: Callable[[Floats], ArrayLike],
    search: Search,
    *,
    rng: np.random.Generator,
    others: Sequence[Search] = (),
    watch: Callable[[int, Floats, Floats], bool | None] | None = None,
) -> tuple[Search, tuple[float, ...]]:
    """Run a search to its target or its last round.

    Args:
        cost: Takes candidates of shape (any number, size) and returns one cost each; infinite where one does not count.
        search: Where to begin, with its options.
        rng: Source of every draw.
        others: Where populations beside the first one begin, if the options ask for several.
        watch: Told the number, candidates and costs of each round; the search ends where it says True.

    Returns:
        The search after its last round (of several populations the best one's), and the best cost after each round.
    """
    history: list[float] = []
    options, state = search.options, Tournament.start(search, others)
    for index in range(options.rounds):
        if state.best.best_cost <= options.target:
            break
        seen: list[tuple[Floats, Floats]] = []
        for _ in options.sizes:
            candidates = state.ask(rng)
            costs = np.asarray(cost(candidates), dtype=np.float64)
            state = state.tell(candidates, costs)
            seen.append((candidates, costs))
        history.append(state.best.best_cost)
        enough = watch is not None and watch(
            index, np.concatenate([candidates for candidates, _ in seen]), np.concatenate([costs for _, costs in seen])
        )
        if enough:
            break
    return state.best, tuple(history)


# seven parameters: three say what is searched, the rest a caller names one at a time
def improve(
    mission: Mission,
    robot: str,
    plan: RobotPlan,
    *,
    rng: np.random.Generator,
    options: Options | None = None,
    cost: Cost | None = None,
    watch: Watch | None = None,
) -> Improvement:
    """Make one robot's nominal path cheaper by cross-entropy; its word, passages and ends stay.

    Args:
        mission: What must be kept.
        robot: Whose cost function counts.
        plan: The nominal path, which does not end in a hover for ever.
        rng: Source of every draw.
        options: How to search; by default the mission's `planner` says.
        cost: Named terms or any function of sampled paths; by default the robot's or the planner's own.
        watch: Told of each round, for pictures.

    Returns:
        A plan that is never worse than the nominal one, and that keeps its regions, rings and walls for all times by the
        planner's own judgement.

    Raises:
        CostError: The cost returns no number for each path.
    """
    function = cost_of(mission, robot) if cost is None else cost
    chosen = options_of(mission) if options is None else options
    nominal = plan_cost(plan, function)
    plan = plan.model_copy(update={"cost": nominal})
    if chosen.rounds == 0 or nominal <= chosen.target or len({w.position for w in plan.waypoints}) < 3:
        return Improvement(plan, nominal, (), ())
    problem = path_problem(mission, plan, function)
    # a sample below the target ends the search only if it is kept when it is judged for all times
    search, *others = searches(problem, replace(chosen, target=-math.inf))
    if not math.isfinite(search.best_cost) and len(plan.waypoints) * 3 > 2 * _LARGE:
        return Improvement(plan, nominal, (), ())  # so few points cannot show so long a word
    shortlist: list[tuple[float, Floats]] = [(search.best_cost, problem.mean)]
    kept: list[float] = []

    @cache
    def judged(index: int) -> RobotPlan:
        return _judged(mission, plan, problem, function, shortlist[index][1])

    def look(index: int, candidates: Floats, costs: Floats) -> bool:
        kept.append(float(np.mean(np.isfinite(costs))))
        if watch is not None:
            watch(index, problem, candidates, costs)
        first = int(np.argmin(costs))
        if not costs[first] < shortlist[-1][0]:
            return False
        shortlist.append((float(costs[first]), candidates[first].copy()))
        return shortlist[-1][0] <= chosen.target and judged(len(shortlist) - 1).cost <= chosen.target

    _, history = minimise(problem.costs, search, rng=rng, others=others, watch=look)
    cheapest_first = range(len(shortlist))[:-_SHORTLIST:-1]
    found = next((better for index in cheapest_first if (better := judged(index)).cost < nominal), plan)
    return Improvement(found, nominal, tuple(min(h, nominal) for h in history), tuple(kept))


def _judged(mission: Mission, plan: RobotPlan, problem: PathProblem, cost: Cost, candidate: Floats) -> RobotPlan:
    """Return the plan along a candidate, judged for all times, with its cost; the nominal one where none is better and keeps clear."""
    length = float(problem.paths(candidate[None]).length[0])
    found = candidate_plans(mission, plan, problem, problem.points(candidate[None])[0], length)
    stretched = [_stretched(mission, other, length / problem.length) for other in found]
    priced = [other.model_copy(update={"cost": plan_cost(other, cost)}) for other in stretched]
    better = [other for other in priced if other.cost < plan.cost and has_room_for_waits(mission, other, plan)]
    least = min((other.cost for other in better), default=0.0)
    return next((other for other in better if other.cost <= least * (1 + _SAME)), plan)


def searches(problem: PathProblem, options: Options) -> list[Search]:
    """Return where the populations begin, the nominal path first; no others where the options ask for one.

    Args:
        problem: The path as a search problem.
        options: How to search, with the number of populations.
    """
    starts = problem.starts() if options.gaussians > 1 else (problem.mean,)
    costs = problem.costs(np.array(starts))
    covariance = problem.covariance(SPREAD)
    return [Search.start(mean, covariance, options, float(cost)) for mean, cost in zip(starts, costs, strict=True)]


def options_of(mission: Mission) -> Options:
    """Return the mission's own settings of the search."""
    planner = mission.planner
    return Options(samples=planner.samples, elite=planner.elite, rounds=planner.iterations, target=planner.target)


def _stretched(mission: Mission, plan: RobotPlan, scale: float) -> RobotPlan:
    """Return the plan flown `scale` times longer, or as much longer as its fastest sampled instant asks for."""
    spline = LeastSnapSpline(plan.times, plan.cycle_waypoint)
    at = np.linspace(plan.times[0], plan.times[-1], 600)
    velocity = spline.evaluate([w.position for w in plan.waypoints], at, 1)
    peak = float(np.max(np.linalg.norm(velocity, axis=1)))
    scale = max(scale, 1.02 * peak / mission.effective_limits.speed)
    return plan.model_copy(update={"times": tuple(time * scale for time in plan.times)})
