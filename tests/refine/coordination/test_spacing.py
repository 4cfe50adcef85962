"""One rule of how far apart robots start and end: what is loaded there is certified there, and a centimetre less is refused on load."""

from __future__ import annotations

import math

import numpy as np
import pytest

import ltlplan
import verify
from ltlplan import parse_mission
from ltlplan.pipeline import certified_team
from refine.coordination.departures import least_between
from tests.helpers.few import few_of
from verify.data import BadInput, Mission, MissionError


def pair(first: np.ndarray, second: np.ndarray, *, ends: bool = False, margin: float = 0.05, more: str = "") -> Mission:
    a, b = ([round(float(x), 7) for x in point] for point in (first, second))
    starts = (f"start: [-1, -1, 0.6], end: {a}", f"start: [-1, 1, 1.2], end: {b}") if ends else (f"start: {a}", f"start: {b}")
    return parse_mission(f"""
format: 1
name: pair
spec: {{formula: "F (a & F free)"}}
regions: {{a: {{center: [1.0, 0, 1.0], radii: [0.2, 0.2, 0.2]}}}}
agents: {{q: {{{starts[0]}}}, r: {{{starts[1]}}}}}
vehicle: crazyflie-2.1
workspace: {{min: [-1.6, -1.6, 0.2], max: [1.6, 1.6, 2.4]}}
margin: {margin}
{more}
""")


@pytest.mark.slow
@pytest.mark.parametrize("ends", [pytest.param(False, marks=pytest.mark.slow), True])
@few_of(
    1,
    ("margin", "separation", "separation_z"),
    [(0.05, 0.3, None), pytest.param(0.02, 0.15, None, marks=pytest.mark.slow), (0.03, 0.3, 0.6), (0.03, 0.4, 0.16)],
)
def test_starts_and_ends_that_are_loaded_are_certified(
    margin: float, separation: float, separation_z: float | None, ends: bool
) -> None:
    """The least distance is worked out here from the documents, in every direction; nothing of the rule's code is used."""
    more = f"separation: {separation}" + ("" if separation_z is None else f"\nseparation_z: {separation_z}")
    k = 1.0 if separation_z is None else separation / separation_z
    asked = separation + 2 * margin * max(1.0, k) + 1e-3
    rng = np.random.default_rng(5)
    for way in (np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0]), rng.normal(size=3)):
        unit = way / math.hypot(way[0], way[1], k * way[2])  # 1 m long, as it counts
        low = np.array([-0.9, -0.3, 0.7])
        with pytest.raises(MissionError, match="separation"):
            pair(low, low + (asked - 1e-5) * unit, ends=ends, margin=margin, more=more)
        mission = pair(low, low + (asked + 1e-4) * unit, ends=ends, margin=margin, more=more)
        done = certified_team(ltlplan.plan(mission, seed=0))
        assert verify.judge(done.plan, done.team, largest=False).holds


def test_a_mission_made_in_code_is_refused_before_it_is_planned() -> None:
    mission = pair(np.array([-0.9, -0.3, 0.7]), np.array([-0.9, 0.3, 0.7]))
    agents = {**mission.agents, "r": mission.agents["r"].model_copy(update={"start": (-0.9, 0.0999, 0.7)})}
    with pytest.raises(
        BadInput, match=r"agents\.r\.start: is 0\.3999 m from q's start; 0\.401 m is needed: separation 0\.3 m, twice"
    ):
        ltlplan.plan(mission.model_copy(update={"agents": agents}))


def test_the_least_distance_of_a_sampled_curve_is_a_bound_and_a_near_one() -> None:
    rng = np.random.default_rng(3)
    for _ in range(200):
        curve = np.polynomial.Polynomial(rng.normal(size=4)), *(np.polynomial.Polynomial(rng.normal(size=4)) for _ in range(2))
        dense = np.stack([axis(np.linspace(0.0, 2.0, 128 * 64 + 1)) for axis in curve], axis=1)
        least = float(np.linalg.norm(dense, axis=1).min())
        told = least_between(dense[::64])
        assert told <= least
        assert told >= least - 2e-3
    assert least_between(np.zeros((3, 3))) == 0.0
