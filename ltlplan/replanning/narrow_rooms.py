"""Narrow places of rooms, named where flights that may not leave these were refused: hardly more than the margin is left there."""

from __future__ import annotations

import itertools

import numpy as np

from ltlplan.free_space.free_space import FreeSpace
from ltlplan.free_space.staying_inside import narrowest_inside
from verify.data import Plan
from verify.data.language.lasting import lasting_regions
from verify.data.obstruction import Obstruction

_HARDLY = 0.02
"""m beside the margin up to which a place is named: curves leave straight lines by so much."""


def narrow_room(plan: Plan, robot: str) -> Obstruction | None:
    """Return where regions that a robot may never leave are narrowest on its way, and what would help; None where that leaves it room.

    Args:
        plan: Whose flight was refused.
        robot: The robot's name.
    """
    mission = plan.mission
    rooms = sorted(lasting_regions(mission, robot, inside=True))
    space = FreeSpace.of(mission, mission.vehicle_of(robot).radius)
    permitted = mission.all_regions.keys() - lasting_regions(mission, robot, inside=False)
    stops = [np.array(at.position) for at in plan.robots[robot].waypoints if at.role in ("start", "centre", "end")]
    found = [
        (room, narrowest_inside(space, [room], leg, permitted, 0.0, mission.margin + _HARDLY))
        for room in rooms
        for leg in itertools.pairwise(stops)
    ]
    deepest = min(((place[1], place[0].tolist(), room) for room, place in found if place is not None), default=None)
    if deepest is None or deepest[0] >= mission.margin + _HARDLY - 1e-6:
        return None
    deep, (x, y, z), room = deepest
    place = (
        f"Around ({x:.2f}, {y:.2f}, {z:.2f}) no way of {robot} is more than {deep:.3g} m within '{room}', and the margin asks for "
        f"{mission.margin:g} m: hardly anything is left to fly in."
    )
    return Obstruction(
        "", (robot,), place, helps=(f"a wider '{room}' there", *(["a smaller `margin`"] if mission.margin > 0.0 else []))
    )
