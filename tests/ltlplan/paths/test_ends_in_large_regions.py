"""A flight ends in a large region as near as it may, and is priced so."""

from __future__ import annotations

import numpy as np
import pytest

import ltlplan
from ltlplan.systems.touching_points import is_large, touching_point
from refine import refine
from refine.single_robot.task import Pace
from tests.helpers.few import few_of
from tests.helpers.rooms_and_rests import fields_or_spots
from verify import judge

FIELD, SPOT = ((3.0, 0.0), (5.0, 2.0)), ((-1.5, 0.0), (0.4, 0.4))
DEEP = 0.25
"""m; how deep in a region flights end, the margin of 5 cm included."""


def away(box: tuple[tuple[float, float], tuple[float, float]], less: float) -> float:
    """Return how far the origin is from a box whose sides are moved inwards, m."""
    centre, size = np.array(box[0]), np.array(box[1])
    return float(np.linalg.norm(np.maximum(np.abs(centre) - size / 2.0 + less, 0.0)))


@pytest.mark.parametrize("pace", ["nominal", 0.7])
def test_a_field_that_begins_nearer_than_a_spot_is_flown_to(pace: Pace) -> None:
    made = ltlplan.plan(fields_or_spots({"field": FIELD, "spot": SPOT}))
    assert [visit.region for visit in made.robots["q"].visits] == ["field"]
    assert made.cost == pytest.approx(away(FIELD, DEEP), abs=1e-3)
    assert made.lower_bound == pytest.approx(away(FIELD, 0.0), abs=1e-5)
    assert judge(made, refine(made, pace=pace), largest=False).holds


@few_of(1, "seed", [*range(2), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 12))])
def test_of_random_fields_the_one_that_begins_nearest_is_flown_to(seed: int) -> None:
    rng, boxes = np.random.default_rng(seed), {}
    corners = [(-3.0, -3.0), (3.0, -3.0), (-3.0, 3.0), (3.0, 3.0)]
    for k, corner in enumerate(corners):
        size = rng.uniform(1.0, 3.5, 2).round(2).tolist()
        boxes[f"f{k}"] = (tuple((np.array(corner) + rng.uniform(-0.4, 0.4, 2)).round(2).tolist()), tuple(size))
    made = ltlplan.plan(fields_or_spots(boxes))
    least = min(away(box, DEEP) for box in boxes.values())
    assert made.cost == pytest.approx(least, rel=0.02)
    assert made.lower_bound is not None
    assert 0.7 * min(away(box, 0.0) for box in boxes.values()) <= made.lower_bound <= made.cost
    paces: tuple[Pace, ...] = ("nominal", 0.7)
    for pace in paces:
        assert judge(made, refine(made, pace=pace), largest=False).holds


def test_small_regions_are_flown_to_as_before() -> None:
    mission = fields_or_spots({"field": FIELD, "spot": SPOT})
    assert is_large(mission, "field")
    assert not is_large(mission, "spot")
    assert touching_point(mission, "field", np.array([0.0, 0.0, 1.0])) == pytest.approx([0.75, 0.0, 1.0])
    assert touching_point(mission, "field", np.array([0.0, 3.0, 1.4])) == pytest.approx([0.75, 0.75, 1.25], abs=1e-3)
    assert ltlplan.plan(fields_or_spots({"spot": SPOT})).robots["q"].waypoints[-1].position == pytest.approx((-1.5, 0.0, 1.0))
