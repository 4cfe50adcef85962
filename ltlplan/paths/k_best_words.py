"""The exact method: the cheapest words by the mission's own costs.

Where all terms are counted leg by leg (`ltlplan.systems.objective.BY_LEGS`) that is the exact search. Other terms, effort for one, are those of a path:
what a leg adds depends on the legs before it. Then words are listed that should cost little (`ltlplan.search.lawler`), nominal paths are laid along them, those of the cheapest few are
improved, and the words whose paths cost least are taken; where robots wait for each other or begin laps together, of a few that were
planned together. A lower bound, from one more exact search over what each leg costs at the least, says how far from the best they can be.

Before any path is laid it is known what legs cost at the least (`least_costs`), and about (`expected_costs`). A leg of `length` and `time` costs at least what the straight line between the nearest points of its regions costs at the nominal speed. `energy` is at least the time, for the thrust's mean is hover, and its
power is convex in it. `effort` is bounded once for each robot that flies: from rest up to the mean speed and, unless it
flies for ever, back. Of every other term it is known only that it is not negative.
"""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from operator import itemgetter

import numpy as np

from ltlplan.allocation import Allocation, Context, Itinerary, Known, Leg
from ltlplan.logic.budget import DEFAULT_BUDGET, Budget, TooLarge
from ltlplan.logic.signed_parts import signed_parts
from ltlplan.paths.costs import Sampling, WeightedCost, cost_by_legs, cost_of, evaluate, plan_cost, team_cost
from ltlplan.paths.hoops.sequencer import metres_of_laps
from ltlplan.paths.improvement import RAMPS, improved_path, with_ramped_times
from ltlplan.paths.sampling.least_snap_spline import LeastSnapSpline
from ltlplan.paths.team_laps import cost_of_all_laps, lay_laps
from ltlplan.paths.unnamed_regions import finished, lay_beside
from ltlplan.search.exact import assign, shutting
from ltlplan.search.exact import exact as exact_by_legs
from ltlplan.search.lawler import Partition
from ltlplan.search.memoization import memoized
from ltlplan.search.problem import TIES
from ltlplan.systems.gaps import gap_of, least_metres
from ltlplan.systems.objective import BOUNDED, is_counted_by_legs, terms_of
from ltlplan.systems.robot_systems import Systems, weighted_metres
from ltlplan.systems.touching_points import distance_to_touch, is_large, touching_depth, words_touch
from ltlplan.systems.transition_systems import Cost
from verify.data import Infeasible, Mission, RobotPlan, Unsatisfiable
from verify.data.arrays import Floats
from verify.data.shapes.inequalities import Point

_PRICED = 24  # allocations along which paths are laid, about
_IMPROVED = 4  # of these, the cheapest ones, whose paths are improved
_BRANCHES = 30  # sets of legs without which some are looked for
_TOUCHING = 16  # sets of legs without which some are looked for that cost less where they touch regions
_WORTH = 0.03  # share of a price that an assignment with more visits saves at the least
_SMOOTH = 1e-3  # share by which a path that is smooth may be longer than its straight legs
_FEW = 6  # robots up to which each is tried alone, and all without each
_FAR = 1e5  # in place of infinite costs
_SAMPLES = 64
_SHORTEST = 1e-3  # m; shorter legs are priced as this long


