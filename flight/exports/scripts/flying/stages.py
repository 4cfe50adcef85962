"""Phases flown one after another with crazyswarm2, under watch: climb, way to the starts, the flight part by part."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path
from typing import Any

from flying.checks import Pose
from flying.crazyswarm import Swarm
from flying.ending import Ending, see_down
from flying.paths import PiecewisePath, Row
from flying.record import FLIGHT, Record
from flying.simulator import trimmed
from flying.watch import Refused, Team, Watch

STEP = 0.02  # s between two looks in flight
AGE = 0.05  # s that a position and a start may have been on their way: it is held against the plan of that time
WAY = 2.0  # s that the last centimetres to a start take
TIMES = 3  # how often a command is sent that nobody acknowledges
HIGH = 0.3  # m above the ground, from which on motors are stopped by an emergency stop
PLATFORM = 0.1  # m above the floor, from which on a robot stood on something


class Flight:
    """One flight.

    Attributes:
        team: Who flies.
        swarm: The robots.
        record: Takes in what happens.
        starts: x, y, z in m and heading in rad of each robot where the flight begins.
        ends: And where it ends.
        grounds: z in m of the ground below each robot.
        flying: Whether motors may turn.
        up: Whether robots may be in the air.
        stage: What is flown.
        hovers: Where robots hover, or are to.
        ending: Brings all to the ground.
    """

    def __init__(self, team: Team, swarm: Swarm, record: Record) -> None:
        """Take what flies."""
        self.team, self.swarm, self.record = team, swarm, record
        self.starts: dict[str, Row] = {name: tuple(row["start"]) for name, row in team.data["robots"].items()}
        self.ends: dict[str, Row] = {name: tuple(row["end"]) for name, row in team.data["robots"].items()}
        self.grounds = dict.fromkeys(team.names, 0.0)
        self.flying, self.up, self.stage = False, False, ""
        self.ending = Unconfirmed(self).ending
        self._paths: dict[str, PiecewisePath] = {}
        self._begin: float | None = None  # of what is flown from the vehicles' memory
        self.hovers: dict[str, Row] = dict(self.starts)
        self._seen: dict[str, float] = {}

    def enter(self, stage: str) -> None:
        """Begin with a stage."""
        self.stage = stage
        self.record.began(stage, self.swarm.now())

    def climb(self) -> None:
        """Climb straight up to the height of the starts.

        Raises:
            Refused: It does not go on.
        """
        self.flying = True
        self.enter("climb")
        self.swarm.arm()
        most = max(start[2] - self.grounds[name] for name, start in self.starts.items())
        seconds = max(2.0, self.team.limits["climb"] * most)
        self.up = True
        for name, start in self.starts.items():
            self.swarm.robots[name].takeoff(targetHeight=start[2], duration=seconds)
        watch = Watch(self.team, self.swarm.now())
        self._go_on(seconds + 0.5, watch)
        if self.swarm.seen_by_tf:
            self._trim(watch)
        self.record.ended("climb", self.swarm.now())

    def go_to_starts(self) -> None:
        """Go to the starts, and hover there.

        Raises:
            Refused: It does not go on.
        """
        self.flying = self.up = True
        self.enter("way")
        for name, start in self.starts.items():
            self.swarm.go_to(name, start, WAY)
        self._go_on(WAY + 1.0, Watch(self.team, self.swarm.now()))
        self.record.ended("way", self.swarm.now())

    def fly(self, folder: Path) -> None:
        """Fly part by part; all are at the start, and have the first part.

        Args:
            folder: Where the files lie.

        Raises:
            Refused: It does not go on.
        """
        swarm, data, pauses = self.swarm, self.team.data, list[float]()
        order: list[int] = data["order"]
        loaded, ended, watch = order[0], 0.0, Watch(self.team, swarm.now())
        for number, index in enumerate(order):
            part, since = data["parts"][index], swarm.now()
            if number:
                self._hold_at(part["starts"], watch)
                if index != loaded:
                    self.load(folder, index)
                    loaded = index
                    watch.begin(swarm.now())  # nobody was listened to meanwhile
                self._go_on(0.5, watch)
            self._come_to_rest(part["starts"], watch)
            if number and swarm.now() - since > data["pause"]:
                raise Refused(f"the pause before part {number + 1} of {len(order)} lasted more than {data['pause']:g} s")
            self._begin = swarm.now()
            swarm.start()
            if not number:
                self.enter(FLIGHT)
                self.record.said["starts"][FLIGHT] = self._begin
            else:
                pauses.append(self._begin - ended)
            ended = self._begin + part["duration"]
            self.record.part(self._begin, ended)
            self._go_on(ended - swarm.now(), watch)
        self.record.ended(FLIGHT, ended)
        self._hold_at(self.ends, watch)
        if pauses:
            said = ",".join(f"{pause:.3f}" for pause in pauses)
            self.record.event(swarm.now(), f"pauses between parts, in s: {said}")

    def load(self, folder: Path, index: int) -> None:
        """Upload a part of the flight.

        Args:
            folder: Where the files lie.
            index: Which of `flight.json`.
        """
        ending = self.team.data["parts"][index]["ending"]
        self.swarm.upload(folder, ending)
        self._paths = {name: PiecewisePath(folder / f"{name}{ending}.csv") for name in self.team.names}

    def look(self, watch: Watch | None) -> None:
        """Take in new poses.

        Args:
            watch: Raises where the flight must not go on; None once it has ended.

        Raises:
            Refused: It must not go on.
        """
        swarm = self.swarm
        for name in self.team.names:
            pose = swarm.pose(name)
            if pose is not None and pose.time > self._seen.get(name, -math.inf):
                self._seen[name] = pose.time
                off, wanted = self._off(name, pose)
                self.record.pose(self.stage, pose.time, name, pose.position, wanted, off)
                if watch is not None:
                    watch.see(name, pose, off, low=self.stage in ("way", FLIGHT))
        if watch is not None:
            watch.require(swarm.now(), swarm.health)

    def brake(self) -> None:
        """Choose where all come to rest; they are measured."""
        for name in self.team.names:
            pose = self.swarm.pose(name)
            if self._begin is not None and self.stage == FLIGHT:
                at = self.swarm.now() - self._begin
                self.hovers[name] = self._paths[name].rest(at, self.team.limits["braking"], self.team.data["braking"])
            elif pose is not None:
                self.hovers[name] = (*pose.position, self.starts[name][3])
        self.enter("hold")

    def ground(self, name: str) -> float:
        """Return how high the ground is where a robot lands, m: what it stood on where it lands there, else the floor.

        Args:
            name: The robot's.
        """
        pose, start = self.swarm.pose(name), self.starts[name]
        home = pose is not None and math.dist(pose.position[:2], start[:2]) < self.team.margin
        return self.grounds[name] if home or self.grounds[name] < PLATFORM else 0.0

    def _trim(self, watch: Watch) -> None:
        """Have robots of crazyswarm2's simulator hover at their starts: its controller takes no mass, and lets them sink."""
        for trims in trimmed(self.starts, self.swarm.pose):
            self.swarm.trims = trims
            for name, start in self.starts.items():
                self.swarm.go_to(name, start, 0.5)
            self._go_on(1.0, watch)
        said = ", ".join(f"{name} {1000 * trim:.0f} mm" for name, trim in self.swarm.trims.items())
        self.record.event(self.swarm.now(), f"the simulator's controller takes no mass: heights are asked higher by {said}")

    def _go_on(self, seconds: float, watch: Watch) -> None:
        """Let what is flown go on under watch."""
        swarm, end = self.swarm, self.swarm.now() + seconds
        while (left := end - swarm.now()) > 0:
            swarm.sleep(min(STEP, left))
            self.look(watch)

    def _hold_at(self, places: dict[str, Any], watch: Watch) -> None:
        """Have robots hold by a command of its own: at a trajectory's end they still read their memory."""
        self._begin, self.hovers = None, {name: tuple(place) for name, place in places.items()}
        for _ in range(2):
            for name, place in places.items():
                self.swarm.go_to(name, tuple(place), 1.0)
            self._go_on(0.6, watch)

    def _come_to_rest(self, places: dict[str, Any], watch: Watch) -> None:
        """Hover until all are where a part begins, for as long as patience lasts.

        Raises:
            Refused: They are not.
        """
        swarm, until = self.swarm, self.swarm.now() + self.team.limits["patience"]
        while True:
            poses = {name: swarm.pose(name) for name in self.team.names}
            faults = self.team.start_faults(poses, places, "the start", swarm.now())
            if not faults:
                return
            if swarm.now() >= until:
                raise Refused("; ".join(faults))
            self._go_on(STEP, watch)

    def _off(self, name: str, pose: Pose) -> tuple[float, Row]:
        """Return how far a robot is from where it should be, m, and where that is."""
        if self.stage in ("climb", "landing"):
            top = self.starts[name] if self.stage == "climb" else self.ends[name]
            wanted: Row = (top[0], top[1], min(max(pose.position[2], 0.0), top[2]))
        elif self.stage == FLIGHT and self._begin is not None:
            at = pose.time - self._begin
            return self._paths[name].near(pose.position, at - AGE, at)
        else:
            wanted = self.hovers[name]
        return math.dist(pose.position, wanted[:3]), wanted


