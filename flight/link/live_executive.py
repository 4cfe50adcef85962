"""A live flight: checks, one certified stage after another under watch, and a safe end on every way out."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from flight.exports.scripts.flying.checks import Check, refusals
from flight.exports.scripts.flying.ending import Ending, insisted
from flight.link.holding import LONGEST, Hold
from flight.link.link import Link, LinkLost
from flight.link.phases import BRAKING, Part, Stage, Watched
from flight.link.preflight_checks import at_start, before_take_off, proved_starts
from flight.link.record import Record
from flight.link.stop_orders import Alarm, Level, Ordered, StopOrders
from flight.link.tracking_monitor import Look, Watch
from flight.monitoring.thresholds import limits
from verify.data import BadInput, DoesNotFit, Trajectory
from verify.data.trajectory import PAUSE

STEP = 0.02
"""s between two looks at all robots."""
SETTLE = 1.0
"""s that robots hover between two stages, and between two parts of one at the least."""
PATIENCE = 4.0
"""s beyond that which robots have to come to rest where the next stage or part begins: a brisk flight ends with a swing."""
INTERRUPTED = "interrupted"
"""Why a flight ended that Ctrl-C or SIGTERM ended."""


@dataclass(frozen=True, slots=True)
class LiveFlight:
    """Outcome of a live flight.

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


@dataclass(frozen=True, slots=True)
class Operator:
    """Operator of a flight: sees it, and may stop it.

    Attributes:
        show: Told what a person is shown, at every look.
        orders: Orders to stop, heeded where the link heeds them (`ObservedLink`).
        record: Takes in what is kept of the flight.
    """

    show: Callable[[Look], None]
    orders: StopOrders = field(default_factory=StopOrders)
    record: Record = field(default_factory=Record)


