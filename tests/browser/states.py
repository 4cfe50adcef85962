"""States of the service's pages: a service that people have worked with, and what is done to see each state."""

from __future__ import annotations

import re
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from ltlplan import Client
from ltlplan.service.people.people import People
from ltlplan.service.people.roles import Role
from ltlplan.service.security.asker import COOKIE
from ltlplan.service.security.tokens import Tokens
from tests.browser.visitor import Visitor, served
from tests.helpers.live.live_feeds import fed
from tests.helpers.serving.services import ONE_HOOP

TABS = ("plan", "watch", "trust", "simulate", "judge", "take-away", "compare", "live", "people")
SHIFTS = """
window.shifts = [];
new PerformanceObserver((list) => {
  for (const entry of list.getEntries()) if (!entry.hadRecentInput) window.shifts.push(entry.value);
}).observe({ type: "layout-shift", buffered: true });
"""

MOST_SHIFT = 0.1
"""Cumulative layout shift that is taken for good (web.dev/articles/cls)."""


@dataclass(frozen=True)
class Lab:
    """A service that people have worked with.

    Attributes:
        url: Where it is.
        session: An admin's.
        done: A job that is done, with a campaign.
        refused: A job that was refused.
        other: A job of another mission.
        study: A study of two values.
    """

    url: str
    session: str
    done: str
    refused: str
    other: str
    study: int


OTHER = ONE_HOOP.replace("one-hoop", "another").replace(
    "agents:",
    "regions:\n"
    + "".join(f"  r{i}: {{center: [{-2.5 + 0.1 * i}, 2, 1], size: [0.2, 0.2, 0.2]}}\n" for i in range(30))
    + "agents:",
)
"""A mission whose difference from the first is longer than what is shown of one at first."""


@contextmanager
def worked_with(folder: Path) -> Generator[Lab]:
    """Serve a folder in which there is one of everything, with a flight in the air."""
    folder.mkdir()
    people = People(Tokens(folder))
    people.accounts.change_password("root", people.accounts.add("root", Role.admin), "twelve letters")
    token, session = people.tokens.new("robots", role="pilot"), people.sessions.begin_of_account("root")
    mission = folder.parent / "one-hoop.yaml"
    mission.write_text(ONE_HOOP, encoding="utf-8")
    with served(folder) as url, Client(url, token=token) as client:
        done, other = (client.submit_text(text).wait().id for text in (ONE_HOOP, OTHER))
        refused = client.submit_text(ONE_HOOP.replace("F hoop0", "F hoop0 & G !hoop0"))
        with pytest.raises(Exception, match="cannot hold together"):
            refused.wait()
        client.campaign(done, runs=3).wait()
        study = client.wait_study(client.study(mission, "limits.speed", [0.4, 0.6]))
        stored = client.store_mission("arena", ONE_HOOP, project="night", tags=("wind",))
        client.save_mission(stored, ONE_HOOP.replace("F hoop0", "F hoop0 & F hoop0"))
        client.share_project("night")
        with fed(f"{url}/live/lab", token=token):
            yield Lab(url, session, done, refused.id, other, study.id)
    people.close()


Act = Callable[[Visitor], None]


def _press(*names: str | re.Pattern[str]) -> Act:
    """Return an act that presses buttons, one after another."""

    def act(visitor: Visitor) -> None:
        for name in names:
            visitor.page.get_by_role("button", name=name).first.click()

    return act


def _unfolded(visitor: Visitor) -> None:
    before = visitor.page.locator(".difference span").count()
    visitor.page.get_by_role("button", name=re.compile(r"All \d+ lines")).first.click()
    visitor.wait(f"document.querySelectorAll('.difference span').length > {before}")


def _history(visitor: Visitor) -> None:
    visitor.page.locator(".stored summary").click()
    visitor.page.get_by_role("button", name="Open arena").click()
    visitor.page.get_by_role("button", name="History", exact=True).click()
    visitor.page.get_by_role("button", name="Changes of version 2").click()
    visitor.page.locator(".changes .difference").wait_for()


def _stored(visitor: Visitor) -> None:
    visitor.page.locator(".stored summary").click()
    visitor.page.get_by_role("button", name="Open arena").wait_for()


def _faulty(visitor: Visitor) -> None:
    visitor.write("name: x\nfoo: 3\nspec: {formula: 'F nowhere & ('}\n")
    visitor.page.locator(".fault-line").first.wait_for()


def _event(visitor: Visitor) -> None:
    visitor.page.locator("input[name=event]").fill("one fails")
    visitor.page.get_by_text("If you tell it:").wait_for()


def _token(visitor: Visitor) -> None:
    visitor.page.locator("input[name=label]").fill("mine")
    visitor.page.locator("input[name=label]").press("Enter")
    visitor.page.locator(".revealed, .q-notification").first.wait_for()


def _replayed(visitor: Visitor) -> None:
    visitor.page.locator(".runs button").first.click()
    visitor.page.locator(".live .player").wait_for()


def states(lab: Lab) -> dict[str, tuple[str, Act | None]]:
    """Return the path of each state, and what is done there."""
    of_done = {f"{tab} of a job": (f"/jobs/{lab.done}/{tab}", None) for tab in TABS[:7]}
    return {
        "write": ("/", None), **{tab: (f"/{tab}", None) for tab in TABS}, **of_done,
        "a refused job": (f"/jobs/{lab.refused}/plan", None), "what would mend it": (f"/jobs/{lab.refused}/trust", None),
        "a study": (f"/studies/{lab.study}", None), "two results": (f"/jobs/{lab.done}/compare/{lab.other}", None),
        "all of a difference": (f"/jobs/{lab.done}/compare/{lab.other}", _unfolded),
        "deleting": (f"/jobs/{lab.done}/plan", _press("Delete")), "varying": ("/", _press("Study this mission")),
        "faults": ("/", _faulty), "stored missions": ("/", _stored), "history": ("/", _history),
        "a new token": ("/people", _token),
        "an event": ("/live/lab", _event), "a replay": ("/live/lab", _replayed),
        "a flight that is stopped": ("/live/lab", _press(re.compile("(Stop|Land) lab"), "Motors off")),
        "login": ("/login", None), "another password": ("/password", None), "no page": ("/nothing", None),
    }  # fmt: skip


def entered(chromium: Any, lab: Lab, **more: Any) -> Visitor:
    """Return an admin's window, which notes what jumps in it."""
    visitor = Visitor(chromium, lab.url, **more)
    visitor.context.add_cookies([{"name": COOKIE, "value": lab.session, "url": lab.url}])
    visitor.page.add_init_script(SHIFTS)
    return visitor


def settled(visitor: Visitor, path: str) -> None:
    """Open a page and wait until nothing more comes."""
    visitor.open(path)
    visitor.page.wait_for_load_state("networkidle")
    if path.startswith("/live"):
        visitor.page.locator(".live-robots tbody tr").first.wait_for()
    visitor.page.wait_for_timeout(700)  # ms: what comes late, too, is seen
