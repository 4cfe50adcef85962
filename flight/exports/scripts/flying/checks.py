"""Checks of a robot before it flies: one list, for live links and for exported scripts. Standard library only; copied into exports.

A check passes, fails, or could not be made. What could not be made keeps a robot on the ground as well, unless the operator accepts it by name
(`--unchecked NAME`). Places are x, y, z in m, headings in rad; all numbers come from `limits` (`flight.monitoring.thresholds`, `flight.json`).
"""

from __future__ import annotations

import cmath
import itertools
import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

Place = tuple[float, float, float]

NAMES = ("age", "heading", "ready", "estimator", "battery", "parameters")
"""Checks that may not be possible, as `--unchecked` names them."""


@dataclass(frozen=True)
class Pose:
    """Measured pose of a robot.

    Attributes:
        time: s of the link's or the script's clock.
        position: x, y, z in m.
        heading: rad; None where it is not measured.
        unrest: Its `speed`, m/s, `tilt`, rad, and `turn`, rad/s, as far as they are reported.
    """

    time: float
    position: Place
    heading: float | None
    unrest: Mapping[str, float] = field(default_factory=dict[str, float])


@dataclass(frozen=True)
class Health:
    """Health that a vehicle reports; None for what it does not report.

    Attributes:
        ready: Whether it would take off: armed or needing no arming, no supervisor in the way.
        settled: Whether its estimator has settled.
        endurance: s that its battery lasts in hover.
        flying: Whether it says that it flies: its supervisor, its land detector.
        fault: What blocks it in flight, as of it alone (`has tumbled`); empty where nothing does.
        why: Why something is not known, by the name of its check.
    """

    ready: bool | None = None
    settled: bool | None = None
    endurance: float | None = None
    flying: bool | None = None
    fault: str = ""
    why: Mapping[str, str] = field(default_factory=dict[str, str])


@dataclass(frozen=True)
class Known:
    """Known state of a robot that is to fly; None for what is not reported.

    Attributes:
        poses: New ones of the last moments, in order of time, while it was at rest.
        health: What it says of itself.
        wrong: Parameters on board that differ, a sentence; empty where none does.
        dated: Whether poses carry the time of their measurement; without, their age is not known.
    """

    poses: Sequence[Pose]
    health: Health
    wrong: str | None = None
    dated: bool = True


@dataclass(frozen=True)
class Asked:
    """Requirements on the robots that are to fly.

    Attributes:
        places: Where each robot has to be, m.
        where: The same in words, such as `its start`.
        heading: rad.
        margin: delta, m.
        lasts: s that all is to take.
        above: Whether heights do not matter.
        start: m from there at which the proof of tracking lets robots begin; None where nothing is proved.
        rest: How far from rest it lets them begin, and what a measurement of that may be off, by `speed`, `tilt`, `turn` and `heading`.
    """

    places: Mapping[str, Place]
    where: str
    heading: float
    margin: float
    lasts: float
    above: bool = False
    start: float | None = None
    rest: Mapping[str, Sequence[float]] = field(default_factory=dict[str, Sequence[float]])

    def allowed(self, limits: Mapping[str, float]) -> float:
        """Return how far from its place a robot may be measured: a share of the margin, and no more than the proof lets it be.

        Args:
            limits: The numbers.
        """
        share = limits["share"] * self.margin
        return share if self.start is None else min(share, self.start - limits["accuracy"])


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


def battery_left(charge: float | None, endurance: float | None) -> float | None:
    """Return how long a battery lasts, s; None where that is not known.

    Args:
        charge: Share that is left; None where it is not reported.
        endurance: s of a full one; None where the vehicle's profile does not say.
    """
    if charge is not None and charge <= 0.0:
        return 0.0
    return None if charge is None or endurance is None else endurance * charge


def no_battery(charge: float | None) -> str:
    """Return why it is not known how long a battery lasts.

    Args:
        charge: Share that is left; None where it is not reported.
    """
    return "its charge is not reported" if charge is None else "its vehicle has no `endurance`"


def differing(board: Mapping[str, float], wanted: Mapping[str, float]) -> list[str]:
    """Return which parameters on board differ, up to float32.

    Args:
        board: As they were read.
        wanted: As they must be.
    """
    return [
        f"{key} is {f'{board[key]:g}' if key in board else 'not known'}, not {value:g}"
        for key, value in wanted.items()
        if key not in board or not math.isclose(board[key], value, rel_tol=1e-5, abs_tol=1e-9)
    ]


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
        _told(
            robot, "ready", known.health, "ready", "put it level, arm it, and restart it where a tumble or a crash blocks it"
        ),
        _told(robot, "estimator", known.health, "settled", "leave it standing still, or reset it"),
        _of_battery(robot, known.health, limits["reserve"] * asked.lasts),
        _of_parameters(robot, known),
    ]


def checks_of_team(
    known: Mapping[str, Known], asked: Mapping[str, Asked], limits: Mapping[str, float], now: float
) -> list[Check]:
    """Check robots before they fly, each by itself and all together: that each is one body, and that they are shown in the mission's frame.

    Args:
        known: What is known of each.
        asked: What is asked of each.
        limits: The numbers.
        now: s of the poses' clock.

    Returns:
        All checks, passed or not; a frame that is turned stands in place of what it makes wrong of each robot.
    """
    found = [check for name in known for check in checks_of(name, known[name], asked[name], limits, now)]
    places = {name: (_mean(each.poses), each.poses[-1].heading) for name, each in known.items() if each.poses}
    if sentence := _turned(places, asked, limits):
        found = [check for check in found if check.passed is not False or check.name not in ("place", "heading")]
        found.append(Check("frame", next(iter(places)), False, sentence))
    return found + one_body_each({name: each.poses[-1].position for name, each in known.items() if each.poses}, limits)


