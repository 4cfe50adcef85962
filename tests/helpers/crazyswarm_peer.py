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
        at: Called with the time whenever it goes on, and may raise.
    """

    now: float = 0.0
    armed: bool = False
    told: list[tuple[str, str]] = field(default_factory=list[tuple[str, str]])
    off: dict[str, Position] = field(default_factory=dict[str, Position])
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
        return {"crazyflie_py": package, "crazyflie_py.uav_trajectory": sub}


class Robot:
    """One robot: at rest where it was sent, or on its trajectory."""

    def __init__(self, name: str, world: World, place: Position) -> None:
        self.name, self.world, self.place = name, world, np.array(place, dtype=float)
        self.uploaded: LoadedTrajectory | None = None
        self.uploads: list[float] = []
        self.started: float | None = None
        self.spinning = False

    def get_position(self) -> list[float]:
        """Return the measured position."""
        if self.started is not None and self.uploaded is not None:
            self.place = self.uploaded.eval(min(self.world.now - self.started, self.uploaded.duration)).pos
        return list(self.place + self.world.off.get(self.name, np.zeros(3)))

    @property
    def poseStamped(self) -> dict[str, Any]:  # noqa: N802  # crazyswarm2's name
        """The last pose's stamp."""
        heard = min(self.world.now, self.world.silent_from.get(self.name, np.inf))
        return {"timestamp_sec": int(heard), "timestamp_nsec": int(1e9 * (heard % 1.0))}

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
        self.place, self.started = np.array(goal, dtype=float), None

    def emergency(self) -> None:
        """Stop motors."""
        self.world.told.append((self.name, "emergency"))
        self.spinning, self.started = False, None


class Swarm:
    """What `Crazyswarm()` returns."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.timeHelper = self.allcfs = self
        self.crazyfliesByName = world.robots

    def time(self) -> float:
        """Return s."""
        return self.world.now

    def sleep(self, duration: float) -> None:
        """Let time go on."""
        end = self.world.now + duration
        while self.world.now < end:
            self.world.now = min(end, self.world.now + 0.01)
            self.world.at(self.world.now)

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

    def land(self, targetHeight: float, duration: float) -> None:
        """Land all."""
        assert targetHeight < 0.1 < duration
        self.world.told.append(("all", "land"))
        for robot in self.world.robots.values():
            robot.get_position()
            robot.started, robot.spinning = None, False
            robot.place[2] = targetHeight

    def emergency(self) -> None:
        """Stop all motors."""
        self.world.told.append(("all", "emergency"))
        for robot in self.world.robots.values():
            robot.emergency()
