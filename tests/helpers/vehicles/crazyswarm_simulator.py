"""A stand-in for crazyswarm2's own simulator (`backend:=sim`, rigid bodies, firmware's Mellinger controller), with ROS 2's message types and its rates.

As `crazyflie_sim` of July 2026: tf for every robot at each of its steps of 0.5 ms, /clock from the same, no /pose, no /status, no parameters, no arming and no
emergency stop; who has landed hovers on where the landing ended. Its vehicle weighs 34 g, and its controller believes in 29 g. Its Python parts and the
firmware's bindings are on no package index, so neither is run here: bodies and controller are those of our simulation.
"""

from __future__ import annotations

import types
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_typestore

from flight.control.mellinger import Mellinger
from flight.mixed_fleet import kinds_of
from flight.model.airframe import airframes_of
from flight.onboard_simulation.fleet import Differences, Fleet
from tests.helpers.vehicles.crazyswarm_peer import Position, Robot, World

STEP, FRAME = 0.0005, 0.01
"""s between two steps of the simulator, and between two of ours."""
MASS, BELIEVED = 0.034, 0.029
"""kg that its vehicle weighs, and that its controller takes it to weigh."""

_TYPES = get_typestore(Stores.ROS2_HUMBLE).types
_Header, _Time = _TYPES["std_msgs/msg/Header"], _TYPES["builtin_interfaces/msg/Time"]
_Stamped, _Transform = _TYPES["geometry_msgs/msg/TransformStamped"], _TYPES["geometry_msgs/msg/Transform"]
_Vector, _Quaternion = _TYPES["geometry_msgs/msg/Vector3"], _TYPES["geometry_msgs/msg/Quaternion"]
TFMessage: Any = _TYPES["tf2_msgs/msg/TFMessage"]


@dataclass
class SimulatedWorld(World):
    """Robots of the simulator.

    Attributes:
        believed: kg that the controller takes vehicles to weigh.
        messages: How many tf had.
    """

    believed: float = BELIEVED
    simulated_clock: bool = True
    messages: int = 0
    _waiting: list[Any] = field(default_factory=list[Any])
    _fleet: Fleet | None = None
    _flown: float = 0.0

    def fly(self, mission: Any) -> None:
        """Put a mission's robots where they stand.

        Args:
            mission: Who flies; each with the simulator's vehicle.
        """
        heavy = mission.model_copy(update={"vehicle": mission.vehicle.changed(mass=MASS)})
        airframes = airframes_of(heavy, heavy.agents)
        start = np.stack([[*robot.place, robot.heading] for robot in self.robots.values()], axis=-1)
        self._fleet = Fleet(kinds_of(airframes, 1), Mellinger(mass=self.believed), start, Differences())

    def go_on(self, until: float) -> None:
        """Let time go on to an instant, frame by frame."""
        self.now = until
        assert self._fleet is not None
        while self._flown + FRAME <= self.now + 1e-9:
            before = self._fleet.state
            if any(robot.spinning for robot in self.robots.values()):
                self._fleet.fly(np.stack([robot.wanted() for robot in self.robots.values()], axis=-1), 0, 0.0)
            after = self._fleet.state
            for share in np.arange(1, round(FRAME / STEP) + 1) * STEP / FRAME:
                self._show(self._flown + share * FRAME, before + (after - before) * share)
            self._flown += FRAME

    def _show(self, now: float, state: Position) -> None:
        stamp = _Time(sec=int(now), nanosec=int(1e9 * (now - int(now))))
        rows = []
        for index, (name, robot) in enumerate(self.robots.items()):
            x, y, z = state[:3, index].tolist()
            w, i, j, k = state[6:10, index].tolist()
            robot.place = np.array([x, y, max(z, 0.0)])
            where = _Transform(_Vector(x, y, max(z, 0.0)), _Quaternion(i, j, k, w))
            rows.append(_Stamped(_Header(stamp, "world"), name, where))
        self._waiting.append(TFMessage(rows))

    def report(self, listeners: dict[str, Callable[[Any], None]], before: float) -> None:
        """Publish what is due: tf, and nothing else."""
        waiting, self._waiting = self._waiting, []
        self.messages += len(waiting)
        for message in waiting:
            if "/tf" in listeners:
                listeners["/tf"](message)

    def modules(self) -> dict[str, types.ModuleType]:
        """Return crazyflie_py's modules and tf2's messages, as scripts import them."""
        messages = types.ModuleType("tf2_msgs.msg")
        messages.TFMessage = TFMessage  # type: ignore[attr-defined]
        return {**super().modules(), "tf2_msgs": types.ModuleType("tf2_msgs"), "tf2_msgs.msg": messages}


class SimulatedRobot(Robot):
    """One of its robots: its planner, which nobody supervises."""

    def __init__(self, name: str, world: World, place: Position) -> None:
        super().__init__(name, world, place)
        self.paramTypeDict: dict[str, int] = {}
        self._asked = np.array([*self.place, self.heading])

    def wanted(self) -> Position:
        """Return what its planner asks for; where it ended, the last of it."""
        if self.started is None and self._way is None:
            flat = np.zeros((5, 4))
            flat[0] = self._asked
            return flat
        flat = super().wanted()
        self._asked = flat[0].copy()
        return flat

    def tick(self, seconds: float) -> None:
        """Do nothing: the simulator moves it."""

    def cut(self, why: str) -> None:
        """Do nothing: its emergency stop is not implemented."""

    def obeys(self, command: str) -> bool:
        """Take every command."""
        self.world.told.append((self.name, command))
        return True

    def get_position(self) -> list[float]:
        """Return what its client has before any /pose came: the origin."""
        return [0.0, 0.0, 0.0]

    @property
    def poseStamped(self) -> dict[str, Any]:  # noqa: N802  # crazyswarm2's name
        """Nothing: there is no /pose."""
        return {}

    def start(self) -> None:
        """Start its trajectory."""
        self.started, self._way, self.landing, self.spinning = self.world.now, None, False, True

    def arm(self, arm: bool) -> None:
        """Do nothing: there is no such service, and the client does not wait for one."""
        self.world.told.append((self.name, "arm" if arm else "disarm"))
