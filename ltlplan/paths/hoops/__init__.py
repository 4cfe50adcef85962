"""Hoops: control points, motion primitives, avoidance, and the sequence-of-hoops planner.

Read `sequencer` (the door), then what it asks: `passage_directions` (from which side a hoop is flown), `legs` (stop by stop, as `stops` has them),
`avoidance` (past hoops in the way), `spline_repair` and `primitives`, over the control points in `hoop_frame`. `keep_out` says what a path must keep
clear of, `clearance` for all times whether it does.
`passage_ends` says where a passage begins and ends.
"""

from ltlplan.paths.hoops.avoidance import Blocked, avoid
from ltlplan.paths.hoops.hoop_frame import ControlPoints, control_points
from ltlplan.paths.hoops.primitives import Primitive, choose
from ltlplan.paths.hoops.sequencer import route, route_itinerary, route_sequence, segments
from ltlplan.paths.hoops.spline_repair import SplineBlocked

__all__ = [
    "Blocked",
    "ControlPoints",
    "Primitive",
    "SplineBlocked",
    "avoid",
    "choose",
    "control_points",
    "route",
    "route_itinerary",
    "route_sequence",
    "segments",
]
