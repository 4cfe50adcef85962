"""Jumps where pieces meet, where the flight begins and where it ends, bounded in position to jerk and in heading."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from verify.arithmetic.balls import Floats
from verify.motion.paths import TeamPaths

JUMPS = (1e-4, 1e-3, 1e-2, 1e-1)
"""Greatest jumps allowed in position (m), velocity (m/s), acceleration (m/s^2) and jerk (m/s^3): what float32
coefficients leave, with room, and far less than a controller notices. The heading's are the same numbers in rad."""

QUANTITIES = ("position", "velocity", "acceleration", "jerk")
HEADINGS = ("heading", "heading's rate", "heading's acceleration")


@dataclass(frozen=True, slots=True)
class Jump:
    """The greatest jump of one robot, as a share of what is allowed.

    Attributes:
        robot: Name.
        share: Proved upper bound on jump / allowed.
        sure: Proved to be at least this share.
        time: When, in s.
        what: Which quantity jumps, and where.
        size: Upper bound on the jump, in its own unit.
        allowed: What is allowed.
    """

    robot: str
    share: float
    sure: float
    time: Fraction
    what: str
    size: float
    allowed: float


@np.errstate(all="ignore")
def jumps(paths: TeamPaths, *, ends: bool = True, seams: Collection[int] = ()) -> list[Jump]:
    """Bound every jump of every robot, the seam of a cycle included; laps of a team begin and end at rest.

    Args:
        paths: The team.
        ends: Whether the hovers before the start and after the end count as pieces; without them only joints are checked.
        seams: Pieces with which laps begin anew that are written one after another: there headings may turn fully, as at a cycle's seam.
    """
    derivatives = [paths.derivative(order) for order in range(4)]
    result: list[Jump] = []
    together = len(paths.robots) > 1  # laps of a team begin and end at rest
    offset = 0
    for robot, name in enumerate(paths.robots):
        trajectory = paths.trajectories[robot]
        count = len(trajectory)
        rows = slice(offset, offset + count)
        offset += count
        agent = paths.mission.agents[name]
        jumps: list[Jump] = []
        for order in range(4):
            part = derivatives[order]
            first, last = part[rows][..., 0], part[rows][..., -1]
            before, before_error = last.mid, last.rad
            after, after_error = first.mid, first.rad
            rest = np.zeros((1, 4))
            if order == 0:
                start = np.array([[*agent.start, agent.yaw]])
                goal = before[-1:].copy()
                if agent.end is not None:
                    goal[0, :3] = agent.end
            else:
                start, goal = rest, rest
            goal_error = np.zeros((1, 4)) if order else before_error[-1:]
            cycle = trajectory.cycle
            if cycle is not None and (order == 0 or not together):
                goal, goal_error = after[cycle][None], after_error[cycle][None]
            left, left_error = np.concatenate([start, before]), np.concatenate([np.zeros((1, 4)), before_error])
            right, right_error = np.concatenate([after, goal]), np.concatenate([after_error, goal_error])
            gap = np.abs(right - left)
            if order == 0:  # a heading may be written with full turns more, and turn them in a lap
                for joint in (0, *seams, -1):
                    gap[joint, 3] = _modulo_turns(float(gap[joint, 3]))
            error = (left_error + right_error + 1e-15 * (np.abs(left) + np.abs(right))) * (1 + 2.0**-40) + 1e-290
            if not ends:
                open_ends = [0] if trajectory.cycle is not None else [0, -1]
                gap[open_ends], error[open_ends] = 0.0, 0.0
            jumps += _jumps(name, paths.knots[robot], order, gap, error)
            if cycle is not None and together and order:
                begins = np.abs(after[cycle])[None], after_error[cycle][None] * (1 + 2.0**-40) + 1e-290
                jumps += _jumps(name, (paths.knots[robot][cycle],), order, *begins, where="where a lap begins")
        result.append(max(jumps, key=lambda jump: jump.share))
    return result


def _jumps(name: str, knots: tuple[Fraction, ...], order: int, gap: Floats, error: Floats, where: str = "") -> Iterator[Jump]:
    """Yield the largest jump of a derivative at some joints, of position and of heading."""
    allowed = JUMPS[order]
    sizes = [(np.sqrt(((gap[:, :3] + error[:, :3]) ** 2).sum(1)) * (1 + 2.0**-40), (gap[:, :3] - error[:, :3]).max(1))]
    labels = [QUANTITIES[order]]
    if order < len(HEADINGS):
        sizes.append((gap[:, 3] + error[:, 3], gap[:, 3] - error[:, 3]))
        labels.append(HEADINGS[order])
    for (high, low), label in zip(sizes, labels, strict=True):
        high = np.where(np.isnan(high), np.inf, high)
        at = int(np.argmax(high))
        share, sure = float(np.nextafter(high[at] / allowed, np.inf)), float(np.nextafter(low[at] / allowed, -np.inf))
        place = where or _named(at, len(high) - 1)
        yield Jump(name, share, sure, knots[at], f"{label} {place}", float(high[at]), allowed)


def _named(joint: int, last: int) -> str:
    return "at the start" if joint == 0 else "at the end" if joint == last else f"between pieces {joint - 1} and {joint}"


def _modulo_turns(angle: float) -> float:
    if not abs(angle) < 1e6:
        return angle
    turns = round(angle / (2 * np.pi))
    return abs(angle - turns * 2 * np.pi)
