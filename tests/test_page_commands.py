"""Commands of pages that are no walks: each runs in a folder that holds what the page speaks of, but for those that need a radio or another page's service."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from tests.helpers.fleets import show_of, trajectory_of, write_show
from tests.test_site import DOCS, EXTENDING, FIRST, PAGES, ROOT, WALKS, Reader, named_commands

RADIO = re.compile(r"--link (crazyflie|mavlink)")
"""Of a command that needs vehicles: it is parsed only."""
SHORTER = {" RUN ": " run ", " LOG ": " run/flight.csv ", "--runs 1000": "--runs 3"}
"""What stands for placeholders of a page, and for what takes minutes."""
ELSEWHERE: Mapping[str, str] = {
    "service.md": "tests/ltlplan/service",
    "identify.md": "tests/flight/identification",
    EXTENDING: "tests/test_extending.py",
}
"""Where the commands of other pages run."""
HALL = """
format: 1
name: hall
spec: {formula: F site}
workspace: {min: [-2, -2, 0], max: [2, 2, 2]}
regions:
  site: {center: [1, 0, 1], radii: [0.3, 0.3, 0.3]}
  smoke: {center: [0, 1.5, 1], radii: [0.3, 0.3, 0.3]}
agents: {quad0: {start: [-1, 0, 1]}, quad1: {start: [-1, -1, 1]}}
vehicle: crazyflie-2.1
separation: 0.3
margin: 0.02
"""


def a_run(reader: Reader) -> None:
    """Leave a run of the fire-fighting mission."""
    reader.type("ltlplan run firefighting --out run")


def flights_of_others(reader: Reader) -> None:
    """Leave a folder of trajectories, a hall, and a show with settings of its own."""
    (reader.folder / "hall.yaml").write_text(HALL, encoding="utf-8")
    reader.type("ltlplan run hall.yaml --out run && mkdir flights && cp run/crazyswarm2/*.csv flights")
    up = trajectory_of([[0, [0, 0, 0], []], [5, [0, 0, 5]]])
    beside = trajectory_of([[0, [0, 6, 0], []], [5, [0, 6, 5]]])
    settings = {"validation": {"maxAltitude": 6, "minDistance": 3}}
    write_show(reader.folder / "show.skyc", show_of([("a", up), ("b", beside)], settings=settings))


def nothing(reader: Reader) -> None:
    """Leave an empty folder."""


PREPARED: Mapping[str, Callable[[Reader], None]] = {
    "audit.md": flights_of_others,
    "live.md": nothing,
    "on-board.md": a_run,
    "px4.md": nothing,
    "recordings.md": a_run,
    "tracking.md": a_run,
}


def with_commands() -> set[str]:
    """Return the pages that name commands of ours and are no walks."""
    others = (page for page in PAGES[:-1] if page not in (*WALKS, FIRST) and named_commands(page))
    return {str(page.relative_to(DOCS)) for page in others}


def test_the_commands_of_each_page_run_somewhere() -> None:
    assert with_commands() == {*PREPARED, *ELSEWHERE}
    assert [place for place in ELSEWHERE.values() if not (ROOT / place).exists()] == []


@pytest.mark.slow
@pytest.mark.parametrize("name", PREPARED)
def test_commands_of_a_page_run(name: str, tmp_path: Path) -> None:
    """A verdict may be no; what is bad input, a bug of ours or beyond a vehicle is not what a page shows."""
    reader = Reader(tmp_path, Path(sys.executable).parent, str(ROOT))
    PREPARED[name](reader)
    for line in named_commands(DOCS / name):
        if not RADIO.search(line):
            command = line
            for text, other in SHORTER.items():
                command = command.replace(text, other)
            printed = reader.type(f"{command}\necho ended with $?")
            assert re.search(r"ended with [05]$", printed.strip(), re.MULTILINE), printed
