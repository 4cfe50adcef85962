"""How long the service's page takes from a click to the first useful picture, in Chromium without a screen.

    python tests/benchmarks/page.py                       # 10, 50 and 200 stored missions in one project
    python tests/benchmarks/page.py --missions 200 --repeat 9

For each click it prints the least and the median time, and the median of the processor time that the browser and the service took for it. Each repetition is
a new window without a cache: *page* is what it loads first, all others are clicks in it. Asked, on two idle cores: 1.5 s for each click, and 1 s for a
project of 200 missions.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.browser.devtools import CHROMIUM
from tests.helpers.benchmarks import LEFT_OUT, installed, run_benchmark

if TYPE_CHECKING:
    from tests.helpers.serving.services import Served

WANTED = 1.5
"""s that are asked for from a click to the picture."""
WANTED_PROJECT = 1.0
"""s that are asked for until a project is seen."""
LIMIT = 240_000
"""ms that a picture may take."""

_SEEN = "(place) => Boolean(document.querySelector(place)?.checkVisibility())"
_CLICK = """async ([clicked, wanted]) => {
  const seen = () => Boolean(document.querySelector(wanted)?.checkVisibility()), begin = performance.now();
  document.querySelector(clicked).click();
  while (!seen()) await new Promise((done) => requestAnimationFrame(done));
  await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  return (performance.now() - begin) / 1000;
}"""
"""Click, wait until something is seen and painted, and return the seconds between."""

_OPEN_PROJECT = """async (size) => {
  const begin = performance.now(), field = () => document.querySelector(".stored input[type=search]");
  document.querySelector(".stored summary").click();
  field().value = "hall";
  field().dispatchEvent(new Event("input", { bubbles: true }));
  const most = Math.min(size, 30);
  while (document.querySelectorAll(".stored .drop li").length < most) await new Promise((done) => requestAnimationFrame(done));
  await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  return (performance.now() - begin) / 1000;
}"""


def processor_seconds(root: int, without: int = 0) -> float:
    """Return the processor time of a process and of all that it began and that still runs, s.

    Args:
        root: Its number.
        without: Number of another process that is left out with all that it began.
    """
    began: dict[int, list[int]] = {}
    took: dict[int, float] = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue  # it has ended
        pid = int(stat.parent.name)
        began.setdefault(int(fields[1]), []).append(pid)
        took[pid] = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    total, open_ = 0.0, [root]
    while open_:
        pid = open_.pop()
        if pid != without:
            total += took.get(pid, 0.0)
            open_ += began.get(pid, [])
    return total


class _Clicks:
    """What was measured."""

    def __init__(self, served: Served) -> None:
        self.served = served
        self.rows: dict[str, list[tuple[float, float, float]]] = {}

    def _clocks(self) -> tuple[float, float]:
        return processor_seconds(os.getpid(), self.served.pid), processor_seconds(self.served.pid)

    def note(self, name: str, act: Any) -> None:
        """Measure what an act says that it took, and the processor time meanwhile."""
        browser, service = self._clocks()
        took = act()
        after = self._clocks()
        self.rows.setdefault(name, []).append((took, after[0] - browser, after[1] - service))


def _visit(chromium: Any, clicks: _Clicks, jobs: tuple[str, str], size: int) -> None:
    """Open a window, and click through it."""
    context = chromium.new_context(viewport={"width": 1280, "height": 800})
    context.set_default_timeout(LIMIT)
    page = context.new_page()
    url = clicks.served.url

    def loaded() -> float:
        begin = time.perf_counter()
        page.goto(f"{url}/plan")
        page.wait_for_function(_SEEN, arg=".job-list .entry")
        return time.perf_counter() - begin

    def clicked(name: str, place: str, wanted: str) -> None:
        page.wait_for_selector(place)
        clicks.note(name, lambda: page.evaluate(_CLICK, [place, wanted]))

    clicks.note("page", loaded)
    clicked("job", ".job-list .entry", ".job .stages .stage")
    clicked("scene", "#watch-tab", ".flight[data-view=watch] .holder[data-drawn=yes]")
    page.goto(f"{url}/jobs/{jobs[0]}/plan")
    page.wait_for_selector(".job .stages .stage")
    clicked("compare", "#compare-tab", ".comparing select")
    clicks.note("two flights", lambda: page.evaluate(_BOTH, jobs[1]))
    clicked("live", "#live-tab", ".live .holder[data-drawn=yes]")
    page.goto(url)
    page.wait_for_selector(".stored summary")
    page.wait_for_load_state("networkidle")
    clicks.note("project", lambda: page.evaluate(_OPEN_PROJECT, size))
    context.close()


_BOTH = """async (other) => {
  const begin = performance.now(), second = document.querySelectorAll(".comparing select")[1];
  second.value = other;
  second.dispatchEvent(new Event("change", { bubbles: true }));
  const drawn = () => [...document.querySelectorAll(".pair .holder[data-drawn=yes]")].filter((each) => each.checkVisibility()).length;
  while (drawn() < 2) await new Promise((done) => requestAnimationFrame(done));
  await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  return (performance.now() - begin) / 1000;
}"""


def main() -> None:
    """Print a table for each size."""
    if CHROMIUM is None:
        print(f"{LEFT_OUT}Chromium is not installed")
        return
    if not (installed("playwright", "playwright") and installed("nicegui", "nicegui")):
        return
    from playwright.sync_api import sync_playwright

    from ltlplan import Client
    from tests.browser.visitor import OPTIONS
    from tests.helpers.live.live_feeds import fed
    from tests.helpers.serving.services import ONE_HOOP, serving

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--missions", nargs="*", type=int, default=[10, 50, 200])
    parser.add_argument("--repeat", type=int, default=5)
    given = parser.parse_args()
    with ExitStack() as opened:
        folder = Path(opened.enter_context(tempfile.TemporaryDirectory())) / "data"
        served = opened.enter_context(serving(folder, page=True))
        driver = opened.enter_context(sync_playwright())
        chromium = driver.chromium.launch(executable_path=CHROMIUM, args=OPTIONS)
        opened.callback(chromium.close)
        client = opened.enter_context(Client(served.url))
        submitted = [client.submit_text(ONE_HOOP, seed=seed) for seed in (1, 2)]
        jobs = (submitted[0].wait().id, submitted[1].wait().id)
        opened.enter_context(fed(f"{served.url}/live/lab"))
        stored = 0
        for size in sorted(given.missions):
            while stored < size:
                client.store_mission(f"mission-{stored}", ONE_HOOP.replace("one-hoop", f"mission-{stored}"), project="hall")
                stored += 1
            clicks = _Clicks(served)
            for _ in range(given.repeat):
                _visit(chromium, clicks, jobs, size)
            print(
                f"\n{size} missions\n\n| click | asked | least | median | browser's processor | service's processor |\n|---|--:|--:|--:|--:|--:|"
            )
            for name, rows in clicks.rows.items():
                took, browser, service = zip(*rows, strict=True)
                asked = WANTED_PROJECT if name == "project" else WANTED
                middle = [statistics.median(each) for each in (took, browser, service)]
                print(
                    f"| {name} | {asked:g} s | {min(took):.2f} s | {middle[0]:.2f} s | {middle[1]:.2f} s | {middle[2]:.2f} s |",
                    flush=True,
                )


if __name__ == "__main__":
    run_benchmark(main, ["--missions", "2", "--repeat", "1"])
