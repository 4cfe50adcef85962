"""Regions that robots need to visit at all: of a thousand regions a formula speaks of a few; no robot has to stop at the others.

Where every region can be reached from every other, a plan that stops at a region of which the formula does not speak is no
better than the one that flies on: without that stop the robot shows free flight there, which it shows just before and just
after as well. Only a formula that may gain by a robot's not being `free` can tell the difference, and obstacles that leave no way but through
other regions.
"""

from __future__ import annotations

from ltlplan.free_space.free_space import FreeSpace, Place
from ltlplan.logic.signed_parts import signed_parts
from ltlplan.search.numbering import closure
from ltlplan.systems.region_labels import Layout
from verify.data import Mission
from verify.data.language.formula import FREE

FEW = 150
"""Regions up to which all of them are kept: where the way of a plan is blocked, it may lead through any of them."""


def places_that_matter(mission: Mission, layout: Layout, few: int = FEW) -> frozenset[str] | None:
    """Return the regions at which robots may have to stop; None where that may be all of them.

    These are the regions that the formula names or that permit an action, and whatever overlaps one of them, however far that
    goes on.

    Args:
        mission: Whose robots.
        layout: How its regions lie.
        few: Regions up to which all of them are kept.
    """
    if len(mission.all_regions) <= few or mission.environment is not None or mission.spec.formula is None:
        return None
    written = mission.written
    if any(node.name == FREE and not sign for node, sign in signed_parts(written)):
        return None
    acted = {action.at for robot in mission.agents for action in mission.robot_of(robot).actions}
    matter = frozenset(closure(acted | (written.names() & mission.all_regions.keys()), layout.neighbours.__getitem__))
    return matter if _reach_each_other(mission, layout, matter) else None


def _reach_each_other(mission: Mission, layout: Layout, regions: frozenset[str]) -> bool:
    """Tell whether there are ways around obstacles between starts and regions that enter no other region, for every robot."""
    if not mission.obstacles:
        return True
    every = [layout.middles[name] for name in sorted(regions)]
    every += [layout.at(agent.start) for agent in mission.agents.values()]
    places = [Place(location.point, frozenset(location.inside)) for location in every if location.clear]
    spaces = [FreeSpace.of(mission, radius) for radius in {mission.vehicle_of(robot).radius for robot in mission.agents}]
    return not any(regions & mission.hoops.keys()) and all(space.connects(places) for space in spaces)
