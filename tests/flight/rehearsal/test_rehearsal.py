"""Rehearsals: a table of cells, the same whoever does the work, and honest about who leaves the tube."""

from __future__ import annotations

import json

import pytest

import flight
from flight import Combinations
from ltlplan.report.rehearsal import rehearsal_html
from tests.helpers.stand_ins import hop, rest_to_rest, stand_in
from verify.data import BadInput

FEW = Combinations(("mellinger", "lee", "pid"), (0.8, 1.0), (0.015,), ("0", "0.3+0.2"))


def short_hop():
    plan, team = hop()
    start = team["quad0"].evaluate(0)[:3]
    return plan, {"quad0": rest_to_rest([start, (start[0] - 0.15, start[1], start[2])], [0.6])}


@pytest.fixture(scope="module")
def found():
    plan, team = short_hop()
    return flight.rehearse(plan, team, stand_in(plan, team), combinations=FEW, runs=2)


def test_every_combination_has_its_cell(found):
    assert len(found.cells) == 3 * 2 * 1 * 2
    assert found.controllers == FEW.controllers
    assert [(cell.mass, cell.wind) for cell in found.of("lee")] == [(0.8, "0"), (0.8, "0.3+0.2"), (1.0, "0"), (1.0, "0.3+0.2")]


def test_the_table_says_who_leaves_the_tube(found):
    assert all(cell.inside for cell in found.of("mellinger") if cell.mass == 1.0)
    assert not any(cell.inside for cell in found.of("pid"))
    wrong, right = found.of("lee")[0], found.of("lee")[2]
    assert wrong.worst > 0.05 > right.worst
    rows = found.rows()
    assert rows[0] == ["controller", "mass", "15 ms, 0 m/s", "15 ms, 0.3+0.2 m/s"]
    assert all(cell.endswith("*") for row in rows if row[0] == "pid" for cell in row[2:])
    assert any("lee stayed in the tube of 0.05 m in 2 of 4 cells" in sentence for sentence in found.sentences)


def test_a_cell_is_the_worst_of_flights_that_anyone_can_fly_again(found):
    plan, team = short_hop()
    cell = found.of("mellinger")[-1]
    sensor = flight.MotionCapture(delay=0.015)
    worst = max(
        float(flight.fly(plan, team, controller="mellinger", noise=sensor, wind="0.3+0.2", seed=seed).peak[0])
        for seed in (0, 1)
    )
    assert cell.worst == pytest.approx(worst, abs=1e-4)


def test_findings_are_plain_data_and_a_page(found):
    data = json.loads(json.dumps(found.to_dict()))
    assert len(data["cells"]) == 12
    assert {"controller", "mass", "latency", "wind", "worst", "robot", "seed", "left", "inside"} == set(data["cells"][0])
    page = rehearsal_html(found)
    assert "<h1>two-tasks: rehearsal of 12 cells of 2 flights</h1>" in page
    assert page == rehearsal_html(found)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"controllers": ("mellingr",)}, "Did you mean 'mellinger'"),
        ({"controllers": ()}, "at least one of its controllers"),
        ({"masses": (0.03,)}, "0.5 to 1.5, not 0.03"),
        ({"masses": (1.0, 1.0)}, "each once"),
        ({"latencies": (15.0,)}, "latencies are 0 to 0.2 s"),
        ({"winds": ("breeze",)}, "is no wind"),
        ({"winds": ("1", "1.0,0,0")}, "at least one of its winds, each once"),
    ],
)
def test_combinations_that_cannot_be_flown_are_refused(given, said):
    with pytest.raises(BadInput, match=said):
        Combinations(**given)


def test_numbers_out_of_range_are_refused():
    plan, team = hop()
    with pytest.raises(BadInput, match="1 to 1000 times"):
        flight.rehearse(plan, team, runs=0)
    with pytest.raises(BadInput, match="workers must be at least 1"):
        flight.rehearse(plan, team, workers=0)
    with pytest.raises(BadInput, match="a seed is a whole number"):
        flight.rehearse(plan, team, seed=-1)
