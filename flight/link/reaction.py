"""How a live flight ends where something is wrong: the whole team holds, lands and stops, told until it has acknowledged that.

Hold while all are seen, then land straight down; stop motors near the ground, where a robot is told to land and does not answer, or on a
second explicit command. What nobody answers to is said, with what acts on board then.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from flight.link.link import Link
from flight.link.record import Record
from flight.monitoring.reaction import LANDING_HEIGHT, LANDING_SPEED
from flight.monitoring.thresholds import FRESH, HOLDING, PATIENCE

AGAIN = 0.1
"""s after which a command that was not acknowledged is sent again."""
_NEAR = 0.1
"""m above where its landing ends, at which a robot's motors may stop."""


def told(link: Link, robots: Sequence[str], command: Callable[[str], bool], patience: float = PATIENCE) -> list[str]:
    """Repeat a command to robots until each has acknowledged it; return those that have not.

    Args:
        link: To them.
        robots: Whom.
        command: Sends it to one; whether that has acknowledged it.
        patience: s.
    """
    end, left = link.now() + patience, list(robots)
    while True:
        left = [robot for robot in left if not command(robot)]
        if not left or link.now() >= end:
            return left
        link.sleep(AGAIN)


def end_safely(link: Link, robots: Sequence[str], grounds: dict[str, float], record: Record) -> list[str]:
    """Bring robots that fly to the ground; return those that are not known to be there.

    Args:
        link: To them.
        robots: Whose motors were started.
        grounds: z in m of the ground below each.
        record: Takes in what is done.
    """
    if not robots:
        return []
    try:
        if all(_fresh(link, robot) for robot in robots):
            record.note(link.now(), "all robots hold where they can stop.", kind="reaction")
            if not told(link, robots, link.hold):
                link.sleep(HOLDING)
        left = land(link, robots, grounds, record)
    except BaseException as error:  # a second Ctrl-C, or the link itself
        record.note(link.now(), f"interrupted again ({type(error).__name__}): motors stop.", kind="reaction")
        left = _stopped(link, robots, record)
    for robot in left:
        record.note(link.now(), f"{robot} has not acknowledged: {link.failsafe}.", robot, "reaction")
    return left


def land(link: Link, robots: Sequence[str], grounds: dict[str, float], record: Record) -> list[str]:
    """Land robots straight down and stop their motors; return those that have not acknowledged it.

    Args:
        link: To them.
        robots: Whom.
        grounds: z in m of the ground below each.
        record: Takes in what is done.
    """
    record.note(link.now(), "all robots land.", kind="reaction")
    targets = {robot: grounds[robot] + LANDING_HEIGHT for robot in robots}
    seconds = time_to_land(link, targets)
    left = told(link, robots, lambda robot: link.land(robot, targets[robot], seconds))
    end = link.now() + seconds + PATIENCE
    while link.now() < end and not all(_down(link, robot, targets[robot]) for robot in robots if robot not in left):
        link.sleep(AGAIN)
    return _stopped(link, robots, record)


def time_to_land(link: Link, targets: Mapping[str, float]) -> float:
    """Return how long robots take that sink together, s.

    Args:
        link: To them; who is not seen is taken to be 2 m up.
        targets: z in m where each one's landing ends.
    """
    heights = {robot: pose.position[2] for robot in targets if (pose := link.pose(robot)) is not None}
    drop = max((heights.get(robot, target + 2.0) - target for robot, target in targets.items()), default=0.0)
    return max(1.0, drop / LANDING_SPEED)


def _stopped(link: Link, robots: Sequence[str], record: Record) -> list[str]:
    left = told(link, robots, link.stop)
    if stopped := [robot for robot in robots if robot not in left]:
        record.note(link.now(), f"the motors of {', '.join(stopped)} are stopped.", kind="reaction")
    return left


def _fresh(link: Link, robot: str) -> bool:
    pose = link.pose(robot)
    return pose is not None and link.now() - pose.time <= FRESH


def _down(link: Link, robot: str, target: float) -> bool:
    pose = link.pose(robot)
    return pose is not None and pose.position[2] <= target + _NEAR
