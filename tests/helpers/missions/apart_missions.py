"""Missions whose formulas come apart: into what single robots are asked, by name, into goals that anybody reaches, and into robots that are alike."""

from __future__ import annotations

import math
from random import Random

import ltlplan
from verify.data import Mission

_TEXT = """
format: 1
name: apart
spec: {{formula: "{formula}", team: {team}, trace: {trace}, repeat: {repeat}}}
regions: {{{regions}}}
agents: {{{agents}}}
vehicle: crazyflie-2.1
workspace: {{min: [-10, -10, 0.2], max: [10, 10, 3]}}
{more}
"""
_PARCELS = (
    "robot: {initial: empty, states: {empty: [], full: [carry]}, actions: [{from: empty, to: full, at: p}, "
    "{from: full, to: empty, at: d0}, {from: full, to: empty, at: d1}, {from: full, to: empty, at: d2}]}\nlimits: {speed: 1.0}"
)


# four parameters, and three that most missions have in common
def _mission(
    formula: str, regions: dict[str, tuple[float, ...]], starts: list[tuple[float, ...]], *, team: str = "joint", trace: str = "finite",
    repeat: int = 1, more: str = "",
) -> Mission:  # fmt: skip
    balls = ", ".join(
        f"{name}: {{center: {list(at[:3])}, radii: {[at[3] if at[3:] else 0.2] * 3}}}" for name, at in regions.items()
    )
    agents = ", ".join(f"quad{i}: {{start: {list(at)}}}" for i, at in enumerate(starts))
    return ltlplan.parse_mission(
        _TEXT.format(formula=formula, team=team, trace=trace, repeat=repeat, regions=balls, agents=agents, more=more)
    )


def show(robots: int, more: str = "") -> Mission:
    """Return a light show: each robot, by its name, to a place of its own on a circle, and home, and `more`."""
    turns = [2 * math.pi * i / robots for i in range(robots)]
    circle = {f"c{i}": (round(2 * math.cos(turn), 3), round(2 * math.sin(turn), 3), 1.8) for i, turn in enumerate(turns)}
    starts = [(-2.2 + 0.88 * (i % 6), -0.5 + i // 6, 0.7) for i in range(robots)]
    homes = {f"h{i}": at for i, at in enumerate(starts)}
    own = " & ".join(f"F(quad{i}.c{i} & F quad{i}.h{i})" for i in range(robots))
    return _mission(own + more, circle | homes, starts)


def patrol(robots: int) -> Mission:
    """Return a patrol of the corners of a grid of sixteen places, two laps."""
    grid = {f"n{x}{y}": (1.5 * x, 1.5 * y, 1.0) for x in range(4) for y in range(4)}
    starts = [(0.5, 0.5, 1.0), (2.0, 5.0, 1.0), (3.5, 3.5, 1.0), (5.0, 2.0, 1.0)][:robots]
    return _mission("G F n00 & G F n30 & G F n03 & G F n33", grid, starts, trace="infinite", repeat=2)


def parcels(robots: int, *, team: str = "joint") -> Mission:
    """Return three parcels that robots, all alike, carry to three desks, and not through a public place."""
    regions = {
        "p": (0, 3, 1, 0.3),
        "d0": (3, 3, 1, 0.3),
        "d1": (3, -3, 1, 0.3),
        "d2": (-3, -3, 1, 0.3),
        "public": (0, 0, 1, 0.8),
    }
    brought = " & ".join(f"F(p & carry & (carry U (d{k} & !carry)))" for k in range(3))
    starts = [(i - 2.5, -1.5, 1.0) for i in range(robots)]
    return _mission(f"{brought} & G(carry -> !public)", regions, starts, more=_PARCELS, team=team)


def goals(count: int, seed: int) -> Mission:
    """Return one robot with goals anywhere, at least 1 m apart; on a grid for seed 0."""
    draw, places = Random(seed), list[tuple[float, ...]]()
    while len(places) < count:
        n = len(places)
        at = (
            (1.5 * (n % 8) - 5, 1.5 * (n // 8) - 3, 1.0)
            if seed == 0
            else (*(round(draw.uniform(-8, 8), 2) for _ in range(2)), 1.0)
        )
        if all(math.dist(at, other) >= 1 for other in places):
            places.append(at)
    names = {f"g{i}": at for i, at in enumerate(places)}
    return _mission(" & ".join(f"F {name}" for name in names), names, [(0.0, 0.0, 2.5)], team="own")
