"""Tabs of a service that has nothing yet, on a phone: each says what to do, with a button or a command, and none scrolls sideways."""

from __future__ import annotations

from typing import Any

from tests.browser.visitor import OF_THE_PAGE, Visitor

pytestmark = OF_THE_PAGE

TABS = ("plan", "watch", "trust", "simulate", "judge", "take-away", "live")


def test_every_empty_tab_says_what_to_do(address: str, chromium: Any) -> None:
    visitor = Visitor(chromium, address, width=360)
    for tab in TABS:
        visitor.open(f"/{tab}")
        place = visitor.page.locator(".empty:visible").first
        place.wait_for()
        assert place.locator("button, a.button, pre").count() > 0, tab
        assert len(place.inner_text()) > 30, tab
        assert visitor.page.evaluate("document.documentElement.scrollWidth <= innerWidth"), f"{tab} scrolls sideways"
    for tab, button, at in (
        ("trust", "Choose a job", "Plan"),
        ("simulate", "Write a mission", "Write"),
        ("watch", "Choose a job", "Plan"),
    ):
        visitor.open(f"/{tab}")
        visitor.page.locator(".empty:visible").get_by_text(button, exact=True).focus()
        visitor.page.keyboard.press("Enter")
        visitor.wait(f"document.querySelector('[role=tab][aria-selected=true]')?.textContent === '{at}'")
    visitor.end()
