"""A passage is inside its hoop's region by the margin as long as the opening is near, however much wider the opening is."""

from __future__ import annotations

import numpy as np
import pytest

import ltlplan
import verify
from ltlplan.pipeline import certified_team
from refine import refine
from tests.helpers.few import few_of
from tests.helpers.missions.gates import SHAPES, gate, gate_of
from verify.data import Infeasible


@few_of(1, "seed", range(8))
def test_visits_contain_their_passages_where_openings_are_wide(seed: int, pace: float | str) -> None:
    rng = np.random.default_rng(seed)
    mission = gate(
        rng.uniform(0.14, 0.2, 3).round(3).tolist(), round(float(rng.uniform(0.27, 0.36)), 3), yaw=float(rng.uniform(-40, 40))
    )
    done = certified_team(ltlplan.plan(mission, seed=0, pace=pace))
    assert done.rounds == 1
    assert verify.judge(done.plan, done.team, largest=False).holds


def test_a_region_too_small_for_its_passage_is_the_reason() -> None:
    mission = gate([0.09, 0.09, 0.09], 0.25)
    with pytest.raises(Infeasible, match=r"'a' reaches .* so no visit could contain a passage. Give it a larger region"):
        refine(ltlplan.plan(mission, seed=0))


@pytest.mark.slow
@pytest.mark.parametrize("shape", ["box", *(pytest.param(name, marks=pytest.mark.slow) for name in SHAPES if name != "box")])
def test_rings_stand_in_regions_of_all_shapes(shape: str) -> None:
    for formula in ("F a & F goal", "F(goal & F G a)"):
        done = certified_team(ltlplan.plan(gate_of(SHAPES[shape], yaw=20.0, formula=formula), seed=0))
        assert verify.judge(done.plan, done.team, largest=False).holds
