"""Random plans: what is returned passes the judge; where a plan is refused, a dense search finds no easy answer either."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

import verify
from refine import refine
from tests.helpers.motion.easy_answers import easy_answer, faults, sampled
from tests.helpers.motion.plans_by_hand import ball, room, straight
from tests.helpers.motion.random_plans import random_plan
from verify.data import DoesNotFit, Infeasible, Plan, Witness
from verify.data.sections import Agent

ROUNDS = 6
"""As many attempts as the pipeline makes."""


@dataclass
class Count:
    certified: int = 0
    at_once: int = 0
    refused: int = 0


def hold_to_it(seed: int, count: Count) -> None:
    """Refine one random plan; the judge has the say about flights, the dense search about refusals."""
    plan = random_plan(seed)
    witnesses: tuple[Witness, ...] = ()
    sentences: list[str] = []
    for attempt in range(ROUNDS):
        refusal = None
        try:
            team = refine(plan, witnesses=witnesses)
        except (Infeasible, DoesNotFit) as error:
            refusal = error
        if refusal is not None:
            found = easy_answer(plan, np.random.default_rng(seed))
            assert found is None, f"seed {seed}: refused ({refusal}), yet {found}"
            count.refused += 1
            return
        claims = [claim for claim in verify.judge(plan, team, largest=False).claims if claim.outcome != "holds"]
        if not claims:
            count.certified += 1
            count.at_once += attempt == 0
            return
        witnesses = (*witnesses, *(claim.witness for claim in claims if claim.witness is not None))
        sentences = [claim.sentence for claim in claims]
    pytest.fail(f"seed {seed}: not certified after {ROUNDS} rounds: {sentences}")


FEW = (10, 15, 19, 30)
"""Seeds of the default run, of those below."""
SOME = (0, 2, 8, 10, 15, 19, 22, 30, 33, 226, 244)
"""Seeds of what takes some seconds: laps, teams, plans whose points lie in each other's regions, one that is refused, a bay in
front of an opening, robots that would hover too near each other."""


@pytest.mark.parametrize("seeds", [FEW, pytest.param(SOME, marks=pytest.mark.slow)])
def test_random_plans_are_certified_or_refused_for_good(seeds: tuple[int, ...]) -> None:
    count = Count()
    for seed in seeds:
        hold_to_it(seed, count)
    assert count.certified >= 6 * len(seeds) / len(SOME)
    assert count.refused >= 1


@pytest.mark.slow
def test_hundreds_of_random_plans_are_certified_or_refused_for_good() -> None:
    count = Count()
    for seed in range(300):
        hold_to_it(seed, count)
    print(count)
    assert count.certified > 4 * count.refused > 0
    assert count.at_once > 0.9 * count.certified


def test_the_dense_search_finds_what_is_there_and_knows_a_fault_when_it_flies_one() -> None:
    mission = room({"wall": ball(0, 0), "goal": ball(1.5, 0)}, {"q": Agent(start=(-1.5, 0.0, 1.0))})
    plan = Plan(mission=mission, robots={"q": straight((-1.5, 0, 1), (1.5, 0, 1), visits={1: "goal"})})
    found = easy_answer(plan, np.random.default_rng(0))
    assert found is not None
    corners, _, pace = found["q"]
    assert faults(mission, plan.robots["q"], sampled(corners, 1.5 * pace / mission.effective_limits.speed)) == []
    through = sampled(np.array([[-1.5, 0, 1.0], [1.5, 0, 1.0]]), 1.5)
    assert "visits ['wall', 'goal']" in faults(mission, plan.robots["q"], through)
    low = sampled(np.array([[-1.5, 0, 1.0], [0.0, 1.5, 0.1], [1.5, 0, 1.0]]), 0.2)
    assert {"leaves the workspace", "breaks speed"} <= set(faults(mission, plan.robots["q"], low))


@pytest.mark.slow
def test_shares_of_time_that_suit_each_robot_do_not_cost_the_team_its_flight() -> None:
    count = Count()
    hold_to_it(52, count)
    assert count.certified == 1