def exact(mission: Mission, context: Context) -> Allocation:
    """Share a mission among its robots at the smallest cost.

    Args:
        mission: What is asked; `planner` and agents give terms and weights, `planner.objective` whether the sum counts or the longest.
        context: Source of draws for improved paths, progress, and legs that are blocked.

    Raises:
        Unsatisfiable: No words that these robots can fly satisfy the formula; the message says why.
        Infeasible: No way to share it brings all back before a vehicle's endurance ends.
        TooLarge: A budget was used up before an answer was found.
    """
    by_metres = exact_by_legs(mission, context)
    if is_counted_by_legs(mission):
        touched = _touched(mission)
        spaces = _TOUCHING // max(len(mission.agents), len(touched) - _TOUCHING)  # of more, touching saves little of much work
        return _priced_where_touched(mission, context, by_metres, spaces) if spaces and touched else by_metres
    if by_metres.meetings or by_metres.precedences or (mission.spec.trace == "infinite" and len(mission.agents) > 1):
        return _planned_together(mission, context, by_metres)
    prices = _Prices(mission)
    priced = _compared(mission, context, prices, by_metres)
    last = [found for price, found in priced if math.isfinite(price)][:_IMPROVED]
    if not last:
        return by_metres  # all are blocked: whoever lays the paths says why
    seed = int(context.rng.integers(2**63))
    flown = [{name: prices.improved(name, does, seed) for name, does in found.robots.items()} for found in last]
    costs = [team_cost(mission, [path.cost for path in paths.values()]) for paths in flown]
    best, paths = last[costs.index(min(costs))], flown[costs.index(min(costs))]
    robots = {name: replace(does, cost=paths[name].cost) for name, does in best.robots.items()}
    bound = lower_bound(mission, budget=context.known.budget.beside(DEFAULT_BUDGET)) if prices.bounded else None
    notes = (*best.notes, *_said(mission, len(priced), bounded=prices.bounded))
    return Allocation(robots=robots, cost=min(costs), paths=paths, lower_bound=bound, notes=notes)


def _planned_together(mission: Mission, context: Context, by_metres: Allocation) -> Allocation:
    """Return the allocation whose nominal paths cost least, of robots that wait for each other or begin laps together.

    Those are the cheapest ones by metres, by what legs cost at the least, and by what they should cost. Their words were planned
    together, so that the paths of one robot cannot be exchanged for others.
    """
    prices, shut, found = _Prices(mission), _Shut(context.blocked), [by_metres]
    for cost, metre in ((least_costs(mission), least_rates(mission)), (expected_costs(mission), weighted_metres(mission))):
        context.progress("pricing words by their paths", 0.05 + 0.1 * len(found))
        if (other := shut.within_reach(mission, cost, metre, context)) is not None:
            found.append(replace(other, lower_bound=None, complete=False))
    best = min(found, key=prices.of)
    bound = lower_bound(mission, budget=context.known.budget.beside(DEFAULT_BUDGET)) if prices.bounded else None
    said = [*_said(mission, len({_key(each) for each in found}), bounded=prices.bounded)]
    if prices.bounded and bound is None:
        said[1:] = ["No bound on costs is known."]
    return replace(best, lower_bound=bound, complete=False, notes=(*best.notes, *said))


def _touched(mission: Mission) -> frozenset[str]:
    """Return the regions that routes touch before their middles, among those that the formula may gain by visiting."""
    if not words_touch(mission):
        return frozenset()
    wanted = {node.name for node, gains in signed_parts(mission.formula) if gains and node.operator == "name"}
    return frozenset(name for name in wanted.intersection(mission.regions) if is_large(mission, name))


