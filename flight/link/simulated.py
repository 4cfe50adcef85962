"""A link to our own simulation: the same interface as to vehicles, in real time or as fast as it computes."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from flight.closed_loop import steps
from flight.conditions import CALM, Conditions
from flight.link.link import Health, LinkLost, Pose
from flight.link.simulated_commander import Commander, Fleet
from flight.model.airframe import airframes_of
from flight.model.attitude import euler
from flight.model.timing import CONTROL_STEP, FRAME_STEPS, STEP
from flight.monitoring.alarm_response import LANDING_HEIGHT, LANDING_SPEED, braking_length
from flight.simulation_setup import Setup, Snapshot
from verify.data import BadInput, Mission, Trajectory

_FRAME = FRAME_STEPS * STEP
"""s between two entries of the simulation."""
_ALONE = 0.5
"""s without a sign of life from the link after which a vehicle acts on its own."""
_HOVER = 1.0
"""s that it hovers then before it lands."""
_AT_ONCE = 0.1
"""s that are simulated at once, where a second need not take a second."""
_HOVERS = 360.0
"""s that a full battery lasts in hover, where the vehicle has no endurance of its own."""


@contextmanager
def _heard_later() -> Generator[None]:
    """Hold Ctrl-C and SIGTERM back for a step of the simulation: an exception inside of it would end it, and nobody could land.

    Their handlers are set aside: other threads may take a signal that this one has blocked, and handlers run in this one all the same.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    heard: list[int] = []
    interrupt, terminate = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    try:
        signal.signal(signal.SIGINT, lambda number, _: heard.append(number))
        signal.signal(signal.SIGTERM, lambda number, _: heard.append(number))
        yield
    finally:
        try:
            signal.signal(signal.SIGTERM, terminate)
        finally:
            signal.signal(signal.SIGINT, interrupt)
    for number in heard:
        signal.raise_signal(number)


@dataclass(slots=True)
class Faults:
    """Faults of a simulated flight; none by default. Times are of the link's clock, in s.

    Attributes:
        unseen: Robot to when motion capture loses it, for good.
        pushed: Robot to when, and by how many metres along x, its measured place is off from then on.
        deaf: Robot to from when on it takes no command.
        flat: Robot to when its battery is empty.
        lost: When the link to all of them is gone; None for never.
    """

    unseen: dict[str, float] = field(default_factory=dict[str, float])
    pushed: dict[str, tuple[float, float]] = field(default_factory=dict[str, tuple[float, float]])
    deaf: dict[str, float] = field(default_factory=dict[str, float])
    flat: dict[str, float] = field(default_factory=dict[str, float])
    lost: float | None = None


