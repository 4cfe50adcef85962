"""Waits on the way: the search over (point, time) is held to trying all waits, and its flights to the judge."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import verify
from refine import refine, stop_and_go
from refine.schedule import GRID
from refine.single import Ask, Robot, single
from refine.spacing import Spacing
from refine.wishes import wishes_of
from tests.refine.random_plans import random_plan
from tests.refine.test_team import ball, room, straight
from verify.data import Infeasible, Plan
from verify.data.mission import Agent

SPACING = Spacing(0.4, 1.0)
WAITS = np.arange(12) * 4 * GRID
RESTS = Ask("nominal", 1000.0, 31, rests=True)


def robots(seed: int) -> dict[str, Robot]:
    """Two robots on polylines that cross somewhere, at rest at each corner, on the grid of times."""
    rng = np.random.default_rng(seed)
    corners = {name: np.c_[rng.uniform(-1.2, 1.2, size=(3, 2)), np.ones(3)] for name in ("a", "b")}
    mission = room({"far": ball(2.5, 2.5)}, {name: Agent(start=tuple(points[0])) for name, points in corners.items()})
    plan = Plan(mission=mission, robots={name: straight(*points) for name, points in corners.items()})
    alone = {name: single(plan, name, wishes_of(plan, ()), (), RESTS) for name in corners}
    return {name: stop_and_go._on_grid(mission, robot) for name, robot in alone.items()}


def end_of(robot: Robot, waits: np.ndarray) -> float:
    return float(waits.sum() + robot.path.duration)


@pytest.mark.parametrize("seed", range(12))
def test_no_waits_end_earlier_than_those_that_are_found(seed: int) -> None:
    first, second = robots(seed).values()
    steps = int(np.ceil((first.path.duration + second.path.duration + 2 * WAITS.max()) / GRID)) + 2
    track = stop_and_go._track(first, np.array([0.0, 1.5]), steps, SPACING)
    found = stop_and_go._through(second, [track], steps, SPACING)

    def keeps_apart(waits: np.ndarray) -> bool:
        points, reach = stop_and_go._track(second, waits, steps, SPACING)
        gap = np.linalg.norm(points - track[0], axis=1) - reach - track[1]
        return bool(gap.min() >= SPACING.distance + stop_and_go._CLEAR)

    tried = [np.array(waits) for waits in itertools.product(WAITS, repeat=2)]
    good = [end_of(second, waits) for waits in tried if keeps_apart(waits)]
    if found is None:
        assert not good
        return
    points, _ = stop_and_go._track(second, found, steps, SPACING)
    assert np.linalg.norm(points - track[0], axis=1).min() >= SPACING.distance
    assert end_of(second, found) <= min(good, default=np.inf)


def test_some_of_these_need_waits_and_some_cannot_be_helped() -> None:
    """The test above would pass on pairs that never meet."""
    kinds = set()
    for seed in range(12):
        first, second = robots(seed).values()
        steps = int(np.ceil((first.path.duration + second.path.duration + 2 * WAITS.max()) / GRID)) + 2
        track = stop_and_go._track(first, np.array([0.0, 1.5]), steps, SPACING)
        found = stop_and_go._through(second, [track], steps, SPACING)
        kinds.add("none" if found is None else "on the way" if found[1] > 0.0 else "at the start" if found[0] > 0.0 else "free")
    assert kinds >= {"none", "free", "at the start"}


def test_a_team_that_only_waits_can_part_is_flown() -> None:
    """Each robot's last place is on the other one's way out of a hoop, in opposite orders."""
    plan = random_plan(979)
    team = refine(plan)
    hovers = [
        name
        for name, flight in team.items()
        if any(not flight.coefficients[piece, :3, 1:].any() for piece in range(1, len(flight)))
    ]
    assert hovers == ["q1"]
    assert verify.judge(plan, team, largest=False).holds


def test_a_plan_that_no_waits_can_mend_is_refused() -> None:
    """Two robots that are to end at one point, which is no region that has room for both."""
    starts = {"a": (-1.5, 0.3, 1.0), "b": (-1.5, -0.3, 1.0)}
    mission = room({"far": ball(2.5, 2.5)}, {name: Agent(start=start) for name, start in starts.items()})
    plan = Plan(mission=mission, robots={name: straight(start, (1.0, 0.0, 1.0)) for name, start in starts.items()})
    with pytest.raises(Infeasible, match="apart"):
        refine(plan)
