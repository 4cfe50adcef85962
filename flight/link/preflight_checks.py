"""Checks before anything spins, over a link: the list that exported scripts go by, too."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from flight.exports.scripts.flying.checks import Asked, Check, Known, Place, checks_of_team
from flight.exports.scripts.flying.starts import at_start as start_of
from flight.exports.scripts.flying.starts import margin_fault, start_fault
from flight.link.link import Link, Pose
from flight.link.phases import Part, Stage
from flight.monitoring.thresholds import WATCHED, limits


def before_take_off(
    link: Link,
    first: Stage,
    lasts: float,
    standing: Part | None = None,
) -> tuple[Check, ...]:
    """Look at every robot for half a second, and say what keeps it from flying.

    Args:
        link: To the robots.
        first: What is flown first; it begins where they stand.
        lasts: s that all is to take.
        standing: Where other robots stand that wait on the ground; None where there are none.

    Returns:
        All checks, passed or not.
    """
    begins = dict.fromkeys(first.paths, first) | ({} if standing is None else dict.fromkeys(standing.paths, standing))
    seen = _watched(link, tuple(begins))
    margin = margin_fault(first.margin, limits(link.accuracy))
    found = [Check("margin", next(iter(begins)), False, margin)] if margin else []
    return (*found, *on_ground(link, begins, lasts, seen))


def on_ground(
    link: Link,
    begins: Mapping[str, Stage | Part],
    lasts: float,
    seen: Mapping[str, Sequence[Pose]],
) -> list[Check]:
    """Say what keeps robots that stand on the ground, and were looked at for a while, from flying.

    Args:
        link: To the robots.
        begins: What each of them flies first; it begins where they stand.
        lasts: s that all is to take.
        seen: Poses of each.

    Returns:
        All checks, passed or not.
    """
    found = [
        Check("reached", robot, False, f"{robot} does not answer: switch it on, and look at its address and channel")
        for robot in begins
        if robot not in link.robots
    ]
    # parameters on board were set and read back when the robots were reached
    known = {robot: Known(seen[robot], link.health(robot), "") for robot in begins if robot in link.robots}
    asked = {robot: _asked(robot, begins[robot], lasts) for robot in known}
    return found + checks_of_team(known, asked, limits(link.accuracy), link.now())


def proved_starts(link: Link, stages: Sequence[Stage]) -> list[Check]:
    """Refuse stages whose proof of tracking lets robots begin no farther off than a measurement may be.

    Args:
        link: To the robots.
        stages: What is flown.
    """
    return [
        Check("margin", next(iter(stage.paths)), False, fault)
        for stage in stages
        if (fault := start_fault(stage.start, f"the {stage.name}", limits(link.accuracy)))
    ]


def at_start(link: Link, stage: Stage | Part) -> tuple[Check, ...]:
    """Look whether every robot hovers where a stage, or a part of one, begins: within what a proof of tracking assumes, where there is one.

    Args:
        link: To the robots.
        stage: What is to be flown next.
    """
    numbers, now = limits(link.accuracy), link.now()
    return tuple(
        check for robot in stage.paths for check in start_of(robot, link.pose(robot), _asked(robot, stage, 0.0), numbers, now)
    )


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
    return Asked(
        places, f"where the {stage.name} begins", rows[robot][3], stage.margin, lasts, start=stage.start, rest=stage.rest
    )
