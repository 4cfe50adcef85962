"""Cross-entropy optimisation of a nominal path (Algorithm 2 of the 2019 paper), a whole round at a time.

    ask: draw paths from a Gaussian    tell: keep the elite of those that satisfy the specification, fit the Gaussian to it

`Search` is a frozen value that knows nothing of paths: ask it for candidates, tell it their costs (infinite for those
that do not count). `minimise` is its loop over any cost of arrays; `improve` builds the path problem from one robot's
plan: the Gaussian is over n equidistant points of the nominal path, and only paths whose labels show the planned word,
through every hoop on the planned side, count. Paths that are kept are judged for all times before they are returned.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ltlplan.cost import Cost, cost_of, plan_cost
from ltlplan.path_result import candidate_plans, flown_pieces
from ltlplan.path_search import PathProblem, path_problem
from ltlplan.splines import Spline
from verify.data import BadInput, Mission, RobotPlan

Floats = NDArray[np.float64]
Progress = Callable[[str, float], None]

_SHORTLIST = 24  # at most this many of the best candidates are judged for all times
_PIECES = 30  # what the usual vehicle's memory holds, and one for a wait
_LARGE = 180  # coordinates
_SAME = 5e-3  # a plan with fewer waypoints is preferred where it costs at most this share more


@dataclass(frozen=True, kw_only=True)
class Options:
    """How to search.

    Attributes:
        samples: Candidates a round.
        elite: Share of a round that the Gaussian is fitted to, 0.1 <= elite < 0.3.
        rounds: At most this many.
        target: Stop once the best cost is not above it.
        smoothing: Weight of the elite's mean against the old mean, 0 < smoothing <= 1.
        covariance_smoothing: Weight of the elite's covariance against the old one, 0 < covariance_smoothing <= 1; by
            default m / (m + 10 n) for an elite of m in n dimensions, at least 0.1: few elites know little of a covariance.
        floor: Least standard deviation in any direction, in the unit of the candidates.
    """

    samples: int = 200
    elite: float = 0.25
    rounds: int = 50
    target: float = 0.0
    smoothing: float = 1.0
    covariance_smoothing: float | None = None
    floor: float = 1e-5

    def __post_init__(self) -> None:
        if not 0.1 <= self.elite < 0.3:
            raise BadInput(f"elite is {self.elite:g}; it must be at least 0.1 and below 0.3.")
        if self.samples < 2 or math.ceil(self.samples * self.elite) < 2:
            raise BadInput(f"{self.samples} samples at elite {self.elite:g} leave fewer than 2 elites; use more samples.")
        if self.rounds < 0:
            raise BadInput(f"rounds is {self.rounds}; it must be 0 or more.")
        for name, value in (("smoothing", self.smoothing), ("covariance_smoothing", self.covariance_smoothing)):
            if value is not None and not 0 < value <= 1:
                raise BadInput(f"{name} is {value:g}; it must be above 0 and at most 1.")
        if not (self.floor >= 0 and math.isfinite(self.floor)):
            raise BadInput(f"floor is {self.floor:g}; it must be 0 or more.")
        if math.isnan(self.target):
            raise BadInput("target is not a number.")


@dataclass(frozen=True, eq=False)
class Search:
    """The Gaussian, and the best candidate seen.

    Attributes:
        mean: Shape (size,).
        covariance: Shape (size, size).
        best: The candidate with the least cost so far; the first mean until one counted. Shape (size,).
        best_cost: Its cost; infinite until one counted.
        options: How to search.
    """

    mean: Floats
    covariance: Floats
    best: Floats
    best_cost: float
    options: Options

    @classmethod
    def start(cls, mean: ArrayLike, covariance: ArrayLike, options: Options, best_cost: float = math.inf) -> Search:
        """Begin at a mean, whose own cost may be given.

        Raises:
            BadInput: The shapes do not fit, a number is not finite, or the covariance is not symmetric with a
                positive diagonal.
        """
        centre, spread = np.array(mean, dtype=np.float64), np.array(covariance, dtype=np.float64)
        if centre.ndim != 1 or len(centre) == 0 or spread.shape != (len(centre), len(centre)):
            raise BadInput(f"mean must have shape (n,) and covariance (n, n), not {centre.shape} and {spread.shape}.")
        if not (np.all(np.isfinite(centre)) and np.all(np.isfinite(spread))):
            raise BadInput("mean and covariance must be finite.")
        if not np.allclose(spread, spread.T, rtol=1e-9, atol=1e-12) or np.any(np.diag(spread) <= 0):
            raise BadInput("covariance must be symmetric with a positive diagonal.")
        return cls(centre, spread, centre, best_cost, options)

    def ask(self, rng: np.random.Generator) -> Floats:
        """Draw one round of candidates. Shape (samples, size)."""
        values, vectors = np.linalg.eigh(self.covariance)
        root = vectors * np.sqrt(np.maximum(values, self.options.floor**2))
        return self.mean + rng.standard_normal((self.options.samples, len(self.mean))) @ root.T

    def tell(self, candidates: Floats, costs: Floats) -> Search:
        """Return the search after a round.

        The elite is `elite` times the round, or fewer where fewer candidates have a finite cost. Fewer than two leave the
        mean where it is and halve the spread: the round was drawn too widely for the specification.

        The update is the maximum-likelihood fit to the elite, weighted by rank. Its covariance is taken about the old
        mean: about the elite's own mean, as the paper leaves it open, the spread dies along the very direction in which
        the costs fall, and the search stops half way.

        Raises:
            BadInput: A cost is not a number.
        """
        if np.any(np.isnan(costs)):
            raise BadInput(f"The cost of candidate {int(np.flatnonzero(np.isnan(costs))[0])} is not a number.")
        order = np.argsort(costs, kind="stable")
        order = order[np.isfinite(costs[order])]
        best, best_cost = self.best, self.best_cost
        if len(order) and costs[order[0]] < best_cost:
            best, best_cost = candidates[order[0]].copy(), float(costs[order[0]])
        count = math.ceil(self.options.elite * len(candidates))
        elites = candidates[order[:count]]
        if len(elites) < 2:
            return replace(self, covariance=self.covariance / 4, best=best, best_cost=best_cost)
        weights = math.log(count + 0.5) - np.log(np.arange(1, len(elites) + 1))
        weights /= weights.sum()
        alpha, beta = self.options.smoothing, self.options.covariance_smoothing
        beta = max(0.1, count / (count + 10 * len(self.mean))) if beta is None else beta
        mean = (1 - alpha) * self.mean + alpha * (weights @ elites)
        offset = elites - self.mean
        covariance = (1 - beta) * self.covariance + beta * (offset.T * weights) @ offset
        return replace(self, mean=mean, covariance=(covariance + covariance.T) / 2, best=best, best_cost=best_cost)


@dataclass(frozen=True, eq=False)
class Improvement:
    """What a search made of one robot's plan.

    Attributes:
        plan: The improved plan, or the nominal one where nothing better was found.
        cost: Its cost.
        nominal: The nominal plan's cost.
        history: Best cost after each round, the nominal plan's at most.
        kept: Share of each round's paths that counted.
    """

    plan: RobotPlan
    cost: float
    nominal: float
    history: tuple[float, ...]
    kept: tuple[float, ...]


Watch = Callable[[int, PathProblem, Floats, Floats], None]
"""Told of a round: its number, the problem, its candidates and their costs (infinite: does not count)."""


def minimise(
    cost: Callable[[Floats], ArrayLike],
    search: Search,
    *,
    rng: np.random.Generator,
    progress: Progress | None = None,
    watch: Callable[[int, Floats, Floats], None] | None = None,
) -> tuple[Search, tuple[float, ...]]:
    """Run a search to its target or its last round.

    Args:
        cost: Takes candidates of shape (samples, size) and returns one cost each; infinite where one does not count.
        search: Where to begin.
        rng: Source of every draw.
        progress: Told a sentence and the share of rounds done.
        watch: Told the number, candidates and costs of each round.

    Returns:
        The search after its last round, and the best cost after each round.
    """
    history: list[float] = []
    for index in range(search.options.rounds):
        if search.best_cost <= search.options.target:
            break
        candidates = search.ask(rng)
        costs = np.asarray(cost(candidates), dtype=np.float64)
        if costs.shape != (len(candidates),):
            raise BadInput(
                f"The cost returned shape {costs.shape} for {len(candidates)} candidates; one number each is needed."
            )
        search = search.tell(candidates, costs)
        history.append(search.best_cost)
        if watch is not None:
            watch(index, candidates, costs)
        if progress is not None:
            progress(f"round {index + 1}: best cost {search.best_cost:.4g}", (index + 1) / search.options.rounds)
    return search, tuple(history)


def improve(
    mission: Mission,
    robot: str,
    plan: RobotPlan,
    *,
    rng: np.random.Generator,
    options: Options | None = None,
    cost: Cost | None = None,
    points: int | None = None,
    spread: float = 0.06,
    progress: Progress | None = None,
    watch: Watch | None = None,
) -> Improvement:
    """Make one robot's nominal path cheaper by cross-entropy; its word, passages and ends stay.

    Args:
        mission: What must be kept.
        robot: Whose cost function counts.
        plan: The nominal path.
        rng: Source of every draw.
        options: How to search; by default the mission's `planner` says.
        cost: Named terms or any function of sampled paths; by default the robot's or the planner's own.
        points: n, how many points of the path are moved; by default one every 0.35 m, at most 20.
        spread: Initial standard deviation of each coordinate, m.
        progress: Told a sentence and the share done.
        watch: Told of each round, for pictures.

    Returns:
        A plan that is never worse than the nominal one, and that keeps its regions, rings and walls for all times by the
        planner's own judgement.

    Raises:
        BadInput: Options out of range, or a cost that returns no number for each path.
    """
    function = cost_of(mission, robot) if cost is None else cost
    chosen = options_of(mission) if options is None else options
    nominal = plan_cost(plan, function)
    plan = plan.model_copy(update={"cost": nominal})
    if len(plan.waypoints) < 3 or chosen.rounds == 0 or len({w.position for w in plan.waypoints}) < 3:
        return Improvement(plan, nominal, nominal, (), ())
    problem = path_problem(mission, plan, function, points=points)
    mean = problem.mean
    search = Search.start(mean, problem.covariance(spread), chosen, float(problem.costs(mean[None])[0]))
    if not math.isfinite(search.best_cost) and len(plan.waypoints) * 3 > 2 * _LARGE:
        return Improvement(plan, nominal, nominal, (), ())  # so few points cannot show so long a word
    shortlist: list[tuple[float, Floats]] = [(search.best_cost, mean)]
    kept: list[float] = []

    def look(index: int, candidates: Floats, costs: Floats) -> None:
        kept.append(float(np.mean(np.isfinite(costs))))
        first = int(np.argmin(costs))
        if costs[first] < shortlist[-1][0]:
            shortlist.append((float(costs[first]), candidates[first].copy()))
        if watch is not None:
            watch(index, problem, candidates, costs)

    _, history = minimise(problem.costs, search, rng=rng, progress=progress, watch=look)
    best, value, most = plan, nominal, max(_PIECES, flown_pieces(mission, plan))
    for _, candidate in shortlist[:-_SHORTLIST:-1]:
        paths = problem.paths(candidate[None])
        found = candidate_plans(mission, plan, problem, problem.points(candidate[None])[0], float(paths.length[0]))
        stretched = [_stretched(mission, other, float(paths.length[0]) / problem.length) for other in found]
        costs = [(plan_cost(other, function), i) for i, other in enumerate(stretched)]
        costs = [(c, i) for c, i in costs if c < nominal and flown_pieces(mission, stretched[i]) <= most]
        if costs:
            least = min(costs)[0]
            value, index = next(c for c in costs if c[0] <= least * (1 + _SAME))
            best = stretched[index].model_copy(update={"cost": value})
            break
    return Improvement(best, value, nominal, tuple(min(h, nominal) for h in history), tuple(kept))


def options_of(mission: Mission) -> Options:
    """Return the mission's own settings of the search."""
    planner = mission.planner
    return Options(samples=planner.samples, elite=planner.elite, rounds=planner.iterations, target=planner.target)


def _stretched(mission: Mission, plan: RobotPlan, scale: float) -> RobotPlan:
    """Return the plan flown `scale` times longer, or as much longer as its fastest sampled instant asks for."""
    spline = Spline(plan.times, plan.cycle_waypoint)
    at = np.linspace(plan.times[0], plan.times[-1], 600)
    velocity = spline.evaluate([w.position for w in plan.waypoints], at, 1)
    peak = float(np.max(np.linalg.norm(velocity, axis=1)))
    scale = max(scale, 1.02 * peak / mission.effective_limits.speed)
    return plan.model_copy(update={"times": tuple(time * scale for time in plan.times)})
