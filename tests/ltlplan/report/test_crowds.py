"""Scenes of many robots: what is drawn together, what is left out, and what a player still finds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from flight.figures import Figure
from flight.pictures import scene
from ltlplan import load_mission
from ltlplan.report.bars import Bar, bars_html
from ltlplan.report.crowds import lightened
from verify.data import Mission


@pytest.fixture
def mission() -> Mission:
    return load_mission("firefighting")


def drawn(mission: Mission) -> Figure:
    paths = {name: np.linspace(agent.start, np.add(agent.start, [1.0, 1.0, 0.5]), 9) for name, agent in mission.agents.items()}
    return scene(mission, paths)


def texts(figure: Any) -> list[list[str]]:
    return [list(trace.text) for trace in figure.data if trace.type == "scatter3d" and trace.mode == "text"]


def test_regions_become_one_body_and_robots_one_trace_that_names_them(mission: Mission) -> None:
    full: Any = drawn(mission).plotly()
    light: Any = lightened(drawn(mission)).plotly()
    bodies = [trace for trace in full.data if trace.type == "mesh3d"]
    merged = [trace for trace in light.data if trace.type == "mesh3d"]
    assert sum(len(body.x) for body in bodies) == sum(len(body.x) for body in merged)
    for body in merged:
        assert max(*body.i, *body.j, *body.k) < len(body.x) == len(body.hovertext)
        assert len(body.facecolor) == len(body.i)
    assert {name for body in merged for name in body.hovertext} == {body.name for body in bodies}
    assert texts(light) == [[words for (words,) in texts(full)]]
    paths, robots = light.data[-2:]
    assert list(robots.customdata) == [*mission.agents]
    starts = np.array([agent.start for agent in mission.agents.values()])
    assert np.array_equal(np.stack([robots.x, robots.y, robots.z], axis=-1), starts)
    for name in mission.agents:
        own = [value for value, whose in zip(paths.x, paths.customdata, strict=True) if whose == name]
        apart = next(trace for trace in full.data if trace.type == "scatter3d" and trace.name == name)
        assert own == [*apart.x, None], "a gap ends each robot's path"
    assert len(paths.x) == len(paths.line.color)


def test_charts_of_many_rows_are_folded() -> None:
    def chart(rows: int) -> str:
        return bars_html("c", [Bar("r0", 0.0, 1.0, "red", "r0")], [f"r{i}" for i in range(rows)], 1.0, "Chart")

    assert chart(40).startswith('<div id="c"')
    assert chart(41).startswith("<details><summary>All 41 rows</summary>")
