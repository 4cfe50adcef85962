"""Preflight checks with crazyswarm2, before any motor spins."""

from __future__ import annotations

from flying.checks import Check, Known, Place, Pose, checks_of_team
from flying.crazyswarm import Swarm
from flying.watch import Refused, Team

STEP = 0.02  # s between two looks
LISTEN = 5.0  # s that first positions are waited for
SELDOM = 1.1  # s in which the battery is reported once at least


def require_certified(team: Team, *, hovering: bool, landing: bool) -> None:
    """Refuse to climb or land straight where that is not proved.

    Args:
        team: Who flies.
        hovering: Whether robots hover at their starts already.
        landing: Whether a landing that is not certified is watched by somebody.

    Raises:
        Refused: As said.
    """
    climb, land = team.data["climb"], team.data["landing"]
    if climb and not hovering:
        raise Refused(f"climb not certified: {climb}; bring robots to hover at their starts, and add --hovering")
    if land and not landing:
        raise Refused(f"landing not certified: {land}; add --watch-landing to land straight down all the same, and watch it")


def checked(team: Team, swarm: Swarm, *, hovering: bool) -> tuple[list[Check], dict[str, float]]:
    """Look at every robot; return all checks, passed or not, and how high the ground below each is, m.

    Args:
        team: Who flies.
        swarm: The robots.
        hovering: Whether they hover at their starts already.

    Raises:
        Refused: Somebody is not measured at all, or two have one address.
    """
    uris = [robot.uri for robot in swarm.robots.values() if hasattr(robot, "uri")]
    if len(set(uris)) < len(uris):
        raise Refused("two robots have one address: look at crazyflies.yaml")
    poses, now = watched(team, swarm), swarm.now()
    starts: dict[str, Place] = {name: tuple(row["start"][:3]) for name, row in team.data["robots"].items()}
    grounds, wrong = dict.fromkeys(team.names, 0.0), swarm.set_parameters()
    where = "its start" if hovering else "below its start"
    asked = {name: team.asked(name, starts, where, above=not hovering) for name in team.names}
    known = {name: Known(poses[name], swarm.health(name), wrong.get(name), swarm.dated) for name in team.names}
    found = checks_of_team(known, asked, team.limits, now)
    for name in team.names:
        found += swarm.voltage(name)
        if poses[name] and not hovering:
            z = sum(pose.position[2] for pose in poses[name]) / len(poses[name])
            grounds[name] = max(z, 0.0)
            on_it = -team.limits["share"] * team.margin <= z < starts[name][2]
            sentence = f"{name} stands at z = {z:.3f} m: the ground is at z = 0, and its start at {starts[name][2]:.3f} m"
            found.append(Check("ground", name, on_it, sentence))
    return found, grounds


def watched(team: Team, swarm: Swarm) -> dict[str, list[Pose]]:
    """Return what is measured of each robot for a moment, once all are seen.

    Args:
        team: Who flies.
        swarm: The robots.

    Raises:
        Refused: Somebody is not measured.
    """
    begin, first = swarm.now(), {name: swarm.pose(name) for name in team.names}
    waits = set(team.names) if swarm.dated else set[str]()
    while waits and swarm.now() - begin < LISTEN:
        swarm.sleep(STEP)
        waits = {name for name in waits if swarm.pose(name) == first[name]}
    if waits:
        silent = ", ".join(name for name in team.names if name in waits)
        raise Refused(
            f"no position from {silent} within {LISTEN:g} s: is it seen by motion capture under its name{swarm.hint}?"
        )
    swarm.sleep(SELDOM)
    seen: dict[str, list[Pose]] = {name: [] for name in team.names}
    end = swarm.now() + team.limits["watched"]
    while swarm.now() < end:
        swarm.sleep(STEP)
        for name, row in seen.items():
            pose = swarm.pose(name)
            if pose is not None and (not row or pose.time > row[-1].time):
                row.append(pose)
    return seen
