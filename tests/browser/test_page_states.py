"""Each state of each page, in light and dark colours, on a desk and on a phone: WCAG 2.2 AA by axe-core, nothing that jumps, nothing sideways."""

from __future__ import annotations

from typing import Any

import pytest

from tests.browser.states import MOST_SHIFT, Lab, entered, settled, states
from tests.browser.visitor import OF_THE_PAGE, Visitor

sync_axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="needs axe-core to judge pages")

pytestmark = OF_THE_PAGE

RULES = {"runOnly": {"type": "tag", "values": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]}}


def _faults(visitor: Visitor) -> list[str]:
    found = sync_axe.Axe().run(visitor.page, options=RULES).response["violations"]
    faults = [f"{each['id']}: {[node['html'][:160] for node in each['nodes'][:3]]}" for each in found]
    wide = visitor.page.evaluate("document.documentElement.scrollWidth - innerWidth")
    shift = sum(visitor.page.evaluate("window.shifts"))
    faults += [f"scrolls sideways by {wide} px"] if wide > 0 else []
    return faults + ([f"jumps: cumulative layout shift {shift:.2f}"] if shift >= MOST_SHIFT else [])


@pytest.mark.parametrize(("dark", "width"), [(False, 1280), (True, 1280), (False, 390)], ids=["light", "dark", "phone"])
def test_every_state_of_every_page_is_as_it_should_be(lab: Lab, chromium: Any, dark: bool, width: int) -> None:
    faults: dict[str, list[str]] = {}
    for name, (path, act) in states(lab).items():
        visitor = entered(chromium, lab, dark=dark, width=width)
        settled(visitor, path)
        if act is not None:
            act(visitor)
            visitor.page.wait_for_timeout(500)  # ms: dialogs come into sight
        if found := _faults(visitor):
            faults[name] = found
        visitor.context.close()
    assert faults == {}
