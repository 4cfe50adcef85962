"""Views have addresses: the browser's back and forward, a reload and a second tab show what was there, as far as it was scrolled."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from ltlplan import Client
from tests.browser.visitor import OF_THE_PAGE, Visitor
from tests.helpers.serving.services import ONE_HOOP

pytestmark = OF_THE_PAGE

DRAWN = "document.querySelector('.flight[data-ready=yes] .holder[data-drawn=yes]') !== null"


@pytest.fixture(scope="module")
def jobs(address: str) -> tuple[str, str]:
    """Return two jobs that are done."""
    with Client(address) as client:
        first, second = (client.submit_text(ONE_HOOP, seed=seed).wait().id for seed in (1, 2))
    return first, second


@pytest.fixture
def visitor(address: str, chromium: Any) -> Iterator[Visitor]:
    """Open a window whose console stays clean."""
    made = Visitor(chromium, address)
    yield made
    made.end()


def _at(visitor: Visitor, path: str, tab: str) -> None:
    visitor.wait(f"location.pathname === {path!r}")
    visitor.page.wait_for_selector(f"[role=tab][aria-selected=true]:text-is('{tab}')")
    visitor.wait(
        "[...document.querySelectorAll('[role=tabpanel], .flight')].some((each) => each.checkVisibility() && each.innerText.trim())"
    )


def test_back_and_forward_go_through_the_views(visitor: Visitor, jobs: tuple[str, str]) -> None:
    first, second = jobs
    visitor.open("/")
    visitor.checked()
    visitor.write(ONE_HOOP.replace("one-hoop", "typed-here"))
    visitor.wait("document.querySelector('.state').textContent.includes('typed-here')")
    visitor.tab("Plan")
    _at(visitor, "/plan", "Plan")
    visitor.page.locator(".job-list .entry").last.click()
    _at(visitor, f"/jobs/{first}/plan", "Plan")
    visitor.page.locator(".job-list .entry").first.click()
    _at(visitor, f"/jobs/{second}/plan", "Plan")
    visitor.tab("Take away")
    _at(visitor, f"/jobs/{second}/take-away", "Take away")
    visitor.tab("Live")
    _at(visitor, "/live", "Live")
    views = [("/", "Write"), ("/plan", "Plan"), (f"/jobs/{first}/plan", "Plan"), (f"/jobs/{second}/plan", "Plan"),
             (f"/jobs/{second}/take-away", "Take away"), ("/live", "Live")]  # fmt: skip
    for path, tab in reversed(views[:-1]):
        visitor.page.go_back()
        _at(visitor, path, tab)
        visitor.wait(f"document.querySelectorAll('.job .name h2').length === {int('jobs' in path)}")
    assert "typed-here" in visitor.written()
    for path, tab in views[1:]:
        visitor.page.go_forward()
        _at(visitor, path, tab)
    for _ in range(4):
        visitor.page.evaluate("history.back()")
    _at(visitor, "/plan", "Plan")
    visitor.page.reload()
    _at(visitor, "/plan", "Plan")
    visitor.page.go_forward()
    _at(visitor, f"/jobs/{first}/plan", "Plan")


def test_one_comes_back_to_where_one_was_scrolled(visitor: Visitor, jobs: tuple[str, str]) -> None:
    visitor.open(f"/jobs/{jobs[0]}/take-away")
    visitor.page.locator("td:has-text('watch.json')").first.wait_for()
    visitor.page.set_viewport_size({"width": 700, "height": 300})
    visitor.page.mouse.wheel(0, 240)
    visitor.wait("scrollY > 200 && history.state?.y === scrollY")
    place = visitor.page.evaluate("scrollY")
    visitor.tab("Live")
    _at(visitor, "/live", "Live")
    assert visitor.page.evaluate("scrollY") == 0
    visitor.page.go_back()
    _at(visitor, f"/jobs/{jobs[0]}/take-away", "Take away")
    visitor.wait(f"scrollY === {place}")
    visitor.page.reload()
    visitor.wait(f"scrollY === {place}")


def test_a_comparison_a_study_and_a_second_tab_have_addresses(visitor: Visitor, jobs: tuple[str, str]) -> None:
    first, second = jobs
    visitor.open(f"/jobs/{first}/compare")
    visitor.page.locator(".comparing .choice", has_text="Second").locator("select").select_option(second)
    _at(visitor, f"/jobs/{first}/compare/{second}", "Compare")
    visitor.wait("document.querySelector('.pair')?.dataset.ready === 'both'")
    visitor.tab("Plan")
    _at(visitor, f"/jobs/{first}/plan", "Plan")
    visitor.page.go_back()
    _at(visitor, f"/jobs/{first}/compare/{second}", "Compare")
    visitor.page.go_back()
    _at(visitor, f"/jobs/{first}/compare", "Compare")
    visitor.wait("document.querySelector('.pair')?.dataset.ready === 'none'")
    visitor.page.go_forward()
    visitor.wait("document.querySelector('.pair')?.dataset.ready === 'both'")
    visitor.tab("Plan")
    with visitor.context.expect_page() as opening:
        visitor.page.locator(".job-list .entry").first.click(modifiers=["Control"])
    other = opening.value
    other.wait_for_url(f"**/jobs/{second}/plan")
    other.locator(".job .name h2:text-is('one-hoop')").wait_for()
    _at(visitor, f"/jobs/{first}/plan", "Plan")
    with visitor.context.expect_page() as opening:
        visitor.page.get_by_role("tab", name="Watch", exact=True).click(button="middle")
    opening.value.wait_for_url(f"**/jobs/{first}/watch")
    opening.value.wait_for_function(f"() => {DRAWN}")
    _at(visitor, f"/jobs/{first}/plan", "Plan")
