"""Every figure of docs/reproduction/elements.md against its reviewed interval, and against a rerun of all elements."""

from __future__ import annotations

import json
import math
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from ltlplan.reproduction.element import Element
from ltlplan.reproduction.elements import ELEMENTS
from ltlplan.reproduction.expectation import Expectation
from ltlplan.reproduction.intervals import INTERVALS

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/reproduction/elements.md"
Row = tuple[str, str, str]


def rows(text: str) -> dict[str, list[Row]]:
    """Return the page's quantities by element: name, what was published, what is found here."""
    found: dict[str, list[Row]] = {}
    element = ""
    for line in text.splitlines():
        if named := re.match(r"`((?:2019|2022|published)-[\w.-]+)`: ", line):
            element = named.group(1)
            found[element] = []
        cells = [cell.strip().replace("\\|", "|") for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
        if len(cells) == 4 and cells[0] not in ("quantity", "---"):
            found[element].append((cells[0], cells[1], cells[2]))
    return found


def admitted(shown: str, expected: Expectation) -> bool:
    """Tell whether what a page shows is as expected, to the digits that it shows."""
    if expected.text is not None or not math.isfinite(expected.low):
        return shown == (expected.text or "holds")
    number = shown.split()[0]
    half = 0.5000001 * 10 ** -len(number.partition(".")[2])
    return expected.low - half <= float(number) <= expected.high + half


def test_the_page_has_all_elements() -> None:
    assert list(rows(PAGE.read_text(encoding="utf-8"))) == [element.id for element in ELEMENTS]


@pytest.mark.parametrize("element", ELEMENTS, ids=lambda element: element.id)
def test_figures_of_the_page_are_within_their_intervals(element: Element) -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert f"### {element.title}\n\n`{element.id}`: {element.says}\n" in text
    assert f"*Differs:* {element.differs}" in text
    own = rows(text)[element.id]
    expected = INTERVALS.get(element.id, {})
    assert set(expected) <= {name for name, _, _ in own}
    assert [name for name, _, shown in own if not admitted(shown, expected.get(name, Expectation()))] == []


def test_a_figure_outside_its_interval_is_found() -> None:
    assert not admitted("9.99 m", INTERVALS["2019-fig-4"]["nominal length"])
    assert not admitted("does not hold", Expectation())
    assert not admitted("hoop1F", INTERVALS["2019-fig-4"]["passages"])


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
    now, page = rows((tmp_path / "out/reproduction.md").read_text(encoding="utf-8")), rows(PAGE.read_text(encoding="utf-8"))
    assert {key: [row[:2] for row in own] for key, own in now.items()} == {
        key: [row[:2] for row in own] for key, own in page.items()
    }
