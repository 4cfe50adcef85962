"""Crazyflies as crazyswarm2's Python client shows them, in its current and its older versions. Copied into exports.

What a version does not have is not asked for, and is "not checked". Poses are the vehicle's own estimate, as its log reports it
(`firmware_logging`, topic `pose`), and in crazyswarm2's simulator, which has none, those of tf.
Battery and supervisor come with `status`, the estimator's variances and the battery's charge with the topic
`estimator` that the exported crazyflies.yaml asks for. The client sends commands and does not tell whether a vehicle has heard them; whether it
does what it was told is seen by its poses.
"""

# pyright: reportMissingImports=false
# ROS 2 and crazyswarm2 are there only where it flies.

from __future__ import annotations

import math
import signal
from collections import deque
from dataclasses import replace
from typing import Any

from flying import supervisor
from flying.checks import Check, Health, Place, Pose, differing
from flying.simulator import Transforms, by_simulated_clock, heading_of
from flying.supervisor import State
from flying.watch import Refused, Team

CRITICAL = 3.7  # V, as crazyflies.yaml says
AGAIN = 0.1  # s after which a command is sent again
TRAJECTORY_ID = 0
_UNKNOWN = {"age": "this version of crazyswarm2 does not date them", "parameters": "crazyswarm2 lists none of them"}


