"""How a flight with crazyswarm2 ends: all hold where something is wrong and all are seen, then land, told until they sink."""

from __future__ import annotations

import math

from flying.stages import Flight

STEP = 0.02  # s between two looks
AGAIN = 0.1  # s after which a landing is told again
NEAR = 0.1  # m above where a landing ends, at which a robot is down
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
    """Land all straight down, and stop their motors; return who is not measured to be down.

    Args:
        flight: What flies.
    """
    swarm, limits = flight.swarm, flight.team.limits
    flight.enter("landing")
    flight.record.event(swarm.now(), "all robots land", "reaction")
    grounds = {name: flight.ground(name) for name in flight.team.names}
    targets = {name: ground + limits["landing_height"] for name, ground in grounds.items()}
    marks = {name: _height(flight, name) for name in targets}
    drop = max((mark if math.isfinite(mark) else targets[name] + 2.0) - targets[name] for name, mark in marks.items())
    seconds = max(1.0, drop / limits["landing_speed"])

    def tell(names: list[str]) -> None:
        for name in names:
            swarm.robots[name].land(targetHeight=targets[name], duration=seconds)

    for _ in range(3):
        tell(list(targets))
        swarm.sleep(AGAIN)
        flight.look(None)
    told = swarm.now()
    end = told + seconds + limits["patience"]
    while swarm.now() < end and (up := _up(flight, targets)):
        swarm.sleep(STEP)
        flight.look(None)
        if swarm.now() - told > 1.0:
            tell([name for name in up if not _height(flight, name) < marks[name] - SINK])
            told, marks = swarm.now(), {name: _height(flight, name) for name in targets}
    swarm.disarm()
    flight.record.ended("landing", swarm.now())
    up = _up(flight, targets)
    if up:
        flight.record.event(swarm.now(), f"{', '.join(up)} is not measured to be down: watch it", "reaction")
    if any(_height(flight, name) > grounds[name] + HIGH for name in up):
        flight.record.event(swarm.now(), "motors are stopped by an emergency stop: switch vehicles off and on", "reaction")
        swarm.emergency()
    return up


def _height(flight: Flight, name: str) -> float:
    """Return how high a robot was measured last, m; infinite where it never was."""
    pose = flight.swarm.pose(name)
    return math.inf if pose is None else pose.place[2]


def _up(flight: Flight, targets: dict[str, float]) -> list[str]:
    return [name for name, target in targets.items() if not _height(flight, name) <= target + NEAR]
