"""A typed stand-in for crazyswarm2's Python client: robots that do at once, in simulated time, what they are told."""

from __future__ import annotations

import types
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Position = NDArray[np.float64]


@dataclass
class Output:
    """Where a trajectory is."""

    pos: Position


class LoadedTrajectory:
    """A trajectory's CSV, as crazyswarm2 loads it: durations, then x, y, z, yaw by ascending powers."""

    def loadcsv(self, path: Path) -> None:
        """Load it."""
        self.rows = np.loadtxt(path, delimiter=",", skiprows=1, usecols=range(33), ndmin=2)
        self.duration = float(self.rows[:, 0].sum())

    def eval(self, t: float) -> Output:
        """Return where it is at t."""
        assert 0 <= t <= self.duration
        ends = np.cumsum(self.rows[:, 0])
        piece = min(int(np.searchsorted(ends, t, side="right")), len(ends) - 1)
        own = t - (ends[piece] - self.rows[piece, 0])
        return Output(self.rows[piece, 1:25].reshape(3, 8) @ own ** np.arange(8))


@dataclass
class World:
    """What the robots share: the clock, what they were told, and what goes wrong.

    Attributes:
        off: m, added to each robot's measured position, by its name.
        headings: rad, added to each robot's measured heading.
        levels: `pm.batteryLevel` by robot; 90 where left out.
        volts: Battery voltage by robot; 4.1 where left out.
        supervisors: `supervisor.info` by robot; able to fly where left out.
        variances: Of a robot's estimated position at a time.
        stubborn: Parameters of robots that stay as they are whatever they are set to.
        lacks: Robot to a parameter that its firmware does not have.
        deaf: Robots that do not land when they are told to.
        at: Called with the time whenever it goes on, and may raise.
    """

    now: float = 0.0
    armed: bool = False
    told: list[tuple[str, str]] = field(default_factory=list[tuple[str, str]])
    off: dict[str, Position] = field(default_factory=dict[str, Position])
    headings: dict[str, float] = field(default_factory=dict[str, float])
    levels: dict[str, float] = field(default_factory=dict[str, float])
    volts: dict[str, float] = field(default_factory=dict[str, float])
    supervisors: dict[str, int] = field(default_factory=dict[str, int])
    variances: Callable[[str, float], float] = lambda _name, _now: 1e-5
    stubborn: dict[tuple[str, str], float] = field(default_factory=dict[tuple[str, str], float])
    lacks: dict[str, str] = field(default_factory=dict[str, str])
    deaf: set[str] = field(default_factory=set[str])
    silent_from: dict[str, float] = field(default_factory=dict[str, float])
    at: Callable[[float], None] = lambda _now: None
    robots: dict[str, Robot] = field(default_factory=dict[str, "Robot"])

    def commands(self, name: str) -> list[str]:
        """Return what a robot, or `all`, was told."""
        return [command for who, command in self.told if who == name]

    def modules(self) -> dict[str, types.ModuleType]:
        """Return crazyflie_py's modules, as scripts import them."""
        package, sub = types.ModuleType("crazyflie_py"), types.ModuleType("crazyflie_py.uav_trajectory")
        package.Crazyswarm, sub.Trajectory = lambda: Swarm(self), LoadedTrajectory  # type: ignore[attr-defined]
        interfaces, messages = types.ModuleType("crazyflie_interfaces"), types.ModuleType("crazyflie_interfaces.msg")
        messages.LogDataGeneric = object  # type: ignore[attr-defined]
        return {
            "crazyflie_py": package,
            "crazyflie_py.uav_trajectory": sub,
            "crazyflie_interfaces": interfaces,
            "crazyflie_interfaces.msg": messages,
        }


