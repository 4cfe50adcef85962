"""Record of a live flight: measured poses, commands, and events."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from flight.link.link import Link
from flight.link.phases import FLIGHT
from flight.logs.log import Event
from flight.monitoring.thresholds import FRESH
from verify.data.frame import Frame

Row = tuple[float, str, float, float, float]
"""s since the link began, robot, x, y, z in m."""


@dataclass(slots=True)
class Record:
    """Grows while a flight is flown; nothing is ever taken out.

    Attributes:
        poses: Measured, also while a team that broke its flight off holds and lands.
        setpoints: Where each robot should have been, at the instant of the pose, while it was flown.
        starts: When each stage began, s.
        ends: When each stage ended, s.
        parts: Of a stage in parts when each of them began and was to end, s; in between the team hovered.
        events: What happened and what was said.
        parameters: What was read back from each vehicle.
        worst: Greatest distance from the plan, m, by stage and robot.
        broken_off: When what was flown was given up, s; infinite where it was not.
    """

    poses: list[Row] = field(default_factory=list[Row])
    setpoints: list[Row] = field(default_factory=list[Row])
    starts: dict[str, float] = field(default_factory=dict[str, float])
    ends: dict[str, float] = field(default_factory=dict[str, float])
    parts: dict[str, list[tuple[float, float]]] = field(default_factory=dict[str, list[tuple[float, float]]])
    events: list[Event] = field(default_factory=list[Event])
    parameters: dict[str, Mapping[str, float]] = field(default_factory=dict[str, Mapping[str, float]])
    worst: dict[str, dict[str, float]] = field(default_factory=dict[str, dict[str, float]])
    broken_off: float = math.inf

    def note(self, time: float, sentence: str, robot: str | None = None, kind: str = "note") -> Event:
        """Add an event, and return it.

        Args:
            time: s of the link's clock.
            sentence: For a person.
            robot: Whom it concerns; None for the team.
            kind: `check`, `alarm`, `reaction` or `note`.
        """
        event = Event(time, robot, kind, sentence)
        self.events.append(event)
        return event

    def see(self, link: Link, robots: Iterable[str]) -> None:
        """Take in where robots were measured, while nothing is flown that is watched.

        Args:
            link: To them.
            robots: Whom.
        """
        for robot in robots:
            pose = link.pose(robot)
            last = next((row[0] for row in reversed(self.poses) if row[1] == robot), -math.inf)
            if pose is not None and pose.time > last:
                self.poses.append((pose.time, robot, *pose.position))

    def table(self, rows: list[Row], since: float = 0.0, until: float = float("inf"), frame: Frame | None = None) -> str:
        """Return rows as CSV, `t,robot,x,y,z`, times from `since` on.

        Args:
            rows: `poses` or `setpoints`.
            since: s; becomes time 0.
            until: s.
            frame: Where the mission lies in the laboratory, whose places are written then.
        """
        if frame is not None and rows:
            seen = frame.to_laboratory([row[2:] for row in rows]).tolist()
            rows = [(time, robot, x, y, z) for (time, robot, *_), (x, y, z) in zip(rows, seen, strict=True)]
        kept = sorted((row for row in rows if since <= row[0] <= until), key=lambda row: row[0])
        lines = [f"{time - since:.6f},{robot},{x:.9g},{y:.9g},{z:.9g}" for time, robot, x, y, z in kept]
        return "t,robot,x,y,z\n" + "".join(f"{line}\n" for line in lines)

    def files(self, frame: Frame | None = None) -> dict[str, str]:
        """Return the files of a live flight, by name.

        `live.csv` has the poses of the stage `flight` from its start on, as `ltlplan certify RUN --flight` reads it.

        Args:
            frame: Where the mission lies in the laboratory; places are then as the laboratory sees them.
        """
        data = {
            "starts": self.starts,
            "ends": self.ends,
            "parts": self.parts,
            "parameters": {robot: dict(values) for robot, values in self.parameters.items()},
            "worst": self.worst,
            "events": [{"time": e.time, "robot": e.robot, "kind": e.kind, "sentence": e.sentence} for e in self.events],
        }
        found = {
            "poses.csv": self.table(self.poses, frame=frame),
            "setpoints.csv": self.table(self.setpoints, frame=frame),
            "live.json": json.dumps(data, indent=1, allow_nan=False) + "\n",
        }
        if FLIGHT in self.starts:
            found["live.csv"] = self.table(self.poses, self.starts[FLIGHT], self._seen_after(FLIGHT), frame)
        return found

    def pauses(self, stage: str) -> tuple[float, ...]:
        """Return how long the team hovered between the parts of a stage, s; nothing of one that was begun once.

        Args:
            stage: Its name.
        """
        return tuple(after[0] - before[1] for before, after in itertools.pairwise(self.parts.get(stage, ())))

    def _seen_after(self, stage: str) -> float:
        """Return when all robots were measured for the first time since a stage ended, s: up to then its last instants lie between two poses.

        Of one that was broken off that is when it was.
        """
        if stage not in self.ends:
            return self.broken_off
        end, first = self.ends[stage], dict[str, float]()
        for time, robot, *_ in self.poses:
            if end <= time <= end + FRESH:
                first[robot] = min(time, first.get(robot, time))
        return max((end, *first.values()))
