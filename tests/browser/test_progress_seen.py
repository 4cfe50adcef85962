"""Progress on the page: clock and bar of a search that takes long go on each second and never back, and nothing jumps while a job comes further."""

from __future__ import annotations

import itertools
import random
from typing import Any

from ltlplan import Client
from ltlplan.reproduction.published_missions import world
from tests.browser.states import MOST_SHIFT, SHIFTS
from tests.browser.visitor import OF_THE_PAGE, Visitor
from tests.helpers.serving.services import ONE_HOOP

pytestmark = OF_THE_PAGE

NOTED = """() => {
  window.noted = [];
  setInterval(() => window.noted.push([
    document.querySelector("#plan-panel progress")?.value ?? null, document.querySelector("#plan-panel [data-ran]")?.textContent ?? null,
  ]), 100);
}"""
LONG = 8.0
"""s for which a search is looked at."""


def test_a_long_search_moves_each_second_and_never_back(address: str, chromium: Any) -> None:
    drawn = random.Random(4)
    places = {f"p{i}": (drawn.uniform(-8, 8), drawn.uniform(-8, 8)) for i in range(16)}
    starts = tuple((float(i), 0.0) for i in range(5))
    mission = world(" & ".join(f"F {place}" for place in places), robots=5, regions=places, starts=starts, objective="longest")
    with Client(address) as client:
        job = client.submit(mission)
        visitor = Visitor(chromium, address)
        visitor.page.add_init_script(SHIFTS)
        visitor.open(f"/jobs/{job.id}/plan")
        visitor.wait("document.querySelector('#plan-panel .sentence')?.textContent.includes('no words cost less than')")
        visitor.page.evaluate(NOTED)
        visitor.page.wait_for_timeout(1000 * LONG)
        noted = visitor.page.evaluate("window.noted")
        moves = visitor.page.evaluate(
            "document.querySelector('progress.going').getAnimations().filter((each) => each.playState === 'running').length"
        )
        shift = sum(visitor.page.evaluate("window.shifts"))
        client.cancel(job)
    seconds = [int(clock.split()[0]) for _, clock in noted]
    assert len(noted) > 5 * LONG
    assert all(0 <= after - before <= 2 for before, after in itertools.pairwise(seconds))
    assert seconds[-1] - seconds[0] >= LONG - 2
    assert all(before <= after for (before, _), (after, _) in itertools.pairwise(noted))
    assert moves == 1
    assert shift < MOST_SHIFT
    visitor.end()


def test_nothing_jumps_while_a_job_comes_further(address: str, chromium: Any) -> None:
    visitor = Visitor(chromium, address)
    visitor.page.add_init_script(SHIFTS)
    visitor.open("/")
    visitor.checked()
    visitor.write(ONE_HOOP.replace("one-hoop", "looked-at"))
    visitor.wait("document.querySelector('.state')?.textContent.includes('No faults: looked-at')")
    visitor.page.evaluate(NOTED)
    visitor.page.evaluate("window.shifts = []")
    visitor.page.get_by_role("button", name="Plan it").click()
    visitor.wait("document.querySelector('.job .head .chip')?.dataset.state === 'done'")
    shares = [share for share, _ in visitor.page.evaluate("window.noted") if share is not None]
    assert shares == sorted(shares)
    assert sum(visitor.page.evaluate("window.shifts")) < MOST_SHIFT
    visitor.end()
