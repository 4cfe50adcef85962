"""The script that flies a mission with crazyswarm2, as text."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flight.exports.target import Request

_SCRIPT = '''#!/usr/bin/env python3
"""Flies the mission MISSION with crazyswarm2. Certificate: DIGEST.

Place it beside the CSV files. It climbs, goes to the starts, and starts the flight only if every robot is within the
certificate's margin of its own start. Climb and landing are not certified: watch them.
"""

from pathlib import Path

import numpy as np
from crazyflie_py import Crazyswarm
from crazyflie_py.uav_trajectory import Trajectory

STARTS = STARTS_HERE  # robot: x, y, z in m, heading in rad
MARGIN = MARGIN_HERE  # m
DURATION = DURATION_HERE  # s
TRAJECTORY_ID = 0


def position(robot):
    """Return a robot's measured position; its name differs between versions of crazyswarm2."""
    return np.array(robot.get_position() if hasattr(robot, "get_position") else robot.position())


def main():
    swarm = Crazyswarm()
    clock, everyone = swarm.timeHelper, swarm.allcfs
    robots = everyone.crazyfliesByName
    for name in STARTS:
        trajectory = Trajectory()
        trajectory.loadcsv(Path(__file__).parent / f"{name}.csv")
        robots[name].uploadTrajectory(TRAJECTORY_ID, 0, trajectory)
    clock.sleep(1.0)
    for name, start in STARTS.items():
        robots[name].takeoff(targetHeight=start[2], duration=3.0)
    clock.sleep(3.5)
    for name, start in STARTS.items():
        robots[name].goTo(start[:3], start[3], 3.0)
    clock.sleep(4.0)
    off = {name: float(np.linalg.norm(position(robots[name]) - np.array(start[:3]))) for name, start in STARTS.items()}
    away = {name: distance for name, distance in off.items() if not distance < MARGIN}
    if away:
        print("not started, too far from the start:", ", ".join(f"{name} {d:.3f} m" for name, d in away.items()))
    else:
        everyone.startTrajectory(TRAJECTORY_ID, timescale=1.0, reverse=False, relative=False)
        clock.sleep(DURATION)
    everyone.land(targetHeight=0.05, duration=3.0)
    clock.sleep(3.5)
    return 1 if away else 0


if __name__ == "__main__":
    raise SystemExit(main())
'''


def script(request: Request, starts: dict[str, tuple[float, ...]], duration: float) -> str:
    """Return the text of fly_mission.py.

    Args:
        request: The export.
        starts: x, y, z in m and heading in rad of each robot at time 0.
        duration: s until the last robot has finished.
    """
    table = "{\n" + "".join(f"    {json.dumps(name)}: {list(start)!r},\n" for name, start in starts.items()) + "}"
    return (
        _SCRIPT.replace("MISSION", repr(request.mission.name))
        .replace("DIGEST", request.digest)
        .replace("STARTS_HERE", table)
        .replace("MARGIN_HERE", repr(request.margin))
        .replace("DURATION_HERE", repr(duration))
    )
