"""The script that flies a mission with crazyswarm2, as text."""

from __future__ import annotations

import itertools
import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from flight.exports.parts import order_of
from verify.data.trajectory import PAUSE

if TYPE_CHECKING:
    from flight.exports.parts import Part
    from flight.exports.target import Request

_SCRIPT = '''#!/usr/bin/env python3
"""Flies the mission MISSION with crazyswarm2. Certificate: DIGEST.

PARTS_SAIDPlace it beside the CSV files. Nothing spins before every robot is measured to stand below its own start, within the certificate's
margin; then all climb straight up at once, and the flight begins only if each is within half a margin of its start. In flight it
holds measured positions against the plan: a robot outside of the margin, or without positions, ends the flight of all. Every way
out lands the whole team: the end, an error, Ctrl-C, SIGTERM. A second Ctrl-C stops all motors. Climb and landing are not
certified: watch them.
"""

import signal
from pathlib import Path

try:
    import numpy as np
    from crazyflie_py import Crazyswarm
    from crazyflie_py.uav_trajectory import Trajectory
except ImportError as missing:
    raise SystemExit(f"{missing.name} is not here: install crazyswarm2, and source its workspace (install/setup.bash) first") from None

PARTS = PARTS_HERE  # each part: how its files' names end, s that it lasts, and where robots begin it: x, y, z in m, heading in rad
ORDER = ORDER_HERE  # parts as they are flown; robots hover between them, while the next one is uploaded
STARTS = PARTS[ORDER[0]][2]
MARGIN = MARGIN_HERE  # m
SHARE = 0.5  # of the margin, that a robot may be off where it begins: the rest is for following the plan
STACKED = STACKED_HERE  # robots whose starts are above each other, so that they cannot climb to them straight up
PAUSE = PAUSE_HERE  # s that robots hover between two parts at the most
TRAJECTORY_ID = 0
STEP = 0.05  # s between two looks in flight
AGE = 0.05  # s that a position and the start may have been on their way: it is held against the plan of that time
SILENT = 0.5  # s without a new position after which nobody knows where a robot is
LISTEN = 5.0  # s that a first position is waited for


class Refused(Exception):
    """The flight is not begun, or not gone on with; the message says why."""


def position(robot):
    """Return a robot's measured position; its name differs between versions of crazyswarm2."""
    return np.array(robot.get_position() if hasattr(robot, "get_position") else robot.position())


def heard(robot):
    """Return a stamp of the last position, another one for each; None where this version of crazyswarm2 has none."""
    pose = getattr(robot, "poseStamped", None)
    return (pose["timestamp_sec"], pose["timestamp_nsec"]) if pose else None


def keep_signals():
    """Have Ctrl-C and SIGTERM raise KeyboardInterrupt: ROS would shut down, and nothing could be told to land any more."""
    try:
        from rclpy.signals import uninstall_signal_handlers

        uninstall_signal_handlers()
    except ImportError:
        pass
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)


def upload(robots, part):
    """Give each robot its trajectory of a part, and return them."""
    missing = [name for name in STARTS if name not in robots]
    if missing:
        raise Refused(f"crazyswarm2 does not know {', '.join(missing)}; it knows {', '.join(robots) or 'no robot'}")
    plans = {}
    for name in STARTS:
        plans[name] = Trajectory()
        plans[name].loadcsv(Path(__file__).parent / f"{name}{PARTS[part][0]}.csv")
        robots[name].uploadTrajectory(TRAJECTORY_ID, 0, plans[name])
    return plans


def arm(everyone, armed):
    """Arm or disarm all: brushless vehicles need it, others do not mind; versions of crazyswarm2 without it have none of them."""
    if hasattr(everyone, "arm"):
        everyone.arm(armed)


def require_below(clock, robots):
    """Refuse to climb where a robot is not measured, or not below its own start: climbing straight up, none meets another."""
    if STACKED:
        raise Refused(f"{STACKED} start above each other and cannot climb there straight up: bring them there by a flight of your own")
    begin, first = clock.time(), {name: heard(robots[name]) for name in STARTS}
    while silent := [name for name in STARTS if hasattr(robots[name], "poseStamped") and heard(robots[name]) == first[name]]:
        if clock.time() - begin > LISTEN:
            raise Refused(f"no position from {', '.join(silent)} within {LISTEN:g} s: is it seen by motion capture under its name?")
        clock.sleep(STEP)
    stands = {name: position(robots[name])[:2] for name in STARTS}
    wrong = []
    for name, start in STARTS.items():
        off = {other: float(np.linalg.norm(stands[name] - np.array(place[:2]))) for other, place in STARTS.items()}
        if not off[name] < MARGIN:
            near = min(off, key=off.get)
            swapped = f", where {near} belongs" if near != name and off[near] < MARGIN else ""
            wrong.append(f"{name} stands {off[name]:.3f} m from there{swapped}: put it at {start[0]:.3f}, {start[1]:.3f}")
    if wrong:
        raise Refused("each robot has to stand below its own start. " + "; ".join(wrong))


def go_to_starts(clock, robots):
    """Climb and go to the starts; refuse to begin where a robot is not there."""
    for name, start in STARTS.items():
        robots[name].takeoff(targetHeight=start[2], duration=3.0)
    clock.sleep(3.5)
    for name, start in STARTS.items():
        robots[name].goTo(start[:3], start[3], 3.0)
    clock.sleep(4.0)
    require_near(robots, STARTS)


def require_near(robots, places):
    """Refuse to start where a robot is not where its part begins."""
    off = {name: float(np.linalg.norm(position(robots[name]) - np.array(place[:3]))) for name, place in places.items()}
    away = {name: distance for name, distance in off.items() if not distance < SHARE * MARGIN}
    if away:
        raise Refused(f"too far from the start (at most {SHARE * MARGIN:g} m): " + ", ".join(f"{name} {d:.3f} m" for name, d in away.items()))


def hover(clock, robots, places):
    """Have robots hold where the next part begins by a command of its own: at a trajectory's end they still read their memory."""
    for _ in range(2):
        for name, place in places.items():
            robots[name].goTo(place[:3], place[3], 1.0)
        clock.sleep(0.6)


def fly_parts(clock, everyone, robots, plans, worst):
    """Fly part by part; the first is uploaded and all are at its start."""
    loaded, ended, pauses = ORDER[0], None, []
    for number, part in enumerate(ORDER):
        if number:
            since = clock.time()
            hover(clock, robots, PARTS[part][2])
            if part != loaded:
                plans, loaded = upload(robots, part), part
            clock.sleep(0.5)
            require_near(robots, PARTS[part][2])
            if clock.time() - since > PAUSE:
                raise Refused(f"the pause before part {number + 1} of {len(ORDER)} lasted more than {PAUSE:g} s")
        began = fly(clock, everyone, robots, plans, PARTS[part][1], worst)
        if number:
            pauses.append(began - ended)
        ended = began + PARTS[part][1]
    if pauses:
        print("pauses between parts, in s:", ",".join(f"{pause:.3f}" for pause in pauses))


def fly(clock, everyone, robots, plans, length, worst):
    """Start all at once and watch them for a part's length; `worst` takes in how far each was from its plan. Return when they began."""
    begin = clock.time()
    last = {name: (heard(robots[name]), begin) for name in STARTS}
    everyone.startTrajectory(TRAJECTORY_ID, timescale=1.0, reverse=False, relative=False)
    while (now := clock.time() - begin) < length:
        clock.sleep(min(STEP, length - now))
        at = clock.time() - begin
        for name, plan in plans.items():
            stamp, since = last[name]
            if heard(robots[name]) != stamp or stamp is None:
                last[name] = heard(robots[name]), clock.time()
            elif clock.time() - since > SILENT:
                raise Refused(f"no position from {name} for {SILENT:g} s at {at:.2f} s")
            times = np.clip(np.linspace(at - AGE, at, 5), 0.0, plan.duration)
            off = min(float(np.linalg.norm(plan.eval(t).pos - position(robots[name]))) for t in times)
            worst[name] = max(worst[name], off)
            if not off < MARGIN:
                raise Refused(f"{name} is {off:.3f} m from its plan at {at:.2f} s; the margin is {MARGIN:g} m")
    return begin


def land(clock, everyone, robots):
    """Land all, told three times; stop all motors where that is interrupted."""
    try:
        for pause in (0.1, 0.1, 3.5):
            everyone.land(targetHeight=0.05, duration=3.0)
            clock.sleep(pause)
        arm(everyone, False)
        return True
    except BaseException as error:
        print(f"landing was interrupted ({type(error).__name__}): all motors are stopped")
        for _ in range(3):
            everyone.emergency()
            for name in STARTS:
                robots[name].emergency()
            clock.sleep(0.05)
        return False


def main():
    """Fly; return 0 where all flew within the margin to the end and landed."""
    swarm = Crazyswarm()
    keep_signals()
    clock, everyone = swarm.timeHelper, swarm.allcfs
    robots = everyone.crazyfliesByName
    flying, reason, worst = False, None, dict.fromkeys(STARTS, 0.0)
    try:
        plans = upload(robots, ORDER[0])
        require_below(clock, robots)
        flying = True
        arm(everyone, True)
        clock.sleep(1.0)
        go_to_starts(clock, robots)
        fly_parts(clock, everyone, robots, plans, worst)
    except Refused as refused:
        reason = str(refused)
    except BaseException as error:
        reason = f"{type(error).__name__} {error}".strip()
    landed = not flying or land(clock, everyone, robots)
    for name, off in worst.items():
        print(f"{name}: at most {off:.3f} m from its plan")
    print("flown and landed" if reason is None and landed else f"stopped: {reason or 'while landing'}")
    return 0 if reason is None and landed else 1


if __name__ == "__main__":
    raise SystemExit(main())
'''


