"""The watch of a team in flight, for live links and exported scripts. Standard library only; copied into exports.

All numbers come from `flight.monitoring.thresholds.bounds`, which scripts read from `flight.json`. Each sentence says what is wrong and what to do
about it. Places are x, y, z in m, headings in rad.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from .checks import Asked, Health, Place, Pose
from .starts import at_start, margin_fault, start_fault


class Refused(Exception):
    """The flight is not begun, or not gone on with; the message says why."""


class Team:
    """The numbers of a flight and its robots.

    Attributes:
        data: All of them, as `flight.json` has them; of a link what `thresholds.bounds` says, and `robots`.
        names: The robots.
        margin: m.
        limits: The numbers that flights are checked and watched by.
        start: m from its start at which the proof of tracking lets a robot begin; None where nothing is proved.
        rest: How far from rest it lets it, as `Asked` has it.
    """

    def __init__(self, data: dict[str, Any]) -> None:
        """Take what a file says."""
        self.data = data
        self.names: list[str] = list(data["robots"])
        self.margin: float = data["margin"]
        self.limits: dict[str, float] = data["limits"]
        self.start: float | None = data.get("start")
        self.rest: dict[str, Sequence[float]] = data.get("rest", {})
        self._beside: dict[str, list[tuple[str, float]]] = {name: [] for name in self.names}
        for one, other, least in data["separation"]:
            self._beside[one].append((other, least))
            self._beside[other].append((one, least))

    # Before the flight

    def require_margin(self) -> None:
        """Refuse a margin, or a start, that measurements use up.

        Raises:
            Refused: As said.
        """
        if fault := margin_fault(self.margin, self.limits) or start_fault(self.start, "the flight", self.limits):
            raise Refused(fault)

    def asked(self, name: str, places: dict[str, Place], where: str, *, above: bool = False) -> Asked:
        """Return what is asked of a robot before it flies.

        Args:
            name: The robot's.
            places: Where each robot has to be.
            where: The same in words.
            above: Whether heights do not matter.
        """
        heading = self.data["robots"][name]["start"][3]
        return Asked(places, where, heading, self.margin, self.data["lasts"], above)

    def start_faults(
        self, poses: Mapping[str, Pose | None], places: Mapping[str, Sequence[float]], where: str, now: float
    ) -> list[str]:
        """Return a sentence for each robot in flight that is not seen where what it flies next begins, or looks elsewhere.

        Args:
            poses: The last of each robot.
            places: Where each has to be, and its heading, rad.
            where: In words.
            now: s.
        """
        ends: dict[str, Place] = {name: (x, y, z) for name, (x, y, z, _) in places.items()}
        asked = {
            name: Asked(ends, where, place[3], self.margin, 0.0, start=self.start, rest=self.rest)
            for name, place in places.items()
        }
        return [
            check.sentence
            for name, pose in poses.items()
            for check in at_start(name, pose, asked[name], self.limits, now)
            if check.passed is False
        ]

    # In flight

    def margin_fault(self, name: str, off: float) -> str:
        """Return that a robot may have left its margin; empty where it has not.

        Args:
            name: The robot's.
            off: m from where it should be.
        """
        accuracy = self.limits["accuracy"]
        if off + accuracy < self.margin:
            return ""
        return f"{name} is {off:.3f} m from its plan; the margin is {self.margin:g} m, and its measurement may be off by {accuracy:.3g} m"

    def apart_fault(self, name: str, places: dict[str, Place]) -> str:
        """Return which robot one is too near to; empty where that is none. A distance in z counts as the mission says.

        Args:
            name: The robot's.
            places: Where it and others are measured.
        """
        z, (x, y, height) = self.data["z_scale"], places[name]
        for other, least in self._beside[name]:
            place = places.get(other)
            if place is None or abs(x - place[0]) > least:
                continue
            found = math.hypot(x - place[0], y - place[1], z * (height - place[2]))
            if not found >= least:
                return f"{name} and {other} are {found:.3f} m apart, and {least:.3f} m are asked"
        return ""

    def workspace_fault(self, name: str, place: Place, *, low: bool = True) -> str:
        """Return that a robot is outside of the workspace; empty where it is not.

        Args:
            name: The robot's.
            place: Where it is measured.
            low: Whether the lower end counts: it does not in climb and landing.
        """
        x, y, z = place
        world = self.data["workspace"]
        out = max([nx * x + ny * y - most for nx, ny, most in world["walls"]] + [z - world["high"]])
        out = max(out, world["low"] - z) if low else out
        return f"{name} is {out:.3f} m outside of the workspace" if not out <= self.limits["accuracy"] else ""


class Watch:
    """Looks at a team in flight, pose by pose, and says why a robot, or the team, must not go on.

    Attributes:
        last: When each robot was measured last, s.
        places: Where that was.
        outside: Robots that may have left their margin or the workspace, with a sentence each.
        near: Which robots came too near to each other, a sentence; empty where none did.
    """

    def __init__(self, team: Team, now: float) -> None:
        """Begin to watch; all count as seen by now."""
        self._team = team
        self.places: dict[str, Place] = {}
        self.outside: dict[str, str] = {}
        self.near = ""
        self.begin(now)

    def begin(self, now: float) -> None:
        """Count all as seen by now, after a time in which nobody was looked at."""
        self.last, self._looked = dict.fromkeys(self._team.names, now), math.inf

    def see(self, name: str, pose: Pose, off: float, *, low: bool = True) -> None:
        """Take in a new pose.

        Args:
            name: The robot's.
            pose: Where it was measured.
            off: m from where it should have been.
            low: Whether the workspace's lower end counts.
        """
        team, self.last[name], self.places[name] = self._team, pose.time, pose.position
        fault = team.margin_fault(name, off) or team.workspace_fault(name, pose.position, low=low)
        if not all(map(math.isfinite, pose.position)):
            fault = f"{name}'s measured place is no number"
        if fault:
            self.outside.setdefault(name, fault)
        self.near = self.near or team.apart_fault(name, self.places)

    def lost(self, name: str, now: float, health: Health) -> str:
        """Return why a robot cannot go on, though others can; empty where it can.

        Args:
            name: The robot's.
            now: s.
            health: What it says of itself.
        """
        limits = self._team.limits
        if now - self.last[name] > limits["fresh"]:
            return f"{name} was not seen for {limits['fresh']:g} s"
        if (lasts := health.endurance) is not None and not lasts >= limits["empty"]:
            return f"{name}'s battery lasts {max(lasts, 0.0):.0f} s more"
        return health.fault and f"{name} {health.fault}"

    def alarm(self) -> str:
        """Return why the team must not go on, though all robots could; empty where it may."""
        return next(iter(self.outside.values()), self.near)

    def late(self, now: float) -> str:
        """Return that nobody was looked at for too long, up to now; empty where they were.

        Args:
            now: s.
        """
        late, self._looked = now - self._looked, now
        return f"this computer is too busy: nobody was looked at for {late:.2f} s" if late > self._team.limits["slow"] else ""

    def require(self, now: float, health: Callable[[str], Health]) -> None:
        """Refuse to go on where one cannot.

        Args:
            now: s.
            health: Returns what a robot says of itself.

        Raises:
            Refused: As said.
        """
        lost = (self.lost(name, now, health(name)) for name in self._team.names)
        if fault := self.late(now) or self.alarm() or next(filter(None, lost), ""):
            raise Refused(fault)
