"""Letters of a flight among more regions than a 64-bit mask has room for."""

from __future__ import annotations

import numpy as np
import pytest

import ltlplan
from flight import fly
from flight.monitoring.letters import RegionMasks, region_letters
from ltlplan import parse_mission
from ltlplan.pipeline import certified_team
from tests.helpers.few import few_of
from verify.data import Mission


def field(count: int) -> Mission:
    regions = "".join(
        f"  r{i}: {{center: [{i % 10}, {i // 10}, 1], radii: [0.2, 0.3, 0.25], yaw_deg: {i}}}\n" for i in range(count)
    )
    return parse_mission(f"""
format: 1
name: field
spec: {{formula: "F r{count - 1}"}}
regions:
{regions}
agents: {{q: {{start: [8.5, {(count - 1) // 10 - 0.5}, 1]}}}}
vehicle: crazyflie-2.1
workspace: {{min: [-2, -2, 0.2], max: [12, 12, 2]}}
""")


@few_of(2, "count", [40, 62, 63, 100])
def test_masks_are_what_each_region_says(count: int) -> None:
    mission, rng = field(count), np.random.default_rng(count)
    points = np.array(list(mission.all_regions.values())[-1].center) + rng.normal(size=(500, 3)) * [3.0, 2.0, 0.2]
    points[0], points[7] = list(mission.all_regions.values())[-1].center, np.nan
    masks, table = RegionMasks(mission).of(points.T).tolist(), region_letters(mission)
    for point, mask in zip(points, masks, strict=True):
        assert table[mask] == {name for name, region in mission.all_regions.items() if region.level(point) <= 1.0}
    assert table[masks[0]] == {f"r{count - 1}"}


@pytest.mark.slow
def test_a_flight_to_the_last_of_a_hundred_regions_shows_it() -> None:
    mission = field(100)
    done = certified_team(ltlplan.plan(mission, seed=0))
    log = fly(done.plan, done.team, done.certificate, seed=0)
    assert log.satisfied
    assert log.letters[-1] == (frozenset({"r99"}),)
