"""How a flight with crazyswarm2 ends: all hold where something is wrong and all are seen, then land, told until they sink, and are disarmed where they stand."""

from __future__ import annotations

import math

from flying.stages import Flight
from flying.standing import Standing
from flying.supervisor import flying

STEP = 0.02  # s between two looks
AGAIN = 0.1  # s after which a landing is told again
HIGH = 0.3  # m above the ground, from which on motors are stopped by an emergency stop
SINK = 0.05  # m by which a robot sinks within a second of being told to land


def hold(flight: Flight) -> None:
    """Have all brake to a hover, while all are seen; who lands already goes on landing.

    Args:
        flight: What flies.
    """
    swarm, limits = flight.swarm, flight.team.limits
    if flight.stage == "landing":
        return
    poses = {name: pose for name in flight.team.names if (pose := swarm.pose(name)) is not None}
    if len(poses) < len(flight.team.names) or any(swarm.now() - pose.time > limits["fresh"] for pose in poses.values()):
        return
    flight.record.event(swarm.now(), "all robots hold where they can stop", "reaction")
    flight.brake(poses)
    end = swarm.now() + limits["braking"] + limits["holding"]
    while swarm.now() < end:
        swarm.sleep(STEP)
        flight.look(None)


def land(flight: Flight) -> list[str]:
    """Land all straight down, and disarm those that stand; return who is not known to stand.

    A robot that does not stand in time is disarmed all the same where it is low, and gets an emergency stop where it is not: it does not do
    what it is told.

    Args:
        flight: What flies.
    """
    swarm, limits = flight.swarm, flight.team.limits
    flight.enter("landing")
    flight.record.event(swarm.now(), "all robots land", "reaction")
    grounds = {name: flight.ground(name) for name in flight.team.names}
    targets = {name: ground + limits["landing_height"] for name, ground in grounds.items()}
    flight.standing = flight.standing or Standing(targets, limits)  # a robot that stands is told nothing more: it would rise
    standing = flight.standing
    marks = {name: _height(flight, name) for name in targets}
    drop = max((mark if math.isfinite(mark) else targets[name] + 2.0) - targets[name] for name, mark in marks.items())
    seconds = max(1.0, drop / limits["landing_speed"])
    standing.land(swarm.now() + seconds)

    def tell(names: list[str]) -> None:
        for name in names:
            swarm.robots[name].land(targetHeight=targets[name], duration=seconds)

    for _ in range(3):
        tell(standing.flying(list(targets)))
        swarm.sleep(AGAIN)
        _look(flight, standing)
    told = swarm.now()
    end = told + seconds + limits["landed"]
    while swarm.now() < end and (up := standing.flying(list(targets))):
        swarm.sleep(STEP)
        _look(flight, standing)
        if swarm.now() - told > 1.0:
            high = [name for name in up if not _height(flight, name) <= targets[name] + limits["near"]]
            tell([name for name in high if not _height(flight, name) < marks[name] - SINK])
            told, marks = swarm.now(), {name: _height(flight, name) for name in targets}
    up = standing.flying(list(targets))
    high = [name for name in up if not _height(flight, name) <= grounds[name] + HIGH]
    swarm.disarm([name for name in targets if name not in high])
    flight.record.ended("landing", swarm.now())
    if up:
        flight.record.event(swarm.now(), f"{', '.join(up)} is not known to stand: watch it", "reaction")
    if high:
        flight.record.event(swarm.now(), "motors are stopped by an emergency stop: switch vehicles off and on", "reaction")
        swarm.emergency()
    return up


def _look(flight: Flight, standing: Standing) -> None:
    """Take in where robots are, and what they say."""
    flight.look(None)
    for name in flight.team.names:
        if (pose := flight.swarm.pose(name)) is not None:
            standing.see(name, pose.time, pose.position[2], flying(flight.swarm.state(name)))


def _height(flight: Flight, name: str) -> float:
    """Return how high a robot was measured last, m; infinite where it never was."""
    pose = flight.swarm.pose(name)
    return math.inf if pose is None else pose.position[2]
