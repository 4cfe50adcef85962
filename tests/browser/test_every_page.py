"""Every page of the service as those meet it who do not see it, and what is drawn as those do who measure it."""

from __future__ import annotations

import time
from typing import Any

import httpx
import pytest

from ltlplan import Client
from ltlplan.missions import load_mission
from tests.browser.visitor import OF_THE_PAGE, Visitor
from tests.helpers.serving.services import ONE_HOOP

pytestmark = OF_THE_PAGE

NAMED = {
    "button", "link", "textbox", "searchbox", "combobox", "listbox", "checkbox", "radio", "slider", "spinbutton", "tab", "tabpanel", "image", "progressbar",
    "dialog", "menuitem", "switch",
}  # fmt: skip
"""Roles of what nobody can use who is not told what it is."""
STRUCTURE = """() => {
  const seen = (element) => element.checkVisibility({ visibilityProperty: true });
  const all = (kind) => [...document.querySelectorAll(kind)].filter(seen);
  const ids = [...document.querySelectorAll("[id]")].map((each) => each.id);
  const levels = all("h1, h2, h3, h4, h5, h6").map((each) => Number(each.tagName[1]));
  return {
    lang: document.documentElement.lang, title: document.title, mains: all("main, [role=main]").length, h1: levels.filter((level) => level === 1).length,
    doubled: ids.filter((id, i) => ids.indexOf(id) !== i), jumps: levels.filter((level, i) => level > (levels[i - 1] ?? 0) + 1),
    orders: all("[tabindex]").filter((each) => each.tabIndex > 0).length,
  };
}"""
TABS = ("plan", "watch", "trust", "simulate", "judge", "take-away", "compare", "live")


def _faults(visitor: Visitor, *, drawn_by_others: bool) -> list[str]:
    """Walk over the page that is open, as a screen reader does, and return what is wrong with it.

    Args:
        visitor: Has it open.
        drawn_by_others: Whether what is in the page is plotly's or Swagger's; then its frame is looked at.
    """
    found = visitor.page.evaluate(STRUCTURE)
    expected = (
        {"mains": 1, "h1": 1, "orders": 0}
        if drawn_by_others
        else {"mains": 1, "h1": 1, "orders": 0, "doubled": [], "jumps": []}
    )
    faults = [f"{name}: {found[name]}" for name, wanted in expected.items() if found[name] != wanted]
    faults += [f"{name}: none" for name in ("title", "lang") if not found[name]]
    if drawn_by_others:
        return faults
    session = visitor.context.new_cdp_session(visitor.page)
    nodes = session.send("Accessibility.getFullAXTree")["nodes"]
    session.detach()
    assert len(nodes) > 5
    for node in nodes:
        role = node.get("role", {}).get("value")
        if not node.get("ignored") and role in NAMED and not node.get("name", {}).get("value", "").strip():
            faults.append(f"a {role} without a name: {node.get('backendDOMNodeId')}")
    return faults


def test_every_page_can_be_walked_over(address: str, chromium: Any) -> None:
    with Client(address) as client:
        done = client.submit_text(ONE_HOOP).wait().id
        refused = client.submit_text(ONE_HOOP.replace("F hoop0", "F hoop0 & G !hoop0"))
        with pytest.raises(Exception, match="cannot hold together"):
            refused.wait()
    visitor = Visitor(chromium, address)
    paths = [
        "/", *(f"/{tab}" for tab in TABS), *(f"/jobs/{job}/{tab}" for job in (done, refused.id) for tab in TABS[:-1]), "/live/lab",
        "/login", "/docs", "/nothing", "/jobs/nothing/plan", f"/api/jobs/{done}/report",
    ]  # fmt: skip
    faults: dict[str, list[str]] = {}
    for path in paths:
        visitor.open(path)
        visitor.page.wait_for_load_state("networkidle")
        if path.startswith(f"/jobs/{done}/watch"):
            visitor.page.wait_for_selector(".flight[data-ready=yes] .holder[data-drawn=yes]")
        if found := _faults(visitor, drawn_by_others=path in ("/docs", f"/api/jobs/{done}/report")):
            faults[path] = found
    assert faults == {}
    visitor.context.close()


