"""A live flight: checks, one certified stage after another under watch, and a safe end on every way out."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from flight.link.checks import FRESH, Check, at_start, before_take_off
from flight.link.link import Link, LinkLost, Pose
from flight.link.reaction import PATIENCE, end_safely, told
from flight.link.record import Record
from flight.link.stages import Stage
from flight.logs.log import Event
from flight.monitoring.monitor import Monitor
from flight.monitoring.reaction import LANDING_HEIGHT
from verify.data import BadInput

STEP = 0.02
"""s between two looks at all robots."""
SETTLE = 1.0
"""s that robots hover between two stages."""
_EMPTY = 15.0
"""s of battery that a landing needs."""


@dataclass(frozen=True, slots=True)
class Look:
    """What a person is shown of a flight as it is flown.

    Attributes:
        stage: Its name.
        time: s into it.
        duration: s.
        errors: Distance of each robot from its plan, m; NaN where it is not seen.
        margin: m.
        events: New ones.
    """

    stage: str
    time: float
    duration: float
    errors: Mapping[str, float]
    margin: float
    events: tuple[Event, ...]


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


class _Alarm(Exception):
    """The flight does not go on; the message says why."""


def fly_live(
    link: Link,
    stages: Sequence[Stage],
    *,
    grounds: Mapping[str, float],
    parameters: Mapping[str, Mapping[str, float]] | None = None,
    show: Callable[[Look], None] | None = None,
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

    Returns:
        How it ended.

    Raises:
        BadInput: There is nothing to fly, or stages are of different robots or do not join.
    """
    _require_joined(stages, grounds)
    record = Record()
    record.parameters.update({robot: link.parameters(robot) for robot in link.robots})
    checks = before_take_off(link, stages, parameters)
    for check in checks:
        record.note(link.now(), check.sentence, check.robot, "check")
    if failed := [check.sentence for check in checks if not check.passed]:
        return LiveFlight(False, "; ".join(failed), checks, record, ())
    robots, flying, reason = tuple(stages[0].paths), False, ""
    try:
        for number, stage in enumerate(stages):
            for robot, path in stage.paths.items():
                link.upload(robot, number, path)
        for number, stage in enumerate(stages):
            if number:
                _require(at_start(link, stage))
            flying = True
            _fly(link, number, stage, record, show)
            link.sleep(SETTLE)
    except (_Alarm, LinkLost) as alarm:
        reason = str(alarm)
    except KeyboardInterrupt:
        reason = "interrupted"
    except BaseException as error:  # whatever it was: robots are in the air
        reason = f"{type(error).__name__}: {error}"
    if reason:
        record.note(link.now(), reason, kind="alarm")
        unsafe = end_safely(link, robots if flying else (), dict(grounds), record)
    else:
        unsafe = _motors_off(link, robots, grounds, record)
    return LiveFlight(not reason and not unsafe, reason, checks, record, tuple(unsafe))


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
        raise _Alarm("; ".join(failed))


def _fly(link: Link, number: int, stage: Stage, record: Record, show: Callable[[Look], None] | None) -> None:
    """Fly one stage to its end.

    Raises:
        _Alarm: It does not go on.
    """
    monitor, robots = stage.monitor(link.accuracy), tuple(stage.paths)
    worst = record.worst[stage.name] = dict.fromkeys(robots, 0.0)
    before = [link.pose(robot) for robot in robots]
    begin = record.starts[stage.name] = link.start(number)
    hovering = [
        pose if (pose := link.pose(robot)) and pose.time <= begin else old for robot, old in zip(robots, before, strict=True)
    ]
    watch = _Watch(link, stage, monitor, begin, record, worst)
    watch.see_hovering(hovering)
    while link.now() - begin < stage.duration:
        link.sleep(STEP)
        look = watch.look()
        if show is not None:
            show(look)
        if reason := watch.alarm():
            raise _Alarm(reason)
    record.ends[stage.name] = link.now()
    monitor.finish(stage.duration)
    record.events += [Event(begin + event.time, event.robot, event.kind, event.sentence) for event in watch.unsaid()]


