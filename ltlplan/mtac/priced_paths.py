"""Costs of robots' paths by cross-entropy, each path optimised once, all with the same draws."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable

import numpy as np

from ltlplan.allocation import Itinerary
from ltlplan.paths.costs import cost_of
from ltlplan.paths.cross_entropy.cross_entropy import Improvement
from ltlplan.paths.flight_times import require_endurance
from ltlplan.paths.hoops import route_itinerary
from ltlplan.paths.improvement import improved_path, searched_cost, with_ramped_times
from verify.data import Infeasible, Mission, RobotPlan


class PricedPaths:
    """The paths that were optimised so far.

    Attributes:
        tried: What was optimised, with nominal path and cost.
    """

    def __init__(self, mission: Mission, seed: int) -> None:
        """Begin with none.

        Args:
            mission: Gives costs and the numbers of cross-entropy.
            seed: Of all draws.
        """
        self._mission, self._seed = mission, seed
        self.tried: dict[Hashable, tuple[RobotPlan, float]] = {}

    def cost(self, robot: str, key: Hashable, does: Callable[[], Itinerary]) -> float:
        """Cost-to-go (line 7): the cost of a robot's whole path so far, by cross-entropy; infinite where there is no way.

        Args:
            robot: Whose path.
            key: Tells what it does.
            does: Returns what it does.
        """
        if (robot, key) not in self.tried:
            what = does()
            try:
                nominal = with_ramped_times(route_itinerary(self._mission, robot, what), cost_of(self._mission, robot))
                require_endurance(self._mission, robot, nominal)
                cost = searched_cost(self._mission, robot, nominal, np.random.default_rng(self._seed))
            except Infeasible:
                return math.inf
            self.tried[robot, key] = nominal, cost
        return self.tried[robot, key][1]

    def best(self, robot: str, does: Itinerary) -> Improvement:
        """Return the path whose cost was found, judged for all times.

        Args:
            robot: Whose path.
            does: What it does.
        """
        nominal = route_itinerary(self._mission, robot, does)
        return improved_path(self._mission, robot, nominal, lambda: np.random.default_rng(self._seed))
