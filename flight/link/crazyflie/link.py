"""The link to Crazyflies: flights lie on board, one broadcast starts them, and the firmware's high-level commander flies them."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Mapping
from typing import Literal

import numpy as np

from flight.exports.crazyflies.radio_addresses import heard_by
from flight.exports.scripts.flying.supervisor import health_of
from flight.link.addresses import require_addresses
from flight.link.crazyflie.broadcast import Broadcast
from flight.link.crazyflie.capture import Body, Capture, Watch
from flight.link.crazyflie.memory import Memory, encoded
from flight.link.crazyflie.setting import wanted
from flight.link.crazyflie.steps import arm, armed, connect, store, until
from flight.link.crazyflie.vehicle import Vehicle
from flight.link.link import Health, Pose
from flight.link.simulated_commander import Commander
from flight.model.attitude import euler
from flight.monitoring.alarm_response import braking_length
from flight.monitoring.thresholds import CRAZYFLIE_ACCURACY
from verify.data import InternalError, Mission, Trajectory

_ALIVE = 0.2
"""s between two signs of life; the firmware waits for 1 s."""
_GONE = "1 s after the last sign of life from here a Crazyflie stops its motors where it is (the firmware's emergency-stop watchdog)"
_GOES_ON = "a Crazyflie flies what was started to its end, and hovers there until its battery is empty"
_HIGH = 0.3
"""m above where it stood, from which on a robot that is told to stop is told so by an emergency stop, too."""
_ASTRAY = 0.05
"""m that an estimate may be off from motion capture."""
_EXAMPLE = "radio://0/80/2M/E7E7E7E701"

Failsafe = Literal["stop", "fly on"]


class CrazyflieLink:
    """Crazyflies, each by its own address.

    Attributes:
        accuracy: Bound on the error of a measured position, m.
        wanted: Parameters that are set on board, by robot.
    """

    _step = 0.01  # s that are slept at once

    def __init__(
        self,
        mission: Mission,
        addresses: Mapping[str, str],
        *,
        masses: Mapping[str, float] | None = None,
        capture: Capture | None = None,
        failsafe: Failsafe | None = None,
        accuracy: float = CRAZYFLIE_ACCURACY,
    ) -> None:
        """Reach all vehicles, set what a flight needs, and read it back. Nothing spins.

        Args:
            mission: Who flies.
            addresses: Robot to address, such as `radio://0/80/2M/E7E7E7E701`.
            masses: kg as robots were weighed; others have their profile's.
            capture: Motion capture, whose poses are sent to the vehicles and are what they are measured by; None where they find
                their own place.
            failsafe: What acts on board when nothing comes from here any more: `stop`, motors stop after 1 s; `fly on`, to the end of
                what was started. None: `stop` with motion capture, without which an estimate is worth nothing, else `fly on`.
            accuracy: Bound on the error of a measured position, m.

        Raises:
            BadInput: An address is missing, of nobody, or used twice.
            LinkLost: There is no radio, or a vehicle does not answer or does not have what is needed.
            DoesNotFit: A robot is no Crazyflie, weighs much more or less than what was certified, or cannot be told what is flown.
            MissingEngine: cflib is not installed.
        """
        require_addresses(mission, addresses, _EXAMPLE, heard_by)
        self._require(mission)
        self._began = time.monotonic()
        self._mission, self.accuracy, self.wanted = mission, accuracy, wanted(mission, masses or {})
        self._stops = (failsafe or ("stop" if capture else "fly on")) == "stop"
        self._quiet = logging.NullHandler()  # cflib logs failures with tracebacks; they are raised here
        logging.getLogger("cflib").addHandler(self._quiet)
        self._vehicles: dict[str, Vehicle] = {}
        self._broadcast: Broadcast | None = None
        self._watch: Watch | None = None
        self._flown: set[str] = set()
        self._fed, self._armed_at = -math.inf, dict[str, float]()
        self._stopped: set[str] = set()
        self._targets: dict[str, tuple[tuple[float, float, float, float], float]] = {}
        try:
            self._vehicles.update({name: Vehicle(name, addresses[name], self.now) for name in mission.agents})
            connect(self._vehicles.values(), self.wanted, self.sleep)
            if capture is not None:
                self._watch = Watch(capture, self._seen)
                until(self._vehicles.values(), lambda v: v.pose is not None, "is not seen by motion capture", self.sleep)
            self._commanders = {name: self._standing(name) for name in self._vehicles}
            self._grounds = {name: float(commander.wanted(0.0)[0, 2]) for name, commander in self._commanders.items()}
            self._reached()
        except BaseException:
            self.close()
            raise

    def _require(self, mission: Mission) -> None:
        """Do nothing: a flight on board may lie anywhere. A link that streams rejects here what it cannot fly, before anybody is reached."""

    def _reached(self) -> None:
        """Prepare for flights, once all are reached."""
        self._memories = {name: Memory(vehicle.room) for name, vehicle in self._vehicles.items()}
        self._broadcast = Broadcast(self._vehicles.values())

    @property
    def robots(self) -> tuple[str, ...]:
        """Names."""
        return tuple(self._vehicles)

    @property
    def failsafe(self) -> str:
        """Reaction on board when nothing arrives from here any more."""
        return _GONE if self._stops else _GOES_ON

    @property
    def streams(self) -> bool:
        """Flights lie on board and are flown from there: none is changed while it is flown."""
        return False

    def now(self) -> float:
        """Return s since the link began."""
        return time.monotonic() - self._began

    def sleep(self, seconds: float) -> None:
        """Wait for so long, and give signs of life meanwhile: a process that hangs gives none."""
        end = self.now() + seconds
        self._go_on(self.now())
        while (left := end - self.now()) > 0:
            time.sleep(min(left, self._step))
            self._go_on(self.now())

    def pose(self, robot: str) -> Pose | None:
        """Return the last pose: of motion capture where there is one, else the vehicle's own."""
        vehicle = self._vehicles[robot]
        return vehicle.reports.estimate if self._watch is None else vehicle.pose

    def health(self, robot: str) -> Health:
        """Return what a vehicle last said of itself."""
        reports, seen = self._vehicles[robot].reports, self._vehicles[robot].pose
        settled = reports.settled
        if self._watch is not None and seen is not None and reports.estimate is not None:
            near = robot in self._flown or math.dist(seen.position, reports.estimate.position) < _ASTRAY
            settled = near if settled is None else settled and near
        return health_of(reports.state, settled, reports.battery, self._mission.vehicle_of(robot).endurance)

    def parameters(self, robot: str) -> Mapping[str, float]:
        """Return the parameters that matter, as they were read back."""
        board = self._vehicles[robot].board
        return {key: board[key] for key in self.wanted[robot] if key in board}

    def require_room(self, team: Mapping[str, Trajectory]) -> None:
        """Reject flights that memories on board cannot hold, before anything is stored.

        Args:
            team: Finite, as they are flown.

        Raises:
            DoesNotFit: A robot's does not.
        """
        for name, path in team.items():
            encoded(name, path, self._vehicles[name].room)

    def upload(self, robot: str, number: int, path: Trajectory) -> None:
        """Store a flight on board and read it from there; one that does not fit beside the others is stored when it is started.

        Args:
            robot: Name.
            number: From 0.
            path: Finite, as it is flown.

        Raises:
            LinkLost: The vehicle did not take it.
            DoesNotFit: Its memory does not hold it.
        """
        self._commanders[robot].store(number, path)
        entry = self._memories[robot].take(number, robot, path)
        if entry is not None:
            store(self._vehicles[robot], entry, self.sleep)

    def bring(self, number: int, meanwhile: Callable[[], None]) -> None:
        """Store what did not fit before, on board of one after another.

        Args:
            number: Of the flight.
            meanwhile: Called again and again while it is written.

        Raises:
            LinkLost: A vehicle does not hold, or did not take it.
        """

        def sleep(seconds: float) -> None:
            self.sleep(seconds)
            meanwhile()

        for name in self._vehicles:
            self._bring(name, number, sleep)

    def ready(self, robot: str, number: int) -> bool:
        """Arm a robot where it has to be armed; return whether it can fly.

        Args:
            robot: Name.
            number: Of the flight.
        """
        del number
        return armed(self._vehicles[robot], self._armed_at)

    def start(self, number: int, at: float | None = None) -> float:
        """Start a stored flight of all at one instant.

        Args:
            number: Of the flight.
            at: None: it begins when the vehicles have heard of it.

        Returns:
            When it began, s of the link's clock.

        Raises:
            LinkLost: A vehicle does not arm, does not take its flight, or did not start with the others.
            InternalError: An instant was named.
        """
        if at is not None:
            raise InternalError("Crazyflies begin a flight when they have heard of it, not at an instant that is said before.")
        self.bring(number, _nothing)
        if not self._flown:
            arm(self._vehicles.values(), self.sleep)
            self._flown.update(self._vehicles)
            self.sleep(0.0)
        assert self._broadcast is not None
        self._targets.clear()
        self._stopped.clear()
        begin = self.now()
        for commander in self._commanders.values():
            commander.start(number, begin)
        self._broadcast.start(number, self.sleep)
        return begin

    def hold(self, robot: str) -> bool:
        """Tell a robot to go to where it comes to rest when it brakes; return whether it has acknowledged that.

        Args:
            robot: Name.
        """
        if robot not in self._targets:
            self._targets[robot] = self._rest(robot, self.now()), braking_length(self._mission)
        return self._vehicles[robot].go_to(*self._targets[robot])

    def land(self, robot: str, height: float, seconds: float) -> bool:
        """Tell a robot to sink; return whether it has acknowledged that.

        Args:
            robot: Name.
            height: z in m where the landing ends.
            seconds: How long it takes.
        """
        return self._vehicles[robot].land(height, seconds)

    def stop(self, robot: str) -> bool:
        """Tell a robot to stop its motors, in the air by an emergency stop as well; return whether it has acknowledged that.

        Args:
            robot: Name.
        """
        vehicle, pose = self._vehicles[robot], self.pose(robot)
        if robot in self._flown and (pose is None or pose.position[2] > self._grounds[robot] + _HIGH):
            vehicle.emergency()
        if vehicle.stop():
            self._stopped.add(robot)
        return robot in self._stopped

    def close(self) -> None:
        """Let go of radios and vehicles."""
        if self._watch is not None:
            self._watch.ended.set()
        if self._broadcast is not None:
            self._broadcast.close()
        for name, vehicle in self._vehicles.items():
            vehicle.close(landed=name not in self._flown or name in self._stopped)
        logging.getLogger("cflib").removeHandler(self._quiet)

    def _rest(self, robot: str, since: float) -> tuple[float, float, float, float]:
        """Return where a robot comes to rest that brakes since an instant, x, y, z in m and heading in rad."""
        commander = self._commanders[robot]
        commander.hold(since)
        x, y, z, heading = commander.wanted(since + 2.0 * braking_length(self._mission))[0].tolist()
        return x, y, z, heading

    def _go_on(self, now: float) -> None:
        """Give signs of life."""
        if self._flown and self._stops and now - self._fed >= _ALIVE:
            self._fed = now
            for name in self._flown:
                self._vehicles[name].alive()

    def _standing(self, robot: str) -> Commander:
        """Return a commander like the one on board, which stands where the robot does."""
        pose = self.pose(robot)
        place = (math.nan,) * 4 if pose is None else (*pose.position, pose.heading or 0.0)
        return Commander(np.array(place), braking_length(self._mission))

    def _seen(self, bodies: Mapping[str, Body]) -> None:
        """Take in a frame of motion capture, and send it on."""
        now = self.now()
        for name, body in bodies.items():
            if name in self._vehicles:
                roll, pitch, heading = euler(np.roll(body.attitude, 1)[:, None])[:, 0].tolist()
                tilt = math.acos(max(-1.0, min(1.0, math.cos(roll) * math.cos(pitch))))
                self._vehicles[name].pose = Pose(now, body.position, heading, {"tilt": tilt})
                self._vehicles[name].show(body.position, body.attitude)

    def _bring(self, robot: str, number: int, sleep: Callable[[float], None]) -> None:
        """Store what did not fit before, while the robot is held where that begins: it must not read the memory meanwhile."""
        entry = self._memories[robot].missing(number)
        if entry is None:
            return
        self._targets.pop(robot, None)
        if robot in self._flown:
            until((self._vehicles[robot],), lambda _: self.hold(robot), "did not hold", sleep)
        store(self._vehicles[robot], entry, sleep)


def _nothing() -> None:
    """Do nothing meanwhile."""
