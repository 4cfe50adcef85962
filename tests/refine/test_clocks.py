"""Flights that are planned for clocks that differ keep apart however they do; others are refused where they do not."""

from __future__ import annotations

import pytest

import verify
from refine import refine
from tests.refine.coordination.avoidance.test_joint_avoidance import circle, hall
from verify.data import Plan


def outcomes(plan: Plan, *, error: float, told: bool) -> set[str]:
    """Refine with clocks that differ, told or not, and return what the judge says of separation at that error."""
    asked = plan.model_copy(update={"mission": plan.mission.changed(clock_error=error if told else 0.0)})
    certificate = verify.judge(plan, refine(asked), clock_error=error, largest=False)
    return {claim.outcome for claim in certificate.claims if claim.name == "separation"}


@pytest.mark.slow
@pytest.mark.parametrize(("robots", "error"), [(3, 0.1), (8, 0.1)])
def test_robots_that_change_sides_keep_apart_with_clocks_that_differ(robots: int, error: float) -> None:
    plan = hall(circle(robots, 1.5))
    assert outcomes(plan, error=error, told=True) == {"holds"}
    assert outcomes(plan, error=error, told=False) != {"holds"}
