"""Random missions that can be satisfied: spheres in a room, robots in free flight, formulas of common patterns."""

from __future__ import annotations

import itertools
from typing import Literal

import numpy as np

from ltlplan import parse_mission
from verify.data import Mission

LETTERS = "abcdefgh"


def random_mission(
    seed: int, *, robots: int | None = None, regions: int | None = None, samples: int = 50, rounds: int = 12
) -> Mission:
    """A mission with 3 to 5 regions and 2 to 4 robots; every pattern of its formula can be met by one robot alone."""
    rng = np.random.default_rng(seed)
    count = regions or int(rng.integers(3, 6))
    team = robots or int(rng.integers(2, 5))
    side = 3.0 + 0.25 * team**0.5
    places: list[np.ndarray] = []
    while len(places) < count + team:
        place = rng.uniform([-side + 0.6, -side + 0.6, 0.8], [side - 0.6, side - 0.6, 1.6])
        gap = 1.0 if len(places) < count else 0.75
        if all(np.linalg.norm((place - other)[:2]) > gap for other in places):
            places.append(place)
    names = LETTERS[:count]
    text = {
        name: f"{{center: [{p[0]:.3f}, {p[1]:.3f}, {p[2]:.3f}], radii: [0.2, 0.2, 0.2]}}"
        for name, p in zip(names, places, strict=False)
    }
    starts = {f"quad{i}": f"{{start: [{p[0]:.3f}, {p[1]:.3f}, {p[2]:.3f}]}}" for i, p in enumerate(places[count:])}
    return parse_mission(
        f"""
format: 1
name: random-{seed}
spec: {{formula: "{random_formula(names, rng)}"}}
regions: {{{", ".join(f"{k}: {v}" for k, v in text.items())}}}
agents: {{{", ".join(f"{k}: {v}" for k, v in starts.items())}}}
vehicle: crazyflie-2.1
workspace: {{min: [{-side}, {-side}, 0.2], max: [{side}, {side}, 2.2]}}
planner: {{method: mtac-e, samples: {samples}, elite: 0.1, iterations: {rounds}, seed: {seed}}}
"""
    )


def random_formula(names: str, rng: np.random.Generator) -> str:
    """Visits of two regions or more, with an order, a response or a place to keep out of."""
    visited = list(rng.permutation(list(names)))
    goals = visited[: int(rng.integers(2, len(visited)))] if len(visited) > 2 else visited
    parts = [f"F {name}" for name in goals]
    spare = [name for name in visited if name not in goals]
    for first, second in itertools.pairwise(goals):
        match int(rng.integers(5)):
            case 0:
                parts.append(f"(!{second} U {first})")
            case 1:
                parts.append(f"G({first} -> F {second})")
            case 2 if spare:
                parts.append(f"G !{spare[0]}")
            case _:
                pass
    return " & ".join(parts)


MANY_TASKS = {
    "visits": "F a & F b & F c & F d & F e & F f & F g",
    "orders": "F a & F b & F c & F d & F e & F f & (!b U a) & (!d W c)",
    "responses": "F a & F b & F c & F d & F e & F f & G(a -> F b) & G !h",
    "sequences": "F(a & F b) & F(c & F d) & F e & F f & F(g | h) & F(h & F a)",
}
"""Formulas of many tasks, by what is in them."""


def mission_of_many_tasks(
    seed: int, formula: str, *, objective: Literal["sum", "longest"] = "sum", robots: int = 3, regions: int = 8
) -> Mission:
    """Return a formula in a random world, its paths improved in a hurry."""
    mission = random_mission(seed, robots=robots, regions=regions, samples=20, rounds=2)
    spec = mission.spec.model_copy(update={"formula": formula})
    planner = mission.planner.model_copy(update={"objective": objective})
    parts = {name: getattr(mission, name) for name in Mission.model_fields}
    return Mission.model_validate({**parts, "spec": spec, "planner": planner})


_SHAPES = (
    "radii: [0.35, 0.3, 0.3]",
    "size: [0.7, 0.6, 0.6], yaw_deg: 30",
    "cylinder: {radius: 0.35, height: 0.6}",
    "radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02, yaw_deg: 70",
)
"""Bodies around a centre; the last one is a hoop's."""
_TASKS = {
    "finite": ("F a & F b", "F (a & F (c & F a))", "(!b U a) & F b", "F a & F G c", "F a & G !b"),
    "infinite": ("G F a & G F b", "G F (a & F c)", "F b & G F c"),
}


def mission_of_many_kinds(seed: int) -> Mission:
    """Return a small mission of one or two robots with some of what a mission may ask of its flight; a few have no plan."""
    rng = np.random.default_rng(seed)

    def one_of(*several: str) -> str:
        return several[int(rng.integers(len(several)))]

    trace = one_of("finite", "infinite")
    centres = {"a": (1.4, 1.1), "b": (-1.5, 1.0), "c": (0.2, -1.2)}
    bodies = {
        name: f"{{center: [{x}, {y}, {rng.uniform(0.9, 1.3):.3f}], {one_of(*_SHAPES)}}}" for name, (x, y) in centres.items()
    }
    hoops = {name: body for name, body in bodies.items() if "opening" in body}
    heading, pace = one_of("", ", heading: path", ", yaw_deg: 71", ", heading: [0, 0, 1]"), one_of("", "", ", pace: 1")
    end = one_of("", ", end: [-0.6, -1.0, 1.1]") if trace == "finite" else ""
    agents = [f"q0: {{start: [-0.2, 0.1, 1.0]{heading}{pace}}}", f"q1: {{start: [1.4, -1.3, 1.0]{end}}}"]
    limits = one_of("", "legs: {a: {speed: 0.25}, b: {acceleration: 0.5}}", "pieces: 6", "speed: 0.8", "acceleration: 1.5")
    soft = one_of("", f", soft: [{{formula: '{'F c' if trace == 'finite' else 'G F c'}'}}]")
    return parse_mission(
        f"""
format: 1
name: kinds-{seed}
spec: {{formula: "{one_of(*_TASKS[trace])}", trace: {trace}, team: {one_of("own", "joint")}{soft}}}
regions: {{{", ".join(f"{name}: {body}" for name, body in bodies.items() if name not in hoops)}}}
hoops: {{{", ".join(f"{name}: {body}" for name, body in hoops.items())}}}
agents: {{{", ".join(agents[: int(rng.integers(1, 3))])}}}
vehicle: {one_of("crazyflie-2.1", "crazyflie-brushless")}
limits: {{{limits}}}
workspace: {{min: [-2.6, -2.2, 0.2], max: [2.6, 2.2, {one_of("1.8", "2.6")}]}}
margin: {one_of("0.05", "0.03", "0.002")}
clock_error: {one_of("0", "0.05", "0.3")}
planner: {{cost: {{{one_of("length", "time")}: 1}}, samples: 20, iterations: 2}}
"""
    )
