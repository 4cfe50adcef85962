"""Sequences with a cycle, drawn at random: each is planned and refined, or refused in words."""

from __future__ import annotations

import numpy as np
import pytest

import ltlplan
from ltlplan.paths.hoops import route_sequence
from refine import jumps, refine
from verify.data import Infeasible, Mission, Plan
from verify.data.mission import check_mission


def flying(name: str, sequence: str) -> Mission:
    """Return a shipped mission that flies another sequence, for ever."""
    mission = ltlplan.load_mission(name)
    agents = {agent: value.model_copy(update={"end": None}) for agent, value in mission.agents.items()}
    spec = mission.spec.model_copy(update={"formula": None, "trace": "infinite", "repeat": 2})
    return check_mission(mission.model_copy(update={"sequence": sequence, "agents": agents, "spec": spec}))


def drawn(rng: np.random.Generator, names: list[str]) -> str:
    def some(low: int, high: int) -> str:
        return " ".join(f"{rng.choice(names)}{rng.choice(['F', 'R'])}" for _ in range(int(rng.integers(low, high))))

    return f"{some(0, 3)} ({some(1, 4)})*".strip()


@pytest.mark.slow  # 200 refinements
def test_random_sequences_with_a_cycle_are_refined_or_refused_in_words():
    rng = np.random.default_rng(0)
    outcomes = {"refined": 0, "refused": 0}
    for _ in range(200):
        name = str(rng.choice(["hoops-sequence", "hoops-ltl", "hoops-published"]))
        mission = flying(name, drawn(rng, list(ltlplan.load_mission(name).hoops)))
        try:
            plan = Plan(mission=mission, robots={"quad0": route_sequence(mission)}, method="sequence")
            (flight,) = refine(plan, max_pieces=200).values()
        except Infeasible:
            outcomes["refused"] += 1
            continue
        assert jumps(flight).position <= 1e-6
        outcomes["refined"] += 1
    assert outcomes["refined"] > outcomes["refused"]


def test_a_lap_that_closes_where_its_last_hoop_is_left_is_improved():
    """Two waypoints at one time were asked for, and the sequence was refused for a reason that had nothing to do with it."""
    plan = ltlplan.plan(flying("hoops-sequence", "hoop2R hoop2R (hoop2F hoop2R hoop2R)*"))
    (robot,) = plan.robots.values()
    assert np.all(np.diff(robot.times) > 0)
    assert [visit.direction for visit in robot.visits] == ["R", "R", "F", "R", "R"]
