"""A short certified flight of three robots, made by hand: they climb, one goes into a region and back, and all land."""

from __future__ import annotations

from flight.link.phases import Stage
from tests.helpers.motion.flights import legs, plan_of, small_mission
from verify import certify
from verify.data import Visit

PLACES = {"r0": (0.0, -0.5, 0.0), "r1": (-1.0, 0.5, 0.02), "r2": (1.0, 0.8, 0.0)}
GROUNDS = {name: place[2] for name, place in PLACES.items()}
UNCHECKED = ("battery",)
"""The profile has no endurance: batteries cannot be held against the flight."""
NEAR = "a: {center: [0.4, -0.5, 0.5], radii: [0.2, 0.2, 0.2]}"
FAR = "a: {center: [3.0, 3.0, 0.5], radii: [0.2, 0.2, 0.2]}"


def stage(
    name: str, points: dict[str, list[list[float]]], formula: str = "true", *, regions: str = NEAR, margin: float = 0.12
) -> Stage:
    """Return robots' flights along their points, rest to rest, certified."""
    mission = small_mission(formula, regions=regions, starts=[legs[0] for legs in points.values()], margin=margin)
    visits = {"r0": [Visit(region="a")]} if formula != "true" else {}
    plan, team = plan_of(mission, visits), {robot: legs(rows) for robot, rows in points.items()}
    return Stage(name, plan, team, certify(plan, team))


def short_flight() -> tuple[Stage, ...]:
    """Return climb, flight and landing."""
    return _flight("F a")


def wide_flight() -> tuple[Stage, ...]:
    """Return the same ways, with nothing on them and a margin for poses of a machine that is late."""
    return _flight("true", regions=FAR, margin=0.35)


def _flight(formula: str, **more) -> tuple[Stage, ...]:
    high = {name: [x, y, 0.5] for name, (x, y, _) in PLACES.items()}
    return (
        stage("climb", {name: [list(place), high[name]] for name, place in PLACES.items()}, **more),
        stage("flight", {name: [at, [at[0] + 0.4, *at[1:]], at] for name, at in high.items()}, formula, **more),
        stage("landing", {name: [at, [*at[:2], 0.05]] for name, at in high.items()}, **more),
    )
