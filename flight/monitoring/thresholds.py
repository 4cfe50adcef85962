"""The numbers that live flights are checked and watched by: over our links and by exported scripts, which are given them as data."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from flight.monitoring.alarm_response import LANDING_HEIGHT, LANDING_SPEED
from verify.data import Mission
from verify.data.frame import Frame

SHARE = 0.5
"""Share of the margin that a robot may stand off where a stage begins: the rest is for following it."""
QUIET = 0.01
"""m that the measured place of a robot at rest may wander within `WATCHED`."""
WATCHED = 0.5
"""s that robots are watched before they fly."""
POSES = 3
"""Poses that are seen of a robot at rest within `WATCHED` at the least."""
FRESH = 0.2
"""s that a pose may be old."""
SLOW = 0.22
"""s between two looks at robots in flight, at most."""
HEADING = math.radians(15.0)
"""rad that a robot's heading may be off before it climbs."""
RESERVE = 1.2
"""How often the flight's duration a battery has to last."""
EMPTY = 15.0
"""s of battery that a landing needs."""
SETTLED = 0.001
"""m^2 that the variances of the estimated position may change by in half a second where the estimator has settled."""
HOLDING = 2.0
"""s that a team hovers before it lands."""
PATIENCE = 2.0
"""s that a robot has to acknowledge a command."""
ARMING = 5.0
"""s that vehicles have from being asked to arm until they can fly: motors of brushless Crazyflies spin up for about 0.3 s, and 2 s at the most."""
LANDED = 5.0
"""s behind a landing's end within which a robot is known to stand: a Crazyflie's supervisor waits for 2 s, and PX4 for about 3 s."""
NEAR = 0.05
"""m above where its landing ends, up to which a robot may stand that does not say whether it flies."""
CRAZYFLIE_ACCURACY = 0.01
"""m that a Crazyflie's measured position may be off."""
PX4_ACCURACY = 0.02
"""m that a position which PX4 reports may be off."""
CLIMB_SPEED = 0.5
"""m/s of climbs and certified landings, near the ground and its turbulence; a mission's lower limit holds as well."""


def limits(accuracy: float) -> dict[str, float]:
    """Return the numbers that checks and watches go by, by name, as exported scripts are given them.

    Args:
        accuracy: m that a measured position may be off.
    """
    return {
        "share": SHARE,
        "quiet": QUIET,
        "watched": WATCHED,
        "poses": POSES,
        "fresh": FRESH,
        "slow": SLOW,
        "heading": HEADING,
        "reserve": RESERVE,
        "empty": EMPTY,
        "settled": SETTLED,
        "holding": HOLDING,
        "patience": PATIENCE,
        "arming": ARMING,
        "landed": LANDED,
        "near": NEAR,
        "landing_height": LANDING_HEIGHT,
        "landing_speed": LANDING_SPEED,
        "accuracy": accuracy,
    }


def bounds(
    mission: Mission, robots: Iterable[str], margin: float, accuracy: float, frame: Frame | None = None
) -> dict[str, Any]:
    """Return what a flight is checked and watched by, as plain data: for links and, in `flight.json`, for exported scripts.

    Args:
        mission: Says how far robots keep apart, and what its workspace is.
        robots: Who flies.
        margin: delta of the certificate, m.
        accuracy: m that a measured position may be off.
        frame: Where the mission lies in the frame of measured places; None where they are the mission's own.
    """
    return {
        "margin": margin,
        "limits": limits(accuracy),
        "separation": [[one, other, mission.least_distance(one, other)] for one, other in itertools.combinations(robots, 2)],
        "z_scale": mission.separation / mission.separation_z if mission.separation_z else 1.0,
        "workspace": _workspace(mission, frame or Frame()),
    }


def _workspace(mission: Mission, frame: Frame) -> dict[str, Any]:
    """Return the workspace in a frame: upright walls as rows x, y of a normal and how far it reaches along it, and heights."""
    low, high = mission.workspace.min, mission.workspace.max
    walls: list[list[float]] = []
    for axis in range(2):
        normal = frame.matrix[:2, axis]
        beyond = float(normal @ np.array(frame.offset[:2]))
        walls += [[*normal.tolist(), high[axis] + beyond], [*(-normal).tolist(), -low[axis] - beyond]]
    return {"walls": walls, "low": low[2] + frame.offset[2], "high": high[2] + frame.offset[2]}