def at_place(robot: str, position: Place, asked: Asked, limits: Mapping[str, float]) -> Check:
    """Check whether a robot is where it has to be, up to what is allowed.

    Args:
        robot: Its name.
        position: Where it is measured, m.
        asked: Where it has to be.
        limits: The numbers.
    """
    axes = 2 if asked.above else 3

    def off(other: str) -> float:
        return math.dist(position[:axes], asked.places[other][:axes])

    most, found = asked.allowed(limits), off(robot)
    near = min(asked.places, key=off)
    swapped = f", and is where {near} belongs" if near != robot and off(near) < asked.margin else ""
    there = ", ".join(f"{value:.3f}" for value in asked.places[robot][:axes])
    told = next((digits for digits in range(3, 9) if round(found, digits) != round(most, digits) != 0.0), 3)
    what = f"{robot} is {found:.{told}f} m from {asked.where}{swapped}; {most:.{told}f} m are allowed"
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
        found.append(
            _unknown("age", robot, f"how old {robot}'s positions are", known.health.why.get("age", "they are not dated"))
        )
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
    return [
        at_place(robot, _mean(known.poses), asked, limits),
        heading_of(robot, known.poses[-1].heading, asked.heading, limits),
    ]


def _mean(poses: Sequence[Pose]) -> Place:
    x, y, z = (math.fsum(pose.position[axis] for pose in poses) / len(poses) for axis in range(3))
    return x, y, z


def _turned(measured: Mapping[str, tuple[Place, float | None]], asked: Mapping[str, Asked], limits: Mapping[str, float]) -> str:
    """Return how places are turned, mirrored and moved, where everybody is elsewhere and all would be right without that; else nothing.

    Bodies that are taken for each other are turned, too, but for their headings, and each is where another belongs.

    Args:
        measured: Place and heading of each robot.
        asked: What is asked of each.
        limits: The numbers.
    """
    ends = {name: asked[name].places[name] for name in measured}
    margin = min((asked[name].margin for name in ends), default=0.0)
    most = limits["share"] * margin
    rises = [0.0 if asked[name].above else at[2] - ends[name][2] for name, (at, _) in measured.items()]
    seen, wanted = [complex(*at[:2]) for at, _ in measured.values()], [complex(*end[:2]) for end in ends.values()]
    near = any(math.hypot(abs(one - other), up) <= margin for one, other, up in zip(seen, wanted, rises, strict=True))
    if len(ends) < 2 or near:
        return ""
    there, here, rise = sum(seen) / len(seen), sum(wanted) / len(wanted), sum(rises) / len(rises)
    swapped = any(abs(one - other) <= most for one in seen for other in wanted)
    for mirrored in (False, True):
        sense = -1.0 if mirrored else 1.0
        shown = [complex(place.real, sense * place.imag) for place in wanted]
        middle = complex(here.real, sense * here.imag)
        turn = cmath.phase(sum((one - there) * (other - middle).conjugate() for one, other in zip(seen, shown, strict=True)))
        off = [one - there - (other - middle) * cmath.rect(1.0, turn) for one, other in zip(seen, shown, strict=True)]
        stands = all(math.hypot(abs(left), up - rise) <= most for left, up in zip(off, rises, strict=True))
        headings = [(heading, turn + sense * asked[name].heading) for name, (_, heading) in measured.items()]
        looks = all(at is not None and heading_of("", at, end, limits).passed for at, end in headings)
        if stands and looks and not (mirrored and swapped):
            moved = there - middle * cmath.rect(1.0, turn)
            by = f"turned by {math.degrees(turn):.1f} degrees about z and moved by ({moved.real:.2f}, {moved.imag:.2f}, {rise:.2f}) m"
            what, wrong = ("mirrored and ", "axes of motion capture are") if mirrored else ("", "the mission's `frame` is")
            return f"the robots are measured where the mission has them, but {what}{by}: if they stand right, {wrong} wrong by that"
    return ""


def _told(robot: str, name: str, known: Health, word: str, do: str) -> Check:
    """Return what a robot says of itself."""
    told = known.ready if name == "ready" else known.settled
    verb, subject = ("is", robot) if name == "ready" else ("has", f"{robot}'s estimator")
    if told is None:
        return _unknown(name, robot, f"whether {subject} {verb} {word}", known.why.get(name, "it does not report that"))
    return Check(name, robot, told, f"{subject} {verb} {word}" if told else f"{subject} {verb} not {word}: {do}")


def _of_battery(robot: str, known: Health, needed: float) -> Check:
    if known.endurance is None:
        why = known.why.get("battery", "its charge is not reported, or its vehicle has no `endurance`")
        return _unknown("battery", robot, f"whether {robot}'s battery lasts for {needed:.0f} s", why)
    what = f"{robot}'s battery lasts {known.endurance:.0f} s of the {needed:.0f} s needed"
    passed = known.endurance >= needed
    return Check("battery", robot, passed, what if passed else f"{what}: charge or change it")


def _of_parameters(robot: str, known: Known) -> Check:
    if known.wrong is None:
        return _unknown(
            "parameters", robot, f"the parameters of {robot}", known.health.why.get("parameters", "they cannot be read")
        )
    return Check("parameters", robot, not known.wrong, known.wrong or f"{robot}'s parameters are as they must be")


def _unknown(name: str, robot: str, what: str, why: str) -> Check:
    return Check(name, robot, None, f"not checked: {what}: {why}")
