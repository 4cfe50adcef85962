"""What robots are asked for before they fly, and what must not go on in flight. Copied into exports; all numbers come from `flight.json`.

Each sentence says what is wrong and what to do about it. Places are x, y, z in m in the laboratory, headings in rad.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Any

Place = tuple[float, float, float]


class Refused(Exception):
    """The flight is not begun, or not gone on with; the message says why."""


@dataclass(frozen=True)
class Pose:
    """Where a robot was measured.

    Attributes:
        time: s of the script's clock.
        place: x, y, z in m.
        heading: rad; None where it is not measured.
    """

    time: float
    place: Place
    heading: float | None


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

    def pose_faults(self, name: str, poses: list[Pose], now: float) -> list[str]:
        """Return what is wrong with a robot's poses: none, old, or restless.

        Args:
            name: The robot's.
            poses: Measured in the last moments, while it was at rest.
            now: s of the same clock.
        """
        limits, faults = self.limits, list[str]()
        if not poses:
            return [f"{name} has no position: look at motion capture, and whether it sees {name} under this name"]
        if now - poses[-1].time > limits["fresh"]:
            faults.append(f"{name}'s last pose is {now - poses[-1].time:.2g} s old: look at motion capture and the markers")
        if len(poses) < limits["poses"]:
            faults.append(
                f"{name} was measured {len(poses)} times in {limits['watched']:g} s, and {limits['poses']:g} are asked for: raise how often its pose is reported"
            )
        spread = math.dist(*(tuple(of(pose.place[axis] for pose in poses) for axis in range(3)) for of in (min, max)))
        if not spread <= limits["quiet"] + 2 * limits["accuracy"]:
            faults.append(
                f"{name}'s place wanders by {spread:.3f} m: look for reflections and for two bodies that are taken for each other"
            )
        return faults

    def place_fault(self, name: str, place: Place, wanted: dict[str, Place], where: str, *, above: bool = False) -> str:
        """Return that a robot is not where it has to be; empty where it is.

        Args:
            name: The robot's.
            place: Where it is measured.
            wanted: Where each robot has to be.
            where: In words.
            above: Whether heights do not matter.
        """

        def off(other: str) -> float:
            return math.dist(place[:2], wanted[other][:2]) if above else math.dist(place, wanted[other])

        most, found = self.limits["share"] * self.margin, off(name)
        if found <= most:
            return ""
        near = min(wanted, key=off)
        swapped = f", and is where {near} belongs" if near != name and off(near) < self.margin else ""
        there = ", ".join(f"{value:.3f}" for value in wanted[name][: 2 if above else 3])
        return f"{name} is {found:.3f} m from {where}{swapped}; {most:.3f} m are allowed: put it at ({there})"

    def heading_fault(self, name: str, heading: float | None, wanted: float) -> str:
        """Return that a robot looks elsewhere; empty where it does not, or does not say where it looks.

        Args:
            name: The robot's.
            heading: rad.
            wanted: rad.
        """
        off = 0.0 if heading is None else abs(math.remainder(heading - wanted, math.tau))
        if off <= self.limits["heading"]:
            return ""
        return f"{name}'s heading is {math.degrees(off):.0f} degrees off: turn it to {math.degrees(wanted):.0f} degrees"

    def battery_fault(self, name: str, level: float, lasts: float) -> str:
        """Return that a battery does not last for the flight; empty where it does, or nobody knows for how long one lasts.

        Args:
            name: The robot's.
            level: Share of its charge.
            lasts: s that all is to take.
        """
        left, needed = self.battery_left(name, level), self.limits["reserve"] * lasts
        if left is None or left >= needed:
            return ""
        return f"{name}'s battery lasts {left:.0f} s of the {needed:.0f} s needed: charge or change it"

    def battery_left(self, name: str, level: float) -> float | None:
        """Return how long a robot's battery lasts, s; None where its vehicle's `endurance` is not known."""
        endurance = self.data["robots"][name]["endurance"]
        return 0.0 if level <= 0.0 else None if endurance is None else endurance * level

    def one_body_each(self, places: dict[str, Place]) -> list[str]:
        """Return who are measured at one place: one body is taken for both."""
        return [
            f"{one} and {other} are measured at one place: look at the names of bodies in motion capture"
            for one, other in itertools.combinations(places, 2)
            if math.dist(places[one], places[other]) < self.limits["quiet"]
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
        self.places[name] = pose.place
        team = self._team
        if not all(map(math.isfinite, pose.place)):
            raise Refused(f"{name}'s measured place is no number")
        fault = (
            team.margin_fault(name, off)
            or team.workspace_fault(name, pose.place, low=low)
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
