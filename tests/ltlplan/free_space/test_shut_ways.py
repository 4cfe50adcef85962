"""What shuts a way: refusals name it, say how wide it is, and a fine grid finds no way either."""

from __future__ import annotations

import math

import numpy as np
import pytest

import ltlplan
from ltlplan.free_space.bottlenecks import Gap, Shut, TooNear, what_shuts
from ltlplan.free_space.free_space import FreeSpace
from tests.helpers.few import few_of
from tests.helpers.missions.walled_rooms import box, two_rooms
from tests.helpers.motion.box_worlds import Boxes, grid_length
from verify.data import BadInput
from verify.data.shapes.obstacle import Obstacle

SIDE, STEP = 4.0, 0.04


@few_of(3, "seed", range(8))
def test_what_shuts_a_way_in_random_rooms_is_confirmed_by_a_fine_grid(seed: int) -> None:
    rng = np.random.default_rng(seed)
    boxes = Boxes.random(rng, 9, SIDE)
    mission = two_rooms("true", regions={}, agents={"quad0": {"start": (20.0, 20.0, 1.0)}}).model_copy(
        update={
            "obstacles": {f"box{k}": Obstacle(center=one.center, parts=one.parts) for k, one in enumerate(boxes.regions())},
            "margin": 0.0,
        }
    )
    corners = [(x, y, 1.0) for x in (0.4, 2.0, 3.6) for y in (0.4, 2.0, 3.6)]
    clearance = 0.25
    free = [point for point in corners if boxes.distances(np.array([point]))[0] > clearance]
    if len(free) < 2:
        return
    space = FreeSpace.of(mission, clearance)
    assert space is not None
    start, end = free[0], free[-1]
    ends = (np.array(start), np.array(end))
    found = what_shuts(space, [start], end)
    if found is None:
        assert math.isfinite(grid_length(boxes, clearance - STEP, ends, SIDE, STEP))
        return
    assert math.isinf(grid_length(boxes, clearance * 1.09 + STEP, ends, SIDE, STEP))
    assert not isinstance(found, TooNear)
    if isinstance(found, Shut):
        assert math.isinf(grid_length(boxes, STEP, ends, SIDE, STEP))
        return
    if "workspace" not in found.between:
        assert math.isinf(grid_length(boxes, found.width / 2 * 1.09 + STEP, ends, SIDE, STEP))
        assert math.isfinite(grid_length(boxes, max(found.width / 2 - STEP, 0.0), ends, SIDE, STEP / 2))


def test_a_door_that_is_too_narrow_is_named_with_its_width_and_what_is_needed() -> None:
    with pytest.raises(ltlplan.Unsatisfiable) as error:
        ltlplan.plan(two_rooms("F b", gap=0.22))
    assert "b can only be reached through door, 0.22 m wide, between 'east' and 'west'" in str(error.value).replace(
        "'west' and 'east'", "'east' and 'west'"
    )
    assert "quad0 needs 0.24 m (radius and margin, 0.07 m and 0.05 m)" in str(error.value)


def test_a_gap_beside_the_workspace_needs_no_radius_on_that_side() -> None:
    mission = two_rooms(
        "F b", obstacles={"wall": box((1.925, 2.0, 1.0), (3.85, 0.1, 2.0))}, regions={"b": box((1, 3.2, 1), (1, 1, 1))}
    )
    with pytest.raises(
        ltlplan.Unsatisfiable, match=r"between 'wall' and the workspace's wall, 0.15 m apart; quad0 needs 0.17 m"
    ):
        ltlplan.plan(mission)


def test_a_workspace_cut_in_two_is_said_to_be() -> None:
    with pytest.raises(ltlplan.Unsatisfiable, match="No way of any width leads to b: 'wall' stands between"):
        ltlplan.plan(two_rooms("F b", obstacles={"wall": box((2.0, 2.0, 1.0), (4.0, 0.1, 2.0))}))


def test_a_region_too_near_to_an_obstacle_says_how_near() -> None:
    plain = two_rooms("F b")
    obstacles = {**plain.obstacles, "post": box((1.2, 3.2, 1.0), (0.2, 0.2, 2.0))}
    with pytest.raises(ltlplan.Unsatisfiable, match=r"middle of b cannot be reached: it is 0.1 m from the obstacle 'post'"):
        ltlplan.plan(two_rooms("F b", obstacles=obstacles))


@pytest.mark.parametrize(
    ("edges", "gap", "said"),
    [
        (
            [["robot", "a"], ["a", "b"]],
            0.8,
            r"edge \[a, b\] of the environment cannot be flown by quad0: every way .* such as door",
        ),
        (
            [["robot", "b"]],
            0.22,
            r"edge \[robot, b\] of the environment cannot be flown: b can only be reached through door, 0.22 m",
        ),
    ],
)
def test_an_edge_that_cannot_be_flown_is_refused(edges: list[list[str]], gap: float, said: str) -> None:
    with pytest.raises(BadInput, match=said):
        ltlplan.plan(two_rooms("F b", gap=gap, environment={"edges": edges}))


def test_edges_that_can_be_flown_are_planned_along() -> None:
    plan = ltlplan.plan(two_rooms("F b", environment={"edges": [["robot", "a"], ["a", "door"], ["door", "b"]]}))
    assert [visit.region for visit in plan.robots["quad0"].visits] == ["a", "door", "b"]


def test_a_smaller_vehicle_passes_where_a_larger_one_does_not() -> None:
    narrow = two_rooms("F b", gap=0.3)
    plain = narrow.vehicle
    large = narrow.changed(vehicle=plain.changed(name="large", radius=0.12))
    assert ltlplan.plan(narrow).robots["quad0"].visits
    with pytest.raises(ltlplan.Unsatisfiable, match=r"quad0 needs 0\.34 m"):
        ltlplan.plan(large)


def test_a_gap_says_where_it_is() -> None:
    space = FreeSpace.of(two_rooms("F b", gap=0.22))
    assert space is not None
    gap = what_shuts(space, [(1.0, 1.0, 1.0)], (1.0, 3.2, 1.0))
    assert isinstance(gap, Gap)
    assert gap.regions == ("door",)
    assert gap.point[:2] == pytest.approx((3.0, 2.0), abs=0.1)
