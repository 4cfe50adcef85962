"""Names in scenes in a real browser: none lies over another, and each is beside its thing or has a line to it, from wherever one looks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import ltlplan
from flight.pictures import scene
from ltlplan.report.page import figure_place, page_html, section
from tests.browser.devtools import CHROMIUM, Browser

pytestmark = [
    pytest.mark.browser,
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium to look at scenes"),
]

MISSIONS = ("office", "warehouse", "door-puzzle", "hoops-ltl")
WIDTHS = (1200, 700, 360)
EYES = ((0.8, -1.7, 1.0), (0.01, -0.01, 2.2), (-1.9, 0.3, 0.2))
"""From the front, from above, from aside near the floor."""

LOOK = """
(() => {
  const around = document.querySelector(".scene-names").getBoundingClientRect();
  const names = [...document.querySelectorAll(".scene-name")].filter((each) => each.style.visibility === "visible");
  const lines = [...document.querySelectorAll(".scene-names path")].map((path) => path.getAttribute("d").slice(1).split("L").map((at) => at.split(",").map(Number)));
  return {
    names: names.map((each) => {
      const box = each.getBoundingClientRect(), [x, y, reach] = each.dataset.at.split(" ").map(Number);
      return { name: each.textContent, left: box.left - around.left, top: box.top - around.top, right: box.right - around.left, bottom: box.bottom - around.top, x, y, reach };
    }),
    lines, width: around.width, height: around.height,
    hidden: document.querySelector(".names-left").hidden ? 0 : Number(document.querySelector(".names-left summary").textContent.split(" ")[0]),
    told: document.querySelector(".names-left p").textContent,
  };
})()
"""


def faults(seen: dict[str, Any]) -> list[str]:
    """Return which names lie over others, over the edge, or far from their things without a line."""
    found: list[str] = []
    names = seen["names"]
    for index, one in enumerate(names):
        if (
            one["left"] < -0.6
            or one["top"] < -0.6
            or one["right"] > seen["width"] + 0.6
            or one["bottom"] > seen["height"] + 0.6
        ):
            found.append(f"{one['name']} is over the edge")
        for other in names[:index]:
            if (one["left"] < other["right"] and other["left"] < one["right"]
                    and one["top"] < other["bottom"] and other["top"] < one["bottom"]):  # fmt: skip
                found.append(f"{one['name']} lies over {other['name']}")
        off = max(one["left"] - one["x"], one["x"] - one["right"], one["top"] - one["y"], one["y"] - one["bottom"])
        joined = any(abs(start[0] - one["x"]) + abs(start[1] - one["y"]) < 0.3 for start, _ in seen["lines"])
        if off > one["reach"] + 4 and not joined:
            found.append(f"{one['name']} is {off:.0f} pixels from its thing and has no line")
    return found


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
            seen = tab.run(LOOK)
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
    assert faults(tab.run(LOOK)) == []
    tab.close()
