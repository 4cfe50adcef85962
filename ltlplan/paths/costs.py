"""Costs of paths: named terms and any function of sampled paths, for a thousand paths at once.

A cost is a weighted sum of terms (`parse_cost("length=1,effort=0.5")`, a mission's `planner.cost`; see `cost_terms`) or a Python
function that takes `SampledPaths` and returns one number a path. Integrals are sums over the sampled instants (trapezoids): costs
guide a search and compare paths; the certificate never reads them.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import starmap
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ltlplan.paths.sampling.least_snap_spline import LeastSnapSpline
from ltlplan.search.memoization import memoized
from ltlplan.systems.objective import flown_weights
from verify.data import BadInput, Plan, RobotPlan, Trajectory
from verify.data.arrays import Floats
from verify.data.mission import Mission
from verify.data.names.choices import COST_TERMS
from verify.data.sections import Costs

if TYPE_CHECKING:
    from ltlplan.allocation import Itinerary
    from ltlplan.systems.transition_systems import Cost as LegCost


class CostError(BadInput):
    """A cost that cannot be used: an unknown term, a bad weight, a function that returns no finite number a path."""


class Sampling:
    """Sampling of a spline: matrices that turn points into sampled paths, shared by all paths of a round.

    Attributes:
        spline: Gives times and closes a lasso. Its times are those of a path with time scale 1.
        instants: s, equally spaced over the spline, both ends included. Shape (instants,).
    """

    def __init__(self, spline: LeastSnapSpline, count: int = 200) -> None:
        self.spline = spline
        self.instants = np.linspace(spline.times[0], spline.times[-1], count)

    @memoized
    def matrix(self, derivative: int) -> Floats:
        """Return the map from points to a derivative at the instants. Shape (instants, points)."""
        return np.ascontiguousarray(self.spline.sampling(self.instants, derivative))

    def paths(self, points: ArrayLike, scale: ArrayLike = 1.0) -> SampledPaths:
        """Return the paths through these points.

        Args:
            points: m. Shape (paths, points, 3), or (points, 3) for one path.
            scale: How many times longer each path takes than the spline's own times; one number or one a path.
        """
        values = np.asarray(points, dtype=np.float64)
        values = values[None] if values.ndim == 2 else values
        return SampledPaths(self, values, np.broadcast_to(np.asarray(scale, dtype=np.float64), len(values)))


@dataclass(frozen=True, eq=False)
class SampledPaths:
    """Many paths at many instants; derivatives are computed when they are asked for.

    Attributes:
        sampling: Instants and matrices.
        points: The points that each path goes through, m. Shape (paths, points, 3).
        scale: Each path's time scale. Shape (paths,).
    """

    sampling: Sampling
    points: Floats
    scale: Floats

    def __len__(self) -> int:
        return len(self.points)

    def axes(self, derivative: int) -> Floats:
        """Return a derivative of all paths in the layout of the computation, in m/s**derivative. Shape (instants, 3, paths)."""
        values = self.unscaled(derivative)
        return values if derivative == 0 or np.all(self.scale == 1.0) else values / self.scale**derivative

    @memoized
    def unscaled(self, derivative: int) -> Floats:
        """Return a derivative in the spline's own time, whatever the time scale. Shape (instants, 3, paths)."""
        if len(self) == 1:  # one path needs no matrix
            return self.sampling.spline.evaluate(self.points[0], self.sampling.instants, derivative)[:, :, None]
        flat = self.points.transpose(1, 2, 0).reshape(self.points.shape[1], -1)
        return (self.sampling.matrix(derivative) @ flat).reshape(-1, 3, len(self))

    @property
    def position(self) -> Floats:
        """M. Shape (paths, instants, 3)."""
        return self.axes(0).transpose(2, 0, 1)

    @property
    def velocity(self) -> Floats:
        """Velocities in m/s. Shape (paths, instants, 3)."""
        return self.axes(1).transpose(2, 0, 1)

    @property
    def acceleration(self) -> Floats:
        """Accelerations in m/s^2. Shape (paths, instants, 3)."""
        return self.axes(2).transpose(2, 0, 1)

    @property
    def snap(self) -> Floats:
        """Fourth derivatives in m/s^4. Shape (paths, instants, 3)."""
        return self.axes(4).transpose(2, 0, 1)

    @property
    def duration(self) -> Floats:
        """S. Shape (paths,)."""
        return self.scale * float(self.sampling.instants[-1] - self.sampling.instants[0])

    @cached_property
    def length(self) -> Floats:
        """M. Shape (paths,)."""
        return self.integral(norm(self.unscaled(1))) / self.scale

    def integral(self, values: Floats) -> Floats:
        """Integrate over each path's time. Shape (instants, paths) to (paths,)."""
        step = float(self.sampling.instants[1] - self.sampling.instants[0])
        return (values.sum(axis=0) - 0.5 * (values[0] + values[-1])) * (step * self.scale)

    def rescaled(self, scale: ArrayLike) -> SampledPaths:
        """Return the same paths flown in other times; what was computed is kept where time does not matter."""
        result = self.sampling.paths(self.points, scale)
        result.__dict__.update(unscaled=self.unscaled, length=self.length)  # a path is as long at any speed
        return result


