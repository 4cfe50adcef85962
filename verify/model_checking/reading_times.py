"""Robots and times at which a counterexample's letters are read: for its readers; no verdict depends on it."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from verify.logic.verdict import TEAM
from verify.model_checking.robot_letters import RobotBehaviour
from verify.model_checking.team_graph import Observation


def all_read(
    robots: Sequence[RobotBehaviour], followed: Sequence[RobotBehaviour], observations: Sequence[Observation]
) -> list[tuple[str, Observation]]:
    """Name who is read; those of which one stood for all are read right after it.

    Args:
        robots: All of the team.
        followed: Those that were followed, by whose indices observations name them.
        observations: A counterexample's letters, in order.
    """
    read: list[tuple[str, Observation]] = []
    waiting = [robot for robot in robots if robot.constant and robot not in followed]
    for observation in observations:
        if observation.robot is None:
            read.append((TEAM, observation))
            continue
        read.append((followed[observation.robot].robot, observation))
        if followed[observation.robot].constant:
            read += [(robot.robot, observation) for robot in waiting if robot.letters[0] == observation.letter]
            waiting = [robot for robot in waiting if robot.letters[0] != observation.letter]
    return read


def when_read(robots: Sequence[RobotBehaviour], observations: Sequence[Observation]) -> list[tuple[Fraction, Fraction]]:
    """Return the times, in s, at which each reading can be made: while its letters can be held, and after the readings before it."""
    held = [held_times(robot) for robot in robots]
    found: list[tuple[Fraction, Fraction]] = []
    for observation in observations:
        readers = range(len(robots)) if observation.robot is None else (observation.robot,)
        spans = [held[r][observation.nodes[r]] for r in readers]
        low, high = max(low for low, _ in spans), min(high for _, high in spans)
        if low > high:  # with clock errors the spans only nearly meet
            low, high = high, low
        low = low if not found else min(max(low, found[-1][0]), high)
        found.append((low, high))
    for index in range(len(found) - 2, -1, -1):
        low, high = found[index]
        found[index] = low, max(low, min(high, found[index + 1][1]))
    return found


def held_times(robot: RobotBehaviour) -> list[tuple[Fraction, Fraction]]:
    """Return for each node from when until when, in s, its letter can be held without a change."""
    before: list[list[int]] = [[] for _ in robot.letters]
    after: list[list[int]] = [[] for _ in robot.letters]
    for node, targets in enumerate(robot.following):
        for target in targets:
            if robot.letters[node] == robot.letters[target] and (node, target) not in robot.laps:
                before[target].append(node)
                after[node].append(target)
    order = sorted(range(len(robot)), key=lambda node: (robot.spans[node], node))
    low, high = [span[0] for span in robot.spans], [span[1] for span in robot.spans]
    for node in order:
        low[node] = min([low[node], *(low[other] for other in before[node])])
    for node in reversed(order):
        high[node] = max([high[node], *(high[other] for other in after[node])])
    return list(zip(low, high, strict=True))


def when(span: tuple[Fraction, Fraction]) -> str:
    """Return a span of time in words, in s."""
    low, high = float(span[0]), float(span[1])
    return f"{low:.3f} s" if f"{low:.3f}" == f"{high:.3f}" else f"{low:.3f} to {high:.3f} s"
