"""Safe termination of a live flight where something is wrong: the whole team holds, lands and stops, repeated until it has acknowledged that.

Hold while all are seen, then land straight down; stop motors where robots stand, where a robot is told to land and does not answer, or on a
second explicit command. Who is neither heard nor answers is told to land once more, and never to stop: that would reach it in the air, where it is
heard again. What nobody answers to is said, with what acts on board then.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping, Sequence

from flight.exports.scripts.flying.standing import Standing
from flight.link.link import Link
from flight.link.record import Record
from flight.monitoring.alarm_response import LANDING_HEIGHT, LANDING_SPEED
from flight.monitoring.thresholds import FRESH, HOLDING, LANDED, PATIENCE, limits

AGAIN = 0.1
"""s after which a command that was not acknowledged is sent again."""
STEP = 0.02
"""s between two looks at robots that land."""
_TRIES = 10
"""How often a flight's end may be interrupted before it is given up, and all robots are named."""


def told(
    link: Link, robots: Sequence[str], command: Callable[[str], bool], record: Record, patience: float = PATIENCE
) -> list[str]:
    """Repeat a command to robots until each has acknowledged it; return those that have not.

    Args:
        link: To them.
        robots: Whom.
        command: Sends it to one; whether that has acknowledged it.
        record: Takes in where they are measured meanwhile.
        patience: s.
    """
    end, left = link.now() + patience, list(robots)
    while True:
        left = [robot for robot in left if not command(robot)]
        record.see(link, robots)
        if not left or link.now() >= end:
            return left
        link.sleep(AGAIN)


def end_safely(
    link: Link, robots: Sequence[str], grounds: dict[str, float], record: Record, grounded: Sequence[str] = ()
) -> list[str]:
    """Bring robots that fly to the ground; return those that are not known to be there with their motors off.

    Args:
        link: To them.
        robots: Whose motors were started.
        grounds: z in m of the ground below each.
        record: Takes in what is done.
        grounded: Robots that stand on the ground with motors that may turn.
    """
    if not robots:
        return []
    try:
        if all(_fresh(link, robot) for robot in robots):
            record.note(link.now(), "all robots hold where they can stop.", kind="reaction")
            if not told(link, robots, link.hold, record):
                end = link.now() + HOLDING
                while link.now() < end:
                    _wait(link, robots, record)
        left = land(link, robots, grounds, record)
        left += _stopped(link, grounded, record)
    except BaseException as error:  # a second Ctrl-C, or the link itself
        record.note(link.now(), f"interrupted again ({type(error).__name__}): motors stop.", kind="reaction")
        left = insisted(lambda: _stopped(link, (*robots, *grounded), record), (*robots, *grounded))
    for robot in left:
        record.note(link.now(), f"{robot} has not acknowledged: {link.failsafe}.", robot, "reaction")
    return left


def insisted(end: Callable[[], list[str]], robots: Sequence[str]) -> list[str]:
    """Do what ends a flight, again where something comes between; return the robots that are not known to be on the ground.

    Args:
        end: Does it, and returns such robots.
        robots: All of them.
    """
    for _ in range(_TRIES):
        with contextlib.suppress(BaseException):  # one more Ctrl-C, or the link itself
            return end()
    return list(robots)


def set_down(
    link: Link, robots: Sequence[str], grounds: Mapping[str, float], record: Record, grounded: Sequence[str] = ()
) -> list[str]:
    """Set all down after the last stage, which ends just above the ground, and stop motors where they stand; return those that have not acknowledged it.

    Args:
        link: To them.
        robots: Whom.
        grounds: z in m of the ground below each.
        record: Takes in what is done.
        grounded: Robots that stand on the ground with motors that may turn.
    """
    targets = {robot: grounds[robot] + LANDING_HEIGHT for robot in robots}
    silent = list(robots)  # who lands is told so once: a robot that stands would rise to land again

    def down() -> list[str]:
        silent[:] = told(link, silent, lambda robot: link.land(robot, targets[robot], 1.0), record)
        wait_until_down(link, {robot: target for robot, target in targets.items() if robot not in silent}, 1.0, record)
        return told(link, (*robots, *grounded), link.stop, record, 3 * PATIENCE)

    left = insisted(down, (*robots, *grounded))
    for robot in left:
        record.note(link.now(), f"{robot} has not acknowledged that its motors stop: {link.failsafe}.", robot, "reaction")
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

    def landing(robot: str) -> bool:
        return link.land(robot, targets[robot], seconds)

    def down(these: Sequence[str]) -> None:
        wait_until_down(link, {robot: targets[robot] for robot in these}, seconds, record)

    silent = told(link, robots, landing, record)
    down([robot for robot in robots if robot not in silent])
    lost = [robot for robot in silent if not _fresh(link, robot)]
    left = _stopped(link, [robot for robot in robots if robot not in lost], record)
    silent = told(link, lost, landing, record)  # not to stop: that would drop them where they are heard again
    back = [robot for robot in lost if robot not in silent]
    down(back)
    return [*left, *silent, *_stopped(link, back, record)]


def wait_until_down(link: Link, targets: Mapping[str, float], seconds: float, record: Record) -> None:
    """Wait until robots that land stand; for `LANDED` s behind their landing's end at most, as who does not stand by then does not do what it is told.

    Args:
        link: To them.
        targets: z in m where each one's landing ends.
        seconds: How long the landing takes.
        record: Takes in where they are.
    """
    standing, end = Standing(targets, limits(link.accuracy)), link.now() + seconds + LANDED
    standing.land(link.now() + seconds)
    while link.now() < end:
        for robot in targets:
            see_down(link, standing, robot)
        if not standing.flying(list(targets)):
            return
        link.sleep(STEP)
        record.see(link, list(targets))


def see_down(link: Link, standing: Standing, robot: str) -> bool:
    """Look at a robot that lands; return whether it stands.

    Args:
        link: To it.
        standing: Knows what was seen before.
        robot: Its name.
    """
    pose = link.pose(robot)
    if pose is not None:
        standing.see(robot, pose.time, pose.position[2], link.health(robot).flying)
    return standing.stands(robot)


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
    left = told(link, robots, link.stop, record)
    if stopped := [robot for robot in robots if robot not in left]:
        record.note(link.now(), f"the motors of {', '.join(stopped)} are stopped.", kind="reaction")
    return left


def _wait(link: Link, robots: Sequence[str], record: Record) -> None:
    """Let a moment pass, and take in where robots are."""
    link.sleep(AGAIN)
    record.see(link, robots)


def _fresh(link: Link, robot: str) -> bool:
    pose = link.pose(robot)
    return pose is not None and link.now() - pose.time <= FRESH
