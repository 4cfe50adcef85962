"""Elements of the reproduction: names, intervals, and what its command says of them."""

from __future__ import annotations

import json
from pathlib import Path
from pkgutil import resolve_name

import pytest
from typer.testing import CliRunner

from ltlplan.cli import app
from ltlplan.reproduction.documents import lines, markdown, verdict
from ltlplan.reproduction.element import HEADINGS, Element, Findings, Quantity
from ltlplan.reproduction.elements import ELEMENTS, chosen
from ltlplan.reproduction.expectation import Expectation, exact, text
from ltlplan.reproduction.intervals import INTERVALS
from ltlplan.reproduction.page import reproduction_html
from ltlplan.reproduction.running import Rerun
from tests.helpers.few import few_of
from verify.data import BadInput

QUICK = (
    "2019-def-1",
    "2019-def-2",
    "2019-def-4",
    "2019-fig-1",
    "2019-flatness",
    "2019-control",
    "2019-alg-1",
    "2019-lengths",
    "2019-alg-2",
)
"""Elements that take less than a second together."""


PRINTED = (
    *(f"2019-def-{number}" for number in range(1, 5)),
    *(f"2019-eq-{number}" for number in range(1, 4)),
    *(f"2019-alg-{number}" for number in (1, 2)),
    *(f"2019-fig-{number}" for number in range(1, 9)),
    *(f"2019-scenario-4.{number}" for number in range(1, 4)),
    *(f"2022-def-{number}" for number in ("2.1", "2.2", "3.1", "3.2", *(f"4.{own}" for own in range(1, 8)))),
    *(f"2022-eq-{number}" for number in range(1, 14)),
    *(f"2022-alg-{number}" for number in range(1, 6)),
    *(f"2022-fig-{number}" for number in range(1, 17)),
    *(f"2022-fact-6.{number}" for number in range(1, 4)),
    *(f"2022-problem-{number}" for number in ("3.1", "3.2", "4.1")),
    *(f"2022-solution-{number}" for number in ("3.1", "3.2", "5.1")),
    *(f"2022-example-{number}" for number in (1, 2)),
    *(f"2022-section-{number}" for number in ("2.1", "2.2", "2.3", "5.2", "5.4", "6.4", "7")),
)
"""Everything that both papers number, and sections with figures of their own."""


def rerun(*quantities: Quantity, fault: str = "", element: str = "2019-def-1") -> Rerun:
    """Return an element with findings by hand."""
    return Rerun(next(each for each in ELEMENTS if each.id == element), Findings(quantities), 0.1, fault)


def test_ids_are_unique_and_begin_with_their_publication() -> None:
    ids = [own for element in ELEMENTS for own in (element.id, *element.also)]
    assert len(ids) == len(set(ids)) + sum(element.id in element.also for element in ELEMENTS)
    assert all(element.id.startswith(f"{element.publication}-") for element in ELEMENTS)
    assert {element.publication for element in ELEMENTS} <= set(HEADINGS)
    known = {element.id for element in ELEMENTS}
    assert {element.shares for element in ELEMENTS if element.shares} <= known


@pytest.mark.parametrize("element", ELEMENTS, ids=lambda element: element.id)
def test_each_element_names_what_implements_it(element: Element) -> None:
    assert element.by
    assert all(resolve_name(name) is not None for name in element.by)
    assert element.says.endswith(".")
    assert not element.differs or element.differs.endswith(".")


def test_all_that_the_papers_number_is_an_element() -> None:
    known = {own for element in ELEMENTS for own in (element.id, *element.also)}
    assert [name for name in PRINTED if name not in known] == []


def test_intervals_are_of_elements_and_say_why() -> None:
    assert set(INTERVALS) <= {element.id for element in ELEMENTS}
    assert all(expected.why for own in INTERVALS.values() for expected in own.values())


@few_of(2, "name", QUICK)
def test_quick_elements_are_within_their_intervals(name: str) -> None:
    element = next(each for each in ELEMENTS if each.id == name)
    found = Rerun(element, element.compute(), 0.0)
    assert [each.quantity.name for each in found.outside] == []
    assert set(INTERVALS.get(name, {})) <= {quantity.name for quantity in found.findings.quantities}


def test_elements_are_chosen_by_beginnings_and_ends() -> None:
    assert [element.id for element in chosen(["fig-8", "2019-alg"])] == [
        "2019-alg-1",
        "2019-alg-2",
        "2019-fig-8",
        "2022-def-4.2",
    ]
    assert [element.id for element in chosen(["2022-fig-5"])] == ["2019-fig-6"]
    assert chosen([]) == ELEMENTS
    with pytest.raises(BadInput, match=r"Did you mean 'fig-8'\? Elements: 2019-def-1, "):
        chosen(["fig-88"])


def test_a_quantity_that_left_its_interval_is_named() -> None:
    inside, outside = rerun(Quantity("points in some hoop", 42, digits=0)), rerun(Quantity("points in some hoop", 43, digits=0))
    assert inside.fine
    assert not outside.fine
    assert "points in some hoop: 43, expected 42" in "\n".join(lines([outside]))
    assert verdict([inside, outside]) == "2 elements, 2 quantities: 1 outside their intervals."
    assert "fails" in reproduction_html([outside])
    assert not rerun(Quantity("unknown", 1.0)).fine
    assert not rerun(Quantity("a check", False)).fine
    assert rerun(Quantity("a check", True)).fine
    assert verdict([rerun(fault="ValueError: no")]) == "1 elements, 0 quantities: 1 elements failed."


def test_expectations_admit_what_they_say() -> None:
    assert exact(6.40).admits(6.4049)
    assert not exact(6.40).admits(6.4151)
    assert text("a").admits("a")
    assert not text("a").admits("b")
    assert not exact(1.0).admits(True)
    assert not Expectation().admits(1.0)


def test_what_contains_a_bar_stays_in_its_cell() -> None:
    assert "| \\|a\\| |" in markdown([rerun(Quantity("|a|", True))])


@pytest.mark.slow
def test_the_command_writes_a_page_and_keeps_what_is_yours(tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = CliRunner().invoke(app, ["reproduce", "--only", "2019-lengths", "--out", str(out), "--json"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert found["verdict"] == "1 elements, 9 quantities: all within their intervals."
    assert {Path(name).name for name in found["files"]} == {
        "reproduction.html",
        "reproduction.md",
        "reproduction.json",
        "manifest.json",
    }
    (out / "reproduction.md").write_text("mine")
    kept = CliRunner().invoke(app, ["reproduce", "--only", "2019-lengths", "--out", str(out)])
    assert isinstance(kept.exception, BadInput)
    assert "is yours" in str(kept.exception)
    assert (out / "reproduction.md").read_text() == "mine"
