"""The page of pictures shows the plan itself."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import ltlplan
from flight.figures import Figure, Trace, trace
from ltlplan.missions import load_mission
from ltlplan.paths.improvement import improved_path
from ltlplan.report import pictures
from ltlplan.report.pictures import pictures_html
from tests.helpers.few import few_of
from verify.data import BadInput


@few_of(1, "name", ["firefighting", "hoops-ltl"])
def test_what_is_shown_is_what_is_planned(name: str) -> None:
    mission = load_mission(name)
    page = pictures_html(mission, seed=3)
    plan = ltlplan.plan(mission, seed=3)
    for robot, path in plan.robots.items():
        if len(path.waypoints) < 2:
            assert f"{robot} stays at its start" in page
        else:
            assert f"after cross-entropy {path.cost:.3f}." in page


@pytest.mark.slow
def test_the_round_that_is_asked_for_is_drawn_counted_from_one(monkeypatch: pytest.MonkeyPatch) -> None:
    mission = load_mission("hoops-ltl")
    drawn: list[np.ndarray] = []
    monkeypatch.setattr(
        pictures, "round_figure", lambda _mission, positions, *_, **__: drawn.append(positions) or Figure([_text()])
    )
    rounds: list[np.ndarray] = []

    def every_round(*args: Any, **options: Any) -> Any:
        *rest, watch = args
        return improved_path(*rest, lambda *seen: (rounds.append(seen[1].paths(seen[2]).position), watch(*seen)))

    monkeypatch.setattr(pictures, "improved_path", every_round)
    for asked in (1, mission.planner.iterations):
        rounds.clear()
        page = pictures_html(mission, shown_round=asked)
        assert f"quad0: sampled paths of round {asked}<" in page
        assert len(rounds) == mission.planner.iterations
        assert np.array_equal(drawn[-1], rounds[asked - 1])
    assert "quad0: sampled paths of round 1<" in pictures_html(mission)


def _text() -> Trace:
    return trace("scatter3d", x=[0], y=[0], z=[0], mode="text", text=["a round"])


@pytest.mark.parametrize("asked", [0, 13, 999])
def test_a_round_that_there_is_not_is_refused_before_any_planning(asked: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pictures, "make_plan", lambda *_, **__: pytest.fail("planned for a page that cannot be"))
    with pytest.raises(BadInput, match=rf"round {asked}: cross-entropy has 12 rounds here .*choose 1 to 12"):
        pictures_html(load_mission("firefighting"), shown_round=asked)


def test_a_search_that_ended_before_the_round_is_refused_with_what_there_was() -> None:
    mission = load_mission("hoops-ltl")
    easy = mission.model_copy(update={"planner": mission.planner.model_copy(update={"target": 6.9})})
    with pytest.raises(BadInput, match=r"no round 12 to draw; the rounds that were needed: quad0 \d+\."):
        pictures_html(easy, shown_round=12)
