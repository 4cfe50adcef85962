"""Hoops: control points, motion primitives, avoidance, and the sequence-of-hoops planner."""

from ltlplan.hoops.avoid import Blocked, avoid
from ltlplan.hoops.control_points import ControlPoints, control_points
from ltlplan.hoops.primitives import Primitive, choose
from ltlplan.hoops.sequencer import SplineBlocked, route, route_sequence, segments

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