def norm(values: Floats) -> Floats:
    """Return the Euclidean norm over the middle axis. Shape (instants, 3, paths) to (instants, paths)."""
    return np.sqrt(square(values))


def square(values: Floats) -> Floats:
    """Return the squared norm over the middle axis. Shape (instants, 3, paths) to (instants, paths)."""
    total = values[:, 0] * values[:, 0]
    total += values[:, 1] * values[:, 1]
    total += values[:, 2] * values[:, 2]
    return total


Cost = Callable[[SampledPaths], ArrayLike]
"""Takes sampled paths, returns one number a path."""


@dataclass(frozen=True)
class WeightedCost:
    """A weighted sum of named terms; call it with sampled paths.

    Attributes:
        weights: Term and weight, weights not negative and at least one above zero.
    """

    weights: tuple[tuple[str, float], ...]

    @classmethod
    def of(cls, weights: Mapping[str, float]) -> WeightedCost:
        """Return the sum of terms with some weights."""
        return cls(tuple(weights.items()))

    def __call__(self, paths: SampledPaths) -> Floats:
        """Return the weighted sum for each path. Shape (paths,)."""
        total = np.zeros(len(paths))
        for name, weight in self.weights:
            if weight:
                values = np.asarray(_term(name)(paths), dtype=np.float64)
                if values.shape != total.shape:
                    said = f"The cost term '{name}' returned shape {values.shape} for {len(paths)} paths"
                    raise CostError(f"{said}; it must return one number a path.")
                total += weight * values
        return total

    def __str__(self) -> str:
        return ",".join(f"{name}={weight:g}" for name, weight in self.weights)

    @property
    def time_matters(self) -> bool:
        """Return whether the cost of a path depends on how fast it is flown."""
        return any(weight > 0 and name != "length" for name, weight in self.weights)


def parse_cost(text: str) -> Costs:
    """Read weights such as `length=1,effort=0.5`.

    Returns:
        Weights by term, as `planner.cost` of a mission holds them.

    Raises:
        CostError: An unknown or repeated term, a weight that is no number or below zero, or no weight above zero.
    """
    weights: Costs = {}
    for part in text.split(","):
        name, equals, value = (piece.strip() for piece in part.partition("="))
        if not equals or not value:
            raise CostError(f"'{part.strip()}' is no cost; write terms with weights, such as length=1,effort=0.5.")
        _term(name)
        if name in weights:
            raise CostError(f"'{name}' is given twice.")
        try:
            weight = float(value)
        except ValueError:
            raise CostError(f"The weight of '{name}' is '{value}'; it must be a number such as 0.5.") from None
        if not (np.isfinite(weight) and weight >= 0):
            raise CostError(f"The weight of '{name}' is {weight}; it must be a finite number, not below zero.")
        weights[name] = weight
    if not any(weights.values()):
        raise CostError("A cost needs at least one term with a weight above zero.")
    return weights


def cost_of(mission: Mission, robot: str) -> WeightedCost:
    """Return a robot's own cost function, or the planner's."""
    return WeightedCost.of(flown_weights(mission, robot))


def team_cost(mission: Mission, costs: Collection[float]) -> float:
    """Return the objective: the sum of the robots' costs, or that of the dearest one."""
    return max(costs) if mission.planner.objective == "longest" else sum(costs)


