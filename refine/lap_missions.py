"""A mission as it is for a part of a team's flight, the prefix or one lap: a finite flight from and to given places."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from verify.data.errors import BadInput
from verify.data.mission import Mission
from verify.data.plan import RobotPlan
from verify.data.shapes.inequalities import Point


@dataclass(frozen=True, slots=True)
class Rest:
    """Position and heading of one robot's hover between cycles.

    Attributes:
        place: m.
        internal: Its internal state.
        visited: The region that it visited last, if any.
    """

    place: Point
    internal: str
    visited: str | None


def rest_after(mission: Mission, name: str, plan: RobotPlan) -> Rest:
    """Return how a robot rests when its lap begins, as it is planned.

    Args:
        mission: Gives its start.
        name: The robot's.
        plan: Its visits and waypoints, with where the cycle begins.

    Raises:
        BadInput: The plan does not say where its cycle begins.
    """
    if plan.cycle_visit is None or plan.cycle_waypoint is None:
        raise BadInput(f"{name}: the mission's trace is infinite, so its plan must say where its cycle begins.")
    once = plan.visits[: plan.cycle_visit]
    actions = [action for visit in once for action in visit.actions]
    internal = actions[-1].target if actions else mission.initial_internal(name)
    return Rest(plan.waypoints[plan.cycle_waypoint].position, internal, once[-1].region if once else None)


def before_laps(mission: Mission) -> Mission:
    """Return the mission of the prefix alone: a finite flight."""
    return mission.model_copy(update={"spec": mission.spec.model_copy(update={"trace": "finite", "repeat": 1})})


def one_lap(mission: Mission, rests: Mapping[str, Rest]) -> Mission:
    """Return the mission of one lap: a finite flight from where robots rest back to there.

    Args:
        mission: The whole one.
        rests: Of those robots that it is to hold for.
    """
    agents = dict(mission.agents)
    for name, rest in rests.items():
        visited = rest.visited or agents[name].visited
        changed = {"start": rest.place, "end": rest.place, "internal": rest.internal, "visited": visited}
        agents[name] = agents[name].model_copy(update=changed)
    return before_laps(mission).model_copy(update={"agents": agents})