@dataclass(slots=True)
class Flying:
    """A team in the air: what more it flies is flown by this, and where that raises anything, all are brought to the ground.

    Attributes:
        link: To the robots.
        record: What is kept.
        robots: All that took off; more may join them.
        grounded: Robots on the ground whose motors may turn, as they are to join.
        show: Told what a person is shown, at every look.
        number: Under which the next flight is stored.
        looked: When all were looked at last, s of the link's clock.
        began: Whether motors may turn.
        unchecked: Checks without which the operator flies.
    """

    link: Link
    record: Record
    robots: tuple[str, ...]
    show: Callable[[Look], None]
    grounded: tuple[str, ...] = ()
    number: int = 0
    looked: float = -math.inf
    began: bool = False
    unchecked: frozenset[str] = frozenset()

    def store(self, paths: Mapping[str, Trajectory]) -> int:
        """Store a flight, and return its number."""
        for robot, path in paths.items():
            self.link.upload(robot, self.number, path)
        self.number += 1
        return self.number - 1

    def store_all(self, stage: Stage) -> tuple[int, ...]:
        """Store each part of a stage once, and return their numbers."""
        return tuple(self.store(paths) for paths in stage.stored)

    def fly(self, stage: Stage, numbers: Sequence[int] | None = None) -> None:
        """Fly one stage from a hover to its end, and hover there.

        Args:
            stage: It begins where the robots hover.
            numbers: Under which its parts are stored; None where they are not.

        Raises:
            Alarm: It does not go on.
        """
        numbers = self.store_all(stage) if numbers is None else numbers
        first, *others = stage.parts
        if numbers[first.stored]:
            self.come_to_rest(first, self.link.sleep)
        watch = self.begin(stage.watched(self.link.accuracy), numbers[first.stored])
        end = watch.begin + first.duration
        if others:
            self.record.parts[stage.name] = [(watch.begin, end)]
        for part in others:
            self._look(watch, end)
            end = self._after_a_pause(watch, stage, part, numbers[part.stored]) + part.duration
        self._look(watch, end)
        self.record.ends[stage.name] = self.link.now()
        watch.finish()
        if stage.braking:
            self._brake(stage, watch.begin)
        self.link.sleep(SETTLE)

    def _look(self, watch: Watch, until: float) -> None:
        """Look at all again and again, until a time of the link's clock, s."""
        while self.link.now() < until:
            self.link.sleep(STEP)
            self._look_once(watch)

    def _look_once(self, watch: Watch) -> None:
        self.looked = self.link.now()
        self.show(watch.look())
        if reason := (watch.lost() or ("", ""))[1] or watch.alarm():
            raise Alarm(reason)

    def _after_a_pause(self, watch: Watch, stage: Stage, part: Part, number: int) -> float:
        """Hover between two parts, watched, until the next one lies on board and everybody is where it begins; return when it began."""
        ended, longest = watch.ended, stage.plan.mission.longest_flight

        def meanwhile() -> None:
            if self.link.now() - self.looked >= STEP:
                self._look_once(watch)
            if longest is not None and self.link.now() - ended > PAUSE:
                raise Alarm(f"{part.name} has not begun within {PAUSE:g} s, which is what a pause counts in the endurance.")

        self._look(watch, ended + SETTLE)
        self.link.bring(number, meanwhile)

        def watched(seconds: float) -> None:
            self.link.sleep(seconds)
            meanwhile()

        self.come_to_rest(part, watched)
        begin = self.link.start(number)
        watch.go_on(part, begin)
        self.record.parts[stage.name].append((begin, begin + part.duration))
        return begin

    def come_to_rest(self, part: Part, wait: Callable[[float], None]) -> None:
        """Hover until every robot is where a part begins, for as long as patience lasts.

        Args:
            part: What is flown next.
            wait: Waits for so many s.

        Raises:
            Alarm: It is not, or it is not known where it is.
        """
        until = self.link.now() + PATIENCE
        while failed := [check for check in at_start(self.link, part) if not check.passed]:
            if self.link.now() >= until or any(
                check.name not in ("place", "heading", "rest") or check.passed is None for check in failed
            ):
                raise Alarm("; ".join(refusals(failed, ())))
            wait(STEP)

    def _brake(self, stage: Stage, begin: float) -> None:
        """Watch how a patrol brakes to rest behind its last lap; what is flown lies on board with the laps, and goes on."""
        since = self.record.ends[stage.name]
        watch = Watch(self.link, stage.watched_braking(self.link.accuracy), begin, self.record, since=since)
        watch.see_before([self.link.pose(robot) for robot in stage.paths])
        self.record.starts[BRAKING] = since
        self._look(watch, begin + stage.duration)
        self.record.ends[BRAKING] = self.link.now()
        watch.finish(covered="it was proved for such a flight")

    def leave_out(self, robot: str) -> None:
        """Tell a robot nothing more: it is on the ground, and has acknowledged that its motors are off."""
        self.robots = tuple(name for name in self.robots if name != robot)
        self.grounded = tuple(name for name in self.grounded if name != robot)

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
    """Source of flights after the phases that are known before take-off."""

    @property
    def duration(self) -> float:
        """S that a battery must last for it."""
        ...

    @property
    def first(self) -> Stage:
        """Flight that it begins with, as far as is known before take-off."""
        ...

    @property
    def standing(self) -> Part | None:
        """Climbs of other robots, which wait on the ground and are checked before take-off, too; None where there are none."""
        ...

    def fly(self, flying: Flying) -> None:
        """Fly on, until everybody is just above the ground; raise `Alarm` where that cannot be."""
        ...


