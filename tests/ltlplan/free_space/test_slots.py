"""Rooms cut by walls with one slot each: an independent grid in space agrees with every refusal, and every plan keeps clear of every box."""

from __future__ import annotations

import numpy as np
import pytest

import ltlplan
import verify
from refine import refine
from tests.helpers.few import few_of
from tests.helpers.missions.slotted_rooms import MARGIN, NEED, START, Slotted
from verify.data import Infeasible, Mission, RobotPlan

STEP = 0.03
BESIDE = 0.87 * STEP
"""m; no point between cells of the grid that touch is farther from both than this."""


def planned(mission: Mission) -> RobotPlan | str:
    """Return a plan's path, or the sentence that refuses it."""
    try:
        return ltlplan.plan(mission).robots["quad0"]
    except (ltlplan.Unsatisfiable, ltlplan.Infeasible) as refused:
        return str(refused)


def held_against_a_grid(rooms: Slotted) -> bool:
    """Hold planning in a room against connected cells of a grid; tell whether there was a plan."""
    found = planned(rooms.mission())
    if isinstance(found, str):  # bevels grow what is solid to 1.09 of the clearance beside edges and corners
        assert not rooms.connected(1.09 * NEED + BESIDE, STEP), found
        said = ("can only be reached", "No way of any width", "m wide between", "straight flight needs", "leaves 0.122 m")
        assert any(words in found for words in said), found
        return False
    assert rooms.connected(NEED - BESIDE, STEP)
    assert all(rooms.distance(np.array([at.position, at.position])) >= NEED for at in found.waypoints)
    return True


@few_of(1, "seed", [38, 45])
def test_a_refusal_of_a_way_through_slots_is_confirmed_by_a_grid(seed: int) -> None:
    """One was refused for want of a point to turn at in the mouth of its slot, one for want of room for a curve."""
    assert held_against_a_grid(Slotted.random(np.random.default_rng(seed), 0.2, 0.5, 3))


@pytest.mark.slow
@pytest.mark.parametrize(("narrowest", "widest", "beams"), [(0.2, 0.5, 3), (0.22, 0.4, 2), (0.3, 0.8, 9), (0.22, 0.3, 0)])
def test_refusals_of_ways_through_many_slots_are_confirmed_by_a_grid(narrowest: float, widest: float, beams: int) -> None:
    rooms = [Slotted.random(np.random.default_rng([seed, beams]), narrowest, widest, beams) for seed in range(40)]
    clear = [room for room in rooms if not starts_too_near(room)]
    plans = sum(held_against_a_grid(room) for room in clear)
    assert 4 < plans < len(clear)


def starts_too_near(rooms: Slotted) -> bool:
    return rooms.distance(np.array([START, START])) < NEED + 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 7, 31, 36, 45])
def test_paths_through_tight_slots_are_certified(seed: int) -> None:
    rooms = Slotted.random(np.random.default_rng(seed), 0.2, 0.5, 3)
    plan = ltlplan.plan(rooms.mission())
    team = refine(plan)
    assert verify.judge(plan, team, largest=False).holds
    path = team["quad0"].evaluate(np.arange(0.0, team["quad0"].duration, 0.002))[:, :3]
    beside = np.maximum(np.abs(path[:, None] - rooms.centers) - rooms.sizes / 2, 0.0)
    assert float(np.linalg.norm(beside, axis=2).min()) >= NEED
    assert plan.mission.margin == MARGIN


@pytest.mark.slow
def test_a_slot_that_leaves_no_millimetre_is_named_with_its_width() -> None:
    with pytest.raises(Infeasible, match=r"it is 0\.243\d m wide between 'box\d' and 'box\d', and 0\.244\d m are needed"):
        ltlplan.plan(Slotted.random(np.random.default_rng(1), 0.2, 0.5, 3).mission())
