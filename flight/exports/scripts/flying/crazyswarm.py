"""Crazyflies as crazyswarm2's Python client shows them, in its current and its older versions. Copied into exports.

What a version does not have is not asked for, and said: `unknown` has a sentence on each. Poses are the vehicle's own estimate, as its log reports it
(`firmware_logging`, topic `pose`); battery and supervisor come with `status`, the estimator's variances and the battery's charge with the topic
`estimator` that the exported crazyflies.yaml asks for. The client sends commands and does not tell whether a vehicle has heard them; whether it
does what it was told is seen by its poses.
"""

# pyright: reportMissingImports=false
# ROS 2 and crazyswarm2 are there only where it flies.

from __future__ import annotations

import math
import signal
from collections import deque
from typing import Any

from flying.watch import Place, Pose, Refused, Team

CAN_ARM, ARMED, CAN_FLY, TUMBLED, LOCKED, CRASHED = 1, 2, 8, 32, 64, 128  # bits of `supervisor.info`
LOW_POWER = 3  # `pm.state` from which on the vehicle itself calls its battery low
CRITICAL = 3.7  # V, as crazyflies.yaml says
AGAIN = 0.1  # s after which a command is sent again
TRAJECTORY_ID = 0


class Swarm:
    """All robots of the flight.

    Attributes:
        unknown: What this version, or these settings, do not tell: a sentence each.
        parameters: What was read back, by robot.
    """

    def __init__(self, team: Team) -> None:
        """Reach crazyswarm2, and listen to it.

        Args:
            team: Who flies.

        Raises:
            Refused: It is not here, or does not know a robot.
        """
        try:
            from crazyflie_py import Crazyswarm
            from crazyflie_py.uav_trajectory import Trajectory
        except ImportError as missing:
            raise Refused(
                f"{missing.name} is not here: install crazyswarm2, and source its workspace (install/setup.bash) first"
            ) from None
        made: Any = Crazyswarm()  # crazyswarm2 has no types
        keep_signals()
        self._loaded: Any = Trajectory
        self._clock, self.everyone, self._team = made.timeHelper, made.allcfs, team
        known: dict[str, Any] = self.everyone.crazyfliesByName
        if missing := [name for name in team.names if name not in known]:
            raise Refused(f"crazyswarm2 does not know {', '.join(missing)}; it knows {', '.join(known) or 'no robot'}")
        self.robots: dict[str, Any] = {name: known[name] for name in team.names}
        self.unknown: list[str] = []
        self.parameters: dict[str, dict[str, float]] = {}
        self.estimates: dict[str, deque[tuple[float, ...]]] = {name: deque(maxlen=10) for name in team.names}
        self._stamps: dict[str, tuple[int, int] | None] = dict.fromkeys(team.names)
        self._poses: dict[str, Pose] = {}
        self.dated = all(hasattr(robot, "poseStamped") for robot in self.robots.values())
        if not self.dated:
            self.unknown.append("how old positions are: this version of crazyswarm2 does not date them")
        self._subscribe()

    def _subscribe(self) -> None:
        """Listen to what the exported crazyflies.yaml has the estimators report."""
        try:
            from crazyflie_interfaces.msg import LogDataGeneric

            for name, kept in self.estimates.items():

                def take(message: Any, kept: deque[tuple[float, ...]] = kept) -> None:
                    kept.append(tuple(float(value) for value in message.values))

                self.everyone.create_subscription(LogDataGeneric, f"/{name}/estimator", take, 10)
        except (ImportError, AttributeError):
            self.unknown.append("whether estimators have settled: this version of crazyswarm2 does not report it")

    # Time and places

    def now(self) -> float:
        """Return s of crazyswarm2's clock."""
        return self._clock.time()

    def sleep(self, seconds: float) -> None:
        """Let time go on, and take in what arrives."""
        self._clock.sleep(seconds)

    def pose(self, name: str) -> Pose | None:
        """Return a robot's last pose; None before any came.

        Its time is that of its stamp where that can be: a server with another clock has stamps that mean nothing here.

        Raises:
            Refused: This version of crazyswarm2 measures no positions.
        """
        robot, now = self.robots[name], self.now()
        if not self.dated:
            return Pose(now, _position(robot), None)
        stamped = robot.poseStamped
        if not stamped:
            return None
        stamp = (stamped["timestamp_sec"], stamped["timestamp_nsec"])
        if stamp != self._stamps[name]:
            self._stamps[name] = stamp
            at = stamp[0] + 1e-9 * stamp[1]
            time = at if now - self._team.limits["fresh"] <= at <= now else now
            pose = stamped.get("pose")
            heading = None if pose is None else _heading(pose.orientation)
            self._poses[name] = Pose(time, _position(robot), heading)
        return self._poses.get(name)

    # Health

    def status(self, name: str) -> dict[str, Any]:
        """Return what a robot last said of its supervisor and battery; nothing where it says nothing."""
        robot = self.robots[name]
        return dict(robot.get_status() or {}) if hasattr(robot, "get_status") else {}

    def level(self, name: str) -> float | None:
        """Return a battery's charge as a share; None where it is not known."""
        if self.status(name).get("pm_state", 0) >= LOW_POWER:
            return 0.0
        kept = self.estimates[name]
        return kept[-1][3] / 100.0 if kept and len(kept[-1]) > 3 else None

    def supervisor_fault(self, name: str) -> str:
        """Return that a robot's supervisor blocks it; empty where it does not, or says nothing."""
        state = int(self.status(name).get("supervisor", CAN_FLY))
        return f"{name} has tumbled, or is locked" if state & (TUMBLED | LOCKED | CRASHED) else ""

    def health_faults(self, name: str, lasts: float) -> list[str]:
        """Return what is wrong with a robot's supervisor, battery and estimator.

        Args:
            name: The robot's.
            lasts: s that all is to take.
        """
        found, status, team = list[str](), self.status(name), self._team
        if status:
            state = int(status["supervisor"])
            if state & (TUMBLED | LOCKED | CRASHED) or not state & (CAN_ARM | CAN_FLY | ARMED):
                found.append(f"{name} is not ready: put it level, and restart it where a tumble or a crash blocks it")
            if status["battery"] != 0.0 and not status["battery"] > CRITICAL:  # 0 where a server does not report it
                found.append(f"{name}'s battery has {status['battery']:.2f} V: charge or change it")
        else:
            self.unknown.append(f"whether {name} is ready, and its battery: no `status` is reported of it")
        level = self.level(name)
        if level is not None and (fault := team.battery_fault(name, level, lasts)):
            found.append(fault)
        elif level is None or team.battery_left(name, level) is None:
            why = "its charge is not reported" if level is None else "its vehicle has no `endurance`"
            self.unknown.append(f"whether {name}'s battery lasts for {lasts:.0f} s: {why}")
        variances = [row[:3] for row in self.estimates[name] if len(row) >= 3]
        if not variances:
            self.unknown.append(f"whether {name}'s estimator has settled: its variances are not reported")
        elif len(variances) < 5 or not all(
            max(axis) - min(axis) < team.limits["settled"] for axis in zip(*variances, strict=True)
        ):
            found.append(f"{name}'s estimator has not settled: leave it standing still, or reset it")
        return found

    def set_parameters(self) -> list[str]:
        """Tell each robot its parameters once more, ask crazyswarm2 for them, and return what differs.

        Its server answers with what it set last, and does not ask the vehicle.
        """
        asked, found = dict[str, dict[str, float]](), list[str]()
        for name, robot in self.robots.items():
            wanted: dict[str, float] = self._team.data["robots"][name]["parameters"]
            if not hasattr(robot, "getParam") or not (has := getattr(robot, "paramTypeDict", None)):
                self.unknown.append(f"the parameters of {name}: crazyswarm2 lists none of them")
                continue
            if missing := [key for key in wanted if key not in has]:
                found.append(f"{name}'s firmware does not have {', '.join(missing)}: update it")
                continue
            asked[name] = wanted
            for key, value in wanted.items():
                robot.setParam(key, value)
        if asked:
            self.sleep(0.5)
        for name, wanted in asked.items():
            board = self.parameters[name] = {key: float(self.robots[name].getParam(key)) for key in wanted}
            wrong = [
                f"{key} is {board[key]:g}, not {value:g}"
                for key, value in wanted.items()
                if not math.isclose(board[key], value, rel_tol=1e-5, abs_tol=1e-9)
            ]
            if wrong:
                found.append(
                    f"{name}: {'; '.join(wrong)}: look whether crazyswarm2 was started with the exported crazyflies.yaml"
                )
        return found

    # Commands

    def arm(self) -> None:
        """Arm all: brushless vehicles need it, others do not mind; versions of crazyswarm2 without it have none of them.

        Raises:
            Refused: One does not say that it is armed.
        """
        begin, left = self.now(), list[str]()
        while self.now() - begin < self._team.limits["patience"]:
            if hasattr(self.everyone, "arm"):
                self.everyone.arm(True)
            self.sleep(1.0)
            reported = {name: int(status["supervisor"]) for name in self.robots if (status := self.status(name))}
            left = [name for name, state in reported.items() if not state & (ARMED | CAN_FLY)]
            if not left:
                return
        raise Refused(f"{', '.join(left)} did not arm: look at what its supervisor says")

    def disarm(self) -> None:
        """Stop motors on the ground."""
        for _ in range(3):
            if hasattr(self.everyone, "arm"):
                self.everyone.arm(False)
            self.sleep(AGAIN)

    def emergency(self) -> None:
        """Stop all motors, whatever robots do."""
        for _ in range(3):
            self.everyone.emergency()
            for robot in self.robots.values():
                robot.emergency()
            self.sleep(0.05)

    def upload(self, folder: Any, ending: str) -> None:
        """Give each robot its trajectory of a part.

        Args:
            folder: Where the files lie.
            ending: What they are called behind a robot's name.
        """
        for name, robot in self.robots.items():
            loaded = self._loaded()
            loaded.loadcsv(folder / f"{name}{ending}.csv")
            robot.uploadTrajectory(TRAJECTORY_ID, 0, loaded)

    def start(self) -> None:
        """Start all at once; a relative start, which crazyswarm2 takes unless told otherwise, would shift the paths."""
        self.everyone.startTrajectory(TRAJECTORY_ID, timescale=1.0, reverse=False, relative=False)


def _position(robot: Any) -> Place:
    """Return a robot's measured position; its name differs between versions of crazyswarm2."""
    read: Any = getattr(robot, "get_position", None) or getattr(robot, "position", None)
    if not callable(read):
        raise Refused("this version of crazyswarm2 measures no positions: update it")
    place: Any = read()
    return float(place[0]), float(place[1]), float(place[2])


def _heading(orientation: Any) -> float:
    x, y, z, w = orientation.x, orientation.y, orientation.z, orientation.w
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def keep_signals() -> None:
    """Have Ctrl-C and SIGTERM raise KeyboardInterrupt: ROS would shut down, and nothing could be told to land any more."""
    try:
        from rclpy.signals import uninstall_signal_handlers

        uninstall_signal_handlers()
    except ImportError:
        pass
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