def test_robots_are_drawn_as_large_as_they_are(address: str, chromium: Any) -> None:
    visitor = Visitor(chromium, address)
    visitor.open("/")
    visitor.checked()
    for name in ("office", "firefighting"):
        visitor.page.get_by_role("button", name=name, exact=True).click()
        visitor.wait(f"document.querySelector('.state').textContent.includes('No faults: {name}')")
        mission = load_mission(name)
        visitor.wait(f"document.querySelector('.holder.small').scene3d.robots.length === {len(mission.agents)}")
        drawn = visitor.page.evaluate(
            """async () => {
              const { THREE } = await import("nicegui-scene");
              return document.querySelector(".holder.small").scene3d.robots.map(({ body }) => {
                body.updateWorldMatrix(true, true);
                const middle = body.getWorldPosition(new THREE.Vector3());
                const far = [];
                for (const part of body.children.filter((each) => each.isMesh)) {
                  const corners = part.geometry.getAttribute("position");
                  for (let i = 0; i < corners.count; i++) {
                    far.push(new THREE.Vector3().fromBufferAttribute(corners, i).applyMatrix4(part.matrixWorld).distanceTo(middle));
                  }
                }
                return Math.max(...far);
              });
            }"""
        )
        assert drawn == pytest.approx([mission.vehicle_of(robot).radius for robot in mission.agents], rel=0.02)
    visitor.end()


def test_the_list_of_jobs_goes_on_and_is_searched(address: str, chromium: Any) -> None:
    with httpx.Client(base_url=address, timeout=60) as client:
        for seed in range(1000, 1070):
            text = ONE_HOOP.replace("one-hoop", "needle" if seed == 1000 else "hay")
            job = client.post("/api/jobs", content=text, params={"seed": seed}).json()["id"]
            while (answer := client.post(f"/api/jobs/{job}/cancel")).status_code != 200:
                time.sleep(0.1)
            assert answer.json()["state"] == "cancelled"
    visitor = Visitor(chromium, address)
    visitor.open("/plan")
    visitor.wait("document.querySelectorAll('.job-list .entry').length === 60")
    assert "needle" not in visitor.said(".job-list")
    visitor.page.get_by_role("button", name="Show more").click()
    visitor.wait("document.querySelectorAll('.job-list .entry').length >= 70")
    assert "needle" in visitor.said(".job-list")
    visitor.page.get_by_role("searchbox").fill("Needle")
    visitor.wait("document.querySelectorAll('.job-list .entry').length === 1")
    visitor.page.locator(".job-list .entry").click()
    visitor.page.wait_for_selector(".job h2:text-is('needle')")
    visitor.page.get_by_role("searchbox").fill("nothing like this")
    visitor.page.wait_for_selector(".job-list li:has-text('No job has this')")
    visitor.page.get_by_role("searchbox").fill("")
    visitor.wait("document.querySelectorAll('.job-list .entry').length === 60")
    visitor.end()


def test_a_blank_mission_teaches_only_what_the_page_reads(address: str, chromium: Any) -> None:
    visitor = Visitor(chromium, address)
    visitor.open("/")
    visitor.checked()
    visitor.page.get_by_role("button", name="a blank mission").click()
    visitor.wait("document.querySelector('.state').textContent.includes('No faults: my-mission')")
    assert "include" not in visitor.written()
    visitor.end()


def test_states_are_not_told_as_places(address: str, chromium: Any) -> None:
    visitor = Visitor(chromium, address)
    visitor.open("/")
    visitor.checked()
    visitor.page.get_by_role("button", name="office", exact=True).click()
    visitor.wait("document.querySelector('.state').textContent.includes('No faults: office')")
    assert visitor.page.locator(".words li").all_inner_texts()[-1] == "At some time: in meeting and in state letters."
    kinds = {each.split()[0]: each.split()[1:] for each in visitor.page.locator(".names .kind").all_inner_texts()}
    assert kinds == {"Places": [*load_mission("office").regions, "free"], "States": ["letters"]}
    visitor.end()