def cost_by_legs(mission: Mission, robots: Mapping[str, Itinerary], leg: LegCost) -> float:
    """Return the objective by the legs that robots fly, those of a lap once.

    Args:
        mission: Gives starts and the objective.
        robots: What each robot does.
        leg: Cost of a leg.
    """
    return team_cost(mission, [sum(starmap(leg, does.route(mission, name))) for name, does in robots.items()])


def with_flown_times(plan: Plan, team: Mapping[str, Trajectory], before: Mapping[str, Trajectory] | None = None) -> Plan:
    """Return a plan whose costs weigh the time that is flown, waits included, in place of the time that was expected.

    Args:
        plan: As it was made, or as it was flown before.
        team: One flight a robot; of laps the first counts.
        before: The flights whose times its costs weigh already; None where they are the expected ones.
    """
    known = _expected_times(plan) if before is None else _flown_times(plan, before)
    return _with_times(plan, known, _flown_times(plan, team))


def with_expected_times(plan: Plan, team: Mapping[str, Trajectory]) -> Plan:
    """Return a plan whose costs weigh the expected time again, in place of a flight's.

    Args:
        plan: As it was flown.
        team: The flights whose times its costs weigh.
    """
    return _with_times(plan, _flown_times(plan, team), _expected_times(plan))


def for_mission(plan: Plan, mission: Mission) -> Plan:
    """Return a plan of the same mission at other paces or nominal speeds as one of the mission: its costs weigh the time expected there.

    Args:
        plan: As it was made.
        mission: Whose plan it becomes.
    """
    moved = plan.model_copy(update={"mission": mission})
    return _with_times(moved, _expected_times(plan), _expected_times(moved))


def _expected_times(plan: Plan) -> dict[str, float]:
    """Return what robots' times cost as planning expects them."""
    mission = plan.mission
    return {name: flown_weights(mission, name).get("time", 0.0) * float(robot.times[-1]) for name, robot in plan.robots.items()}


def _flown_times(plan: Plan, team: Mapping[str, Trajectory]) -> dict[str, float]:
    """Return what robots' times cost as they are flown."""
    return {name: plan.mission.weights_of(name).get("time", 0.0) * team[name].duration for name in plan.robots}


def _with_times(plan: Plan, before: Mapping[str, float], after: Mapping[str, float]) -> Plan:
    robots = {
        name: robot if robot.still else robot.model_copy(update={"cost": robot.cost + after[name] - before[name]})
        for name, robot in plan.robots.items()
    }
    if all(before[name] == after[name] for name in plan.robots):
        return plan
    return plan.model_copy(
        update={"robots": robots, "cost": team_cost(plan.mission, [robot.cost for robot in robots.values()])}
    )


def plan_cost(plan: RobotPlan, cost: Cost) -> float:
    """Return the cost of a plan's own spline at its own times; of a robot that stays where it is, 0."""
    if len(plan.waypoints) < 2:
        return 0.0
    sampling = Sampling(LeastSnapSpline(plan.times, plan.cycle_waypoint), max(400, 12 * len(plan.waypoints)))
    return float(evaluate(cost, sampling.paths([w.position for w in plan.waypoints]))[0])


def evaluate(cost: Cost, paths: SampledPaths) -> Floats:
    """Return the cost of each path, checked. Shape (paths,).

    Raises:
        CostError: The function returned another shape, or a number that is not finite (plus infinity is allowed and
            rules a path out); names the first such path.
    """
    values = np.asarray(cost(paths), dtype=np.float64)
    if values.shape != (len(paths),):
        raise CostError(f"The cost returned shape {values.shape} for {len(paths)} paths; it must return one number a path.")
    bad = np.flatnonzero(np.isnan(values) | np.isneginf(values))
    if len(bad):
        raise CostError(f"The cost is {values[bad[0]]} for path {bad[0]} of {len(paths)}; it must be a number for every path.")
    return values


def _term(name: str) -> Cost:
    """Return the function of a cost term.

    Raises:
        CostError: There is none, or it cannot be loaded.
    """
    try:
        return COST_TERMS.find(name)
    except BadInput as error:
        raise CostError(str(error)) from None
