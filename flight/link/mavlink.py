"""A link to PX4 vehicles by MAVLink: set-points streamed from here, all robots by one clock, modes and arming asked for until confirmed.

PX4 stores no trajectories: flights are kept here, and `sleep` sends each robot's set-point of the instant, 50 times a second, of which
PX4 wants more than two. When they end, PX4's own failsafe acts: after `COM_OF_LOSS_T` seconds it does what `COM_OBL_RC_ACT` says. Both are set before the first
flight and read back.
"""

from __future__ import annotations

import contextlib
import math
import os
import time
from collections.abc import Callable, Collection, Mapping
from typing import Any

import numpy as np

from flight.exports.px4 import FAILSAFE, to_ned
from flight.exports.px4_parameters import px4_parameters
from flight.exports.scripts.flying.checks import differing
from flight.exports.scripts.flying.reports import (
    ARM,
    CUSTOM_MODE,
    HOLD,
    LAND,
    OFFBOARD,
    SET_INTERVAL,
    SET_MODE,
    encoded,
    intervals,
)
from flight.link.addresses import require_addresses, said_of
from flight.link.link import Health, LinkLost, Pose
from flight.link.px4_vehicle import AGAIN, Heartbeats, Vehicle
from flight.link.streaming import RATE, SetpointStream
from flight.monitoring.thresholds import PX4_ACCURACY
from verify.data import BadInput, MissingEngine, Mission, Trajectory

CONNECT = 10.0
"""s to wait for each robot's heartbeat and position."""
LEAD = 1.5
"""s of set-points before offboard flight is asked for."""
ANSWER = 5.0
"""s to wait for a mode, for arming, and for a parameter."""
LOOK = 2.5
"""s in which estimator and battery are reported, and checks before arming pass; what is not known until then is not checked."""
_NO_SERIAL = "it is taken for a serial port, which needs pyserial (addresses in a network begin with udpin:, udpout: or tcp:)"
_NO_PORT = "it has no port; write it as udpin:0.0.0.0:14540, udpout:, tcp: or a serial port, /dev/ttyUSB0"
_LOCAL_NED = 1


