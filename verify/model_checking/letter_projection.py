"""Projection of robots to one conjunct: of their letters the propositions that it names, and of robots with constant letters one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from verify.data.language.word import Letter
from verify.logic.team_letters import TeamLetters
from verify.model_checking.robot_letters import RobotBehaviour, merged
from verify.model_checking.timeline import Timeline


def marked(name: str, robot: RobotBehaviour, letters: TeamLetters) -> RobotBehaviour:
    """Return a robot with what a conjunct sees of its letters, nodes joined between which it sees no change.

    Args:
        name: The robot's.
        robot: What it may do.
        letters: What the conjunct sees.
    """
    seen = tuple(letters.own(name, letter) for letter in robot.letters)
    if len(set(seen)) == 1:  # whatever it does, it shows one thing
        span = robot.spans[0][0], max(high for _, high in robot.spans)
        return RobotBehaviour(name, seen[:1], (span,), ((),), (0,), frozenset({0}), actions=(0,))
    return merged(replace(robot, letters=seen, actions=(0,) * len(robot)))


def seen_of(robot: RobotBehaviour, letters: TeamLetters) -> RobotBehaviour:
    """Return a robot that flies laps with what a conjunct sees of its letters.

    Args:
        robot: What it may do.
        letters: What the conjunct sees.
    """
    seen = tuple(letters.own(robot.robot, letter) for letter in robot.letters)
    return merged(replace(robot, letters=seen, actions=(0,) * len(robot)))


def that_show(robots: Sequence[RobotBehaviour], names: frozenset[str]) -> list[RobotBehaviour]:
    """Keep the robots of a union that can show one of some names, one at least.

    Who shows none of them adds nothing to a union, and its times bind nobody. What it shows besides is left out.

    Args:
        robots: At least one.
        names: Of a conjunct.
    """
    letters = [tuple(letter & names for letter in robot.letters) for robot in robots]
    return [
        merged(replace(robot, letters=seen, actions=(0,) * len(robot)))
        for robot, seen in zip(robots, letters, strict=True)
        if any(seen)
    ] or [replace(robots[0], letters=letters[0])]


def without_equals(robots: Sequence[RobotBehaviour]) -> list[RobotBehaviour]:
    """Keep one of the robots that show one and the same letter all the time (formulas without X cannot tell)."""
    seen: set[Letter] = set()
    kept: list[RobotBehaviour] = []
    for robot in robots:
        if robot.constant:
            if robot.letters[0] in seen:
                continue
            seen.add(robot.letters[0])
        kept.append(robot)
    return kept


def shown(timeline: Timeline) -> frozenset[str]:
    """Return all names that a robot may show at some time."""
    regions = {region for region, status in timeline.initial.items() if status != "no"}
    regions.update(change.region for change in timeline.changes)
    return timeline.internal.union(regions, *(action.propositions for action in timeline.actions))