class SimulatedLink:
    """Vehicles that exist in simulation only.

    Attributes:
        faults: What goes wrong; may be changed while it flies.
    """

    def __init__(
        self,
        mission: Mission,
        places: Mapping[str, tuple[float, float, float]],
        *,
        conditions: Conditions = CALM,
        seed: int = 0,
        real_time: bool = False,
        faults: Faults | None = None,
    ) -> None:
        """Put the robots where they stand.

        Args:
            mission: Who flies, on what.
            places: Where each robot stands, m.
            conditions: Wind, sensors, dynamics and controller.
            seed: Of every random number.
            real_time: Whether a second takes a second.
            faults: What goes wrong.

        Raises:
            BadInput: A robot of the mission stands nowhere.
        """
        missing = [name for name in mission.agents if name not in places]
        if missing:
            raise BadInput(f"where does {missing[0]} stand? Places are of {', '.join(places) or 'nobody'}.")
        brakes = braking_length(mission)
        commanders = {name: Commander(np.array([*places[name], agent.yaw]), brakes) for name, agent in mission.agents.items()}
        self._mission, self._fleet = mission, Fleet(commanders, CONTROL_STEP)
        airframes = (conditions.airframe,) if conditions.airframe else airframes_of(mission, mission.agents)
        self._noise = conditions.noise
        self._entries = steps(Setup(airframes, self._fleet, conditions), [seed])
        self._poses: dict[str, Pose] = {}
        self._time, self._real_time, self._began = 0.0, real_time, time.monotonic()
        self._frames = 0
        self._grounds = {name: place[2] for name, place in places.items()}
        self._heard = dict.fromkeys(commanders, 0.0)
        self._landing: dict[str, float] = {}
        self.faults = faults or Faults()
        self._take(next(self._entries))

    @property
    def robots(self) -> tuple[str, ...]:
        """Names."""
        return self._fleet.robots

    @property
    def failsafe(self) -> str:
        """Reaction on board when the link is gone."""
        return f"{_ALONE:g} s without a command or a sign of life a simulated vehicle brakes, and lands where it is {_HOVER:g} s later"

    @property
    def accuracy(self) -> float:
        """Bound on the error of a measured position, m."""
        return 0.0 if self._noise is None else self._noise.bound

    @property
    def streams(self) -> bool:
        """True: a trajectory that is stored anew while it is flown goes on changed."""
        return True

    @property
    def spinning(self) -> tuple[str, ...]:
        """Robots whose motors turn: what a test asks in the end."""
        return tuple(name for name, commander in self._fleet.commanders.items() if commander.spinning)

    def now(self) -> float:
        """Return the simulation's time, s."""
        return self._time

    def sleep(self, seconds: float) -> None:
        """Fly on for so long."""
        end = self._time + seconds
        while self._time < end - 1e-9:
            ahead = (self._frames + 1) * _FRAME - (time.monotonic() - self._began)
            if self._real_time and ahead > 0:
                time.sleep(ahead)
            until = min(end, self._time + (0.0 if self._real_time else _AT_ONCE))
            with _heard_later():
                self._frames += 1
                self._take(next(self._entries))
                while self._time < until - 1e-9:
                    self._frames += 1
                    self._take(next(self._entries))

    def pose(self, robot: str) -> Pose | None:
        """Return the last pose that arrived."""
        return self._poses.get(robot)

    def health(self, robot: str) -> Health:
        """Return what a vehicle says of itself."""
        endurance = self._mission.vehicle_of(robot).endurance or _HOVERS
        empty = self._time >= self.faults.flat.get(robot, np.inf)
        return Health(True, robot in self._poses, 0.0 if empty else endurance - self._time)

    def parameters(self, robot: str) -> Mapping[str, float]:
        """Return what matters on board: the simulated controller knows its vehicle."""
        return {"mass": self._mission.vehicle_of(robot).mass}

    def upload(self, robot: str, number: int, path: Trajectory) -> None:
        """Store a flight.

        Args:
            robot: Name.
            number: From 0.
            path: Finite, as it is flown.

        Raises:
            LinkLost: Nobody can be told anything.
        """
        if not self._reaches(robot):
            raise LinkLost(f"{robot} does not take flight {number}: the link to it is gone; {self.failsafe}.")
        self._fleet.commanders[robot].store(number, path)

    def bring(self, number: int, meanwhile: Callable[[], None]) -> None:
        """Do nothing: what is stored lies on board."""

    def ready(self, robot: str, number: int) -> bool:
        """Return whether a robot can be told anything: it needs nothing before it flies."""
        del number
        return self._reaches(robot)

    def start(self, number: int, at: float | None = None) -> float:
        """Start a stored flight of all that have it, and return when."""
        begin = self._time if at is None else at
        for name, commander in self._fleet.commanders.items():
            if self._reaches(name):
                commander.start(number, begin)
        return begin

    def hold(self, robot: str) -> bool:
        """Tell a robot to brake to a hover."""
        if reached := self._reaches(robot):
            self._fleet.commanders[robot].hold(self._time)
        return reached

    def land(self, robot: str, height: float, seconds: float) -> bool:
        """Tell a robot to sink.

        Args:
            robot: Name.
            height: z in m where the landing ends.
            seconds: How long it takes.
        """
        if reached := self._reaches(robot):
            self._fleet.commanders[robot].land(height, seconds, self._time)
        return reached

    def stop(self, robot: str) -> bool:
        """Tell a robot to stop its motors."""
        if reached := self._reaches(robot):
            self._fleet.commanders[robot].stop(self._time)
        return reached

    def close(self) -> None:
        """Do nothing: a simulation holds nothing that is to be let go of."""

    def _reaches(self, robot: str) -> bool:
        gone = self.faults.lost is not None and self._time >= self.faults.lost
        return not gone and self._time < self.faults.deaf.get(robot, np.inf)

    def _take(self, entry: Snapshot) -> None:
        """Take an entry of the simulation for a frame of motion capture."""
        self._time = entry.step * STEP
        for name, commander in self._fleet.commanders.items():
            self._act_alone(name, commander)
        if self.faults.lost is not None and self._time >= self.faults.lost:
            return
        seen = entry.position if entry.measured is None else entry.measured
        roll, pitch, heading = euler(entry.attitude)
        tilt = np.arccos(np.clip(np.cos(roll) * np.cos(pitch), -1.0, 1.0))
        unrest = {"speed": np.linalg.norm(entry.velocity, axis=0), "tilt": tilt, "turn": np.linalg.norm(entry.rates, axis=0)}
        for index, name in enumerate(self.robots):
            x, y, z = seen[:, index].tolist()
            when, off = self.faults.pushed.get(name, (np.inf, 0.0))
            if x == x and self._time < self.faults.unseen.get(name, np.inf):  # NaN where it was not seen
                place = (x + (off if self._time >= when else 0.0), y, z)
                still = {what: float(values[index]) for what, values in unrest.items()}
                self._poses[name] = Pose(self._time, place, float(heading[index]), still)

    def _act_alone(self, name: str, commander: Commander) -> None:
        """Do what is done on board where the link is silent: brake, hover, land, stop."""
        if self._reaches(name):
            self._heard[name] = self._time
            self._landing.pop(name, None)
            return
        silent = self._time - self._heard[name]
        if name in self._landing:
            if self._time >= self._landing[name]:
                commander.stop(self._time)
        elif silent >= _ALONE + _HOVER:
            target = self._grounds[name] + LANDING_HEIGHT
            seconds = max(1.0, (float(commander.wanted(self._time)[0, 2]) - target) / LANDING_SPEED)
            commander.land(target, seconds, self._time)
            self._landing[name] = self._time + seconds
        elif silent >= _ALONE:
            commander.hold(self._time)
