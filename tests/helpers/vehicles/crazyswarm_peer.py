"""A typed stand-in for crazyswarm2's Python client: robots that do in simulated time what they are told, as far as the firmware lets them.

Each has the firmware's supervisor: commands are answered EBUSY, of which the client tells nothing, while it lets nothing fly; who is disarmed in the air
falls. Poses come 50 times a second, the estimator's report 20 times and `status` twice, as the exported crazyflies.yaml asks for.
"""

from __future__ import annotations

import math
import types
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flight.monitoring.alarm_response import smooth_step
from tests.helpers.vehicles.supervisor import Supervisor
from verify.data import GRAVITY

Position = NDArray[np.float64]
LOW = 0.08
"""m above the ground, from which on motors that are cut let a robot fall."""
TICK = 0.01
"""s of the simulated clock at once."""
_POWERS = np.maximum(np.arange(8) - np.arange(5)[:, None], 0)
_FACTORS = np.array([[math.perm(power, order) for power in range(8)] for order in range(5)], dtype=float)
"""Powers and factors of the derivatives of 0 to 4 times, by ascending powers. Shape (5, 8)."""


@dataclass
class Output:
    """Where a trajectory is."""

    pos: Position


@dataclass
class Coefficients:
    """One axis of a piece, by ascending powers."""

    p: Position


class Piece:
    """One piece of a trajectory."""

    def __init__(self, row: Position) -> None:
        self.duration = float(row[0])
        self.px, self.py, self.pz, self.pyaw = (Coefficients(row[1 + 8 * axis : 9 + 8 * axis].copy()) for axis in range(4))

    def flat(self, t: float) -> Position:
        """Return x, y, z, heading and four derivatives. Shape (5, 4)."""
        return (_FACTORS * t**_POWERS) @ np.stack([axis.p for axis in (self.px, self.py, self.pz, self.pyaw)], axis=1)


class LoadedTrajectory:
    """A trajectory's CSV, as crazyswarm2 loads it: durations, then x, y, z, yaw by ascending powers."""

    def loadcsv(self, path: Path) -> None:
        """Load it."""
        self.polynomials = [Piece(row) for row in np.loadtxt(path, delimiter=",", skiprows=1, usecols=range(33), ndmin=2)]
        self.duration = math.fsum(piece.duration for piece in self.polynomials)

    def flat(self, t: float) -> Position:
        """Return x, y, z, heading and four derivatives at t, at rest behind the end. Shape (5, 4)."""
        left = min(max(t, 0.0), self.duration)
        for piece in self.polynomials:
            if left <= piece.duration or piece is self.polynomials[-1]:
                flat = piece.flat(min(left, piece.duration))
                flat[1:] *= t < self.duration
                return flat
            left -= piece.duration
        raise AssertionError

    def eval(self, t: float) -> Output:
        """Return where it is at t."""
        assert 0 <= t <= self.duration
        return Output(self.flat(t)[0, :3])


