"""The pages by the keyboard alone: Tab reaches everything in its order, what has the focus is seen, nothing keeps it, and Escape closes."""

from __future__ import annotations

import re
from typing import Any

import pytest

from tests.browser.states import Lab, entered, settled, states
from tests.browser.visitor import OF_THE_PAGE, Visitor

pytestmark = OF_THE_PAGE

IN_DIALOGS = ("deleting", "varying", "history")
"""States in which a dialog keeps the focus."""
STOPS = """() => {
  const looks = (element) => {
    const seen = [];
    for (let each = element, i = 0; each && i < 4; each = each.parentElement, i++) {
      const { outline, borderColor, boxShadow, backgroundColor } = getComputedStyle(each);
      seen.push(outline, borderColor, boxShadow, backgroundColor);
    }
    return seen.join();
  };
  const stops = [...document.querySelectorAll("a[href], button, input, select, textarea, summary, [tabindex], [contenteditable=true]")]
    .filter((each) => each.tabIndex >= 0 && !each.disabled && each.type !== "hidden" && each.checkVisibility({ visibilityProperty: true }))
    .filter((each) => each.type !== "radio");
  window.stops = stops.map((element) => ({ element, before: looks(element) }));
  window.atStop = () => {
    const at = document.activeElement, found = window.stops.findIndex(({ element }) => element === at);
    if (found < 0) return { index: -1, what: at === document.body ? "" : at.outerHTML.slice(0, 120) };
    const box = at.getBoundingClientRect(), x = box.x + box.width / 2, y = box.y + Math.min(box.height, innerHeight) / 2;
    const over = document.elementFromPoint(Math.min(Math.max(x, 0), innerWidth - 1), Math.min(Math.max(y, 0), innerHeight - 1));
    const covered = over?.closest("header.top, .stops");
    return { index: found, shown: looks(at) !== window.stops[found].before, hidden: Boolean(covered) && !covered.contains(at) };
  };
  return stops.map((each) => (each.getAttribute("aria-label") || each.textContent.trim() || each.name || each.className).slice(0, 50) + " <" + each.tagName.toLowerCase() + ">");
}"""
"""Notes what Tab has to reach, in the page's order, and what each looks like without the focus."""


def _walked(visitor: Visitor) -> list[str]:
    """Press Tab until it comes round, and return what is wrong with the way."""
    visitor.page.evaluate("document.activeElement.blur()")
    visitor.wait(
        "document.getAnimations().every((each) => !(each instanceof CSSTransition))"
    )  # what had the focus looks as without it
    names = visitor.page.evaluate(STOPS)
    way: list[int] = []
    faults: list[str] = []
    for _ in range(2 * len(names) + 10):
        visitor.page.keyboard.press("Tab")
        at = visitor.page.evaluate("window.atStop()")
        if at["index"] in way:
            break
        if at["index"] < 0:
            continue
        way.append(at["index"])
        name = names[at["index"]]
        faults += [f"{name} does not show the focus"] if not at["shown"] else []
        faults += [f"{name} has the focus under what stays in sight"] if at["hidden"] else []
    begin = way.index(min(way)) if way else 0
    way = way[begin:] + way[:begin]
    faults += [f"Tab does not reach {names[i]}" for i in range(len(names)) if i not in way]
    return faults + ([f"Tab goes another way: {[names[i] for i in way]}"] if way != sorted(way) else [])


@pytest.mark.parametrize("width", [1280, 390], ids=["desk", "phone"])
def test_tab_reaches_everything_on_every_page_and_is_seen_there(lab: Lab, chromium: Any, width: int) -> None:
    faults: dict[str, list[str]] = {}
    for name, (path, act) in states(lab).items():
        if name in IN_DIALOGS:
            continue
        visitor = entered(chromium, lab, width=width)
        settled(visitor, path)
        if act is not None:
            act(visitor)
        if found := _walked(visitor):
            faults[name] = found
        visitor.context.close()
    assert faults == {}


def test_lists_and_dialogs_open_by_enter_close_by_escape_and_give_the_focus_back(lab: Lab, chromium: Any) -> None:
    visitor = entered(chromium, lab)
    settled(visitor, "/")
    page = visitor.page
    page.locator(".stored summary").focus()
    page.keyboard.press("Enter")
    page.get_by_role("button", name="Open arena").wait_for()
    page.keyboard.press("Tab")
    page.keyboard.press("Tab")
    page.keyboard.press("Escape")
    page.get_by_role("button", name="Open arena").wait_for(state="hidden")
    assert page.evaluate("document.activeElement.textContent") == "Stored"
    page.keyboard.press("Enter")
    page.get_by_role("button", name="Open arena").focus()
    page.keyboard.press("Enter")
    page.get_by_role("button", name="Open arena").wait_for(state="hidden")
    for opened in ("History", "Study this mission"):
        opens = page.get_by_role("button", name=opened).first
        opens.focus()
        page.keyboard.press("Enter")
        page.locator(".dialog").wait_for()
        page.keyboard.press("Escape")
        page.locator(".dialog").wait_for(state="detached")
        assert opens.evaluate("(each) => each === document.activeElement"), opened
    visitor.end()


def test_tabs_folds_clocks_and_regions_are_worked_by_arrows_and_enter(lab: Lab, chromium: Any) -> None:
    visitor = entered(chromium, lab)
    settled(visitor, f"/jobs/{lab.done}/compare/{lab.other}")
    page = visitor.page
    page.get_by_role("button", name=re.compile(r"All \d+ lines")).focus()
    lines = page.locator(".compared .difference span").count()
    page.keyboard.press("Enter")
    visitor.wait(f"document.querySelectorAll('.compared .difference span').length > {lines}")
    assert page.evaluate("document.activeElement.getAttribute('aria-expanded')") == "true"
    page.locator(".pair .clock").focus()
    page.keyboard.press("ArrowRight")
    visitor.wait("Number(document.querySelector('.pair .clock').value) > 0")
    page.get_by_role("tab", name="Compare", exact=True).focus()
    page.keyboard.press("ArrowRight")
    visitor.wait("document.querySelector('[role=tab][aria-selected=true]').textContent === 'Live'")
    settled(visitor, "/live/lab")
    handle = page.get_by_role("button", name="Move left")
    handle.focus()
    page.keyboard.press("ArrowUp")
    page.get_by_text("If you tell it:").wait_for()
    assert page.locator("input[name=event]").input_value().startswith("left moves ")
    visitor.end()