def fly_live(
    link: Link,
    stages: Sequence[Stage],
    *,
    grounds: Mapping[str, float],
    operator: Operator | None = None,
    onwards: Onwards | None = None,
    unchecked: Collection[str] = (),
) -> LiveFlight:
    """Fly certified stages over a link, watch them, and end safely whatever happens.

    Nothing is raised once motors turn: Ctrl-C, SIGTERM (where the caller has it raise KeyboardInterrupt), any error and a lost link end
    with the team holding, landing and stopping; what could not be told is in the answer.

    Args:
        link: To the robots.
        stages: What is flown one after another: the first begins where robots stand, each other where the one before ends.
        grounds: z in m of the ground below each robot.
        operator: Who sees the flight, and may order it to stop.
        onwards: What is flown after the stages; None where they end just above the ground.
        unchecked: Checks without which the operator flies where they cannot be made, such as `battery`; else they keep all on the ground.

    Returns:
        How it ended.

    Raises:
        BadInput: There is nothing to fly, or stages are of different robots or do not join.
        DoesNotFit: A vehicle's memory does not hold a stage; nothing spins.
    """
    _require_joined(stages, grounds)
    operator = operator or Operator(_nobody)
    record, orders = operator.record, operator.orders
    record.parameters.update({robot: link.parameters(robot) for robot in link.robots})
    lasts = sum(stage.duration + SETTLE * (len(stage.parts) - 1) for stage in stages) + (
        0.0 if onwards is None else onwards.duration
    )
    standing = None if onwards is None else onwards.standing
    known = stages if onwards is None else (*stages, onwards.first)
    checks = (*proved_starts(link, known), *before_take_off(link, stages[0], lasts, standing))
    for check in checks:
        record.note(link.now(), check.sentence, check.robot, "check")
    if failed := refusals(checks, unchecked):
        return LiveFlight(False, "; ".join(failed), checks, record, ())
    flying = Flying(link, record, tuple(stages[0].paths), operator.show, unchecked=frozenset(unchecked))
    ending = Ending(link, record.note, lambda robots: record.see(link, robots), grounds.__getitem__, limits(link.accuracy))
    orders.begin_flying()
    try:
        reason = _flown(flying, stages, onwards, orders)
        if reason and flying.began and orders.held:
            ending.held = _held(flying, orders, reason, grounds)
    except BaseException as error:
        if isinstance(error, DoesNotFit) and not flying.began:
            raise
        reason = INTERRUPTED  # once more, as why was still looked at
    orders.begin_ending()

    def end() -> list[str]:
        if reason and math.isinf(record.broken_off):
            record.broken_off = record.note(link.now(), reason, kind="alarm").time
        if orders.level is Level.MOTORS and flying.began:
            return ending.stop_motors(flying.robots, flying.grounded)
        if not reason:
            return ending.set_down(flying.robots, flying.grounded)
        return ending.end_safely(flying.robots if flying.began else (), flying.grounded)

    unsafe = insisted(end, (*flying.robots, *flying.grounded))
    return LiveFlight(not reason and not unsafe, reason, checks, record, tuple(unsafe))


def _flown(flying: Flying, stages: Sequence[Stage], onwards: Onwards | None, orders: StopOrders) -> str:
    """Fly all; return why it was broken off, or nothing."""
    try:
        orders.heed()
        stored = [flying.store_all(stage) for stage in stages]
        for numbers, stage in zip(stored, stages, strict=True):
            orders.heed()
            flying.began = True
            flying.fly(stage, numbers)
        if onwards is not None:
            onwards.fly(flying)
    except Ordered as order:
        orders.begin_holding()
        return str(order)
    except (Alarm, LinkLost) as alarm:
        return str(alarm)
    except KeyboardInterrupt:
        return INTERRUPTED
    except BaseException as error:  # whatever it was: robots are in the air
        if isinstance(error, DoesNotFit) and not flying.began:
            raise
        return f"{type(error).__name__}: {error}"
    return ""


def _held(flying: Flying, orders: StopOrders, reason: str, grounds: Mapping[str, float]) -> float:
    """Hold as is ordered, until a higher order, or until that cannot last; return since when all do, s."""
    link, record = flying.link, flying.record
    record.broken_off = record.note(link.now(), reason, kind="alarm").time
    record.note(link.now(), f"all robots hold where they can stop, for {LONGEST:g} s at most.", kind="reaction")
    hold = Hold(link, record, flying.robots, grounds.__getitem__, limits(link.accuracy))
    try:
        orders.heed()
        why = hold.last()
    except Ordered:
        return hold.since
    except BaseException as error:  # Ctrl-C, a lost link: the team lands
        why = str(error) or type(error).__name__
    record.note(link.now(), f"the hold ends: {why}.", kind="reaction")
    return hold.since


def _nobody(_look: Look) -> None:
    """Show a look to nobody."""


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
