"""Manners of the service's page: nothing is cut off on a phone, dialogs keep the focus and give it back, and motion is left out where it is not wanted."""

from __future__ import annotations

from typing import Any

import pytest

from ltlplan import Client
from tests.browser.visitor import LIMIT, OF_THE_PAGE, Visitor
from tests.helpers.serving.services import ONE_HOOP

pytestmark = OF_THE_PAGE

CUT = """(places) => [...document.querySelectorAll(places)].filter((each) => each.checkVisibility()).filter((each) => {
  const box = each.getBoundingClientRect();
  return box.width > 0 && (box.right > innerWidth + 0.5 || each.scrollWidth > each.clientWidth + 1);
}).map((each) => each.textContent || each.placeholder)"""
"""Text that goes over the window's edge, or over its own."""
HINTS = """() => {
  const pen = document.createElement("canvas").getContext("2d");
  return [...document.querySelectorAll("input[placeholder]")].filter((each) => each.checkVisibility()).filter((each) => {
    const style = getComputedStyle(each);
    pen.font = style.font;
    return pen.measureText(each.placeholder).width > each.clientWidth - parseFloat(style.paddingLeft) - parseFloat(style.paddingRight) + 1;
  }).map((each) => each.placeholder);
}"""
"""Hints that have no room in their fields."""


@pytest.fixture(scope="module")
def job(address: str) -> str:
    """Return a job that is done."""
    with Client(address) as client:
        return client.submit_text(ONE_HOOP).wait().id


def test_nothing_is_cut_off_on_a_phone(address: str, chromium: Any, job: str) -> None:
    visitor = Visitor(chromium, address, width=390, height=844)
    for tab, place in (("take-away", ".away td, .away p"), ("judge", ".bounds label span"), ("simulate", ".bounds label span")):
        visitor.open(f"/jobs/{job}/{tab}")
        visitor.page.locator(f"{place.split(',')[0]}:visible").first.wait_for()
        assert visitor.page.evaluate(CUT, place) == [], tab
        assert visitor.page.evaluate(HINTS) == [], tab
    visitor.end()


def test_a_dialog_keeps_the_focus_and_gives_it_back(address: str, chromium: Any, job: str) -> None:
    visitor = Visitor(chromium, address)
    visitor.open(f"/jobs/{job}/plan")
    opens = visitor.page.get_by_role("button", name="Delete", exact=True)
    opens.focus()
    visitor.page.keyboard.press("Enter")
    visitor.page.get_by_role("button", name="Keep it").wait_for()
    within = "document.activeElement?.closest('[role=dialog]') !== null"
    visitor.wait(within)
    for _ in range(6):
        visitor.page.keyboard.press("Tab")
        assert visitor.page.evaluate(within)
    visitor.page.keyboard.press("Escape")
    visitor.page.get_by_role("button", name="Keep it").wait_for(state="hidden")
    visitor.wait("document.activeElement !== document.body")
    assert visitor.page.evaluate("document.activeElement.textContent") == "Delete"
    visitor.end()


def test_motion_is_left_out_where_it_is_not_wanted(address: str, chromium: Any, job: str) -> None:
    context = chromium.new_context(reduced_motion="reduce", viewport={"width": 1280, "height": 800})
    visitor = Visitor(chromium, address, context=context)
    visitor.open(f"/jobs/{job}/plan")
    visitor.page.get_by_role("button", name="Delete", exact=True).click()
    visitor.page.get_by_role("button", name="Keep it").wait_for(timeout=LIMIT)
    moving = """() => document.getAnimations().filter((each) => {
      const { duration, iterations } = each.effect.getComputedTiming();
      return duration > 5 || iterations === Infinity;
    }).length"""
    assert visitor.page.evaluate(moving) == 0
    visitor.end()
