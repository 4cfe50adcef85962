"""Every figure of docs/reproduction/elements.md against its reviewed interval, and against a rerun of all elements."""

from __future__ import annotations

import json
import math
import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from ltlplan.reproduction.element import Element
from ltlplan.reproduction.elements import ELEMENTS
from ltlplan.reproduction.expectation import Expectation
from ltlplan.reproduction.intervals import INTERVALS

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/reproduction/elements.md"
MOST_SECONDS = 1200.0
"""Processor time of all elements: ten minutes on two processors."""


@dataclass(frozen=True, slots=True)
class Row:
    """A quantity of the page, as it is shown."""

    name: str
    published: str
    here: str
    interval: str


def rows(text: str) -> dict[str, list[Row]]:
    """Return the page's quantities by element."""
    found: dict[str, list[Row]] = {}
    element = ""
    for line in text.splitlines():
        if named := re.match(r"`((?:2019|2022|published)-[\w.-]+)`: ", line):
            element = named.group(1)
            found[element] = []
        cells = [cell.strip().replace("\\|", "|") for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
        if len(cells) == 4 and cells[0] not in ("quantity", "---"):
            found[element].append(Row(*cells))
    return found


def digits(shown: str) -> int:
    """Return the digits behind the point of a number with its unit."""
    return len(shown.split()[0].partition(".")[2])


def admitted(shown: str, expected: Expectation) -> bool:
    """Tell whether what a page shows is as expected, to the digits that it shows."""
    if expected.text is not None or not math.isfinite(expected.low):
        return shown == (expected.text or "holds")
    half = 0.5000001 * 10 ** -digits(shown)
    return expected.low - half <= float(shown.split()[0]) <= expected.high + half


def names_of(found: dict[str, list[Row]]) -> dict[str, list[tuple[str, str]]]:
    """Return what stands in a page whatever is found: each quantity, and what was published of it."""
    return {element: [(row.name, row.published) for row in own] for element, own in found.items()}


def test_the_page_has_all_elements() -> None:
    assert list(rows(PAGE.read_text(encoding="utf-8"))) == [element.id for element in ELEMENTS]


@pytest.mark.parametrize("element", ELEMENTS, ids=lambda element: element.id)
def test_figures_of_the_page_are_within_their_intervals(element: Element) -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert f"### {element.title}\n\n`{element.id}`: {element.says}\n" in text
    assert f"*Differs:* {element.differs}" in text
    own = rows(text)[element.id]
    expected = INTERVALS.get(element.id, {})
    assert set(expected) <= {row.name for row in own}
    for row in own:
        wanted = expected.get(row.name, Expectation())
        assert admitted(row.here, wanted), row.name
        assert row.interval == wanted.shown(digits(row.here) if math.isfinite(wanted.low) else 0), row.name


def test_a_figure_outside_its_interval_is_found() -> None:
    assert not admitted("9.99 m", INTERVALS["2019-fig-4"]["nominal length"])
    assert not admitted("does not hold", Expectation())
    assert not admitted("hoop1F", INTERVALS["2019-fig-4"]["passages"])


def test_each_interval_has_a_reason_for_its_width() -> None:
    assert [name for own in INTERVALS.values() for name, expected in own.items() if not expected.why] == []


@pytest.mark.slow
def test_a_rerun_is_within_all_intervals_and_is_what_the_page_says(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "ltlplan", "reproduce", "--out", str(tmp_path / "out"), "--json"]
    done = subprocess.run(
        command, cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=False
    )
    found = json.loads(done.stdout)
    faults = {each["id"]: each["fault"] for each in found["elements"] if each["fault"]}
    outside = {each["id"]: [own for own in each["quantities"] if not own["inside"]] for each in found["elements"]}
    assert (faults, {name: own for name, own in outside.items() if own}) == ({}, {}), found["verdict"]
    assert done.returncode == 0
    assert sum(each["seconds"] for each in found["elements"]) < MOST_SECONDS
    now, page = rows((tmp_path / "out/reproduction.md").read_text(encoding="utf-8")), rows(PAGE.read_text(encoding="utf-8"))
    assert names_of(now) == names_of(page)
