"""Online flights among boxes and walls: robots are seen where they are, slow down clear of obstacles, and fly on around them."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from ltlplan.online.segments.braking import Stop, come_to_rest
from ltlplan.online.simulated_online_flight import fly_online
from ltlplan.systems.region_labels import Layout
from refine import refine
from tests.helpers.missions.rooms_by_hand import MARGIN, Box, along, from_boxes, sampled, walled
from tests.helpers.motion.solids import random_solid
from verify.data import parse_mission
from verify.data.events import NewFormula
from verify.data.shapes.region import Region

END: dict[str, Box] = {"wall": ((0.2, -0.3, 1), (0.05, 1.8, 2))}
NEED = 0.07 + MARGIN
SPLIT = """
format: 1
name: split
spec: {formula: F a}
regions: {a: {center: [1, 0, 1], size: [0.5, 0.4, 0.6]}}
obstacles: {wall: {center: [0.2, -0.3, 1], size: [0.05, 1.8, 2]}}
agents: {q: {start: [-0.7, 0, 1]}}
vehicle: crazyflie-2.1
workspace: {min: [-2, -2, 0.2], max: [2, 2, 2]}
margin: 0.05
"""


def test_points_are_seen_in_the_regions_that_hold_them() -> None:
    rng = np.random.default_rng(5)
    mission = parse_mission(SPLIT)
    drawn = {f"r{k}": random_solid(rng) for k in range(12)}
    layout = Layout(
        mission.model_copy(update={"regions": {name: Region.model_validate(data) for name, (data, _) in drawn.items()}})
    )
    points = rng.uniform([-2, -2, 0], [2, 2, 2], (400, 3))
    seen = layout.regions_at(points)
    for name, (_, holds) in drawn.items():
        depth = holds(points)
        sure = np.abs(depth) > 1e-6
        assert [name in here for here, told in zip(seen, sure, strict=True) if told] == (depth[sure] > 0).tolist()


def test_slowing_down_beside_a_wall_is_proved_and_stays_clear_of_it() -> None:
    mission = walled(END, start=(-0.7, 0, 1), goal=(1, 0, 1))
    team = refine(along(mission, (0.2 - 0.025 - NEED - 0.002, 0.6 + NEED, 1), (0.2 + 0.025 + NEED + 0.002, 0.6 + NEED, 1)))
    length = team["q"].duration
    for share in (0.3, 0.45, 0.55, 0.7):
        stop = come_to_rest(Stop(mission, team, Fraction(share * length).limit_denominator(50), braking=False))
        assert stop.refused == ()
        assert stop.team["q"].duration <= length
        assert from_boxes(sampled(stop.team["q"]), END) >= NEED


@pytest.mark.slow  # a certified flight, in simulation
def test_a_certified_flight_goes_around_a_wall_through_a_change() -> None:
    mission = parse_mission(SPLIT)
    event = NewFormula(time=2.5, formula="F a & G(a -> F !a)")
    flight = fly_online(mission, seed=1, certified=True, events=[event])
    assert flight.require().certified
    assert flight.words["q"] == (frozenset(), frozenset({"a"}), frozenset())
    for piece in flight.pieces:
        assert from_boxes(sampled(piece.team["q"]), END) >= NEED
    assert from_boxes(flight.log.position.reshape(-1, 3), END) >= 0.07


@pytest.mark.slow  # a flight in simulation
def test_online_sharing_goes_around_a_wall() -> None:
    text = SPLIT + "planner: {method: online-mtac-e, samples: 50, elite: 0.1}\n"
    flight = fly_online(parse_mission(text), seed=1, certified=True)
    assert flight.require().words["q"] == (frozenset(), frozenset({"a"}))
    assert from_boxes(flight.log.position.reshape(-1, 3), END) >= 0.07
