"""A nominal path made cheaper by the mission's rounds of cross-entropy, judged for all times.

The search begins at the path with ramped times: at one speed on every segment a spline that begins and ends at rest swings to
and fro around its waypoints, so time to get going and to come to rest is added where that makes it cheaper.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import replace
from operator import attrgetter, itemgetter

import numpy as np
from numpy.random import Generator

from ltlplan.paths.costs import WeightedCost, cost_of, plan_cost
from ltlplan.paths.cross_entropy.cross_entropy import Improvement, Watch, improve, minimise, options_of, searches
from ltlplan.paths.final_hover import until_hover
from ltlplan.paths.flight_times import lasts_too_long
from ltlplan.paths.path_result import candidate_plans, has_room_for_waits, keeps
from ltlplan.paths.sampling.path_problem import path_problem
from verify.data import Mission, RobotPlan, Waypoint

RAMPS = (0.5, 1.0)
"""s more on the first and on the last segment that are tried."""
_LONG_RAMPS = (0.25, *RAMPS, 2.0, 4.0)
"""Those of paths that are flown as they are laid."""
_SWINGS = 1.05
"""Times the least cost up to which a path does not swing: of those that do not, the soonest is taken."""
_LONG = 2.0
"""Times as long as a leg beside it, from where on a leg gets a point in its middle."""
_HALVINGS = 3
"""Times that legs are halved so, at the most."""
_STRAIGHT = 1e-9
"""m by which a way by a point on its line may be longer."""


def improved_path(
    mission: Mission, robot: str, nominal: RobotPlan, draws: Callable[[], Generator], watch: Watch | None = None
) -> Improvement:
    """Return what the mission's rounds of cross-entropy make of a nominal path, judged for all times.

    The search begins at the path with ramped times. Where nothing better that keeps clear is found it begins at the nominal
    path itself, which was judged. Where that is no better either, as often where regions overlap, it gets times by which it swings less. Where the
    path that is found lasts longer than vehicles fly, the nominal one stays.

    Args:
        mission: What must be kept; `planner` gives costs and the numbers of the search.
        robot: Whose costs count.
        nominal: Its path.
        draws: Returns the source of all draws of one search; asked again where a second search is needed.
        watch: Told of each round, for pictures.

    Raises:
        CostError: A cost term returns no number for a path.
    """
    found = _improved(mission.seen_by(robot), robot, nominal, draws, watch)
    if lasts_too_long(mission, robot, found.plan):
        return replace(found, plan=nominal)
    laps = nominal.cycle_waypoint is not None and not nominal.hovers  # hoops hold a spline to its legs by themselves
    laps = laps and not any(visit.region in mission.hoops for visit in nominal.visits)
    if mission.planner.iterations and (laps or (found.plan.times == nominal.times and nominal.cycle_waypoint is None)):
        steady = without_swings(mission, robot, nominal)
        return replace(found, plan=min(found.plan, steady, key=attrgetter("cost")) if laps else steady)
    return found


def _improved(
    mission: Mission, robot: str, nominal: RobotPlan, draws: Callable[[], Generator], watch: Watch | None
) -> Improvement:
    function = cost_of(mission, robot)
    if nominal.hovers:
        return _improved(mission, robot, until_hover(nominal), draws, watch).with_hover(nominal, function)
    ramped = with_ramped_times(nominal, function)
    found = improve(mission, robot, ramped, rng=draws(), watch=watch)
    if ramped is nominal or found.cost < found.nominal:
        return found
    problem = path_problem(mission, ramped, function)
    judged = candidate_plans(mission, ramped, problem, problem.nominal, found.nominal)
    if judged:
        priced = [plan.model_copy(update={"cost": plan_cost(plan, function)}) for plan in judged]
        return replace(found, plan=min(priced, key=attrgetter("cost")))
    return improve(mission, robot, nominal, rng=draws(), watch=watch)


def searched_cost(mission: Mission, robot: str, nominal: RobotPlan, rng: Generator) -> float:
    """Return the least cost that the mission's rounds of cross-entropy find; sampled paths only, no plan is made of them.

    Args:
        mission: What must be kept; `planner` gives costs and the numbers of the search.
        robot: Whose costs count.
        nominal: Its path, where the search begins.
        rng: Source of every draw.

    Raises:
        CostError: A cost term returns no number for a path.
    """
    mission = mission.seen_by(robot)
    function = cost_of(mission, robot)
    known = plan_cost(nominal, function)
    if len({w.position for w in nominal.waypoints}) < 3:
        return known
    problem = path_problem(mission, nominal, function)
    search, *others = searches(problem, options_of(mission))
    return min(known, minimise(problem.costs, search, rng=rng, others=others)[0].best_cost)


def with_ramped_times(plan: RobotPlan, cost: WeightedCost) -> RobotPlan:
    """Return a plan with more time to get going and to come to rest, where that makes its spline cheaper."""
    if len(plan.waypoints) < 3:
        return plan
    best, least = plan, plan_cost(plan, cost)
    for ramp in RAMPS:
        other = _ramped(plan, ramp)
        value = plan_cost(other, cost)
        if value < least * (1 - 1e-3):
            best, least = other, value
    return best


def without_swings(mission: Mission, robot: str, nominal: RobotPlan) -> RobotPlan:
    """Return a nominal path whose spline does not swing to and fro: it gets going and comes to rest slowly, and keeps to long legs by their middles.

    That is for paths that are flown as they are laid, as those of robots that wait for each other. Points that only keep a spline to its leg
    are left out first, so that what is beside a path decides nothing where a steady one keeps clear of it.

    Args:
        mission: What must be kept, and what counts.
        robot: Whose path.
        nominal: Its path.
    """
    if len(nominal.waypoints) < 3:
        return nominal
    function = cost_of(mission, robot)
    bare = nominal if nominal.cycle_waypoint is not None else _without_straighteners(nominal)
    finer = itertools.accumulate(range(_HALVINGS), lambda form, _: _with_middles(form), initial=bare)
    ways = [nominal, *(_ramped(form, ramp) for form in dict.fromkeys((nominal, *finer)) for ramp in (0.0, *_LONG_RAMPS))]
    priced = sorted(((plan_cost(way, function), way) for way in ways), key=itemgetter(0))
    if nominal == bare and nominal.cost <= _SWINGS * priced[0][0]:
        return nominal
    problem = path_problem(mission.seen_by(robot), nominal, function)

    def flown(way: RobotPlan) -> bool:
        fits = has_room_for_waits(mission, way, nominal) and not lasts_too_long(mission, robot, way)
        return way is nominal or (fits and keeps(problem, way))

    least = next(cost for cost, way in priced if flown(way))
    steady = sorted(((way.times[-1], cost, way) for cost, way in priced if cost <= _SWINGS * least), key=itemgetter(0, 1))
    return next(way.model_copy(update={"cost": cost}) for _, cost, way in steady if flown(way))


def _without_straighteners(plan: RobotPlan) -> RobotPlan:
    """Return a plan without points that stand for nothing and lie on the line between their neighbours."""
    kept = [0]
    for k, (here, after) in enumerate(itertools.pairwise(plan.waypoints[1:]), start=1):
        a, b, c = (np.array(waypoint.position) for waypoint in (plan.waypoints[kept[-1]], here, after))
        bent = float(np.linalg.norm(b - a) + np.linalg.norm(c - b) - np.linalg.norm(c - a)) > _STRAIGHT
        if bent or here.role != "via" or here.region is not None:
            kept.append(k)
    kept.append(len(plan.waypoints) - 1)
    return plan.model_copy(
        update={"waypoints": tuple(plan.waypoints[k] for k in kept), "times": tuple(plan.times[k] for k in kept)}
    )


def _with_middles(plan: RobotPlan) -> RobotPlan:
    """Return a plan with a point in the middle of each leg that is much longer than a leg beside it, where its spline swings."""
    lengths = [math.dist(a.position, b.position) for a, b in itertools.pairwise(plan.waypoints)]
    waypoints, times, begins = [plan.waypoints[0]], [plan.times[0]], plan.cycle_waypoint
    for k, (a, b) in enumerate(itertools.pairwise(plan.waypoints)):
        if lengths[k] > _LONG * min(lengths[max(k - 1, 0) : k + 2]):
            x, y, z = np.add(a.position, b.position) / 2.0
            waypoints.append(Waypoint(position=(float(x), float(y), float(z)), role="via", visit=b.visit))
            times.append((plan.times[k] + plan.times[k + 1]) / 2.0)
        waypoints.append(b)
        times.append(plan.times[k + 1])
        if k + 1 == plan.cycle_waypoint:
            begins = len(waypoints) - 1
    return plan.model_copy(update={"waypoints": tuple(waypoints), "times": tuple(times), "cycle_waypoint": begins})


def _ramped(plan: RobotPlan, ramp: float) -> RobotPlan:
    """Return a plan whose first and last segment take longer, s."""
    longer = np.diff(plan.times)
    longer[0] += ramp
    longer[-1] += ramp
    return plan.model_copy(update={"times": (0.0, *(float(t) for t in np.cumsum(longer)))})
