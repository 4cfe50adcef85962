"""Paths beside regions that a formula does not name.

A planned path leads around all regions that it does not visit, as its word says. Those that the formula does not name are left out first. A path that keeps
clear of them anyway is the one that is flown without them; else they are put back.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

from ltlplan.allocation import Itinerary
from ltlplan.paths.final_hover import until_hover
from ltlplan.paths.hoops.clearance import conflicts
from ltlplan.paths.hoops.keep_out import room
from ltlplan.paths.nominal import lay_path
from ltlplan.paths.sampling.least_snap_spline import LeastSnapSpline
from verify.data import Infeasible, Mission, RobotPlan
from verify.data.language.formula import FREE

_SLACK = 0.02
"""m beyond the margin that a path keeps from regions that were left out: refinement changes it a little."""
_TRIES = 3
"""Times that a path is made without some of them."""

Finish = Callable[[Mission, RobotPlan], RobotPlan]
"""From a mission and a nominal path in it to the path that is planned."""


def finished(mission: Mission, robot: str, does: Itinerary, nominal: RobotPlan, finish: Finish) -> RobotPlan:
    """Return the path that is made of a nominal one; where that is in nobody's way, without regions that the formula does not name.

    Args:
        mission: What must be kept.
        robot: Whose path.
        does: Its visits and word.
        nominal: Its path, laid around all regions.
        finish: Makes the path.
    """
    hidden = _unnamed(mission, does)
    for _ in range(_TRIES if hidden else 0):
        few = mission.model_copy(
            update={"regions": {name: region for name, region in mission.regions.items() if name not in hidden}}
        )
        with suppress(Infeasible):
            found = finish(few, lay_path(few, robot, does)[0])
            met = _too_near(mission, robot, found, hidden)
            if not met:
                return found
            hidden -= met
            continue
        break
    return finish(mission, nominal)


def lay_beside(mission: Mission, robot: str, does: Itinerary) -> tuple[RobotPlan, tuple[str, ...]]:
    """Lay one robot's path as it is finished by nothing.

    Args:
        mission: What must be kept.
        robot: Whose path.
        does: Its visits and word.

    Raises:
        Infeasible: There is no way.
    """
    nominal, notes = lay_path(mission, robot, does)
    return finished(mission, robot, does, nominal, lambda _, path: path), notes


def _unnamed(mission: Mission, does: Itinerary) -> frozenset[str]:
    """Return the regions that neither the formula nor what a robot does speaks of."""
    named = mission.written.names()
    if mission.spec.formula is None or mission.soft_parts or mission.environment is not None or FREE in named:
        return frozenset()
    shown = {name for letter in does.word.letters for name in letter}
    acted = {action.at for robot in mission.agents for action in mission.robot_of(robot).actions}
    return frozenset(mission.regions) - named - shown - acted - {visit.region for visit in does.visits}


def _too_near(mission: Mission, robot: str, plan: RobotPlan, hidden: frozenset[str]) -> frozenset[str]:
    """Return which regions a path comes too near to, for all times."""
    flight = until_hover(plan) if plan.hovers else plan
    if len(flight.waypoints) < 2:
        return frozenset()
    spline = LeastSnapSpline(flight.times, flight.cycle_waypoint)
    path = spline.through([waypoint.position for waypoint in flight.waypoints])
    permitted = frozenset(mission.all_regions) - hidden
    found = conflicts(path, spline.durations, room(mission, _SLACK, robot=robot), [permitted] * len(path))
    return frozenset(conflict.name for conflict in found if conflict.name in hidden)