class _Watch:
    """Looks at all robots, and says when a stage must not go on."""

    def __init__(
        self, link: Link, stage: Stage, monitor: Monitor, begin: float, record: Record, worst: dict[str, float]
    ) -> None:
        self._link, self._stage, self._monitor, self._begin = link, stage, monitor, begin
        self._record, self._worst, self._said = record, worst, 0
        self._last = dict.fromkeys(stage.paths, begin)
        self._outside = ""

    def see_hovering(self, poses: Sequence[Pose | None]) -> None:
        """Show the monitor where robots hovered last before they set off, that the time up to the first look is not left open.

        Args:
            poses: One a robot; nothing is shown where one is missing, stale, or of the stage itself.
        """
        kept = [pose for pose in poses if pose is not None and self._begin - FRESH <= pose.time <= self._begin]
        if len(kept) < len(poses):
            return
        measured = np.array([pose.position for pose in kept]).T
        planned = np.stack([path.evaluate(0.0)[:3] for path in self._stage.paths.values()], axis=1)
        self._monitor.see(min(pose.time for pose in kept) - self._begin, measured, planned)

    def look(self) -> Look:
        """Take in what was measured since."""
        now = self._link.now()
        measured, errors = np.full((3, len(self._last)), np.nan), np.full(len(self._last), np.nan)
        for index, (robot, path) in enumerate(self._stage.paths.items()):
            pose = self._link.pose(robot)
            if pose is None or pose.time <= self._last[robot]:
                continue
            self._last[robot] = pose.time
            wanted = path.evaluate(min(pose.time - self._begin, path.duration))[:3]
            measured[:, index] = pose.position
            errors[index] = np.linalg.norm(measured[:, index] - wanted)
            self._worst[robot] = max(self._worst[robot], float(errors[index]))
            if not errors[index] + self._link.accuracy < self._stage.margin:
                self._outside = (
                    f"{robot} is {errors[index]:.3f} m from its plan; the margin is {self._stage.margin:g} m, "
                    f"and its measurement may be off by {self._link.accuracy:.3g} m."
                )
            self._record.poses.append((pose.time, robot, *pose.position))
            x, y, z = wanted.tolist()
            self._record.setpoints.append((pose.time, robot, x, y, z))
        self._monitor.see_errors(now - self._begin, measured, errors)
        new = [Event(self._begin + event.time, event.robot, event.kind, event.sentence) for event in self.unsaid()]
        self._record.events += new
        return Look(
            self._stage.name, now - self._begin, self._stage.duration, dict(zip(self._last, errors.tolist(), strict=True)),
            self._stage.margin, tuple(new),
        )  # fmt: skip

    def unsaid(self) -> list[Event]:
        """Return the monitor's events since the last time."""
        new = self._monitor.events[self._said :]
        self._said = len(self._monitor.events)
        asks = self._stage.plan.mission.spec.formula != "true"
        return [event for event in new if asks or event.kind != "formula"]

    def alarm(self) -> str:
        """Return why the stage must not go on; empty where it may."""
        now = self._link.now()
        for robot, time in self._last.items():
            if now - time > FRESH:
                return f"{robot} was not seen for {FRESH:g} s at {now - self._begin:.2f} s of the {self._stage.name}."
            endurance = self._link.health(robot).endurance
            if endurance is not None and endurance < _EMPTY:
                return f"{robot}'s battery lasts {max(endurance, 0.0):.0f} s more at {now - self._begin:.2f} s of the {self._stage.name}."
        if self._outside:
            return self._outside
        if self._monitor.too_close or self._monitor.formula == "violated":
            kind = "separation" if self._monitor.too_close else "formula"
            return [event.sentence for event in self._monitor.events if event.kind == kind][-1]
        return ""