def _priced_where_touched(mission: Mission, context: Context, by_metres: Allocation, most: int) -> Allocation:
    """Return the assignment whose route is cheapest, of the one that is cheapest between middles and those that may be cheaper where regions are touched.

    Each leg between edges is as short as it may be, whatever comes before and after; so what these cost is a bound for all routes, and the
    first of which it is no lower than the best route ends the search.
    """
    laps = mission.spec.repeat if mission.spec.trace == "infinite" and len(mission.agents) == 1 else 1
    prices, legs, metre = _Prices(mission, laps), _legs_between_edges(mission), weighted_metres(mission)
    price, best, least, complete = prices.of(by_metres), by_metres, 0.0, False
    budget, touched = context.known.budget, _touched(mission)
    known = replace(context.known, budget=budget.of(max(1, budget.states // len(mission.agents) ** 2)))

    def solve(shut: _Shut) -> Iterator[tuple[float, Allocation]]:
        found = shut.cheapest(mission, legs, metre, known)
        if found is not None:
            yield found.lower_bound or 0.0, found

    spaces = Partition([_Shut(context.blocked)], solve, partial(_without_a_leg, mission), searches=most)
    with contextlib.suppress(TooLarge):
        for bound, _, _, found in spaces:
            last = len(spaces.searched) == most
            if last:  # cheaper ones may be missing, but of the first
                least = least or bound
            elif not least and touched.isdisjoint(visit.region for does in found.robots.values() for visit in does.visits):
                return by_metres  # nothing that touches is cheaper
            else:
                least, complete = max(least, bound), price <= (1.0 + _SMOOTH) * bound + TIES
            if not complete and (
                found.complete or cost_by_legs(mission, found.robots, legs) < cost_by_legs(mission, best.robots, legs)
            ):
                price, best = _cheaper((price, best), (prices.of(found), found))
            if complete or last:
                break
    return replace(best, cost=price, lower_bound=min(least, price), complete=complete)


def _cheaper(best: tuple[float, Allocation], other: tuple[float, Allocation]) -> tuple[float, Allocation]:
    """Return the cheaper one of two allocations with their prices; one with more visits only where it is worth them."""
    visits = [sum(len(does.visits) for does in found.robots.values()) for _, found in (best, other)]
    least = (1.0 - _WORTH) * best[0] if visits[1] > visits[0] else best[0]
    return other if other[0] < least else best


def _without_a_leg(mission: Mission, shut: _Shut, found: Allocation) -> Iterator[_Shut]:
    return (replace(shut, legs=shut.legs | {leg}) for leg in sorted(found.legs(mission), key=str))


def _legs_between_edges(mission: Mission) -> Cost:
    """Return a lower bound on the cost of each leg, where regions are touched and others come to in their middles.

    It is straight from edge to edge, and among obstacles no less than the way between middles without what lies between these and edges.
    """
    straight, rates, regions = Systems(mission), weighted_metres(mission), mission.all_regions
    depths = {name: touching_depth(mission, name) for name in _touched(mission)}
    reach = {name: float(np.linalg.norm(np.array(regions[name].half_lengths) - deep)) for name, deep in depths.items()}

    def leg(robot: str, start: Point | str, region: str) -> float:
        whole = straight.leg(robot, start, region)
        if not math.isfinite(whole) or start == region:
            return whole
        metres = gap_of(mission, start, region, depths)
        if region in depths and not isinstance(start, str):
            metres = distance_to_touch(mission, start, region)
        if mission.obstacles:
            inside = sum(reach.get(place, 0.0) for place in (start, region) if isinstance(place, str))
            metres = max(metres, straight.metres(robot, whole) - inside)
        return min(whole, rates[robot] * metres)

    return leg


def _said(mission: Mission, priced: int, *, bounded: bool) -> Iterator[str]:
    yield f"{priced} assignments were priced by their paths, and the cheapest was taken; that it is the cheapest of all is not proved."
    if unbounded := ", ".join(sorted(terms_of(mission) - BOUNDED)):
        yield (
            f"The lower bound counts {unbounded} as 0." if bounded else f"{unbounded} was below 0: no bound on costs is known."
        )


def lower_bound(mission: Mission, *, budget: Budget = DEFAULT_BUDGET) -> float | None:
    """Return what no plan's path costs less than, one lap and what leads to it; None where the search for it is too large.

    Args:
        mission: What is asked. Terms that have no bound of their own are counted as 0.
        budget: Bounds on the search.
    """
    once = mission if mission.spec.repeat == 1 else mission.changed(spec=mission.spec.model_copy(update={"repeat": 1}))
    rates = least_rates(once)
    try:
        bound = assign(once, cost=least_costs(once), metre=rates, budget=budget, explained=False).lower_bound
    except (TooLarge, Infeasible, Unsatisfiable):
        return None
    if bound is None:
        return None
    # Ways to ends are counted from the middles of the regions before them.
    widest = max((region.outer_radius for region in once.all_regions.values()), default=0.0)
    home = [rates[name] * widest for name, agent in once.agents.items() if agent.end is not None]
    spare = max(home, default=0.0) if once.planner.objective == "longest" else sum(home)
    return max(0.0, bound - spare - TIES)


def _compared(mission: Mission, context: Context, prices: _Prices, first: Allocation) -> list[tuple[float, Allocation]]:
    """Return allocations with what their nominal paths cost, the cheapest first.

    These are the one that is cheapest by metres, those that should be cheapest when all, all but one, or one of the robots fly, and
    what should be cheapest, or is shortest, without some leg of one of them, those whose paths cost least being taken apart first.
    """
    costs, metre = (expected_costs(mission), Systems(mission).leg), weighted_metres(mission)
    whole, keys = _Shut(context.blocked), {_key(first)}

    def solve(shut: _Shut) -> Iterator[tuple[float, Allocation]]:
        if shut == whole:
            yield prices.of(first), first
        for cost in costs if len(keys) < _PRICED else ():
            context.progress("pricing words by their paths", 0.05 + 0.1 * len(spaces.searched) / _BRANCHES)
            other = shut.within_reach(mission, cost, metre, context)
            if other is not None and _key(other) not in keys and not (other.meetings or other.precedences):
                keys.add(_key(other))
                allocation = Allocation(robots=other.robots, cost=other.cost, notes=other.notes)
                yield prices.of(allocation), allocation

    robots = frozenset(mission.agents) if 1 < len(mission.agents) <= _FEW else frozenset[str]()
    few = [*({robot} for robot in sorted(robots)), *(robots - {robot} for robot in sorted(robots))]
    spaces = Partition(
        [whole, *(_Shut(context.blocked, frozenset(each)) for each in few)],
        solve,
        partial(_without_a_leg, mission),
        searches=_BRANCHES,
    )
    return sorted(((cost, found) for cost, _, _, found in spaces), key=itemgetter(0))


@dataclass(frozen=True, slots=True)
class _Shut:
    """Restrictions on allocations: legs that they do without, and robots that stay where they are."""

    legs: frozenset[Leg]
    grounded: frozenset[str] = frozenset()

    def forbids(self, leg: Leg) -> bool:
        return leg in self.legs or leg[0] in self.grounded

    def within_reach(self, mission: Mission, cost: Cost, metre: Mapping[str, float], context: Context) -> Allocation | None:
        """Return the assignment that costs least without what is shut; None where there is none, or the search for it is too large."""
        with contextlib.suppress(TooLarge):
            return self.cheapest(mission, cost, metre, Known(budget=context.known.budget.beside(DEFAULT_BUDGET)))
        return None

    def cheapest(self, mission: Mission, cost: Cost, metre: Mapping[str, float], known: Known) -> Allocation | None:
        """Return the assignment that costs least without what is shut; None where there is none.

        Raises:
            TooLarge: The search for it is too large.
        """
        dear = shutting(cost, self.forbids)
        try:
            found = assign(mission, cost=dear, metre=metre, budget=known.budget, capacities=known.capacities)
        except (Infeasible, Unsatisfiable):
            return None
        return None if any(map(self.forbids, found.legs(mission))) else found


class _Prices:
    """Costs of allocations' nominal paths, each robot's path laid once. Of one robot's laps, where several are counted, legs count by metres.

    Attributes:
        bounded: Whether every term that has no bound of its own was at least 0 on all paths.
    """

    def __init__(self, mission: Mission, counted: int = 1) -> None:
        self._mission, self._counted = mission, counted
        self._laps = mission.spec.trace == "infinite" and len(mission.agents) > 1
        self._others = [WeightedCost(((name, 1.0),)) for name in sorted(terms_of(mission) - BOUNDED)]
        self._paths: dict[tuple[str, Itinerary], RobotPlan] = {}
        self.bounded = True

    def of(self, found: Allocation) -> float:
        """Return the objective of an allocation; infinite where a path is blocked."""
        return team_cost(self._mission, [self._price(name, does) for name, does in found.robots.items()])

    @memoized
    def _price(self, name: str, does: Itinerary) -> float:
        try:
            path, _ = (lay_laps if self._laps else lay_beside)(self._mission, name, does)
        except Infeasible:
            return math.inf
        if self._counted > 1:
            return weighted_metres(self._mission)[name] * metres_of_laps(self._counted, path)
        function, self._paths[name, does] = cost_of(self._mission, name), path
        ramped = path if path.hovers or self._laps else with_ramped_times(path, function)
        self.bounded = self.bounded and all(plan_cost(ramped, term) >= 0 for term in self._others)
        return cost_of_all_laps(self._mission, name, path) if self._laps else plan_cost(ramped, function)

    @memoized
    def improved(self, name: str, does: Itinerary, seed: int) -> RobotPlan:
        """Return what cross-entropy makes of a path that was laid, by draws that depend on nothing but the seed."""
        draws, laid = partial(np.random.default_rng, seed), self._paths[name, does]
        return finished(self._mission, name, does, laid, lambda few, path: improved_path(few, name, path, draws).plan)


def _key(found: Allocation) -> tuple[object, ...]:
    return tuple((name, does.visits, does.word, does.cycle_visit, does.stops) for name, does in found.robots.items())


def least_rates(mission: Mission) -> dict[str, float]:
    """Return what a metre costs each robot at the least, by its own weights."""
    return {
        robot: rate + mission.weights_of(robot).get("energy", 0.0) / mission.seen_by(robot).planner.speed
        for robot, rate in weighted_metres(mission).items()
    }


def least_costs(mission: Mission) -> Cost:
    """Return a lower bound on the cost of each leg: of the straight line between a start or region and the next region, at their nearest.

    Paths need not lead through the middles of regions, so that each region's outer radius is taken off at both ends; from a start the distance to a region's body counts.

    Args:
        mission: Gives regions, weights and speeds.
    """
    straight, rates = Systems(mission), least_rates(mission)
    ends = 1.0 if mission.spec.trace == "infinite" else 2.0
    least = cache(partial(least_metres, mission))  # whoever flies it

    def leg(robot: str, start: Point | str, region: str) -> float:
        if not math.isfinite(straight.leg(robot, start, region)):
            return _FAR
        speed = straight.nominal_speed(robot)
        metres = least(start, region)
        first = 0.0
        if not isinstance(start, str) and metres > 0.0:
            slowest = metres / (metres / speed + 2 * max(RAMPS))  # the mean speed with time to get going and to come to rest
            first = mission.weights_of(robot).get("effort", 0.0) * ends * slowest
        return rates[robot] * metres + first

    return leg


def expected_costs(mission: Mission) -> Cost:
    """Return about what each leg costs: a straight flight from rest; after another leg, what a turn to the side and a leg add.

    These are the mission's own terms on sampled paths, so they are known of terms of other packages as well.

    Args:
        mission: Gives regions, weights and speeds.
    """
    straight, rates = Systems(mission), weighted_metres(mission)
    centres = {name: np.array(region.center) for name, region in mission.all_regions.items()}
    functions = {robot: cost_of(mission, robot) for robot in mission.agents}

    @cache  # robots of the same weights and speed pay the same
    def price(function: WeightedCost, speed: float, start: Point | str, region: str, metres: float, rate: float) -> float:
        here = centres[start] if isinstance(start, str) else np.array(start)
        way = centres[region] - here
        if (far := float(np.linalg.norm(way))) < _SHORTEST:  # out of the region and back
            way, far = np.array([max(metres, _SHORTEST), 0.0, 0.0]), max(metres, _SHORTEST)
        if isinstance(start, str):
            level = np.array([-way[1], way[0], 0.0])
            side = level * (far / size) if (size := float(np.linalg.norm(level))) > 0 else np.array([far, 0.0, 0.0])
            cost = _flown(function, speed, here - side, here, here + way) - _flown(function, speed, here - side, here)
        else:
            cost = _flown(function, speed, here, here + way)
        cost += rate * max(0.0, metres - far)  # what ways around obstacles are longer
        return min(max(cost, 0.0), _FAR)

    def leg(robot: str, start: Point | str, region: str) -> float:
        metres = straight.metres(robot, straight.leg(robot, start, region))
        if not math.isfinite(metres):
            return _FAR
        return price(functions[robot], straight.nominal_speed(robot), start, region, metres, rates[robot])

    return leg


def _flown(function: WeightedCost, speed: float, *points: Floats) -> float:
    """Return the cost of a flight through points, at a mean speed on each line."""
    lengths = [float(np.linalg.norm(b - a)) for a, b in itertools.pairwise(points)]
    sampling = Sampling(LeastSnapSpline(np.cumsum([0.0, *lengths]) / speed), _SAMPLES)
    found = float(evaluate(function, sampling.paths(np.array(points)))[0])
    return found if math.isfinite(found) else _FAR
