"""Names in scenes in a real browser: none lies over another, and each is beside its thing or has a line to it, from wherever one looks."""

from __future__ import annotations

from pathlib import Path

import pytest

import ltlplan
from flight.pictures import scene
from ltlplan.report.page import figure_place, page_html, section
from tests.browser.devtools import CHROMIUM, Browser
from tests.browser.seen_names import LOOK, faults

pytestmark = [
    pytest.mark.browser,
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium to look at scenes"),
]

MISSIONS = ("office", "warehouse", "door-puzzle", "hoops-ltl")
WIDTHS = (1200, 700, 360)
EYES = ((0.8, -1.7, 1.0), (0.01, -0.01, 2.2), (-1.9, 0.3, 0.2))
"""From the front, from above, from aside near the floor."""


@pytest.mark.parametrize("name", MISSIONS)
def test_no_name_lies_over_another_in_a_report(name: str, browser: Browser, tmp_path: Path) -> None:
    mission = ltlplan.load_mission(name)
    place = section("Scene", figure_place("scene", "The scene of the mission", scene=True))
    page = tmp_path / "page.html"
    page.write_text(page_html(name, header="", sections=[place], figures={"scene": scene(mission, {})}), encoding="utf-8")
    wanted = {*mission.agents, *mission.all_regions}
    for width in WIDTHS:
        tab = browser.open(page, width=width, phone=width == min(WIDTHS)).to_front()
        for x, y, z in EYES:
            tab.run(f"Plotly.relayout('scene', {{'scene.camera.eye': {{x: {x}, y: {y}, z: {z}}}}}).then(() => true)")
            tab.run("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
            seen = tab.run(f"({LOOK})(document)")
            assert faults(seen) == [], (width, x, y, z)
            assert len(seen["names"]) >= min(6, len(wanted)) or width == min(WIDTHS)
            assert seen["hidden"] == len([each for each in seen["told"].split(", ") if each])
        assert tab.run("document.documentElement.scrollWidth <= innerWidth"), f"{width} pixels scroll sideways"
        assert tab.complaints() == []
        tab.close()


def test_a_camera_is_moved_by_keys(browser: Browser, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    place = section("Scene", figure_place("scene", "The scene of the mission", scene=True))
    figures = {"scene": scene(ltlplan.load_mission("office"), {})}
    page.write_text(page_html("keys", header="", sections=[place], figures=figures), encoding="utf-8")
    tab = browser.open(page).to_front()
    eye = "JSON.stringify(document.getElementById('scene')._fullLayout.scene.camera)"
    first = tab.run(eye)
    tab.run("document.getElementById('scene').focus()")
    for key in ("ArrowLeft", "+"):
        before = tab.run(eye)
        tab.call("Input.dispatchKeyEvent", {"type": "keyDown", "key": key})
        tab.wait(f"{eye} !== {before!r}")
    tab.call("Input.dispatchKeyEvent", {"type": "keyDown", "key": "0"})
    tab.wait(f"{eye} === {first!r}")
    assert faults(tab.run(f"({LOOK})(document)")) == []
    tab.close()
