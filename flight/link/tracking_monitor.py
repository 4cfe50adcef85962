"""Monitor of a team that flies over a link: each robot's distance from its trajectory, and every condition that ends a flight.

A `Watch` is of one flight at a time: it holds measured poses against paths at the very instants of the measurements, and asks the monitor, which follows
formula, tube and separation. What it says of a robot alone (not seen, battery) is told apart from what concerns the flight.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from flight.exports.scripts.flying import watch as gate
from flight.link.link import Link, Pose
from flight.link.phases import Part, Watched
from flight.link.record import Record
from flight.logs.log import Event
from flight.monitoring.formula_state import PartState
from flight.monitoring.monitor import COVERED
from flight.monitoring.thresholds import FRESH, bounds


@dataclass(frozen=True, slots=True)
class Look:
    """State of a flight as a person is shown it.

    Attributes:
        stage: Its name, and which part of it.
        time: s into it, pauses between parts left out.
        duration: s.
        errors: Distance of each robot from its plan, m; NaN where it is not seen.
        margin: m.
        events: New ones.
        to_do: Parts of the formula that are still to be done.
        parts: Its parts, each with its state.
    """

    stage: str
    time: float
    duration: float
    errors: Mapping[str, float]
    margin: float
    events: tuple[Event, ...]
    to_do: tuple[str, ...] = ()
    parts: tuple[tuple[str, PartState], ...] = ()


class Watch:
    """Looks at all robots, and says when a stage must not go on."""

    def __init__(self, link: Link, watched: Watched, begin: float, record: Record, *, since: float | None = None) -> None:
        """Begin to watch a flight.

        Args:
            link: To the robots.
            watched: What they fly.
            begin: When that began, s of the link's clock.
            record: Takes in what is seen.
            since: From when on it is watched, s of the link's clock; None from its beginning.
        """
        self._link, self._watched, self._begin, self._record = link, watched, begin, record
        self._since = begin if since is None else since
        self._monitor, self._said = watched.monitor, 0
        self._name, self._paths = watched.first or watched.name, watched.paths
        self._part, self._flown, self._pauses = begin, 0.0, watched.pauses
        worst = record.worst.setdefault(watched.name, {})
        self._worst = worst
        worst.update({robot: worst.get(robot, 0.0) for robot in watched.paths})
        numbers = bounds(watched.monitor.mission, watched.paths, watched.margin, link.accuracy)
        self._gate = gate.Watch(gate.Team({"robots": dict.fromkeys(watched.paths), **numbers}), self._since)
        self._late = ""

    def see_before(self, poses: Sequence[Pose | None]) -> None:
        """Show the monitor where robots were just before they are watched, that the time up to the first look is not left open.

        Args:
            poses: One a robot; nothing is shown where one is missing, stale, or of the stage itself.
        """
        kept = [pose for pose in poses if pose is not None and self._since - FRESH <= pose.time <= self._since]
        if len(kept) < len(poses):
            return
        measured = np.array([pose.position for pose in kept]).T
        paths = self._watched.paths.values()
        at = [max(pose.time - self._begin, 0.0) for pose in kept]  # before it began they hovered there
        planned = np.stack([path.evaluate(min(time, path.duration))[:3] for path, time in zip(paths, at, strict=True)], axis=1)
        self._monitor.see(min(pose.time for pose in kept) - self._since, measured, planned)

    @property
    def begin(self) -> float:
        """Start of the flight, s of the link's clock."""
        return self._begin

    @property
    def ended(self) -> float:
        """End of the part that is flown, after which the team hovers until another one begins, s of the link's clock; infinite where none does."""
        return self._part + self._pauses

    def go_on(self, part: Part, begin: float) -> None:
        """Watch another part from when on it began; robots hovered until then.

        Args:
            part: It follows the one before.
            begin: s of the link's clock.
        """
        self._flown += self._pauses
        self._name, self._paths = part.name, part.paths
        self._part, self._pauses = begin, part.duration if part.pauses else math.inf

    def _on_plan(self, now: float) -> float:
        """Return the plan's time, s since its beginning: it stands still while the team hovers between parts."""
        return self._flown + min(now - self._part, self._pauses)

    def look(self) -> Look:
        """Take in what was measured since."""
        now = self._link.now()
        self._late = self._late or self._gate.late(now)
        measured, errors = np.full((3, len(self._paths)), np.nan), np.full(len(self._paths), np.nan)
        for index, (robot, path) in enumerate(self._paths.items()):
            pose = self._link.pose(robot)
            if pose is None or pose.time <= self._gate.last[robot]:
                continue
            wanted = path.evaluate(min(max(pose.time - self._part, 0.0), path.duration))[:3]
            measured[:, index] = pose.position
            errors[index] = np.linalg.norm(measured[:, index] - wanted)
            self._worst[robot] = max(self._worst[robot], float(errors[index]))
            self._gate.see(robot, pose, float(errors[index]))
            self._record.poses.append((pose.time, robot, *pose.position))
            x, y, z = wanted.tolist()
            self._record.setpoints.append((pose.time, robot, x, y, z))
        self._monitor.pause(now - self._begin - self._on_plan(now))
        self._monitor.see_errors(now - self._since, measured, errors)
        new = self._unsaid()
        self._record.events += new
        return Look(
            self._name, self._on_plan(now), self._watched.duration, dict(zip(self._paths, errors.tolist(), strict=True)),
            self._watched.margin, tuple(new), self._monitor.to_do, self._monitor.parts,
        )  # fmt: skip

    def finish(self, *, covered: str = COVERED) -> None:
        """Take the flight as flown to its end, and say how it was.

        Args:
            covered: What it means that the tube was never left.
        """
        self._monitor.finish(self._watched.duration + self._part - self._flown - self._since, covered=covered)
        self._record.events += self._unsaid()

    def _unsaid(self) -> list[Event]:
        """Return the monitor's events since the last time, on the link's clock."""
        new = self._monitor.events[self._said :]
        self._said = len(self._monitor.events)
        return [Event(self._since + event.time, event.robot, event.kind, event.sentence) for event in new]

    def lost(self) -> tuple[str, str] | None:
        """Return a robot that cannot go on, and why; None where all can."""
        now = self._link.now()
        for robot in self._gate.last:
            if why := self._gate.lost(robot, now, self._link.health(robot)):
                return robot, f"{why} at {self._on_plan(now):.2f} s of the {self._watched.name}."
        return None

    def outside(self, robot: str) -> str:
        """Say that a robot was outside of its margin or the workspace; empty where it was not.

        Args:
            robot: Name.
        """
        return self._gate.outside.get(robot, "")

    def alarm(self) -> str:
        """Return why the flight must not go on, though all robots could; empty where it may."""
        broken = [event.sentence for event in self._monitor.events if event.kind == "formula"][-1:]
        return self._gate.alarm() or self._late or "".join(broken if self._monitor.formula == "violated" else ())
