"""Limits on the way to regions hold wherever robots are led: every flight that is returned for a random plan is accepted."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
import pytest

import verify
from refine import refine
from refine.single_robot.task import Pace
from tests.helpers.few import few_of
from tests.helpers.motion.random_plans import random_plan
from verify.data import Infeasible, Plan
from verify.data.sections import LegLimits


def limited(seed: int) -> Plan:
    """A random plan whose visited regions mostly have limits of their own, on speed or on acceleration."""
    plan, rng = random_plan(seed), np.random.default_rng(seed)
    legs = {
        name: LegLimits(speed=float(rng.uniform(0.15, 0.5)))
        if rng.random() < 0.6
        else LegLimits(acceleration=float(rng.uniform(0.2, 1.0)))
        for name in sorted({visit.region for robot in plan.robots.values() for visit in robot.visits})
        if rng.random() < 0.8
    }
    limits = plan.mission.limits.model_copy(update={"legs": legs})
    return plan.model_copy(update={"mission": plan.mission.model_copy(update={"limits": limits})})


@few_of(1, "seed", [188, 22])
def test_robots_that_give_way_keep_the_limits_of_their_ways(seed: int, pace: Pace) -> None:
    plan = limited(seed)
    assert verify.judge(plan, refine(plan, pace=pace), largest=False).holds


@pytest.mark.slow
def test_whatever_is_returned_is_accepted() -> None:
    held = 0
    for seed in range(400, 600):
        plan = limited(seed)
        with suppress(Infeasible):
            certificate = verify.judge(plan, refine(plan), largest=False)
            assert certificate.holds, (seed, [claim.sentence for claim in certificate.claims if claim.outcome != "holds"])
            held += 1
    assert held > 140