_IN_PARTS = """The vehicles do not hold the flight at once: it is flown in parts. After each of them all robots hover, hold by a go-to where they
are, are given the next part, and start it together once each is within half a margin of where it begins; who waits for longer than PAUSE s lands.
"""


def script(request: Request, parts: Sequence[Part]) -> str:
    """Return the text of fly_mission.py.

    Args:
        request: The export.
        parts: What is uploaded.
    """
    table = "[\n" + "".join(_row(part) for part in parts) + "]"
    return (
        _SCRIPT.replace("PARTS_SAID", _IN_PARTS if len(parts) > 1 else "")
        .replace("MISSION", repr(request.mission.name))
        .replace("DIGEST", request.digest)
        .replace("PARTS_HERE", table)
        .replace("ORDER_HERE", repr(list(order_of(request))))
        .replace("MARGIN_HERE", repr(request.margin))
        .replace("STACKED_HERE", repr(" and ".join(stacked(request, 0.0))))
        .replace("PAUSE_HERE", repr(PAUSE))
    )


def stacked(request: Request, time: float) -> tuple[str, ...]:
    """Return two robots that are too near to each other, seen from above, to be one climbing or landing beside the other; else nothing.

    Args:
        request: The export.
        time: s, of the flights: when they hover there.
    """
    mission = request.mission
    places = {name: path.evaluate(min(time, path.duration))[:2] for name, path in request.flown.items()}
    for one, other in itertools.combinations(places, 2):
        if np.linalg.norm(places[one] - places[other]) < mission.least_distance(one, other) + 2 * request.margin:
            return one, other
    return ()


def _row(part: Part) -> str:
    starts = "".join(f"        {json.dumps(name)}: {list(place)!r},\n" for name, place in part.starts.items())
    return f"    ({part.ending!r}, {part.duration!r}, {{\n{starts}    }}),\n"
