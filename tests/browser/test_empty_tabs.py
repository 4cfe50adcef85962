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


def test_every_empty_list_says_what_to_do_and_leads_there(address: str, chromium: Any) -> None:
    visitor = Visitor(chromium, address, width=360)

    def step(place: str, words: str) -> None:
        button = visitor.page.locator(f"{place} .empty:visible").get_by_text(words, exact=True)
        button.focus()
        visitor.page.keyboard.press("Enter")

    for path, place in (("/plan", ".job-list"), ("/compare", "[aria-label=Studies]"), ("/compare", ".comparing")):
        visitor.open(path)
        step(place, "Write a mission")
        visitor.wait("document.querySelector('[role=tab][aria-selected=true]')?.textContent === 'Write'")
    for path, label in (("/plan", "Search jobs by"), ("/compare", "Search studies"), ("/", "Search stored missions")):
        visitor.open(path)
        if path == "/":
            visitor.page.locator(".stored summary").click()
            step(".stored", "Name this one")
            visitor.wait("document.activeElement.matches('.stored-name')")
        field = visitor.page.get_by_label(label)
        field.fill("no such thing")
        step("", "Show all")
        visitor.wait("document.activeElement.matches('.search') && document.activeElement.value === ''")
        visitor.page.get_by_text("Show all", exact=True).wait_for(state="detached")
        assert visitor.page.locator(".empty:visible").count() > 0
    visitor.end()
