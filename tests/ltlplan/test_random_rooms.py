"""Missions over regions of all shapes, drawn at random: certified, or refused in words; never one whose samples break it."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

import ltlplan
import refine
import verify
from tests.helpers.motion.solids import Holds, random_solid
from verify.data import parse_mission


def moved(data: dict[str, Any], step: np.ndarray) -> dict[str, Any]:
    if "union" in data:
        return {"union": [moved(member, step) for member in data["union"]]}
    if "prism" in data:
        corners = [[x + step[0], y + step[1]] for x, y in data["prism"]["polygon"]]
        return {"prism": {"polygon": corners, "z": data["prism"]["z"]}}
    return {**data, "center": (np.array(data["center"]) + np.array([*step, 0.0])).tolist()}


def drawn(rng: np.random.Generator) -> tuple[str, dict[str, tuple[Holds, np.ndarray]]]:
    """A mission to visit three regions from above, and for each region what tells its points, before it was moved by so much."""
    rows: list[str] = []
    bodies: dict[str, tuple[Holds, np.ndarray]] = {}
    for name in "abc":
        data, holds = random_solid(rng)
        step = rng.uniform(-1.6, 1.6, 2)
        rows.append(f"  {name}: {json.dumps(moved(data, step))}")
        bodies[name] = holds, np.array([*step, 0.0])
    x, y = rng.uniform(-2, 2, 2)
    head = f"""format: 1
name: drawn
spec: {{formula: "F a & F b & F c"}}
agents: {{q: {{start: [{x:g}, {y:g}, 2.6]}}}}
vehicle: crazyflie-2.1
workspace: {{min: [-3.5, -3.5, -0.8], max: [3.5, 3.5, 3.2]}}
margin: 0.03
regions:
"""
    return head + "\n".join(rows), bodies


def flown(seed: int, missions: int) -> int:
    """Plan, refine and certify, and hold what is certified against samples; return how many were."""
    rng = np.random.default_rng(seed)
    certified, refusals = 0, list[str]()
    for _ in range(missions):
        text, bodies = drawn(rng)
        try:
            mission = parse_mission(text)
            plan = ltlplan.plan(mission)
            team = refine.refine(plan)
        except (ltlplan.BadInput, ltlplan.Unsatisfiable, ltlplan.Infeasible) as refused:
            refusals.append(str(refused))
            continue
        if not verify.certify(plan, team, margin=mission.margin).holds:
            continue
        certified += 1
        times = np.linspace(0.0, team["q"].duration, 4000)
        points = team["q"].evaluate(times)[:, :3]
        for name, (holds, step) in bodies.items():
            inside = holds(points - step) >= 0.0
            stays = int(inside[0]) + int(np.sum(inside[1:] & ~inside[:-1]))
            assert stays == sum(visit.region == name for visit in plan.robots["q"].visits)
    assert all(len(sentence) > 20 for sentence in refusals)
    return certified


@pytest.mark.slow
def test_missions_drawn_at_random_are_certified_or_refused_in_words() -> None:
    assert flown(0, 3) >= 1


@pytest.mark.slow
def test_many_missions_drawn_at_random_are_certified_or_refused_in_words() -> None:
    assert flown(1, 40) >= 25
