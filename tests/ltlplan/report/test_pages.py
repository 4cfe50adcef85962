"""Pages are small enough to send, and their charts can be read: scales, colours, bars."""

from __future__ import annotations

import base64
import gzip
import itertools
import json
import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from plotly.offline import get_plotlyjs

import ltlplan
from flight.campaigns import campaign
from flight.flights import fly
from flight.pictures import COLOURS, REGION_COLOURS
from ltlplan.report.bars import Bar, bars_html, tick_step
from ltlplan.report.campaign import campaign_html
from ltlplan.report.charts import limit_chart
from ltlplan.report.inline import packed, script_data, stepped
from ltlplan.report.over_time import Line, over_time, stacked
from ltlplan.report.pictures import pictures_html
from ltlplan.report.run_page import report_html
from tests.helpers.missions.shipped import PAPER_MISSIONS, WORLD_MISSIONS
from tests.helpers.pages import MOST_BYTES, bars_of, carried, data_of, read_rows


def size(page: str) -> int:
    return len(page.encode())


@pytest.mark.parametrize(
    "name",
    [
        "firefighting",
        *(pytest.param(name, marks=pytest.mark.slow) for name in (*PAPER_MISSIONS, *WORLD_MISSIONS) if name != "firefighting"),
    ],
)
def test_the_report_of_a_shipped_mission_can_be_sent(shipped_run, name: str) -> None:
    assert size(report_html(shipped_run(name))) <= MOST_BYTES


@pytest.mark.parametrize(
    "name",
    ["firefighting", *(pytest.param(name, marks=pytest.mark.slow) for name in (*PAPER_MISSIONS[1:], *WORLD_MISSIONS))],
)
def test_the_pictures_of_a_shipped_mission_can_be_sent(shipped_page, name: str) -> None:
    """Those of hoops-sequence are weighed by default, too, where the command line draws them."""
    pictures = shipped_page("show") if name == "firefighting" else pictures_html(ltlplan.load_mission(name))
    assert size(pictures) <= MOST_BYTES


@pytest.mark.parametrize("name", ["campaign", pytest.param("online", marks=pytest.mark.slow)])
def test_the_pages_of_a_campaign_and_of_an_online_flight_can_be_sent(shipped_page, name: str) -> None:
    assert size(shipped_page(name)) <= MOST_BYTES


def test_a_page_carries_all_of_plotly_and_unpacks_to_the_same(
    shipped_run: Callable[[str], ltlplan.Result], shipped_page: Callable[[str], str]
) -> None:
    page = shipped_page("report")
    assert carried(page, "plotly") == get_plotlyjs()
    assert page == report_html(shipped_run("firefighting"))
    text = "</script> & <b>\N{GREEK SMALL LETTER DELTA}" * 7
    assert "<" not in packed(text)
    assert gzip.decompress(base64.b85decode(packed(text).replace(",", "<"))).decode() == text


def test_long_rows_of_numbers_are_carried_to_the_last_digit() -> None:
    rng = np.random.default_rng(0)
    path = rng.normal(0.0, 0.05, (200, 3)).cumsum(axis=0).round(4).tolist()
    data = {
        "path": path,
        "values": [row[0] for row in path],
        "exact": rng.normal(size=100).tolist(),
        "whole": list(range(100)),
        "broken": [0.5, None] * 50,
        "mixed": [[1.0, 2.0, None]] * 50,
        "texts": ["a"] * 50,
        "short": [1.25, 2.0],
        "large": [1e300] * 50,
    }
    written = carried(f'<script id="data" type="text/plain">{script_data(data)}</script>', "data")
    assert read_rows(json.loads(written)) == data
    assert len(json.dumps(stepped(path))) < 0.7 * len(json.dumps(path))