class Robot:
    """One robot: at rest where it was sent, or on its trajectory."""

    def __init__(self, name: str, world: World, place: Position) -> None:
        self.name, self.world, self.place = name, world, np.array(place, dtype=float)
        self.uri, self.heading = f"radio://0/80/2M/{name}", 0.0
        self.board = {
            "stabilizer.estimator": 2.0, "stabilizer.controller": 1.0, "ctrlMel.mass": 0.029, "ctrlMel.massThrust": 1.0,
            "locSrv.extPosStdDev": 0.01, "locSrv.extQuatStdDev": 0.0045,
        }  # fmt: skip
        self.paramTypeDict = {key: 3 for key in self.board if world.lacks.get(name) != key}
        self.uploaded: LoadedTrajectory | None = None
        self.uploads: list[float] = []
        self.started: float | None = None
        self.spinning = False

    def get_position(self) -> list[float]:
        """Return the measured position."""
        if self.started is not None and self.uploaded is not None:
            at = max(self._heard() - self.started, 0.0)
            self.place = self.uploaded.eval(min(at, self.uploaded.duration)).pos
        return list(self.place + self.world.off.get(self.name, np.zeros(3)))

    def _heard(self) -> float:
        """Return when the last pose was measured: 50 times a second."""
        return min(np.floor(50 * self.world.now + 1e-9) / 50, self.world.silent_from.get(self.name, np.inf))

    @property
    def poseStamped(self) -> dict[str, Any]:  # noqa: N802  # crazyswarm2's name
        """The last pose's stamp, and its attitude."""
        heard, half = self._heard(), 0.5 * (self.heading + self.world.headings.get(self.name, 0.0))
        turned = types.SimpleNamespace(x=0.0, y=0.0, z=float(np.sin(half)), w=float(np.cos(half)))
        nanoseconds = round(1e9 * heard)
        return {
            "timestamp_sec": nanoseconds // 10**9,
            "timestamp_nsec": nanoseconds % 10**9,
            "pose": types.SimpleNamespace(orientation=turned),
        }

    def get_status(self) -> dict[str, Any]:
        """Return what it last said of itself."""
        state = self.world.supervisors.get(self.name, 8 | (2 if self.world.armed else 1))
        return {"supervisor": state, "battery": self.world.volts.get(self.name, 4.1), "pm_state": 0}

    def setParam(self, name: str, value: float) -> None:  # noqa: N802
        """Set a parameter."""
        self.world.told.append((self.name, f"set {name}"))
        self.board[name] = self.world.stubborn.get((self.name, name), value)

    def getParam(self, name: str) -> float:  # noqa: N802
        """Return a parameter."""
        return self.board[name]

    def land(self, targetHeight: float, duration: float) -> None:
        """Land."""
        assert 0.0 < targetHeight < 0.2
        assert duration >= 1.0
        self.world.told.append((self.name, "land"))
        if self.name not in self.world.deaf:
            self.get_position()
            self.started, self.spinning = None, False
            self.place[2] = targetHeight

    def uploadTrajectory(self, trajectoryId: int, pieceOffset: int, trajectory: LoadedTrajectory) -> None:  # noqa: N802
        """Take a trajectory; a robot that is on one, or at its end, still reads its memory, as the firmware does."""
        assert (trajectoryId, pieceOffset) == (0, 0)
        assert self.started is None, "its memory is written while it flies from it"
        self.uploaded = trajectory
        self.uploads.append(self.world.now)

    def takeoff(self, targetHeight: float, duration: float) -> None:
        """Climb."""
        assert duration > 0
        assert self.world.armed
        self.world.told.append((self.name, "takeoff"))
        self.place[2], self.spinning = targetHeight, True

    def goTo(self, goal: Position, yaw: float, duration: float) -> None:  # noqa: N802
        """Go somewhere."""
        assert duration > 0
        assert np.isfinite(yaw)
        self.world.told.append((self.name, "goTo"))
        self.place, self.started, self.heading = np.array(goal, dtype=float), None, yaw

    def emergency(self) -> None:
        """Stop motors."""
        self.world.told.append((self.name, "emergency"))
        self.spinning, self.started = False, None


class Swarm:
    """What `Crazyswarm()` returns."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.timeHelper = self.allcfs = self
        self.listeners: dict[str, Callable[[Any], None]] = {}
        self.crazyfliesByName = world.robots

    def time(self) -> float:
        """Return s."""
        return self.world.now

    def sleep(self, duration: float) -> None:
        """Let time go on."""
        end = self.world.now + duration
        while self.world.now < end:
            before, self.world.now = self.world.now, min(end, self.world.now + 0.01)
            if int(20 * before) < int(20 * self.world.now):
                self.report()
            self.world.at(self.world.now)

    def create_subscription(self, kind: type, topic: str, callback: Callable[[Any], None], depth: int) -> None:
        """Listen to a topic."""
        assert (kind, depth) == (object, 10)
        self.listeners[topic] = callback

    def report(self) -> None:
        """Report what crazyflies.yaml asks estimators for."""
        for topic, callback in self.listeners.items():
            name = topic.split("/")[1]
            variance = self.world.variances(name, self.world.now)
            callback(types.SimpleNamespace(values=[variance] * 3 + [self.world.levels.get(name, 90.0)]))

    def arm(self, arm: bool) -> None:
        """Arm or disarm all."""
        self.world.told.append(("all", "arm" if arm else "disarm"))
        self.world.armed = arm

    def startTrajectory(self, trajectoryId: int, timescale: float, reverse: bool, relative: bool) -> None:  # noqa: N802
        """Start all."""
        assert (trajectoryId, timescale, reverse, relative) == (0, 1.0, False, False)
        self.world.told.append(("all", "startTrajectory"))
        for robot in self.world.robots.values():
            robot.started = self.world.now

    def emergency(self) -> None:
        """Stop all motors."""
        self.world.told.append(("all", "emergency"))
        for robot in self.world.robots.values():
            robot.emergency()
