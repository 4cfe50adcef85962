"""How far robots keep apart, and what of a robot the others must know: its flight and where it hovers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from refine.labels import stays
from refine.legs import HOVERING
from refine.obstacles import Ball, keep_out
from refine.schedule import Flight
from refine.single import Robot
from refine.wishes import Wishes
from verify.data import Mission, Plan


class Spacing(NamedTuple):
    """The distance that nominal paths keep.

    Attributes:
        distance: m between centres: the separation, twice the margin, and what witnesses asked for on top.
        z_scale: Distances in z count this many times.
    """

    distance: float
    z_scale: float


def spacing_of(mission: Mission, wishes: Wishes) -> Spacing:
    """Return how far a mission's robots keep apart."""
    z_scale = 1.0 if mission.separation_z in (None, 0.0) else mission.separation / float(mission.separation_z)
    return Spacing(mission.separation + 2 * mission.margin * max(1.0, z_scale) + 1e-3 + wishes.distance, z_scale)


def idle_others(plan: Plan, name: str, spacing: Spacing) -> tuple[Ball, ...]:
    """Return the places of robots that never move, to be kept clear of."""
    idle = [other for other, robot in plan.robots.items() if other != name and robot.still]
    places = {other: np.array(plan.robots[other].waypoints[0].position) for other in idle}
    return tuple(
        keep_out(f"{other}, which hovers there", place, spacing.distance + HOVERING, spacing.z_scale)
        for other, place in places.items()
    )


def hovers_of(robot: Robot, spacing: Spacing) -> tuple[Ball, ...]:
    """Return where a robot hovers before and after its flight, to be kept clear of."""
    ends = (("starts", robot.path.nodes[0]), ("ends", robot.path.nodes[-1]))
    return tuple(
        keep_out(f"{robot.name}, which {what} there", place, spacing.distance + HOVERING, spacing.z_scale)
        for what, place in ends
    )


def flight_of(plan: Plan, robot: Robot) -> Flight:
    """Return a robot's flight as scheduling sees it."""
    found = stays(robot.path, plan.mission.all_regions, plan.mission.margin)
    return Flight(robot.name, robot.path, tuple((stay.start, stay.end) for stay in found), robot.plan.hold)
