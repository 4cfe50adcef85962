"""Names in the service's own scenes in a real browser: never one over another, robots to scale with rings, and words beside each scene that explain the rings."""

from __future__ import annotations

from typing import Any

import pytest

from ltlplan import Client, load_mission
from tests.browser.seen_names import LOOK, faults
from tests.browser.visitor import OF_THE_PAGE, Visitor
from tests.helpers.live.live_feeds import fed
from tests.helpers.serving.services import ONE_HOOP

pytestmark = OF_THE_PAGE

MISSIONS = ("office", "warehouse", "door-puzzle", "hoops-ltl")
WAYS = ("", "ArrowUp ArrowUp ArrowUp ArrowUp ArrowUp ArrowUp", "0 ArrowLeft ArrowLeft ArrowLeft ArrowLeft ArrowDown ArrowDown")
"""Keys that turn the camera: as it is at first, from above, from aside near the floor."""
DRAWN = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => requestAnimationFrame(done))))"
RINGS = """(holder) => holder.scene3d.robots.map(({ name, body }) => {
  const { radius, reach, halo } = body.userData;
  return { name, radius, ringed: halo.visible, reach, pixels: radius * holder.scene3d.pixels(body.position) };
})"""


def _look(visitor: Visitor, holder: Any) -> dict[str, Any]:
    """Return the names that are seen, after the scene was drawn again."""
    visitor.page.evaluate(DRAWN)
    seen = holder.evaluate(LOOK)
    assert faults(seen) == []
    assert holder.locator(".names-left").is_visible() == (seen["hidden"] > 0), (
        "a count of names is seen only where some have no room"
    )
    assert seen["hidden"] == len([each for each in seen["told"].split(", ") if each])
    return seen


@pytest.mark.parametrize("width", [1280, 390])
def test_no_name_lies_over_another_where_missions_are_written(address: str, chromium: Any, width: int) -> None:
    visitor = Visitor(chromium, address, width=width)
    visitor.open("/")
    visitor.checked()
    holder = visitor.page.locator(".holder.small").first
    for name in MISSIONS:
        visitor.page.get_by_role("button", name=name, exact=True).click()
        visitor.wait(f"document.querySelector('.state').textContent.includes('No faults: {name}')")
        mission = load_mission(name)
        visitor.wait(f"document.querySelector('.holder.small').scene3d.robots.length === {len(mission.agents)}")
        for keys in WAYS:
            for key in keys.split():
                holder.press(key)
            seen = _look(visitor, holder)
            known = {each["name"] for each in seen["names"]} | {each for each in seen["told"].split(", ") if each}
            assert {*mission.agents} <= known, "every robot is named, or listed among those without room"
        holder.press("0")
    visitor.end()


def test_every_scene_has_rings_for_robots_too_small_and_says_what_they_are(address: str, chromium: Any) -> None:
    with Client(address) as client:
        jobs = [client.submit_text(ONE_HOOP, seed=seed) for seed in (1, 2)]
        one, other = (job.wait().id for job in jobs)
    with fed(f"{address}/live/lab"):
        visitor = Visitor(chromium, address)
        for path, scenes in (
            ("/", 1),
            (f"/jobs/{one}/watch", 1),
            (f"/jobs/{one}/trust", 1),
            (f"/jobs/{one}/compare/{other}", 2),
            ("/live/lab", 2),
        ):
            visitor.open(path)
            drawn = visitor.page.locator(".holder[data-drawn=yes]:visible")
            drawn.nth(scenes - 1).wait_for()
            assert visitor.page.locator(".ring-words:visible").all_inner_texts() == [
                "Robots are to scale: a ring stands for one too small to be seen, and is no size."
            ], path
            for holder in drawn.all():
                _look(visitor, holder)
                robots = holder.evaluate(RINGS)
                assert robots, path
                for robot in robots:
                    assert robot["radius"] > 0
                    assert robot["ringed"] == (robot["pixels"] < 5), (path, robot)
        visitor.context.close()
