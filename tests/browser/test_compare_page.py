"""Studies and comparisons on the page: begun where a mission is written, followed as they run, two rows compared."""

from __future__ import annotations

from typing import Any

from tests.browser.visitor import OF_THE_PAGE, Visitor
from tests.helpers.serving.services import ONE_HOOP

pytestmark = OF_THE_PAGE


def test_a_study_is_begun_followed_and_two_of_its_results_compared(chromium: Any, address: str) -> None:
    visitor = Visitor(chromium, address)
    visitor.open("/")
    visitor.checked()
    visitor.write(ONE_HOOP)
    visitor.wait("document.querySelector('.state')?.textContent.includes('No faults: one-hoop')")
    page = visitor.page
    page.get_by_role("button", name="Study this mission").click()
    page.locator("input[name=key]").fill("limits.speed")
    page.locator("textarea[name=values]").fill("1.0, 5")
    page.get_by_role("button", name="Study it").click()
    page.get_by_text("is above the vehicle's own").wait_for()
    page.locator("textarea[name=values]").fill("0.3, 0.4")
    page.get_by_role("button", name="Study it").click()
    visitor.wait("location.pathname.startsWith('/studies/')")
    assert visitor.at() == "Compare"
    visitor.wait("document.querySelector('.job .head .chip')?.textContent === 'all ended'")
    assert page.locator(".study-table tbody tr").count() == 2
    assert page.locator("svg.plot circle").count() == 2
    page.get_by_label("Figure over the values").select_option("largest_margin")
    visitor.wait("document.querySelector('svg.plot').getAttribute('aria-label').startsWith('largest margin')")
    for value in ("0.3", "0.4"):
        page.get_by_label(f"Compare {value}").check()
    page.get_by_role("button", name="Compare the two").click()
    visitor.wait("document.querySelector('.pair')?.dataset.ready === 'both'")
    assert "speed: 0.4" in visitor.said(".compared .difference .added")
    assert "limits.speed" in visitor.said(".compared")
    address_of_two = page.evaluate("location.pathname")
    page.get_by_role("button", name="Play both").click()
    visitor.wait("Number(document.querySelector('.pair .clock').value) > 0.2")
    visitor.open(address_of_two)
    visitor.wait("document.querySelector('.pair')?.dataset.ready === 'both'")
    assert "one-hoop" in visitor.said(".pair figcaption")
    visitor.end()


def test_without_studies_the_page_says_how_one_begins(chromium: Any, address: str) -> None:
    visitor = Visitor(chromium, address, width=390, dark=True)
    visitor.open("/compare")
    visitor.wait("window.socket?.connected")
    visitor.page.get_by_label("Search studies").fill("no such study")
    visitor.page.get_by_text("No study has this").wait_for()
    seen = visitor.page.locator("#compare-tab").bounding_box()
    assert 0 <= seen["x"] <= seen["x"] + seen["width"] <= 390, "the tab that is open is in sight"
    visitor.end()