class Unconfirmed:
    """Robots of a client that tells of no command whether a vehicle has heard it, as `ending` brings them to the ground.

    A command counts as acknowledged once it was sent several times; that motors stop, once a robot that landed is seen to stand as well.

    Attributes:
        failsafe: What is to be done where that is not seen.
        ending: Brings them to the ground.
    """

    failsafe = "watch it, and switch it off and on"

    def __init__(self, flight: Flight) -> None:
        """Take what flies."""
        self._flight, self._sent, self._cut = flight, Counter[tuple[str, str]](), set[str]()
        self.now, self.sleep, self.pose, self.health = (
            flight.swarm.now,
            flight.swarm.sleep,
            flight.swarm.pose,
            flight.swarm.health,
        )
        limits = flight.team.limits
        numbers = {**limits, "holding": limits["holding"] + limits["braking"]}

        def note(time: float, sentence: str, _robot: str | None, kind: str) -> None:
            flight.record.event(time, sentence, kind)

        self.ending = Ending(self, note, lambda _: flight.look(None), flight.ground, numbers)

    def hold(self, robot: str) -> bool:
        """Have a robot go to where it comes to rest."""
        flight = self._flight
        if flight.stage != "hold":
            flight.brake()
        flight.swarm.go_to(robot, flight.hovers[robot], flight.team.limits["braking"])
        return self._often(robot, "hold")

    def land(self, robot: str, height: float, seconds: float) -> bool:
        """Have a robot sink.

        Args:
            robot: Its name.
            height: z in m where the landing ends.
            seconds: How long it takes.
        """
        flight = self._flight
        if flight.stage != "landing":
            flight.enter("landing")
        flight.swarm.robots[robot].land(targetHeight=height, duration=seconds)
        return self._often(robot, "land")

    def stop(self, robot: str) -> bool:
        """Disarm a robot; one that is high up, and does not do what it is told, has all get an emergency stop."""
        flight, pose, standing = self._flight, self.pose(robot), self.ending.standing
        if pose is not None and pose.position[2] <= flight.ground(robot) + HIGH:
            flight.swarm.disarm(robot)
        else:
            if not self._cut:
                said = "motors are stopped by an emergency stop: switch vehicles off and on"
                flight.record.event(self.now(), said, "reaction")
                flight.swarm.emergency()
            self._cut.add(robot)
        stands = standing is None or see_down(self, standing, robot)
        return self._often(robot, "stop") and stands and robot not in self._cut

    def _often(self, robot: str, command: str) -> bool:
        self._sent[robot, command] += 1
        return self._sent[robot, command] >= TIMES
