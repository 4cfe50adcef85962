"""How many frames a second a scene of many robots plays at, in Chromium without a screen and without a graphics card (SwiftShader draws).

python tests/benchmarks/scene.py                  # 30 and 100 robots that swing over a field
python tests/benchmarks/scene.py run/report.html  # the report of a run
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.browser.devtools import CHROMIUM, Browser
from tests.helpers.benchmarks import LEFT_OUT, is_smallest, run_benchmark
from tests.helpers.serving.crowd_pages import crowd_page

SECONDS = 10
WANTED = 30
"""Frames a second that are asked for."""

_PLAY = """
(async () => {
  const scene = document.getElementById("scene");
  const box = scene.getBoundingClientRect();
  scrollTo(0, box.top + scrollY - 50);
  const drawn = () => Number(scene.dataset.drawn || 0);
  document.getElementById("play").click();
  await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  const [since, before] = [performance.now(), drawn()];
  await new Promise((done) => setTimeout(done, %d));
  return [drawn() - before, (performance.now() - since) / 1000];
})()
"""


def frames(page: Path) -> float:
    """Play a page for a while; return the frames drawn a second.

    Args:
        page: A page with more than 20 robots, whose player counts what it draws.
    """
    with tempfile.TemporaryDirectory() as profile:
        browser = Browser(Path(profile))
        try:
            tab = browser.open(page, width=1200).to_front()
            drawn, seconds = tab.run(_PLAY % (1000 * SECONDS))
            assert tab.complaints() == []
        finally:
            browser.close()
    return drawn / seconds


def main() -> None:
    """Print a row for each page; fail where a hundred robots play at less than what is asked."""
    if CHROMIUM is None:
        print(f"{LEFT_OUT}Chromium is not installed")
        return
    print(f"| page | frames a second (asked: {WANTED}) | MB |")
    slow = False
    with tempfile.TemporaryDirectory() as folder:
        parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
        parser.add_argument("pages", nargs="*", type=Path)
        parser.add_argument("--robots", nargs="*", type=int, default=[30, 100])
        given = parser.parse_args()
        pages = [page.resolve() for page in given.pages]
        for robots in () if pages else given.robots:
            pages.append(Path(folder) / f"{robots}-robots.html")
            pages[-1].write_text(crowd_page(robots), encoding="utf-8")
        for page in pages:
            drawn = frames(page)
            slow |= drawn < WANTED and not is_smallest()
            print(f"| {page.name} | {drawn:.0f} | {page.stat().st_size / 1e6:.1f} |", flush=True)
    sys.exit(slow)


if __name__ == "__main__":
    run_benchmark(main, ["--robots", "30"])
