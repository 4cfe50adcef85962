"""The end of a flight, for live links and exported scripts: a team holds, lands and stops, told until it has acknowledged that. Standard library only; copied into exports.

Where something is wrong all hold while all are seen, then land straight down. Motors stop where robots stand, where a robot is told to land and does not
answer, or on a second explicit command. A robot that is neither heard nor answers is told to land once more, and never to stop: that would reach it in the air,
where it is heard again. What nobody answers to is said, with what acts on board then.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from .checks import Health, Pose
from .standing import Standing

AGAIN = 0.1  # s after which a command that was not acknowledged is sent again
STEP = 0.02  # s between two looks at robots that land
SINK = 0.05  # m by which a robot that lands has sunk at half of its time
UNSEEN = 2.0  # m that a robot which is not seen is taken to be up
TRIES = 10  # how often a flight's end may be interrupted before it is given up, and all robots are named
STOPPING = 3.0  # how much longer robots have to acknowledge that motors stop than anything else: some do on the ground only


class Robots(Protocol):
    """Robots as their flight is ended; commands tell whether they are acknowledged, and are repeated until they are."""

    @property
    def failsafe(self) -> str:
        """Failsafe that acts on board once no message arrives any more, as it was set and read back; a sentence."""
        ...

    def now(self) -> float:
        """Return the robots' clock, s; it never goes back."""
        ...

    def sleep(self, seconds: float) -> None:
        """Let time go on, and take in what arrives."""
        ...

    def pose(self, robot: str) -> Pose | None:
        """Return the last pose that arrived; None before any did."""
        ...

    def health(self, robot: str) -> Health:
        """Return what a vehicle last said of itself."""
        ...

    def hold(self, robot: str) -> bool:
        """Tell a robot to brake to a hover; return whether it has acknowledged that."""
        ...

    def land(self, robot: str, height: float, seconds: float) -> bool:
        """Tell a robot to sink to a height in m, in so many seconds; return whether it has acknowledged that.

        Args:
            robot: Name.
            height: z in m where the landing ends.
            seconds: How long it takes.
        """
        ...

    def stop(self, robot: str) -> bool:
        """Tell a robot to stop its motors; return whether it has acknowledged that."""
        ...


Note = Callable[[float, str, "str | None", str], object]
"""Adds what happened: s of the robots' clock, a sentence, whom it concerns, and `note` or `reaction`."""


