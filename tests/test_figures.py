"""Figures of the pages: each table of measurements names its command, machine and versions, and what code knows is compared with it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from gallery.pages import accepted
from ltlplan.reproduction.intervals import INTERVALS
from ltlplan.reproduction.published import PROBLEMS
from tests.benchmarks.peers import PUBLISHED, table

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
CHECKED = ("reproduction/elements.md", "gallery.md", "features.md")
"""Pages whose figures a command writes and tests compare."""
BOUNDS = ("service.md",)
"""Pages whose numbers are settings."""
PAGES = [page for page in sorted(DOCS.rglob("*.md")) if str(page.relative_to(DOCS)) not in (*CHECKED, *BOUNDS)]
TABLE = re.compile(r"^\|.*\n\|[-| :]+\n(?:\|.*\n?)+", re.MULTILINE)
NUMBER = re.compile(r"[-+~]?[\d.,]+( ?(%|s|ms|m|mm|MB|GB|x)\b)?")
COMMAND = re.compile(r"tests[./]benchmarks|pytest |ltlplan [a-z]+|flight\.campaign|python -m tests\.")
SAID = re.compile(
    r"\b(?:takes?|took|weighs?) (?:about |up to |at most |less than )*\d[\d.,]*(?: to \d[\d.,]*)? ?(?:s|ms|MB|kB|GB|minutes?|hours?)\b"
)
"""Of a measurement that a sentence tells."""
BENCHMARK = re.compile(r"tests[./]benchmarks[./](\w+)(?:\.py)?((?: [^\s`|#;,)]+)*)")


def tables_of_figures(text: str) -> Iterator[str]:
    """Yield the tables of which most cells, but for the first column, begin with a number."""
    for found in TABLE.findall(text):
        rows = [re.split(r"(?<!\\)\|", line)[2:-1] for line in found.splitlines()[2:]]
        cells = [cell.strip() for row in rows for cell in row if cell.strip()]
        if sum(bool(NUMBER.match(cell)) for cell in cells) > len(cells) / 2:
            yield found


WITH_FIGURES = [
    page for page in PAGES if page.parent.name == "performance" or any(tables_of_figures(page.read_text(encoding="utf-8")))
]


def test_tables_of_figures_are_told_from_others() -> None:
    figures, words = "| a | s |\n|---|---|\n| b | 1.2 |\n| c | 3 s |\n", "| a | b |\n|---|---|\n| c | d |\n"
    assert list(tables_of_figures(f"{figures}\n{words}")) == [figures]
    assert DOCS / "pace.md" in WITH_FIGURES


@pytest.mark.parametrize("page", WITH_FIGURES, ids=lambda page: str(page.relative_to(DOCS)))
def test_a_page_with_measurements_names_machine_versions_and_commands(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert re.search(r"(?i)2-core|two cores", text), "the machine"
    assert "Python 3.1" in text, "versions"
    beginning, *sections = re.split(r"^(?=## )", text, flags=re.MULTILINE)
    without = [
        section.splitlines()[0] for section in sections if any(tables_of_figures(section)) and not COMMAND.search(section)
    ]
    assert without == [] or COMMAND.search(beginning), "the command that prints a table"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(DOCS)))
def test_a_sentence_that_tells_a_measurement_has_its_command_beside_it(page: Path) -> None:
    """Or a link to the page that has it."""
    beginning, *sections = re.split(r"^(?=## )", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    without = {
        section.splitlines()[0]: told
        for section in sections
        if (told := SAID.findall(" ".join(section.split()))) and not COMMAND.search(section) and "](performance/" not in section
    }
    assert without == {} or COMMAND.search(beginning)


@pytest.mark.parametrize("page", [*PAGES, ROOT / "CONTRIBUTING.md"], ids=lambda page: page.name)
def test_benchmarks_that_pages_name_are_there_and_know_their_options(page: Path) -> None:
    for name, rest in BENCHMARK.findall(page.read_text(encoding="utf-8")):
        file = ROOT / "tests" / "benchmarks" / f"{name}.py"
        assert file.exists(), name
        source = file.read_text(encoding="utf-8") + (ROOT / "tests/helpers/benchmarks.py").read_text(encoding="utf-8")
        unknown = [word for word in rest.split() if word.startswith("--") and f'"{word}"' not in source]
        assert unknown == [], name


def test_the_peers_page_has_the_rows_of_its_command() -> None:
    text = (DOCS / "performance" / "peers.md").read_text(encoding="utf-8")
    printed = [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines() if line.startswith("| ")]
    assert [(row[1], row[5], row[6]) for row in printed if len(row) == 7][1:] == [
        (row.work, row.proves, row.ours) for row in table("")
    ]
    assert [tuple(row) for row in printed if len(row) == 5][1:] == list(PUBLISHED)


def test_flights_with_deadlines_last_as_long_as_where_they_are_computed_anew() -> None:
    text = (DOCS / "time.md").read_text(encoding="utf-8")
    found = re.findall(r"^\| `([\w-]+)` \| [^|]* \| ([\d.]+) \| ([\d.]+) \|", text, re.MULTILINE)
    assert len(found) == 5
    for mission, flight, slack in found:
        expected = INTERVALS[f"published-{mission}"]
        assert expected["flight"].admits(float(flight)), mission
        assert expected["least slack of its bounds in seconds"].admits(float(slack)), mission


def test_the_gallery_flies_published_problems_as_the_reproduction_does() -> None:
    problems = {problem.mission for problem in PROBLEMS}
    flights = {name: result["duration"] for name, result in accepted().items() if name in problems}
    assert len(flights) >= 4
    outside = {name for name, lasts in flights.items() if not INTERVALS[f"published-{name}"]["flight"].admits(lasts)}
    assert outside == set()
