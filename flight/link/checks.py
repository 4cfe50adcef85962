"""What is checked before anything spins: each robot, what was found, and what to do about it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from flight.link.link import Link, Pose
from flight.link.stages import Part, Stage
from flight.monitoring.thresholds import FRESH, HEADING, QUIET, RESERVE, SHARE, WATCHED


@dataclass(frozen=True, slots=True)
class Check:
    """One thing that was looked at.

    Attributes:
        name: `reached`, `pose`, `quiet`, `place`, `heading`, `ready`, `estimator`, `battery`, `parameters` or `frame`.
        robot: Whose.
        passed: Whether it is as it must be.
        sentence: What was found, and what to do where it did not pass.
    """

    name: str
    robot: str
    passed: bool
    sentence: str


def before_take_off(
    link: Link,
    first: Stage,
    lasts: float,
    wanted: Mapping[str, Mapping[str, float]] | None = None,
    standing: Part | None = None,
) -> tuple[Check, ...]:
    """Look at every robot for half a second, and say what keeps it from flying.

    Args:
        link: To the robots.
        first: What is flown first; it begins where they stand.
        lasts: s that all is to take.
        wanted: Parameters that must be on board, by robot; None asks for none.
        standing: Where other robots stand that wait on the ground; None where there are none.

    Returns:
        All checks, passed or not.
    """
    seen = _watched(link, (*first.paths, *(() if standing is None else standing.paths)))
    team = {robot: seen[robot] for robot in first.paths}
    found = on_ground(link, first, lasts, team, wanted)
    if standing is not None:
        found += on_ground(link, standing, lasts, {robot: seen[robot] for robot in standing.paths})
    found += one_body_each(seen)
    if frame := _frame(first, team):
        found = [check for check in found if check.passed or check.name not in ("place", "heading")]
    return (*found, *frame)


def on_ground(
    link: Link,
    first: Stage | Part,
    lasts: float,
    seen: Mapping[str, Sequence[Pose]],
    wanted: Mapping[str, Mapping[str, float]] | None = None,
) -> list[Check]:
    """Say what keeps robots that stand on the ground, and were looked at for a while, from flying.

    Args:
        link: To the robots.
        first: What they fly first; it begins where they stand.
        lasts: s that all is to take.
        seen: Poses of those that are meant.
        wanted: Parameters that must be on board, by robot; None asks for none.

    Returns:
        All checks, passed or not.
    """
    needed = RESERVE * lasts
    found: list[Check] = []

    def say(name: str, robot: str, passed: bool, what: str, do: str) -> None:
        found.append(Check(name, robot, passed, what if passed else f"{what}: {do}"))

    for robot in seen:
        if robot not in link.robots:
            say("reached", robot, False, f"{robot} does not answer", "switch it on, and look at its address and channel")
            continue
        poses = seen[robot]
        age = math.inf if not poses else link.now() - poses[-1].time
        say("pose", robot, age <= FRESH, f"{robot}'s last pose is {age:.2g} s old", "look at motion capture and the markers")
        if poses:
            places = np.array([pose.position for pose in poses])
            spread = float(np.linalg.norm(np.ptp(places, axis=0)))
            say("quiet", robot, spread <= QUIET + 2 * link.accuracy, f"{robot}'s place wanders by {spread:.3f} m",
                "look for reflections and for two bodies that are taken for each other")  # fmt: skip
            found.append(_place(robot, first, places.mean(axis=0)))
            if poses[-1].heading is not None:
                off = abs(math.remainder(poses[-1].heading - float(first.paths[robot].evaluate(0.0)[3]), math.tau))
                say("heading", robot, off <= HEADING, f"{robot}'s heading is {math.degrees(off):.0f} degrees off",
                    "turn it as the mission says (`yaw_deg`)")  # fmt: skip
        health = link.health(robot)
        say("ready", robot, health.ready is not False, f"{robot} {'is' if health.ready is not False else 'is not'} ready",
            "arm it, put it level, and free its supervisor (a tumble or a crash blocks it)")  # fmt: skip
        say("estimator", robot, health.settled is not False,
            f"{robot}'s estimator {'has' if health.settled is not False else 'has not'} settled", "leave it standing still, or reset it")  # fmt: skip
        if health.endurance is not None:
            say("battery", robot, health.endurance >= needed,
                f"{robot}'s battery lasts {health.endurance:.0f} s of the {needed:.0f} s needed", "charge or change it")  # fmt: skip
        else:
            unknown = "its charge is not reported, or its vehicle has no `endurance`"
            found.append(
                Check("battery", robot, True, f"{robot}'s battery is not held against the {needed:.0f} s needed: {unknown}")
            )
        board = link.parameters(robot)
        wrong = [f"{key} is {board.get(key)}, not {value:g}" for key, value in ((wanted or {}).get(robot) or {}).items()
                 if key not in board or not math.isclose(board[key], value, rel_tol=1e-5, abs_tol=1e-9)]  # fmt: skip
        say("parameters", robot, not wrong, f"{robot}'s parameters are as they must be" if not wrong else f"{robot}: {'; '.join(wrong)}",
            "set them again, and look whether the firmware has them")  # fmt: skip
    return found


def at_start(link: Link, stage: Stage | Part) -> tuple[Check, ...]:
    """Look whether every robot hovers where a stage, or a part of one, begins.

    Args:
        link: To the robots.
        stage: What is to be flown next.
    """
    found: list[Check] = []
    for robot in stage.paths:
        pose = link.pose(robot)
        if pose is None or link.now() - pose.time > FRESH:
            found.append(Check("pose", robot, False, f"{robot} was not seen lately: look at motion capture and the markers"))
        else:
            found.append(_place(robot, stage, np.array(pose.position)))
    return tuple(found)


def _watched(link: Link, robots: Sequence[str]) -> dict[str, list[Pose]]:
    seen: dict[str, list[Pose]] = {robot: [] for robot in robots}
    for _ in range(round(WATCHED / 0.02)):
        for robot in robots:
            pose = link.pose(robot) if robot in link.robots else None
            if pose is not None and (not seen[robot] or pose.time > seen[robot][-1].time):
                seen[robot].append(pose)
        link.sleep(0.02)
    return seen


def _place(robot: str, stage: Stage | Part, place: np.ndarray) -> Check:
    """Return whether a robot is where a stage begins, up to a share of the margin."""
    start = stage.paths[robot].evaluate(0.0)[:3]
    off, most = float(np.linalg.norm(place - start)), SHARE * stage.margin
    what = f"{robot} is {off:.3f} m from where the {stage.name} begins; {most:.3f} m are allowed"
    x, y, z = start.tolist()
    return Check("place", robot, off <= most, what if off <= most else f"{what}: put it at ({x:.3f}, {y:.3f}, {z:.3f})")


def _frame(stage: Stage, seen: Mapping[str, list[Pose]]) -> list[Check]:
    """Refuse a frame by which everybody stands elsewhere, and all would stand right if the mission was turned and moved: say by what."""
    poses = {robot: row[-1] for robot, row in seen.items() if row}
    if len(poses) < 2:
        return []
    measured = np.array([pose.position for pose in poses.values()])
    wanted = np.array([stage.paths[robot].evaluate(0.0) for robot in poses])
    most = SHARE * stage.margin
    if (np.linalg.norm(measured - wanted[:, :3], axis=1) <= most).any():
        return []
    here, there = (places[:, :2] - places[:, :2].mean(axis=0) for places in (wanted, measured))
    turn = math.atan2(float((here[:, 0] * there[:, 1] - here[:, 1] * there[:, 0]).sum()), float((here * there).sum()))
    headings = [(pose.heading, yaw) for pose, yaw in zip(poses.values(), wanted[:, 3].tolist(), strict=True)]
    if any(heading is None or abs(math.remainder(heading - yaw - turn, math.tau)) > HEADING for heading, yaw in headings):
        return []  # bodies that are taken for each other are turned, too, but for their headings
    cosine, sine = math.cos(turn), math.sin(turn)
    turned = wanted[:, :3] @ np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]]).T
    offset = (measured - turned).mean(axis=0)
    if (np.linalg.norm(measured - turned - offset, axis=1) > most).any():
        return []
    x, y, z = offset.tolist()
    sentence = (
        f"the robots are measured where the mission has them, but turned by {math.degrees(math.remainder(turn, math.tau)):.1f} degrees about z "
        f"and moved by ({x:.2f}, {y:.2f}, {z:.2f}) m: if they stand right, the mission's `frame` is wrong by that"
    )
    return [Check("frame", next(iter(poses)), False, sentence)]


def one_body_each(seen: Mapping[str, Sequence[Pose]]) -> list[Check]:
    """Refuse two robots that are measured at one place: one body is taken for both.

    Args:
        seen: Poses of each, in order of time.
    """
    found: list[Check] = []
    last = {robot: poses[-1].position for robot, poses in seen.items() if poses}
    for (one, here), (other, there) in itertools.combinations(last.items(), 2):
        if math.dist(here, there) < QUIET:
            sentence = f"{one} and {other} are measured at one place: look at the names of bodies in motion capture"
            found.append(Check("pose", other, False, sentence))
    return found