def lab(colour: str) -> np.ndarray:
    """CIE L*a*b* of a colour such as #1f77b4, white D65: distances in it are about what people see."""
    channels = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
    to_xyz = [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
    x, y, z = (t ** (1 / 3) if t > 0.008856 else 7.787 * t + 16 / 116 for t in to_xyz @ linear / [0.95047, 1.0, 1.08883])
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def test_no_region_has_a_colour_that_could_be_a_robots() -> None:
    for robot, region in itertools.product(COLOURS, REGION_COLOURS):
        assert np.linalg.norm(lab(robot) - lab(region)) > 20, f"robot {robot}, region {region}"
    for palette in (COLOURS, REGION_COLOURS):
        for first, second in itertools.combinations(palette, 2):
            assert np.linalg.norm(lab(first) - lab(second)) > 12, f"{first} and {second}"


def test_an_axis_is_broken_only_where_a_limit_would_flatten_the_curve() -> None:
    times = np.linspace(0, 2, 21)
    lines = {"quad0": Line(times, np.abs(np.sin(times)))}
    near = over_time(lines, "error (mm)", {"margin": 2.0})
    assert "yaxis2" not in near.layout
    far = over_time(lines, "error (mm)", {"margin": 50.0, "least": 0.1}).plotly()
    assert far.layout.yaxis.range[1] < 1.5, "the curve fills its part of the chart"
    low, high = far.layout.yaxis2.range
    assert low < 50.0 < high
    assert far.layout.yaxis.domain[1] < far.layout.yaxis2.domain[0]
    drawn = {trace.name: (trace.yaxis or "y", trace.y[0]) for trace in far.data if trace.name != "quad0"}
    assert drawn == {"margin": ("y2", 50.0), "least": ("y", 0.1)}
    still = over_time({"quad0": Line(times, 0 * times)}, "error (mm)", {"margin": 50.0})
    assert "yaxis2" not in still.layout, "where nothing moves there is nothing to flatten"


def test_panels_have_one_legend_one_time_and_the_limit_each() -> None:
    times = np.linspace(0, 2, 21)
    lines = {name: Line(times, np.abs(np.sin(times))) for name in ("quad0", "quad1")}
    figure = stacked({"speed": lines, "thrust": {"quad0": Line(times, 3.0 + times)}}, 1.0, "limit").plotly()
    drawn = [(trace.name, trace.yaxis, trace.showlegend) for trace in figure.data]
    assert drawn == [
        ("quad0", "y", True), ("quad1", "y", True), ("limit", "y", False), ("quad0", "y2", False), ("limit", "y2", False),
    ]  # fmt: skip
    upper, lower = figure.layout.yaxis, figure.layout.yaxis2
    assert (upper.title.text, lower.title.text) == ("speed", "thrust")
    assert upper.domain[0] > lower.domain[1]
    assert upper.range[1] > 1.0
    assert lower.range[1] > 5.0, "what exceeds its limit is seen"
    assert figure.layout.xaxis.anchor == "y2"
    assert [(note.text, note.y, note.yref) for note in figure.layout.annotations] == [("limit", 1, "y"), ("limit", 1, "y2")]


def test_shares_of_limits_are_those_of_the_certificate(shipped_run) -> None:
    run = shipped_run("firefighting")
    shares = {(trace["name"], trace["yaxis"]): max(trace["y"]) for trace in limit_chart(run).data if trace["name"] in run.team}
    for axis, limit in (("y", "speed"), ("y2", "acceleration"), ("y3", "thrust_max")):
        for name in run.team:
            (claim,) = (each for each in run.certificate.claims if (each.name, each.robot) == (f"limits.{limit}", name))
            assert claim.bound is not None
            assert claim.limit is not None
            assert 0.98 * claim.bound / claim.limit <= shares[name, axis] + 1e-3
            assert shares[name, axis] <= claim.bound / claim.limit + 1e-3
            assert shares[name, axis] <= 1.0


@pytest.mark.slow
def test_the_error_chart_of_a_run_shows_curve_and_margin(shipped_run) -> None:
    flown = shipped_run("firefighting")
    run = replace(flown, log=fly(flown.plan, flown.team, flown.certificate))  # in still air, by who knows all: far inside
    layout = data_of(report_html(run))["figures"]["errors"]["layout"]
    greatest = 1000 * float(run.log.error.max())
    assert greatest <= layout["yaxis"]["range"][1] < 1.5 * greatest
    assert layout["yaxis2"]["tickvals"] == [pytest.approx(1000 * run.certificate.margin)]


@pytest.mark.parametrize(("end", "step"), [(8.08, 2.0), (0.9, 0.2), (17.7, 5.0), (80.0, 10.0), (1000.0, 200.0), (0.0, 2e-7)])
def test_ticks_are_round_numbers(end: float, step: float) -> None:
    assert tick_step(end) == pytest.approx(step)


def test_bars_stand_where_they_last_and_touching_ones_are_joined() -> None:
    bars = [
        Bar("a <b>", 0.0, 1.0, "#123456", "a"),
        Bar("a <b>", 1.0, 2.5, "#123456", "a"),
        Bar("a <b>", 4.0, 5.0, "#123456", "a"),
    ]
    bars += [Bar("c", 2.0, 3.0, "#123456", "c"), Bar("c", 3.0, 4.0, "#654321", "c")]
    page = bars_html("chart", bars, ["a <b>", "c", "nothing"], 10.0, "what is seen")
    rows, seen = bars_of(page, "chart")
    assert rows == ["a <b>", "c", "nothing"]
    assert [(bar.row, bar.start, bar.length) for bar in seen] == [
        ("a <b>", 0.0, 0.25), ("a <b>", 0.4, 0.1), ("c", 0.2, 0.1), ("c", 0.3, 0.1),
    ]  # fmt: skip
    assert seen[0].title == "a: 0.00 to 2.50 s"
    assert re.findall(r"<b style=\"left:([0-9.]+)%\">([0-9.]+)</b>", page) == [
        (f"{10 * k}.000", str(k)) for k in range(0, 11, 2)
    ]


def test_one_flight_is_not_called_flights(shipped_run) -> None:
    run = shipped_run("firefighting")
    assert "<h1>firefighting: 1 flight</h1>" in campaign_html(campaign(run.plan, run.team, run.certificate, runs=5, seed=0))