class MavlinkLink:
    """PX4 vehicles, each by its own address. Each hears the heartbeat of a ground station once a second, for as long as the link is up."""

    def __init__(
        self,
        mission: Mission,
        addresses: Mapping[str, str],
        *,
        systems: Mapping[str, int] | None = None,
        origin: tuple[float, float, float] = (0.0, 0.0, 0.0),
        accuracy: float = PX4_ACCURACY,
    ) -> None:
        """Reach all vehicles, and set and read back what acts on board when set-points end.

        Args:
            mission: Who flies.
            addresses: Robot to address, such as `udpin:0.0.0.0:14540`.
            systems: Robot to MAVLink system id; 1, 2, ... in the mission's order where left out.
            origin: Where the vehicles' local frame has its origin in the mission's, m.
            accuracy: Bound on the error of a reported position, m.

        Raises:
            BadInput: An address is missing, of nobody, used twice, or cannot be opened.
            LinkLost: A vehicle does not answer, or does not take a parameter.
            MissingEngine: pymavlink is not installed.
        """
        require_addresses(mission, addresses, "udpin:0.0.0.0:14540")
        os.environ["MAVLINK20"] = "1"  # before pymavlink is imported: it decides there
        try:
            from pymavlink import mavutil
        except ImportError:
            raise MissingEngine("flying PX4 needs pymavlink: pip install 'ltlplan[px4]'.") from None
        self._mission, self._origin, self.accuracy = mission, np.array(origin, dtype=float), accuracy
        self._vehicles: dict[str, Vehicle] = {}
        for index, name in enumerate(mission.agents):
            try:
                link = mavutil.mavlink_connection(addresses[name], source_system=255, source_component=190, dialect="common")
            except Exception as error:  # pymavlink raises what its drivers do
                self.close()
                reason = _NO_SERIAL if isinstance(error, ImportError) else _NO_PORT if isinstance(error, ValueError) else error
                raise BadInput(f"{name} cannot be reached at {addresses[name]}: {reason}.") from None
            self._vehicles[name] = Vehicle(name, (systems or {}).get(name, index + 1), link)
        self._stream, self._streaming = SetpointStream(self._vehicles), False
        self._waking: dict[str, tuple[int, float]] = {}
        self._beats = Heartbeats(tuple(self._vehicles.values()))
        try:
            self._connect()
        except BaseException:
            self.close()
            raise

    @property
    def robots(self) -> tuple[str, ...]:
        """Names."""
        return tuple(self._vehicles)

    @property
    def failsafe(self) -> str:
        """Reaction on board when set-points end, as it was read back."""
        return (
            f"{FAILSAFE['COM_OF_LOSS_T']:g} s after its last set-point PX4 lands where it is (COM_OF_LOSS_T, COM_OBL_RC_ACT); "
            "one that was told to hold or to land does so to the end"
        )

    @property
    def streams(self) -> bool:
        """Set-points come from here: what is stored anew while it is flown goes on changed."""
        return True

    def now(self) -> float:
        """Return s of this computer's steady clock."""
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        """Listen, and stream set-points, for so long.

        Args:
            seconds: How long.

        Raises:
            LinkLost: This computer was late by more than `LATE`; from then on robots are asked to stay where they last were.
        """
        end = self.now() + seconds
        while True:
            self._listen()
            self._send()
            left = end - self.now()
            if left <= 0:
                return
            time.sleep(min(left, 0.002))

    def pose(self, robot: str) -> Pose | None:
        """Return the last reported pose."""
        poses = self._vehicles[robot].poses
        return poses[-1] if poses else None

    def health(self, robot: str) -> Health:
        """Return what a vehicle last said of itself."""
        return self._vehicles[robot].says.health(self._mission.vehicle_of(robot).endurance)

    def parameters(self, robot: str) -> Mapping[str, float]:
        """Return the parameters that were read back."""
        return dict(self._vehicles[robot].says.board)

    def upload(self, robot: str, number: int, path: Trajectory) -> None:
        """Keep a flight; it is streamed when it is started.

        Args:
            robot: Name.
            number: From 0.
            path: Finite, as it is flown.
        """
        self._stream.store(robot, number, path)

    def bring(self, number: int, meanwhile: Callable[[], None]) -> None:
        """Do nothing: what is stored is streamed from here."""

    def ready(self, robot: str, number: int) -> bool:
        """Have a robot on the ground in offboard flight and armed, at the set-point with which a flight begins.

        Args:
            robot: Name.
            number: Of the flight.
        """
        vehicle, now = self._vehicles[robot], self.now()
        if self._waking.get(robot, (-1, 0.0))[0] != number:
            self._waking[robot] = number, now
        if now - self._waking[robot][1] >= LEAD:
            if vehicle.says.mode != OFFBOARD:
                vehicle.ask("offboard", now, SET_MODE, CUSTOM_MODE, *OFFBOARD)
            elif not vehicle.says.armed:
                vehicle.ask("arm", now, ARM, 1.0)
        return vehicle.says.mode == OFFBOARD and vehicle.says.armed

    def start(self, number: int, at: float | None = None) -> float:
        """Start a flight of all that have it: before the first one, set-points, offboard flight and arming.

        Args:
            number: Of the flight.
            at: When it is to begin, s of the link's clock; None for now.

        Returns:
            When it began, s of the link's clock.

        Raises:
            LinkLost: A vehicle does not change to offboard flight, or does not arm.
        """
        if not self._streaming:
            self._stream.fly(number, math.inf)
            self._streaming = True
            whom = [self._vehicles[name] for name in self._stream.those_in(number)]
            self._waking = {vehicle.name: (number, self.now()) for vehicle in whom}
            self.sleep(LEAD)
            for done, otherwise in (
                (lambda vehicle: vehicle.says.mode == OFFBOARD, "did not change to offboard flight"),
                (lambda vehicle: vehicle.says.armed, "did not arm"),
            ):
                self._until(done, lambda vehicle: self.ready(vehicle.name, number), otherwise, whom=whom)
        self._waking.clear()
        self._stream.fly(number, self.now() if at is None else at)
        return self._stream.begin

    def hold(self, robot: str) -> bool:
        """Ask a robot to hold, which is to brake to a hover; return whether it does."""
        self._waking.pop(robot, None)
        return self._in_mode(robot, HOLD, "hold")

    def land(self, robot: str, height: float, seconds: float) -> bool:
        """Ask a robot to land as PX4 does, to the ground and at its own speed; return whether it does.

        Args:
            robot: Name.
            height: Not used: PX4 lands until it feels the ground.
            seconds: Not used.
        """
        del height, seconds
        vehicle = self._vehicles[robot]
        self._waking.pop(robot, None)
        return vehicle.off or self._in_mode(robot, LAND, "land")

    def stop(self, robot: str) -> bool:
        """Ask a robot to disarm, which PX4 does on the ground only, and to land until it has; return whether its motors are off."""
        vehicle = self._vehicles[robot]
        self._waking.pop(robot, None)
        self._listen()
        if not vehicle.off:
            self._in_mode(robot, LAND, "land")
            vehicle.ask("disarm", self.now(), ARM, 0.0)
        return vehicle.off

    def close(self) -> None:
        """Close all sockets."""
        with contextlib.suppress(AttributeError):  # it never began
            self._beats.ended.set()
        for vehicle in self._vehicles.values():
            with contextlib.suppress(Exception):
                vehicle.link.close()

    def _in_mode(self, robot: str, mode: tuple[int, int], what: str) -> bool:
        vehicle = self._vehicles[robot]
        self._listen()
        if vehicle.says.mode != mode:
            vehicle.ask(what, self.now(), SET_MODE, CUSTOM_MODE, *mode)
        return vehicle.says.mode == mode

    def _connect(self) -> None:
        """Wait for all to speak, and set what acts on board."""

        def often(vehicle: Vehicle) -> None:
            if vehicle.says.mode is None:  # before it was heard, a link that listens knows nobody to send to
                return
            if self.now() - vehicle.asked.get("interval", -math.inf) >= AGAIN:
                vehicle.asked["interval"] = self.now()
                vehicle.beat()
                for message, microseconds in intervals(RATE):
                    vehicle.command(SET_INTERVAL, message, microseconds)

        self._until(lambda vehicle: vehicle.speaks, often, "sends no PX4 heartbeat and position", CONNECT)
        end = self.now() + LOOK
        while self.now() < end and (
            left := [vehicle for vehicle in self._vehicles.values() if not vehicle.says.ready_to_check]
        ):
            for vehicle in left:
                often(vehicle)
            self.sleep(0.02)
        self._require_gains()
        for key, value in FAILSAFE.items():

            def set_it(vehicle: Vehicle, key: str = key, value: float = value) -> None:
                if self.now() - vehicle.asked.get(key, -math.inf) >= AGAIN:
                    vehicle.asked[key] = self.now()
                    with vehicle.turn:
                        vehicle.link.mav.param_set_send(vehicle.system, 1, key.encode(), *encoded(value))

            def has_it(vehicle: Vehicle, key: str = key, value: float = value) -> bool:
                return vehicle.says.board.get(key) == value

            self._until(has_it, set_it, f"does not take the parameter {key} = {value:g}")

    def _require_gains(self) -> None:
        """Read the gains with which vehicles are simulated, and refuse others.

        Raises:
            LinkLost: A vehicle has others, or does not say.
        """
        wanted = {name: px4_parameters(self._mission.vehicle_of(name)) for name in self._vehicles}

        def missing(vehicle: Vehicle) -> set[str]:
            return wanted[vehicle.name].keys() - vehicle.says.board.keys()

        end = self.now() + ANSWER
        while self.now() < end and any(missing(vehicle) for vehicle in self._vehicles.values()):
            for vehicle in self._vehicles.values():
                if self.now() - vehicle.asked.get("gains", -math.inf) >= AGAIN:
                    vehicle.asked["gains"] = self.now()
                    for key in missing(vehicle):
                        with vehicle.turn:
                            vehicle.link.mav.param_request_read_send(vehicle.system, 1, key.encode(), -1)
            self.sleep(0.02)
        for name, vehicle in self._vehicles.items():
            if others := differing(vehicle.says.board, wanted[name]):
                raise LinkLost(
                    f"{name}: gains on board are not those that its profile has simulated: {', '.join(others)}. Put yours into its `autopilot`, and run again; "
                    "what an `autopilot` has no key for has to stand on board as it is said here."
                )

    def _until(
        self,
        done: Callable[[Vehicle], bool],
        ask: Callable[[Vehicle], object],
        otherwise: str,
        patience: float = ANSWER,
        whom: Collection[Vehicle] | None = None,
    ) -> None:
        """Ask vehicles, all where nobody is named, for something until each has confirmed it.

        Raises:
            LinkLost: One has not.
        """
        end = self.now() + patience
        while True:
            left = [vehicle for vehicle in (self._vehicles.values() if whom is None else whom) if not done(vehicle)]
            if not left:
                return
            if self.now() >= end:
                raise LinkLost(f"{said_of([vehicle.name for vehicle in left], otherwise)} within {patience:g} s.")
            for vehicle in left:
                ask(vehicle)
            self.sleep(0.02)

    def _listen(self) -> None:
        """Take in what has arrived."""
        for vehicle in self._vehicles.values():
            while (message := vehicle.link.recv_msg()) is not None:
                if message.get_srcSystem() == vehicle.system:
                    self._hear(vehicle, message)

    def _hear(self, vehicle: Vehicle, message: Any) -> None:  # pymavlink's messages have no types
        now = self.now()
        vehicle.says.take(message, now)
        if message.get_type() == "LOCAL_POSITION_NED":
            x, y, z = (self._origin + np.array([message.y, message.x, -message.z])).tolist()
            vehicle.poses.append(Pose(now, (x, y, z), vehicle.says.heading, dict(vehicle.says.unrest)))

    def _send(self) -> None:
        """Send each robot in offboard flight, or on its way there, the set-point of this instant."""
        now = self.now()
        if not self._streaming or not self._stream.due(now):
            return
        for name, vehicle in self._vehicles.items():
            if name in self._waking:  # whatever its mode is on the ground
                asked = self._stream.first(name, self._waking[name][0], 3)
            else:
                asked = None if vehicle.says.mode in (HOLD, LAND) else self._stream.of(name, now, 3)
            if asked is None:
                continue
            position, velocity, acceleration, heading, rate = to_ned(asked.flat[:, None], self._origin)
            with vehicle.turn:
                vehicle.link.mav.set_position_target_local_ned_send(
                    round(1000 * asked.time),
                    vehicle.system,
                    1,
                    _LOCAL_NED,
                    0,
                    *position[0],
                    *velocity[0],
                    *acceleration[0],
                    heading[0],
                    rate[0],
                )
        self._stream.require_in_time()
