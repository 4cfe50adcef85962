"""Objective of a mission: its cost terms by their names and weights, and which of them are counted leg by leg."""

from __future__ import annotations

from verify.data import Mission
from verify.data.sections import Costs

BY_LEGS = frozenset({"length", "time"})
"""Terms of which the sum over straight legs is what a search minimises exactly."""

BOUNDED = BY_LEGS | {"energy", "effort"}
"""Terms with a lower bound above 0."""

_DEFAULT = {"length": 1.0}


def terms_of(mission: Mission) -> frozenset[str]:
    """Return the names of all terms that weigh something for some robot."""
    return frozenset(name for robot in mission.agents for name, weight in mission.weights_of(robot).items() if weight > 0)


def is_counted_by_legs(mission: Mission) -> bool:
    """Return whether all terms are of those that are counted exactly leg by leg."""
    return terms_of(mission) <= BY_LEGS


def objective_text(mission: Mission) -> str | None:
    """Return what is minimised, for a person; None where it is the sum of all lengths, which a mission need not say."""
    own = {robot: {n: w for n, w in mission.weights_of(robot).items() if w > 0} for robot in mission.agents}
    longest = mission.planner.objective == "longest" and len(own) > 1
    if not longest and all(weights == _DEFAULT for weights in own.values()):
        return None
    alike = len({tuple(weights.items()) for weights in own.values()}) == 1
    said = {robot: " + ".join(f"{weight:g} {name}" for name, weight in weights.items()) for robot, weights in own.items()}
    each = next(iter(said.values())) if alike else "; ".join(f"{robot}: {terms}" for robot, terms in said.items())
    what = "the robot that costs most" if longest else "the robots' sum" if len(own) > 1 else "the path"
    return f"{what}, {each}"


def flown_speed(mission: Mission, robot: str) -> float:
    """Return the speed by which planning counts a robot's time in the air, m/s: its nominal one, or its pace's share of its limit.

    Flights keep their speed limit nearly all the time at best, so few are refused in vain; the certificate has the last word on endurance.

    Args:
        mission: Gives speeds and paces.
        robot: Its name.
    """
    pace = mission.pace_of(robot)
    return mission.seen_by(robot).planner.speed if isinstance(pace, str) else pace * mission.limits_of(robot).speed


def flown_weights(mission: Mission, robot: str) -> Costs:
    """Return the weights of a robot's path at the nominal speed, with its time weighed as at the greatest speed of its pace.

    What a path costs by them is about what its flight costs, and no straight leg costs more than is flown of it. At the pace `nominal` they
    are the mission's own.

    Args:
        mission: Gives weights, speeds and paces.
        robot: Whose path.
    """
    weights = mission.weights_of(robot)
    if mission.pace_of(robot) == "nominal" or not weights.get("time"):
        return weights
    return {**weights, "time": weights["time"] * mission.seen_by(robot).planner.speed / flown_speed(mission, robot)}
