"""A live flight: checks, one certified stage after another under watch, and a safe end on every way out."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from flight.link.checks import Check, at_start, before_take_off
from flight.link.link import Link, LinkLost
from flight.link.reaction import PATIENCE, end_safely, told
from flight.link.record import Record
from flight.link.stages import Stage, Watched
from flight.link.watch import Look, Watch
from flight.monitoring.reaction import LANDING_HEIGHT
from verify.data import BadInput, DoesNotFit, Trajectory

STEP = 0.02
"""s between two looks at all robots."""
SETTLE = 1.0
"""s that robots hover between two stages."""


@dataclass(frozen=True, slots=True)
class LiveFlight:
    """How a live flight ended.

    Attributes:
        flown: Whether every stage was flown to its end, inside the margin.
        reason: Why not; empty where it was.
        checks: What was looked at before it.
        record: What is kept of it.
        unsafe: Robots that are not known to be on the ground with their motors stopped.
    """

    flown: bool
    reason: str
    checks: tuple[Check, ...]
    record: Record
    unsafe: tuple[str, ...]


class Alarm(Exception):
    """The flight does not go on; the message says why."""


@dataclass(slots=True)
class Flying:
    """A team in the air: what more it flies is flown by this, and where that raises anything, all are brought to the ground.

    Attributes:
        link: To the robots.
        record: What is kept.
        robots: All that took off.
        show: Told what a person is shown, at every look.
        number: Under which the next flight is stored.
    """

    link: Link
    record: Record
    robots: tuple[str, ...]
    show: Callable[[Look], None]
    number: int = 0

    def store(self, paths: Mapping[str, Trajectory]) -> int:
        """Store a flight, and return its number."""
        for robot, path in paths.items():
            self.link.upload(robot, self.number, path)
        self.number += 1
        return self.number - 1

    def fly(self, stage: Stage, number: int | None = None) -> None:
        """Fly one stage from a hover to its end, and hover there.

        Args:
            stage: It begins where the robots hover.
            number: Under which it is stored; None where it is not.

        Raises:
            Alarm: It does not go on.
        """
        number = self.store(stage.paths) if number is None else number
        if number:
            _require(at_start(self.link, stage))
        watch = self.begin(stage.watched(self.link.accuracy), number)
        while self.link.now() - self.record.starts[stage.name] < stage.duration:
            self.link.sleep(STEP)
            self.show(watch.look())
            if reason := (watch.lost() or ("", ""))[1] or watch.alarm():
                raise Alarm(reason)
        self.record.ends[stage.name] = self.link.now()
        watch.finish()
        self.link.sleep(SETTLE)

    def begin(self, watched: Watched, number: int, at: float | None = None) -> Watch:
        """Start a stored flight, and return who watches it.

        Args:
            watched: What is flown.
            number: Under which it is stored.
            at: When it is to begin, s of the link's clock; None for now.
        """
        before = [self.link.pose(robot) for robot in watched.paths]
        begin = self.link.start(number, at)
        self.record.starts.setdefault(watched.name, begin)
        hovering = [
            pose if (pose := self.link.pose(robot)) and pose.time <= begin else old
            for robot, old in zip(watched.paths, before, strict=True)
        ]
        watch = Watch(self.link, watched, begin, self.record)
        watch.see_before(hovering)
        return watch


class Onwards(Protocol):
    """What is flown after stages that are known before take-off."""

    @property
    def duration(self) -> float:
        """S that a battery must last for it."""
        ...

    def fly(self, flying: Flying) -> None:
        """Fly on, until everybody is just above the ground; raise `Alarm` where that cannot be."""
        ...


def fly_live(
    link: Link,
    stages: Sequence[Stage],
    *,
    grounds: Mapping[str, float],
    parameters: Mapping[str, Mapping[str, float]] | None = None,
    show: Callable[[Look], None] | None = None,
    onwards: Onwards | None = None,
) -> LiveFlight:
    """Fly certified stages over a link, watch them, and end safely whatever happens.

    Nothing is raised once motors turn: Ctrl-C, SIGTERM (where the caller has it raise KeyboardInterrupt), any error and a lost link end
    with the team holding, landing and stopping; what could not be told is in the answer.

    Args:
        link: To the robots.
        stages: What is flown one after another: the first begins where robots stand, each other where the one before ends.
        grounds: z in m of the ground below each robot.
        parameters: What must be on board, by robot.
        show: Told what a person is shown, at every look.
        onwards: What is flown after the stages; None where they end just above the ground.

    Returns:
        How it ended.

    Raises:
        BadInput: There is nothing to fly, or stages are of different robots or do not join.
        DoesNotFit: A vehicle's memory does not hold a stage; nothing spins.
    """
    _require_joined(stages, grounds)
    record = Record()
    record.parameters.update({robot: link.parameters(robot) for robot in link.robots})
    lasts = sum(stage.duration for stage in stages) + (0.0 if onwards is None else onwards.duration)
    checks = before_take_off(link, stages[0], lasts, parameters)
    for check in checks:
        record.note(link.now(), check.sentence, check.robot, "check")
    if failed := [check.sentence for check in checks if not check.passed]:
        return LiveFlight(False, "; ".join(failed), checks, record, ())
    robots, began, reason = tuple(stages[0].paths), False, ""
    flying = Flying(link, record, robots, show or _nobody)
    try:
        numbers = [flying.store(stage.paths) for stage in stages]
        for number, stage in zip(numbers, stages, strict=True):
            began = True
            flying.fly(stage, number)
        if onwards is not None:
            onwards.fly(flying)
    except (Alarm, LinkLost) as alarm:
        reason = str(alarm)
    except KeyboardInterrupt:
        reason = "interrupted"
    except BaseException as error:  # whatever it was: robots are in the air
        if isinstance(error, DoesNotFit) and not began:
            raise
        reason = f"{type(error).__name__}: {error}"
    if reason:
        record.note(link.now(), reason, kind="alarm")
        unsafe = end_safely(link, robots if began else (), dict(grounds), record)
    else:
        unsafe = _motors_off(link, robots, grounds, record)
    return LiveFlight(not reason and not unsafe, reason, checks, record, tuple(unsafe))


def _nobody(_look: Look) -> None:
    """Show a look to nobody."""


def _motors_off(link: Link, robots: Sequence[str], grounds: Mapping[str, float], record: Record) -> list[str]:
    """Set all down after the last stage, which ends just above the ground, and stop motors."""

    def down() -> list[str]:
        told(link, robots, lambda robot: link.land(robot, grounds[robot] + LANDING_HEIGHT, 1.0))
        return told(link, robots, link.stop, 3 * PATIENCE)

    try:
        left = down()
    except BaseException:  # once more: it is on the ground, and motors turn
        left = down()
    for robot in left:
        record.note(link.now(), f"{robot} has not acknowledged that its motors stop: {link.failsafe}.", robot, "reaction")
    return left


def _require_joined(stages: Sequence[Stage], grounds: Mapping[str, float]) -> None:
    if not stages:
        raise BadInput("there is nothing to fly.")
    for before, after in itertools.pairwise(stages):
        if set(before.paths) != set(after.paths):
            raise BadInput(f"{before.name} and {after.name} are of different robots.")
        for robot, path in before.paths.items():
            off = float(np.linalg.norm(path.evaluate(path.duration)[:3] - after.paths[robot].evaluate(0.0)[:3]))
            if off > 1e-3:
                raise BadInput(f"{robot}'s {after.name} begins {off:.3f} m from where its {before.name} ends.")
    missing = [robot for robot in stages[0].paths if robot not in grounds]
    if missing:
        raise BadInput(f"how high is the ground below {missing[0]}?")


def _require(checks: Sequence[Check]) -> None:
    failed = [check.sentence for check in checks if not check.passed]
    if failed:
        raise Alarm("; ".join(failed))