class Ending:
    """Ends one flight.

    Attributes:
        standing: Looks at robots that land; None before they do.
        held: When all held already, s of the robots' clock; infinite where they do not.
    """

    def __init__(
        self,
        link: Robots,
        note: Note,
        see: Callable[[Sequence[str]], object],
        ground: Callable[[str], float],
        limits: Mapping[str, float],
    ) -> None:
        """Take a flight.

        Args:
            link: To the robots.
            note: Keeps what is done.
            see: Keeps where robots are.
            ground: Returns z in m of the ground below a robot.
            limits: The numbers.
        """
        self._link, self._note, self._see, self._ground, self._limits = link, note, see, ground, limits
        self._targets: dict[str, float] = {}
        self.standing: Standing | None = None
        self.held = math.inf

    def end_safely(self, robots: Sequence[str], grounded: Sequence[str] = ()) -> list[str]:
        """Bring robots that fly to the ground; return those that are not known to be there with their motors off.

        Args:
            robots: Whose motors were started.
            grounded: Robots that stand on the ground with motors that may turn.
        """
        if not robots:
            return []
        try:
            left = self._down(robots) + self._stopped(grounded)
        except BaseException as error:  # a second Ctrl-C
            self._say(f"interrupted again ({type(error).__name__}).")
            return self.stop_motors(robots, grounded)
        return self._named(left)

    def stop_motors(self, robots: Sequence[str], grounded: Sequence[str] = ()) -> list[str]:
        """Stop all motors at once, wherever robots are; return those that have not acknowledged it.

        Args:
            robots: Whose motors were started.
            grounded: Robots that stand on the ground with motors that may turn.
        """
        self._say("all motors are stopped.")
        return self._named(insisted(lambda: self._stopped((*robots, *grounded)), (*robots, *grounded)))

    def set_down(self, robots: Sequence[str], grounded: Sequence[str] = ()) -> list[str]:
        """Land robots after the last stage, and stop motors; return those that have not acknowledged it.

        Args:
            robots: Whom.
            grounded: Robots that stand on the ground with motors that may turn.
        """
        return self._named(self._land(robots, grounded))

    def _hold(self, robots: Sequence[str]) -> None:
        """Have all brake to a hover, while all are seen; robots that land already go on landing."""
        link = self._link
        if self.standing is not None or not all(self._fresh(robot) for robot in robots):
            return
        if math.isinf(self.held):
            self._say("all robots hold where they can stop.")
        end = math.inf if self._told(robots, link.hold) else min(self.held, link.now()) + self._limits["holding"]
        while link.now() < end < math.inf:
            link.sleep(AGAIN)
            self._see(robots)

    def _land(self, robots: Sequence[str], grounded: Sequence[str] = ()) -> list[str]:
        """Land robots straight down and stop their motors; return those that have not acknowledged it."""
        link = self._link
        if self.standing is None:
            self._targets = {robot: self._ground(robot) + self._limits["landing_height"] for robot in robots}
            self.standing = Standing(self._targets, self._limits)
        up, seconds = self.standing.flying(list(robots)), time_to_land(link, self._targets, self._limits)

        def landing(robot: str) -> bool:
            return link.land(robot, self._targets[robot], seconds)

        self.standing.land(link.now() + seconds)
        silent = self._told(up, landing)  # a robot that stands is told nothing more: it would rise
        self._wait([robot for robot in up if robot not in silent], seconds, landing)
        lost = [robot for robot in silent if not self._fresh(robot)]
        left = self._stopped([*(robot for robot in robots if robot not in lost), *grounded])
        silent = self._told(lost, landing)  # not to stop: that would drop them where they are heard again
        back = [robot for robot in lost if robot not in silent]
        self._wait(back, seconds, landing)
        return [*left, *silent, *self._stopped(back)]

    def _down(self, robots: Sequence[str]) -> list[str]:
        """Hold and land, and land once more where that fails; only an interruption ends it."""
        for what, step in (("", self._hold), ("all robots land.", self._land), ("all robots land.", self._land)):
            try:
                if what:
                    self._say(what)
                if (left := step(robots)) is not None:
                    return left
            except Exception as error:  # whatever it was: robots are in the air
                self._say(f"{type(error).__name__}: {error}")
        return self._stopped(robots)

    def _told(self, robots: Sequence[str], command: Callable[[str], bool], patience: float = 1.0) -> list[str]:
        """Repeat a command until each robot has acknowledged it, so many times as long as robots have for that; return those that have not."""
        end, left = self._link.now() + patience * self._limits["patience"], list(robots)
        while True:
            left = [robot for robot in left if not command(robot)]
            self._see(robots)
            if not left or self._link.now() >= end:
                return left
            self._link.sleep(AGAIN)

    def _wait(self, robots: Sequence[str], seconds: float, landing: Callable[[str], bool]) -> None:
        """Wait until robots that land stand, for `landed` s behind their landing's end at most; one that does not sink is told once more."""
        assert self.standing is not None, "they land"
        link, told, marks = self._link, self._link.now(), {robot: self._height(robot) for robot in robots}
        end = told + seconds + self._limits["landed"]
        while link.now() < end:
            if not (up := [robot for robot in robots if not see_down(link, self.standing, robot)]):
                return
            if link.now() - told > max(1.0, seconds / 2):  # at half time it has sunk half of its way
                for robot in up:
                    height = self._height(robot)
                    if not (height <= self._targets[robot] + self._limits["near"] or height < marks[robot] - SINK):
                        landing(robot)
                told, marks = link.now(), {robot: self._height(robot) for robot in robots}
            link.sleep(STEP)
            self._see(robots)
        if up := self.standing.flying(list(robots)):
            self._say(f"{', '.join(up)} is not known to stand: watch it.")

    def _stopped(self, robots: Sequence[str]) -> list[str]:
        left = self._told(robots, self._link.stop, STOPPING)
        if stopped := [robot for robot in robots if robot not in left]:
            self._say(f"the motors of {', '.join(stopped)} are stopped.")
        return left

    def _named(self, left: list[str]) -> list[str]:
        """Say what acts on board of robots that have not acknowledged; return them."""
        for robot in left:
            self._note(self._link.now(), f"{robot} has not acknowledged: {self._link.failsafe}.", robot, "reaction")
        return left

    def _fresh(self, robot: str) -> bool:
        pose = self._link.pose(robot)
        return pose is not None and self._link.now() - pose.time <= self._limits["fresh"]

    def _height(self, robot: str) -> float:
        """Return how high a robot was measured last, m; infinite where it never was."""
        pose = self._link.pose(robot)
        return math.inf if pose is None else pose.position[2]

    def _say(self, sentence: str) -> None:
        self._note(self._link.now(), sentence, None, "reaction")


def insisted(end: Callable[[], list[str]], robots: Sequence[str]) -> list[str]:
    """Do what ends a flight, again where something comes between; return the robots that are not known to be on the ground.

    Args:
        end: Does it, and returns such robots.
        robots: All of them.
    """
    for _ in range(TRIES):
        with contextlib.suppress(BaseException):  # one more Ctrl-C, or the link itself
            return end()
    return list(robots)


def see_down(link: Robots, standing: Standing, robot: str) -> bool:
    """Look at a robot that lands; return whether it stands.

    Args:
        link: To it.
        standing: Knows what was seen before.
        robot: Its name.
    """
    pose = link.pose(robot)
    if pose is not None:
        standing.see(robot, pose.time, pose.position[2], link.health(robot).flying)
    return standing.stands(robot)


def time_to_land(link: Robots, targets: Mapping[str, float], limits: Mapping[str, float]) -> float:
    """Return how long robots take that sink together, s.

    Args:
        link: To them.
        targets: z in m where each one's landing ends.
        limits: The numbers.
    """
    poses = {robot: link.pose(robot) for robot in targets}
    drops = (UNSEEN if (pose := poses[robot]) is None else pose.position[2] - target for robot, target in targets.items())
    return max(1.0, max(drops, default=0.0) / limits["landing_speed"])
