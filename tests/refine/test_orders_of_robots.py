"""Robots that fly as long as each other are refined one after another around the middle of their starts."""

from __future__ import annotations

import numpy as np
import pytest

import ltlplan
from refine import refine
from refine.team import _in_order
from tests.benchmarks.scale import circle_mission
from verify import judge
from verify.data import Plan


def swap(robots: int) -> Plan:
    """Return the plan of robots that change sides of a circle."""
    return ltlplan.plan(circle_mission(robots))


@pytest.mark.parametrize("sign", [1, -1])
def test_alike_robots_come_after_those_beside_them_however_they_are_listed(sign: int) -> None:
    made = swap(8)
    rng = np.random.default_rng(0)
    listed = [list(made.robots), *(rng.permutation(list(made.robots)).tolist() for _ in range(5))]
    orders = {
        tuple(_in_order(made.model_copy(update={"robots": {n: made.robots[n] for n in names}}), sign).robots)
        for names in listed
    }
    assert len(orders) == 1
    starts = [made.robots[name].waypoints[0].position for name in next(iter(orders))]
    beside = np.linalg.norm(np.diff(starts, axis=0), axis=1)
    assert beside == pytest.approx([beside[0]] * 7, rel=0.02)


@pytest.mark.slow
def test_twenty_that_swap_give_way_for_a_fifth_of_their_flight_at_most() -> None:
    """In an order along an axis they took 7.9 s, where one of them alone takes 6.0."""
    made = swap(20)
    team = refine(made, pace=0.7)
    assert max(flight.duration for flight in team.values()) < 7.2
    assert judge(made, team, largest=False).holds
