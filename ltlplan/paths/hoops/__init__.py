"""Hoops: control points, motion primitives, avoidance, and the sequence-of-hoops planner."""

from ltlplan.paths.hoops.avoidance import Blocked, avoid
from ltlplan.paths.hoops.hoop_frame import ControlPoints, control_points
from ltlplan.paths.hoops.primitives import Primitive, choose
from ltlplan.paths.hoops.sequencer import SplineBlocked, route, route_sequence, segments

__all__ = [
    "Blocked",
    "ControlPoints",
    "Primitive",
    "SplineBlocked",
    "avoid",
    "choose",
    "control_points",
    "route",
    "route_sequence",
    "segments",
]
