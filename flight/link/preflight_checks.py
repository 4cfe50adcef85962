"""Checks before anything spins, over a link: the list that exported scripts go by, too, and whether a mission's `frame` is wrong."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from flight.exports.scripts.flying.checks import Asked, Check, Known, Place, at_place, checks_of, heading_of
from flight.exports.scripts.flying.checks import one_body_each as bodies_of
from flight.link.link import Link, Pose
from flight.link.phases import Part, Stage
from flight.monitoring.thresholds import FRESH, HEADING, SHARE, WATCHED, limits


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
    found += one_body_each(link, seen)
    if frame := _frame(first, team):
        found = [check for check in found if check.passed is not False or check.name not in ("place", "heading")]
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
    found: list[Check] = []
    for robot in seen:
        if robot not in link.robots:
            sentence = f"{robot} does not answer: switch it on, and look at its address and channel"
            found.append(Check("reached", robot, False, sentence))
            continue
        health, board = link.health(robot), link.parameters(robot)
        wrong = [f"{key} is {board.get(key)}, not {value:g}" for key, value in ((wanted or {}).get(robot) or {}).items()
                 if key not in board or not math.isclose(board[key], value, rel_tol=1e-5, abs_tol=1e-9)]  # fmt: skip
        differs = f"{robot}: {'; '.join(wrong)}: set them again, and look whether the firmware has them" if wrong else ""
        known = Known(seen[robot], health.ready, health.settled, health.endurance, differs, why=health.why)
        found += checks_of(robot, known, _asked(robot, first, lasts), limits(link.accuracy), link.now())
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
            asked, numbers = _asked(robot, stage, 0.0), limits(link.accuracy)
            found.append(at_place(robot, pose.position, asked, numbers))
            if pose.heading is not None:
                found.append(heading_of(robot, pose.heading, asked.heading, numbers))
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


def _asked(robot: str, stage: Stage | Part, lasts: float) -> Asked:
    """Return what a stage asks of a robot that begins it; all is to take so many s."""
    rows = {name: path.evaluate(0.0).tolist() for name, path in stage.paths.items()}
    places: dict[str, Place] = {name: (row[0], row[1], row[2]) for name, row in rows.items()}
    return Asked(places, f"where the {stage.name} begins", rows[robot][3], stage.margin, lasts)


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


def one_body_each(link: Link, seen: Mapping[str, Sequence[Pose]]) -> list[Check]:
    """Refuse two robots that are measured at one place: one body is taken for both.

    Args:
        link: To the robots.
        seen: Poses of each, in order of time.
    """
    return bodies_of({robot: poses[-1].position for robot, poses in seen.items() if poses}, limits(link.accuracy))
