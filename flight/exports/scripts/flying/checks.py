"""Checks of a robot before it flies: one list, for live links and for exported scripts. Standard library only; copied into exports.

A check passes, fails, or could not be made. What could not be made keeps a robot on the ground as well, unless the operator accepts it by name
(`--unchecked NAME`). Places are x, y, z in m, headings in rad; all numbers come from `limits` (`flight.monitoring.thresholds`, `flight.json`).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

Place = tuple[float, float, float]

NAMES = ("age", "heading", "ready", "estimator", "battery", "parameters")
"""Checks that may not be possible, as `--unchecked` names them."""


@dataclass(frozen=True)
class Pose:
    """Where a robot was measured.

    Attributes:
        time: s of the link's or the script's clock.
        position: x, y, z in m.
        heading: rad; None where it is not measured.
    """

    time: float
    position: Place
    heading: float | None


@dataclass(frozen=True)
class Known:
    """What is known of a robot that is to fly; None for what is not reported.

    Attributes:
        poses: New ones of the last moments, in order of time, while it was at rest.
        ready: Whether it would take off.
        settled: Whether its estimator has settled.
        lasts: s that its battery lasts in hover.
        wrong: Parameters on board that differ, a sentence; empty where none does.
        dated: Whether poses carry the time of their measurement; without, their age is not known.
        why: Why a check cannot be made, by its name.
    """

    poses: Sequence[Pose]
    ready: bool | None = None
    settled: bool | None = None
    lasts: float | None = None
    wrong: str | None = None
    dated: bool = True
    why: Mapping[str, str] = field(default_factory=dict[str, str])


@dataclass(frozen=True)
class Asked:
    """What is asked of a robot that is to fly.

    Attributes:
        places: Where each robot has to be, m.
        where: The same in words, such as `its start`.
        heading: rad.
        margin: delta, m.
        lasts: s that all is to take.
        above: Whether heights do not matter.
    """

    places: Mapping[str, Place]
    where: str
    heading: float
    margin: float
    lasts: float
    above: bool = False


@dataclass(frozen=True)
class Check:
    """One thing that was looked at.

    Attributes:
        name: `reached`, `pose`, `often`, `quiet`, `place`, `ground`, `frame`, or one of `NAMES`.
        robot: Whose.
        passed: Whether it is as it must be; None where that could not be checked.
        sentence: What was found, and what to do where it did not pass.
    """

    name: str
    robot: str
    passed: bool | None
    sentence: str


def refusals(checks: Iterable[Check], unchecked: Collection[str]) -> list[str]:
    """Return a sentence for each check that keeps a team on the ground: it failed, or could not be made and is not accepted; and how to accept it.

    Args:
        checks: All of them.
        unchecked: Names of checks without which the operator flies.
    """
    listed = list(checks)
    found = [check.sentence for check in listed if check.passed is False]
    unknown = [check for check in listed if check.passed is None and check.name not in unchecked]
    if unknown:
        options = " ".join(f"--unchecked {name}" for name in NAMES if any(check.name == name for check in unknown))
        found += [*(check.sentence for check in unknown), f"add {options} to fly without that"]
    return found


def checks_of(robot: str, known: Known, asked: Asked, limits: Mapping[str, float], now: float) -> list[Check]:
    """Check a robot before it flies.

    Args:
        robot: Its name.
        known: What is known of it.
        asked: What is asked of it.
        limits: The numbers.
        now: s of the poses' clock.

    Returns:
        All checks, passed or not.
    """
    return [
        *_of_poses(robot, known, limits, now),
        *_of_place(robot, known, asked, limits),
        _told(robot, "ready", known, "ready", "put it level, arm it, and restart it where a tumble or a crash blocks it"),
        _told(robot, "estimator", known, "settled", "leave it standing still, or reset it"),
        _of_battery(robot, known, limits["reserve"] * asked.lasts),
        _of_parameters(robot, known),
    ]


def at_place(robot: str, position: Place, asked: Asked, limits: Mapping[str, float]) -> Check:
    """Check whether a robot is where it has to be, up to a share of its margin.

    Args:
        robot: Its name.
        position: Where it is measured, m.
        asked: Where it has to be.
        limits: The numbers.
    """
    axes = 2 if asked.above else 3

    def off(other: str) -> float:
        return math.dist(position[:axes], asked.places[other][:axes])

    most, found = limits["share"] * asked.margin, off(robot)
    near = min(asked.places, key=off)
    swapped = f", and is where {near} belongs" if near != robot and off(near) < asked.margin else ""
    there = ", ".join(f"{value:.3f}" for value in asked.places[robot][:axes])
    what = f"{robot} is {found:.3f} m from {asked.where}{swapped}; {most:.3f} m are allowed"
    return Check("place", robot, found <= most, what if found <= most else f"{what}: put it at ({there})")


def heading_of(robot: str, heading: float | None, asked: float, limits: Mapping[str, float]) -> Check:
    """Check whether a robot looks where it has to.

    Args:
        robot: Its name.
        heading: rad; None where it is not measured.
        asked: rad.
        limits: The numbers.
    """
    if heading is None:
        return _unknown("heading", robot, f"the heading of {robot}", "it is not reported")
    off = abs(math.remainder(heading - asked, math.tau))
    what = f"{robot}'s heading is {math.degrees(off):.0f} degrees off"
    passed = off <= limits["heading"]
    return Check("heading", robot, passed, what if passed else f"{what}: turn it to {math.degrees(asked):.0f} degrees")


def one_body_each(places: Mapping[str, Place], limits: Mapping[str, float]) -> list[Check]:
    """Refuse two robots that are measured at one place: one body is taken for both.

    Args:
        places: Where each is measured, m.
        limits: The numbers.
    """
    return [
        Check(
            "pose", other, False, f"{one} and {other} are measured at one place: look at the names of bodies in motion capture"
        )
        for one, other in itertools.combinations(places, 2)
        if math.dist(places[one], places[other]) < limits["quiet"]
    ]


def _of_poses(robot: str, known: Known, limits: Mapping[str, float], now: float) -> list[Check]:
    poses = known.poses
    if not poses:
        sentence = f"{robot} has no position: look at motion capture, and whether it sees {robot} under this name"
        return [Check("pose", robot, False, sentence)]
    found: list[Check] = []

    def say(name: str, passed: bool, what: str, do: str) -> None:
        found.append(Check(name, robot, passed, what if passed else f"{what}: {do}"))

    age = now - poses[-1].time
    say("pose", age <= limits["fresh"], f"{robot}'s last pose is {age:.2g} s old", "look at motion capture and the markers")
    if not known.dated:
        found.append(_unknown("age", robot, f"how old {robot}'s positions are", known.why.get("age", "they are not dated")))
    say("often", len(poses) >= limits["poses"], f"{robot} was measured {len(poses)} times in {limits['watched']:g} s",
        f"{limits['poses']:g} are asked for; raise how often its pose is reported")  # fmt: skip
    least, most = (tuple(of(pose.position[axis] for pose in poses) for axis in range(3)) for of in (min, max))
    spread = math.dist(least, most)
    say("quiet", spread <= limits["quiet"] + 2.0 * limits["accuracy"], f"{robot}'s place wanders by {spread:.3f} m",
        "look for reflections and for two bodies that are taken for each other")  # fmt: skip
    return found


def _of_place(robot: str, known: Known, asked: Asked, limits: Mapping[str, float]) -> list[Check]:
    if not known.poses:
        return []
    x, y, z = (sum(pose.position[axis] for pose in known.poses) / len(known.poses) for axis in range(3))
    return [
        at_place(robot, (x, y, z), asked, limits),
        heading_of(robot, known.poses[-1].heading, asked.heading, limits),
    ]


def _told(robot: str, name: str, known: Known, word: str, do: str) -> Check:
    """Return what a robot says of itself."""
    told = known.ready if name == "ready" else known.settled
    verb, subject = ("is", robot) if name == "ready" else ("has", f"{robot}'s estimator")
    if told is None:
        return _unknown(name, robot, f"whether {subject} {verb} {word}", known.why.get(name, "it does not report that"))
    return Check(name, robot, told, f"{subject} {verb} {word}" if told else f"{subject} {verb} not {word}: {do}")


def _of_battery(robot: str, known: Known, needed: float) -> Check:
    if known.lasts is None:
        why = known.why.get("battery", "its charge is not reported, or its vehicle has no `endurance`")
        return _unknown("battery", robot, f"whether {robot}'s battery lasts for {needed:.0f} s", why)
    what = f"{robot}'s battery lasts {known.lasts:.0f} s of the {needed:.0f} s needed"
    passed = known.lasts >= needed
    return Check("battery", robot, passed, what if passed else f"{what}: charge or change it")


def _of_parameters(robot: str, known: Known) -> Check:
    if known.wrong is None:
        return _unknown("parameters", robot, f"the parameters of {robot}", known.why.get("parameters", "they cannot be read"))
    return Check("parameters", robot, not known.wrong, known.wrong or f"{robot}'s parameters are as they must be")


def _unknown(name: str, robot: str, what: str, why: str) -> Check:
    return Check(name, robot, None, f"not checked: {what}: {why}")
