"""What legs cost before any path is laid: at the least, and about.

A leg of `length` and `time` costs at least what the straight line between the nearest points of its regions costs at the nominal speed. `energy` is at least the time, for the thrust's mean is hover, and its
power is convex in it. `effort` is bounded once for each robot that flies: from rest up to the mean speed and, unless it
flies for ever, back. Of every other term it is known only that it is not negative.
"""

from __future__ import annotations

import itertools
import math
from functools import cache

import numpy as np

from ltlplan.paths.costs import Sampling, WeightedCost, cost_of, evaluate
from ltlplan.paths.improvement import RAMPS
from ltlplan.paths.sampling.least_snap_spline import LeastSnapSpline
from ltlplan.systems.robot_systems import Systems, weighted_metres
from ltlplan.systems.transition_systems import Cost
from verify.data import Mission
from verify.data.arrays import Floats
from verify.data.shapes.inequalities import Point

_FAR = 1e5  # in place of infinite costs
_SAMPLES = 64
_SHORTEST = 1e-3  # m; shorter legs are priced as this long


def least_rates(mission: Mission) -> dict[str, float]:
    """Return what a metre costs each robot at the least, by its own weights."""
    found = weighted_metres(mission)
    for robot in found:
        found[robot] += mission.weights_of(robot).get("energy", 0.0) / mission.seen_by(robot).planner.speed
    return found


def least_costs(mission: Mission) -> Cost:
    """Return a lower bound on the cost of each leg: of the straight line between a start or region and the next region, at their nearest.

    Paths need not lead through the middles of regions, so that each region's outer radius is taken off at both ends.

    Args:
        mission: Gives regions, weights and speeds.
    """
    straight, rates, regions = Systems(mission), least_rates(mission), mission.all_regions
    ends = 1.0 if mission.spec.trace == "infinite" else 2.0

    def leg(robot: str, start: Point | str, region: str) -> float:
        if not math.isfinite(straight.leg(robot, start, region)):
            return _FAR
        goal, speed = regions[region], straight.nominal_speed(robot)
        here, around = (regions[start].center, regions[start].outer_radius) if isinstance(start, str) else (start, 0.0)
        metres = max(0.0, math.dist(here, goal.center) - around - goal.outer_radius)
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