@dataclass
class World:
    """What the robots share: the clock, what they were told, and what goes wrong.

    Attributes:
        simulated_clock: Whether scripts go by /clock (`use_sim_time`).
        off: m, added to each robot's measured position, by its name.
        headings: rad, added to each robot's measured heading.
        levels: `pm.batteryLevel` by robot; 90 where left out.
        volts: Battery voltage by robot; 4.1 where left out.
        supervisors: What `status` says of a robot's `supervisor.info`; as it is where left out.
        variances: Of a robot's estimated position at a time.
        stubborn: Parameters of robots that stay as they are whatever they are set to.
        lacks: Robot to a parameter that its firmware does not have.
        deaf: Robots that do not land when they are told to.
        at: Called with the time whenever it goes on, and may raise.
        busy: Commands that were answered EBUSY, by robot: the client tells of none.
        fell: Robots whose motors were cut in the air, by what, and from how high, m; nothing of it was an emergency stop.
        impacts: m/s at which robots came down.
    """

    now: float = 0.0
    simulated_clock: bool = False
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
    busy: list[tuple[str, str]] = field(default_factory=list[tuple[str, str]])
    fell: list[tuple[str, str, float]] = field(default_factory=list[tuple[str, str, float]])
    impacts: dict[str, float] = field(default_factory=dict[str, float])

    @property
    def armed(self) -> bool:
        """Whether a robot is armed that does not arm itself."""
        return any(robot.supervisor.armed and robot.supervisor.brushless for robot in self.robots.values())

    def commands(self, name: str) -> list[str]:
        """Return what a robot, or `all`, was told."""
        return [command for who, command in self.told if who == name]

    def go_on(self, until: float) -> None:
        """Let time go on to an instant."""
        before, self.now = self.now, until
        for robot in self.robots.values():
            robot.tick(self.now - before)

    def report(self, listeners: dict[str, Callable[[Any], None]], before: float) -> None:
        """Publish what is due since an instant."""
        if int(2 * before) < int(2 * self.now):
            for robot in self.robots.values():
                robot.report()
        if int(20 * before) < int(20 * self.now):
            for topic, callback in listeners.items():
                name = topic.split("/")[1]
                if name in self.robots:
                    variance = self.variances(name, self.now)
                    callback(types.SimpleNamespace(values=[variance] * 3 + [self.levels.get(name, 90.0)]))

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
    """One robot: at rest where it was sent, on its way, on its trajectory, or falling."""

    def __init__(self, name: str, world: World, place: Position, *, brushless: bool = False, spin_up: float = 0.26) -> None:
        self.name, self.world, self.place = name, world, np.array(place, dtype=float)
        self.uri, self.heading = f"radio://0/80/2M/{name}", 0.0
        self.supervisor = Supervisor(brushless, spin_up if brushless else 0.0)
        self.supervisor.settle()
        self.board = {
            "stabilizer.estimator": 2.0, "stabilizer.controller": 1.0, "ctrlMel.mass": 0.029, "ctrlMel.massThrust": 1.0,
            "locSrv.extPosStdDev": 0.01, "locSrv.extQuatStdDev": 0.0045,
        }  # fmt: skip
        self.paramTypeDict = {key: 3 for key in self.board if world.lacks.get(name) != key}
        self.uploaded: LoadedTrajectory | None = None
        self.uploads: list[float] = []
        self.started: float | None = None
        self.spinning, self.landing = False, False
        self._stands = self.place.copy()
        self._way: tuple[float, Position, Position, float] | None = None  # begin, from, to, seconds
        self._sinks = 0.0
        self._seen: tuple[float, Position] | None = None
        self.status: dict[str, Any] = {}

    # What it does

    @property
    def ground(self) -> float:
        """Height of what is below it, m: what it stood on first, and elsewhere the floor."""
        return float(self._stands[2]) if math.dist(self.place[:2], self._stands[:2]) < 0.1 else 0.0

    def wanted(self) -> Position:
        """Return x, y, z, heading and four derivatives that it follows. Shape (5, 4)."""
        flat = np.zeros((5, 4))
        flat[0] = (*self.place, self.heading)
        if self.started is not None and self.uploaded is not None:
            return self.uploaded.flat(self.world.now - self.started)
        if self._way is not None:
            begin, source, goal, seconds = self._way
            step = smooth_step((self.world.now - begin) / seconds)
            flat[0, :3] = source + (goal - source) * step[0]
            for order in range(1, 5):
                flat[order, :3] = (goal - source) * step[order] / seconds**order
        return flat

    def tick(self, seconds: float) -> None:
        """Go on for a moment."""
        now = self.world.now
        if self._seen is None:
            self._stands = self.place.copy()
        self.supervisor.look(now, thrust=self.spinning)
        if self.spinning and not self.supervisor.runs_motors:
            self.cut("supervisor" if self.supervisor.state in ("crashed", "locked") else "disarmed")
        if self.spinning:
            self.place = self.wanted()[0, :3]
            if self.landing and self._way is not None and now >= self._way[0] + self._way[3]:
                self.cut("landed")
        elif self.place[2] > self.ground:
            self._sinks += GRAVITY * seconds
            self.place = np.array([*self.place[:2], max(self.place[2] - self._sinks * seconds, self.ground)])
            if self.place[2] <= self.ground:
                self.world.impacts[self.name] = self._sinks
        due = self._seen is None or math.floor(50.0 * now + 1e-6) > math.floor(50.0 * self._seen[0] + 1e-6)
        if due and now <= self.world.silent_from.get(self.name, math.inf):
            self._seen = (now, self.place.copy())

    def cut(self, why: str) -> None:
        """Cut its motors, and stop its planner."""
        height = self.place[2] - self.ground
        if self.spinning and why == "disarmed" and height > LOW:
            self.world.fell.append((self.name, why, float(height)))
        self.spinning = self.landing = False
        self.started, self._way, self._sinks = None, None, 0.0

    def obeys(self, command: str) -> bool:
        """Take a command to its high-level commander; return whether it is taken."""
        self.world.told.append((self.name, command))
        if not self.supervisor.can_fly:
            self.world.busy.append((self.name, command))
        return self.supervisor.can_fly

    def go(self, goal: Position, seconds: float, *, landing: bool = False) -> None:
        """Plan a way from where it is wanted now."""
        source = self.wanted()[0, :3].copy()
        self._way = (self.world.now, source, np.array(goal, dtype=float), max(seconds, 0.1))
        self.started, self.spinning, self.landing = None, True, landing

    def hover(self, place: Position) -> None:
        """Hover somewhere: somebody has flown it there."""
        self.place, self.spinning, self._seen = np.array(place, dtype=float), True, None
        self.supervisor.armed, self.supervisor.state = True, "flying"
        self.tick(0.0)
        self._stands = self.place * (1, 1, 0)

    # What it says

    def get_position(self) -> list[float]:
        """Return the measured position."""
        if self._seen is None:
            self.tick(0.0)
        assert self._seen is not None
        return list(self._seen[1] + self.world.off.get(self.name, np.zeros(3)))

    @property
    def poseStamped(self) -> dict[str, Any]:  # noqa: N802  # crazyswarm2's name
        """The last pose's stamp, and its attitude."""
        if self._seen is None:
            self.tick(0.0)
        assert self._seen is not None
        heard, half = self._seen[0], 0.5 * (self.heading + self.world.headings.get(self.name, 0.0))
        turned = types.SimpleNamespace(x=0.0, y=0.0, z=float(np.sin(half)), w=float(np.cos(half)))
        nanoseconds = round(1e9 * heard)
        return {
            "timestamp_sec": nanoseconds // 10**9,
            "timestamp_nsec": nanoseconds % 10**9,
            "pose": types.SimpleNamespace(orientation=turned),
        }

    def report(self) -> None:
        """Publish its `status`."""
        state = self.world.supervisors.get(self.name, self.supervisor.info)
        self.status = {"supervisor": state, "battery": self.world.volts.get(self.name, 4.1), "pm_state": 0}

    def get_status(self) -> dict[str, Any]:
        """Return what it last said of itself."""
        return self.status

    def setParam(self, name: str, value: float) -> None:  # noqa: N802
        """Set a parameter."""
        self.world.told.append((self.name, f"set {name}"))
        self.board[name] = self.world.stubborn.get((self.name, name), value)

    def getParam(self, name: str) -> float:  # noqa: N802
        """Return a parameter."""
        return self.board[name]

    # What it is told

    def arm(self, arm: bool) -> None:
        """Arm or disarm."""
        self.world.told.append((self.name, "arm" if arm else "disarm"))
        self.supervisor.request(arm)

    def land(self, targetHeight: float, duration: float) -> None:
        """Land; who lands already goes on, who stands rises to land again."""
        assert 0.0 < targetHeight < 0.25
        assert duration >= 1.0
        if self.obeys("land") and self.name not in self.world.deaf and not self.landing:
            self.go(np.array([*self.wanted()[0, :2], targetHeight]), duration, landing=True)

    def uploadTrajectory(self, trajectoryId: int, pieceOffset: int, trajectory: LoadedTrajectory) -> None:  # noqa: N802
        """Take a trajectory; a robot that is on one, or at its end, still reads its memory, as the firmware does."""
        assert (trajectoryId, pieceOffset) == (0, 0)
        assert self.started is None, "its memory is written while it flies from it"
        self.uploaded = trajectory
        self.uploads.append(self.world.now)

    def takeoff(self, targetHeight: float, duration: float) -> None:
        """Climb."""
        assert duration > 0
        if self.obeys("takeoff"):
            self.go(np.array([*self.place[:2], targetHeight]), duration)

    def goTo(self, goal: Position, yaw: float, duration: float) -> None:  # noqa: N802
        """Go somewhere."""
        assert duration > 0
        assert np.isfinite(yaw)
        if self.obeys("goTo"):
            self.go(goal, duration)
            self.heading = yaw

    def start(self) -> None:
        """Start its trajectory."""
        if self.supervisor.can_fly:
            self.started, self._way, self.landing, self.spinning = self.world.now, None, False, True
        else:
            self.world.busy.append((self.name, "startTrajectory"))

    def emergency(self) -> None:
        """Stop motors."""
        self.world.told.append((self.name, "emergency"))
        self.supervisor.emergency = True
        self.cut("emergency")


