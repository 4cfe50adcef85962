"""Steps of tests that fly exported scripts for crazyswarm2, and looks at how such a flight ended."""

from __future__ import annotations

import json

import numpy as np

from tests.helpers.vehicles.crazyswarm_peer import World

BALL = "a: {center: [1.5, 0.0, 0.6], radii: [0.2, 0.2, 0.2]}"


def begun(world: World) -> bool:
    return "startTrajectory" in world.commands("all")


def on_the_ground(world: World) -> bool:
    return not any(command in ("arm", "takeoff", "goTo") for _, command in world.told)


ACCEPTED = ["--unchecked", "battery"]  # the shipped Crazyflies have no endurance


def all_off(world: World) -> bool:
    """Whether motors stand still, and nobody's were cut in the air."""
    return not any(robot.spinning for robot in world.robots.values()) and not world.armed and not world.fell


def once(world: World, after: str, do, later: float = 0.3) -> None:
    """Have something happen once, some time after a command was told."""
    since: list[float] = []

    def at(now: float) -> None:
        if not since and any(command == after for _, command in world.told):
            since.append(now + later)
        if since and since[0] <= now:
            since[0] = np.inf
            do()

    world.at = at


def interrupt(error: type[BaseException] = KeyboardInterrupt):
    def do() -> None:
        raise error

    return do


def kept(script) -> dict:
    (folder,) = script.FOLDER.glob("flown-*")
    return json.loads((folder / "live.json").read_text())
