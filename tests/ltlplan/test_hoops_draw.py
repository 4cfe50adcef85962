import itertools

import numpy as np
import pytest

from ltlplan.cost import WeightedCost
from ltlplan.cross_entropy import Options, improve
from ltlplan.hoops import route_sequence
from ltlplan.hoops.draw import control_point_figure, path_figure, primitives_figure, round_figure
from ltlplan.missions import load_mission
from verify.data import BadInput


@pytest.fixture(scope="module")
def published():
    mission = load_mission("hoops-published")
    return mission, route_sequence(mission)


def names(figure):
    return {trace.name for trace in figure.data}


def test_control_points_are_drawn_for_every_hoop(published):
    mission, _ = published
    figure = control_point_figure(mission)
    texts = [t for trace in figure.data for t in (getattr(trace, "text", None) or ())]
    for hoop in mission.hoops:
        assert {f"{hoop} rear", f"{hoop} centre", f"{hoop} front", f"{hoop} avoid"} <= set(texts)
    assert figure.layout.scene.xaxis.title.text == "x (m)"
    written = next(trace for trace in figure.data if trace.name == "names")
    assert list(written.text) == list(mission.hoops)
    for hoop, z in zip(mission.hoops.values(), written.z, strict=True):
        assert z > hoop.center[2] + hoop.opening + hoop.rim  # above the ring


def test_primitives_are_drawn_in_order_and_named(published):
    mission, plan = published
    figure = primitives_figure(mission, plan)
    assert {"STRAIGHT", "S_CURVE", "U_TURN", "waypoints"} <= names(figure)
    lines = [trace for trace in figure.data if trace.name in ("STRAIGHT", "S_CURVE", "U_TURN", "TURN")]
    assert len(lines) == len(plan.waypoints) - 1
    for before, after in itertools.pairwise(lines):
        assert before.x[-1] == pytest.approx(after.x[0])


def test_a_lasso_is_drawn_as_prefix_and_cycle(published):
    mission, plan = published
    figure = path_figure(mission, plan)
    assert {"prefix", "cycle"} <= names(figure)
    cycle = next(trace for trace in figure.data if trace.name == "cycle")
    assert cycle.x[0] == pytest.approx(cycle.x[-1], abs=0.05)


def test_a_round_and_the_optimised_path_are_drawn(published):
    mission, plan = published
    rounds = []
    found = improve(
        mission, "quad0", plan, rng=np.random.default_rng(0), options=Options(samples=40, rounds=2),
        cost=WeightedCost({"length": 1.0}),
        watch=lambda _, problem, candidates, costs: rounds.append((problem.paths(candidates).position, np.isfinite(costs))),
    )  # fmt: skip
    positions, counts = rounds[0]
    figure = round_figure(mission, positions, counts, best=found.plan)
    assert {"satisfies the specification, its cycle", "the path in the end"} <= names(figure)
    drawn = next(trace for trace in figure.data if trace.name.startswith("satisfies the specification ("))
    assert int(np.isnan(np.array(drawn.x, dtype=float)).sum()) == int(counts.sum())  # a gap after each path
    assert {"nominal path", "cycle"} <= names(path_figure(mission, found.plan, nominal=plan))
    assert len(figure.to_json()) > 1000
    with pytest.raises(BadInput, match="counts"):
        round_figure(mission, positions, counts[:-1])
