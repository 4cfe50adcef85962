"""Every page of the service as axe-core judges it: WCAG 2.2, levels A and AA, in light and in dark colours, on a desk and on a phone."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from ltlplan import Client
from tests.browser.visitor import OF_THE_PAGE, Visitor
from tests.helpers.live.live_feeds import fed
from tests.helpers.serving.services import ONE_HOOP

sync_axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="needs axe-core to judge pages")

pytestmark = OF_THE_PAGE

RULES = {"runOnly": {"type": "tag", "values": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]}}
TABS = ("plan", "watch", "trust", "simulate", "judge", "take-away", "compare", "live")


@pytest.fixture(scope="module")
def jobs(address: str) -> tuple[str, str]:
    """Return a job that is done, and one that was refused."""
    with Client(address) as client:
        done = client.submit_text(ONE_HOOP).wait().id
        refused = client.submit_text(ONE_HOOP.replace("F hoop0", "F hoop0 & G !hoop0"))
        with pytest.raises(Exception, match="cannot hold together"):
            refused.wait()
    return done, refused.id


@pytest.fixture(scope="module")
def flying(address: str) -> Iterator[None]:
    """Have a flight in the air."""
    with fed(f"{address}/live/lab"):
        yield


def _faults(visitor: Visitor) -> list[str]:
    found = sync_axe.Axe().run(visitor.page, options=RULES).response["violations"]
    return [f"{each['id']}: {[node['html'][:160] for node in each['nodes'][:3]]}" for each in found]


@pytest.mark.parametrize(("dark", "width"), [(False, 1280), (True, 1280), (False, 390)], ids=["light", "dark", "phone"])
def test_every_page_passes(address: str, chromium: Any, jobs: tuple[str, str], flying: None, dark: bool, width: int) -> None:
    done, refused = jobs
    paths = [
        "/",
        *(f"/{tab}" for tab in TABS),
        *(f"/jobs/{done}/{tab}" for tab in TABS[:-1]),
        f"/jobs/{refused}/plan",
        "/login",
        "/nothing",
    ]
    visitor = Visitor(chromium, address, dark=dark, width=width)
    faults: dict[str, list[str]] = {}
    for path in paths:
        visitor.open(path)
        visitor.page.wait_for_load_state("networkidle")
        if path == "/live":
            visitor.page.wait_for_selector(".live-robots tbody tr")
        if found := _faults(visitor):
            faults[path] = found
    assert faults == {}
    visitor.context.close()
