"""What robots are asked for before they fly, and what must not go on in flight. Copied into exports; all numbers come from `flight.json`.

Each sentence says what is wrong and what to do about it. Places are x, y, z in m in the laboratory, headings in rad.
"""

from __future__ import annotations

import math
from typing import Any

from flying.checks import Asked, Place, Pose, at_place, heading_of


class Refused(Exception):
    """The flight is not begun, or not gone on with; the message says why."""


class Team:
    """What is known of a flight and its robots, as `flight.json` has it.

    Attributes:
        data: All of it.
        names: The robots.
        margin: m.
        limits: The numbers that flights are checked and watched by.
    """

    def __init__(self, data: dict[str, Any]) -> None:
        """Take what a file says."""
        self.data = data
        self.names: list[str] = list(data["robots"])
        self.margin: float = data["margin"]
        self.limits: dict[str, float] = data["limits"]
        self._beside: dict[str, list[tuple[str, float]]] = {name: [] for name in self.names}
        for one, other, least in data["separation"]:
            self._beside[one].append((other, least))
            self._beside[other].append((one, least))

    # Before the flight

    def require_margin(self) -> None:
        """Refuse a margin that measurements use up.

        Raises:
            Refused: As said.
        """
        accuracy = self.limits["accuracy"]
        if not (1.0 - self.limits["share"]) * self.margin > accuracy:
            least = accuracy / (1.0 - self.limits["share"])
            raise Refused(
                f"the margin is {self.margin:g} m, and a measurement may be off by {accuracy:g} m: a margin above {least:g} m leaves "
                "robots room to begin in"
            )

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

    def place_faults(self, name: str, pose: Pose, places: dict[str, Place], heading: float, where: str) -> list[str]:
        """Return that a robot in flight is not where what it flies next begins, or looks elsewhere; nothing where it is, and does.

        Args:
            name: The robot's.
            pose: Where it is measured.
            places: Where each robot has to be.
            heading: rad.
            where: In words.
        """
        asked = Asked(places, where, heading, self.margin, 0.0)
        found = (at_place(name, pose.position, asked, self.limits), heading_of(name, pose.heading, heading, self.limits))
        return [check.sentence for check in found if check.passed is False]

    def battery_left(self, name: str, level: float) -> float | None:
        """Return how long a robot's battery lasts, s; None where its vehicle's `endurance` is not known."""
        endurance = self.data["robots"][name]["endurance"]
        return 0.0 if level <= 0.0 else None if endurance is None else endurance * level

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
        return f"{name} is {off:.3f} m from its plan; the margin is {self.margin:g} m, and its measurement may be off by {accuracy:g} m"

    def apart_fault(self, name: str, places: dict[str, Place]) -> str:
        """Return which robot one is too near to; empty where that is none. A distance in z counts as the mission says.

        Args:
            name: The robot's.
            places: Where it and others are measured.
        """
        z, (x, y, height) = self.data["z_scale"], places[name]
        for other, least in self._beside[name]:
            if other in places:
                place = places[other]
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
    """Looks at the team in flight, pose by pose; whoever must not go on raises Refused."""

    def __init__(self, team: Team, now: float) -> None:
        """Begin to watch; all count as seen by now."""
        self._team = team
        self.last = dict.fromkeys(team.names, now)
        self.places: dict[str, Place] = {}

    def see(self, name: str, pose: Pose, off: float, *, low: bool = True) -> None:
        """Take in a new pose.

        Args:
            name: The robot's.
            pose: Where it was measured.
            off: m from where it should have been.
            low: Whether the workspace's lower end counts.

        Raises:
            Refused: It must not go on.
        """
        self.last[name] = pose.time
        self.places[name] = pose.position
        team = self._team
        if not all(map(math.isfinite, pose.position)):
            raise Refused(f"{name}'s measured place is no number")
        fault = (
            team.margin_fault(name, off)
            or team.workspace_fault(name, pose.position, low=low)
            or team.apart_fault(name, self.places)
        )
        if fault:
            raise Refused(fault)

    def require_seen(self, now: float) -> None:
        """Refuse to go on where a robot was not seen lately, or nobody looked.

        Args:
            now: s.

        Raises:
            Refused: As said.
        """
        fresh = self._team.limits["fresh"]
        silent = [name for name, time in self.last.items() if now - time > fresh]
        if silent:
            raise Refused(f"no position from {', '.join(silent)} for {fresh:g} s")

    def require_charged(self, name: str, level: float) -> None:
        """Refuse to go on with a battery that is nearly empty.

        Args:
            name: The robot's.
            level: Share of its charge.

        Raises:
            Refused: As said.
        """
        left = self._team.battery_left(name, level)
        if left is not None and not left >= self._team.limits["empty"]:
            raise Refused(f"{name}'s battery lasts {left:.0f} s more")