class Swarm:
    """What `Crazyswarm()` returns."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.timeHelper = self.allcfs = self
        self.listeners: dict[str, Callable[[Any], None]] = {}
        self.crazyfliesByName = world.robots

    def get_parameter(self, name: str) -> types.SimpleNamespace:
        """Return a parameter of the node's."""
        assert name == "use_sim_time"
        return types.SimpleNamespace(value=self.world.simulated_clock)

    def time(self) -> float:
        """Return s."""
        return self.world.now

    def sleep(self, duration: float) -> None:
        """Let time go on."""
        end = self.world.now + duration
        while self.world.now < end:
            before = self.world.now
            self.world.go_on(min(end, before + TICK))
            self.world.report(self.listeners, before)
            self.world.at(self.world.now)

    def create_subscription(self, kind: type, topic: str, callback: Callable[[Any], None], depth: int) -> None:
        """Listen to a topic."""
        assert isinstance(kind, type)
        assert depth == 10
        self.listeners[topic] = callback

    def arm(self, arm: bool) -> None:
        """Arm or disarm all."""
        self.world.told.append(("all", "arm" if arm else "disarm"))
        for robot in self.world.robots.values():
            robot.supervisor.request(arm)

    def startTrajectory(self, trajectoryId: int, timescale: float, reverse: bool, relative: bool) -> None:  # noqa: N802
        """Start all."""
        assert (trajectoryId, timescale, reverse, relative) == (0, 1.0, False, False)
        self.world.told.append(("all", "startTrajectory"))
        for robot in self.world.robots.values():
            robot.start()

    def emergency(self) -> None:
        """Stop all motors."""
        self.world.told.append(("all", "emergency"))
        for robot in self.world.robots.values():
            robot.emergency()
