"""Starts of flights, for live links and exported scripts: how near robots have to be, and how still. Standard library only; copied into exports."""

from __future__ import annotations

from collections.abc import Mapping

from .checks import Asked, Check, Pose, at_place, heading_of

_UNITS = {"speed": "m/s", "tilt": "rad", "turn": "rad/s"}


def margin_fault(margin: float, limits: Mapping[str, float]) -> str:
    """Return that measurements use a margin up, so that nobody could begin; empty where they do not.

    Args:
        margin: delta, m.
        limits: The numbers.
    """
    accuracy, left = limits["accuracy"], 1.0 - limits["share"]
    if left * margin > accuracy:
        return ""
    return (
        f"the margin is {margin:g} m, and a measurement may be off by {accuracy:.3g} m: a margin above {accuracy / left:.3g} m leaves robots room "
        "to begin in"
    )


def start_fault(start: float | None, where: str, limits: Mapping[str, float]) -> str:
    """Return that nobody can be measured to be as near to a start as the proof of tracking assumes; empty where they can.

    Args:
        start: m from the start at which it lets robots begin; None where nothing is proved.
        where: What begins there.
        limits: The numbers.
    """
    if start is None or start > limits["accuracy"]:
        return ""
    return (
        f"the proof of tracking lets robots begin {start:g} m from where {where} begins, and a measurement may be off by {limits['accuracy']:.3g} m: "
        "state a greater `disturbance.start`"
    )


def at_start(robot: str, pose: Pose | None, asked: Asked, limits: Mapping[str, float], now: float) -> list[Check]:
    """Check whether a robot in flight is seen, where what it flies next begins, looks as that does, and rests, as far as that is measured.

    Args:
        robot: Its name.
        pose: Its last; None where it was never seen.
        asked: What is asked of it.
        limits: The numbers.
        now: s of the poses' clock.
    """
    if pose is None or now - pose.time > limits["fresh"]:
        return [Check("pose", robot, False, f"{robot} was not seen lately: look at motion capture and the markers")]
    near = limits
    if "heading" in asked.rest:
        most, error = asked.rest["heading"]
        near = {**limits, "heading": min(limits["heading"], most - error)}
    looks = [] if pose.heading is None else [heading_of(robot, pose.heading, asked.heading, near)]
    return [at_place(robot, pose.position, asked, limits), *looks, *_at_rest(robot, pose, asked)]


def _at_rest(robot: str, pose: Pose, asked: Asked) -> list[Check]:
    found: list[Check] = []
    for name, value in pose.unrest.items():
        if name in asked.rest:
            most, error = asked.rest[name]
            what = f"{robot}'s {name} is {value:.3g} {_UNITS[name]}, and may be {error:.3g} more; the proof of tracking lets it begin at {most:.3g}"
            passed = value + error <= most
            found.append(
                Check(
                    "rest", robot, passed, what if passed else f"{what}: let it settle, or state a greater `disturbance.rest`"
                )
            )
    return found
