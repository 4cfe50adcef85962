import itertools

import numpy as np
import pytest

from ltlplan.missions import load_mission
from ltlplan.paths.costs import WeightedCost
from ltlplan.paths.cross_entropy.cross_entropy import Options, improve
from ltlplan.paths.hoops import route_sequence
from ltlplan.report.hoop_figures import control_point_figure, path_figure, primitives_figure, round_figure
from verify.data import BadInput


@pytest.fixture(scope="module")
def published():
    mission = load_mission("hoops-published")
    return mission, route_sequence(mission)


def names(figure):
    return {trace.name for trace in figure.data}


def test_control_points_are_drawn_for_every_hoop(published):
    mission, _ = published
    figure = control_point_figure(mission).plotly()
    texts = [t for trace in figure.data for t in (trace.hovertext or ())]
    for hoop in mission.hoops:
        assert {f"{hoop} rear", f"{hoop} centre", f"{hoop} front", f"{hoop} avoid"} <= set(texts)
    assert figure.layout.scene.xaxis.title.text == "x (m)"
    written = _named(figure)
    assert list(written) == list(mission.hoops)
    for name, hoop in mission.hoops.items():
        assert written[name].z[0] > hoop.center[2] + hoop.opening + hoop.rim  # above the ring


def _named(figure):
    return {trace.text[0]: trace for trace in figure.data if trace.type == "scatter3d" and trace.mode == "text"}


def test_hoops_are_drawn_as_they_are_and_to_scale(published):
    mission, plan = published
    workspace = np.array(mission.workspace.max) - np.array(mission.workspace.min)
    for figure in (control_point_figure(mission), primitives_figure(mission, plan), path_figure(mission, plan)):
        figure = figure.plotly()
        shown = figure.layout.scene
        ranges = np.array([np.ptp(shown[f"{axis}axis"].range) for axis in "xyz"])
        ratio = np.array([shown.aspectratio[axis] for axis in "xyz"])
        assert shown.aspectmode == "manual"
        assert ranges == pytest.approx(workspace)
        assert ratio / ratio[0] == pytest.approx(workspace / workspace[0])
        for name, hoop in mission.hoops.items():
            (rim,) = [trace for trace in figure.data if trace.name == f"{name} rim"]
            corners = np.stack([rim.x, rim.y, rim.z], axis=1) - np.array(hoop.center)
            along = corners @ np.array(hoop.normal)
            across = np.linalg.norm(corners - along[:, None] * np.array(hoop.normal), axis=1)
            assert np.hypot(along, across - hoop.opening - hoop.rim / 2) == pytest.approx(max(hoop.rim, 0.01) / 2, abs=2e-4)


def test_primitives_are_drawn_in_order_and_named(published):
    mission, plan = published
    figure = primitives_figure(mission, plan).plotly()
    assert {"STRAIGHT", "S_CURVE", "U_TURN", "waypoints"} <= names(figure)
    lines = [trace for trace in figure.data if trace.name in ("STRAIGHT", "S_CURVE", "U_TURN", "TURN")]
    assert len(lines) == len(plan.waypoints) - 1
    for before, after in itertools.pairwise(lines):
        assert before.x[-1] == pytest.approx(after.x[0])


def test_a_lasso_is_drawn_as_prefix_and_cycle(published):
    mission, plan = published
    figure = path_figure(mission, plan).plotly()
    assert {"prefix", "cycle"} <= names(figure)
    cycle = next(trace for trace in figure.data if trace.name == "cycle")
    assert cycle.x[0] == pytest.approx(cycle.x[-1], abs=0.05)


def test_a_round_and_the_optimised_path_are_drawn(published):
    mission, plan = published
    rounds = []
    found = improve(
        mission, "quad0", plan, rng=np.random.default_rng(0), options=Options(samples=40, rounds=2),
        cost=WeightedCost.of({"length": 1.0}),
        watch=lambda _, problem, candidates, costs: rounds.append((problem.paths(candidates).position, np.isfinite(costs))),
    )  # fmt: skip
    positions, counts = rounds[0]
    figure = round_figure(mission, positions, counts, best=found.plan).plotly()
    assert {"satisfies the specification, its cycle", "the path in the end"} <= names(figure)
    drawn = next(trace for trace in figure.data if trace.name.startswith("satisfies the specification ("))
    assert int(np.isnan(np.array(drawn.x, dtype=float)).sum()) == int(counts.sum())  # a gap after each path
    few = round_figure(mission, positions, counts, best=found.plan, most_points=6 * positions.shape[1]).plotly()
    drawn = next(trace for trace in few.data if trace.name == f"satisfies the specification ({int(counts.sum())})")
    assert int(np.isnan(np.array(drawn.x, dtype=float)).sum()) == min(3, int(counts.sum()))
    assert {"nominal path", "cycle"} <= names(path_figure(mission, found.plan, nominal=plan).plotly())
    assert len(figure.to_json()) > 1000
    with pytest.raises(BadInput, match="counts"):
        round_figure(mission, positions, counts[:-1])