class Swarm:
    """All robots of the flight.

    Attributes:
        parameters: What was read back, by robot.
        simulated: Whether robots are those of crazyswarm2's simulator, by whose clock this goes.
        trims: m by which heights are asked higher, by robot: in crazyswarm2's simulator.
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
        self.trims: dict[str, float] = {}
        self._transforms = Transforms(team.names)
        self.simulated = by_simulated_clock(self.everyone)
        self.parameters: dict[str, dict[str, float]] = {}
        self.estimates: dict[str, deque[tuple[float, ...]]] = {name: deque(maxlen=10) for name in team.names}
        self._stamps: dict[str, tuple[int, int] | None] = dict.fromkeys(team.names)
        self._poses: dict[str, Pose] = {}
        self.dated = all(hasattr(robot, "poseStamped") for robot in self.robots.values())
        self._subscribe()

    def _subscribe(self) -> None:
        """Listen to what the exported crazyflies.yaml has the estimators report, and to tf."""
        try:
            from crazyflie_interfaces.msg import LogDataGeneric

            for name, kept in self.estimates.items():

                def take(message: Any, kept: deque[tuple[float, ...]] = kept) -> None:
                    kept.append(tuple(float(value) for value in message.values))

                self.everyone.create_subscription(LogDataGeneric, f"/{name}/estimator", take, 10)
        except (ImportError, AttributeError):
            pass  # whether estimators have settled is not checked then
        try:
            from tf2_msgs.msg import TFMessage

            self.everyone.create_subscription(TFMessage, "/tf", self._transforms.take, 10)
        except (ImportError, AttributeError):
            pass  # there is no simulator then

    # Time and places

    def now(self) -> float:
        """Return s of crazyswarm2's clock."""
        return self._clock.time()

    def sleep(self, seconds: float) -> None:
        """Let time go on, and take in what arrives."""
        self._clock.sleep(seconds)

    def pose(self, robot: str) -> Pose | None:
        """Return a robot's last pose; None before any came.

        Its time is that of its stamp where that can be: a server with another clock has stamps that mean nothing here.

        Raises:
            Refused: This version of crazyswarm2 measures no positions.
        """
        client, now = self.robots[robot], self.now()
        if not self.dated:
            return Pose(now, _position(client), None)
        stamped = client.poseStamped
        if not stamped:
            return self._transforms.poses.get(robot) if self.simulated else None
        stamp = (stamped["timestamp_sec"], stamped["timestamp_nsec"])
        if stamp != self._stamps[robot]:
            self._stamps[robot] = stamp
            at = stamp[0] + 1e-9 * stamp[1]
            time = at if now - self._team.limits["fresh"] <= at <= now else now
            pose = stamped.get("pose")
            heading = None if pose is None else heading_of(pose.orientation)
            self._poses[robot] = Pose(time, _position(client), heading)
        return self._poses.get(robot)

    @property
    def seen_by_tf(self) -> bool:
        """True if robots are the simulator's, and have no /pose."""
        return self.simulated and self.dated and any(not robot.poseStamped for robot in self.robots.values())

    @property
    def hint(self) -> str:
        """Remedy where robots have no pose and tf shows them: motion capture does so, too, and tf alone is not taken for the simulator's."""
        shown = any(
            not robot.poseStamped and name in self._transforms.poses for name, robot in self.robots.items() if self.dated
        )
        if not shown or self.simulated:
            return ""
        return "; in crazyswarm2's simulator, which has only tf, add --ros-args -p use_sim_time:=True"

    # Health

    def status(self, name: str) -> dict[str, Any]:
        """Return what a robot last said of its supervisor and battery; nothing where it says nothing."""
        robot = self.robots[name]
        return dict(robot.get_status() or {}) if hasattr(robot, "get_status") else {}

    def state(self, name: str) -> State | None:
        """Return what a robot's supervisor last said; None where it says nothing."""
        status = self.status(name)
        return State(int(status["supervisor"])) if status else None

    def level(self, name: str) -> float | None:
        """Return a battery's charge as a share; None where it is not known."""
        kept = self.estimates[name]
        return supervisor.charge_of(self.status(name).get("pm_state", 0), kept[-1][3] if kept and len(kept[-1]) > 3 else None)

    def health(self, robot: str) -> Health:
        """Return what a robot last said of itself.

        Args:
            robot: The robot's.
        """
        settled = supervisor.is_settled([row[:3] for row in self.estimates[robot] if len(row) >= 3], self._team.limits)
        endurance = self._team.data["robots"][robot]["endurance"]
        health = supervisor.health_of(self.state(robot), settled, self.level(robot), endurance)
        return replace(health, why={**health.why, **_UNKNOWN})

    def voltage(self, name: str) -> list[Check]:
        """Return the check of a battery's voltage; nothing where it is not reported, which a server says by 0.

        Args:
            name: The robot's.
        """
        volts = self.status(name).get("battery", 0.0)
        if volts == 0.0:
            return []
        sentence = f"{name}'s battery has {volts:.2f} V"
        passed = volts > CRITICAL
        return [Check("battery", name, passed, sentence if passed else f"{sentence}: charge or change it")]

    def set_parameters(self) -> dict[str, str]:
        """Tell each robot its parameters once more, ask crazyswarm2 for them, and return what differs, a sentence, empty where nothing does.

        Its server answers with what it set last, and does not ask the vehicle. A robot of which it lists no parameters is left out.
        """
        asked, found = dict[str, dict[str, float]](), dict[str, str]()
        for name, robot in self.robots.items():
            wanted: dict[str, float] = self._team.data["robots"][name]["parameters"]
            if not hasattr(robot, "getParam") or not (has := getattr(robot, "paramTypeDict", None)):
                continue
            if missing := [key for key in wanted if key not in has]:
                found[name] = f"{name}'s firmware does not have {', '.join(missing)}: update it"
                continue
            asked[name] = wanted
            for key, value in wanted.items():
                robot.setParam(key, value)
        if asked:
            self.sleep(0.5)
        for name, wanted in asked.items():
            board = self.parameters[name] = {key: float(self.robots[name].getParam(key)) for key in wanted}
            wrong = differing(board, wanted)
            remedy = "look whether crazyswarm2 was started with the exported crazyflies.yaml"
            found[name] = f"{name}: {'; '.join(wrong)}: {remedy}" if wrong else ""
        return found

    # Commands

    def arm(self) -> None:
        """Arm all, and wait until they can fly: motors of brushless vehicles spin up first, others need no arming.

        Versions of crazyswarm2 that cannot arm have no brushless vehicles.

        Raises:
            Refused: One does not say in time that it can fly.
        """
        begin, asked, left = self.now(), -math.inf, list[str]()
        while self.now() - begin < self._team.limits["arming"]:
            if self.now() - asked >= 1.0:
                asked = self.now()
                if hasattr(self.everyone, "arm"):
                    self.everyone.arm(True)
            self.sleep(AGAIN)
            reported = {name: state for name in self.robots if (state := self.state(name)) is not None}
            left = [name for name, state in reported.items() if State.CAN_FLY not in state]
            if not left and self.now() - begin >= 1.0:  # what is not reported has that long to spin up
                return
        armed = [name for name in left if State.ARMED in (self.state(name) or State(0))]
        why = f"armed, and cannot fly: the motors of {', '.join(armed)} did not spin up" if armed else "did not arm"
        raise Refused(f"{', '.join(left)} {why}: look at what its supervisor says")

    def disarm(self, name: str) -> None:
        """Stop the motors of a robot that stands.

        Args:
            name: The robot's.
        """
        if hasattr(self.robots[name], "arm"):
            self.robots[name].arm(False)

    def go_to(self, name: str, place: tuple[float, ...], seconds: float) -> None:
        """Have a robot go somewhere.

        Args:
            name: The robot's.
            place: x, y, z in m and heading in rad.
            seconds: How long it takes.
        """
        x, y, z, heading = place
        self.robots[name].goTo([x, y, z + self.trims.get(name, 0.0)], heading, seconds)

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
            if trim := self.trims.get(name):
                for piece in loaded.polynomials:
                    piece.pz.p[0] += trim
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


def keep_signals() -> None:
    """Have Ctrl-C and SIGTERM raise KeyboardInterrupt: ROS would shut down, and nothing could be told to land any more."""
    try:
        from rclpy.signals import uninstall_signal_handlers

        uninstall_signal_handlers()
    except ImportError:
        pass
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
