"""Results of the reproduction as text, as Markdown, and as plain data for JSON."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from ltlplan.reproduction.element import HEADINGS
from ltlplan.reproduction.running import Judged, Rerun

HEADER = ("quantity", "publication", "here", "interval", "")
"""Columns of an element's table."""


def row(judged: Judged) -> tuple[str, str, str, str, str]:
    """Return a quantity's cells.

    Args:
        judged: The quantity beside its expectation.
    """
    quantity = judged.quantity
    interval = judged.expected.shown(quantity.digits)
    return quantity.name, quantity.paper, quantity.shown, interval, "" if judged.inside else "fails"


def verdict(reruns: Sequence[Rerun]) -> str:
    """Return a sentence on all of them."""
    quantities = sum(len(each.findings.quantities) for each in reruns)
    outside, failed = sum(len(each.outside) for each in reruns), sum(bool(each.fault) for each in reruns)
    said = f"{len(reruns)} elements, {quantities} quantities"
    if not outside and not failed:
        return f"{said}: all within their intervals."
    faults = [f"{outside} outside their intervals"] * bool(outside) + [f"{failed} elements failed"] * bool(failed)
    return f"{said}: {' and '.join(faults)}."


def lines(reruns: Sequence[Rerun]) -> Iterator[str]:
    """Yield a line for each element, and one for each quantity that is not as expected."""
    width = max(len(each.element.id) for each in reruns)
    for each in reruns:
        state = "ok" if each.fine else "NOT"
        yield f"{state:<4} {each.element.id:<{width}}  {each.element.title}"
        if each.fault:
            yield f"     {'':<{width}}  {each.fault}"
        for judged in each.outside:
            yield f"     {'':<{width}}  {judged.quantity.name}: {judged.quantity.shown}, expected {expected(judged)}"


def expected(judged: Judged) -> str:
    """Return what was expected of a quantity.

    Args:
        judged: The quantity beside its expectation.
    """
    if judged.expected.text is not None:
        return repr(judged.expected.text)
    return judged.expected.shown(judged.quantity.digits) or (
        "that it holds" if isinstance(judged.quantity.ours, bool) else "no quantity of this name"
    )


def markdown(reruns: Sequence[Rerun]) -> str:
    """Return all elements as a Markdown page, a table for each."""
    parts = ["# The papers, element by element", _BEGINS]
    for publication, heading in HEADINGS.items():
        own = [each for each in reruns if each.element.publication == publication]
        if own:
            parts += [f"## {heading}", *(_element(each) for each in own)]
    return "\n\n".join(parts) + "\n"


_BEGINS = (
    "After this page you can compare each figure of both papers and of published problems with what is computed here.\n\n"
    "`ltlplan reproduce` computes each quantity anew and writes this page; an interval's reason is in `ltlplan/reproduction/intervals.py`.\n"
    "A text must be the same, a check must hold. Positions of hoops and places are ours, where publications give none."
)


def _element(each: Rerun) -> str:
    element = each.element
    cells = [(name, paper, here, interval) for name, paper, here, interval, _ in map(row, each.judged)]
    table = ["| quantity | publication | here | interval |", "|---|---|---|---|"]
    table += [f"| {' | '.join(_cell(cell) for cell in line)} |" for line in cells]
    said = [f"### {element.title}", f"`{element.id}`: {element.says}"]
    said += [f"*Differs:* {element.differs}"] * bool(element.differs)
    by = ", ".join(f"`{name}`" for name in element.by)
    return "\n\n".join([*said, f"By {by}.", each.fault or "\n".join(table)])


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def data(reruns: Sequence[Rerun]) -> dict[str, Any]:  # of any type: JSON nests
    """Return all elements as plain data."""
    return {"verdict": verdict(reruns), "elements": [_data(each) for each in reruns]}


def _data(each: Rerun) -> dict[str, Any]:
    element = each.element
    return {
        "id": element.id,
        "also": list(element.also),
        "kind": element.kind,
        "title": element.title,
        "says": element.says,
        "differs": element.differs,
        "by": list(element.by),
        "seconds": round(each.seconds, 2),
        "fault": each.fault or None,
        "quantities": [_quantity(judged) for judged in each.judged],
    }


def _quantity(judged: Judged) -> dict[str, Any]:
    quantity, expectation = judged.quantity, judged.expected
    number = expectation.text is None and not isinstance(quantity.ours, bool)
    return {
        "name": quantity.name,
        "publication": quantity.paper or None,
        "ours": quantity.ours,
        "unit": quantity.unit or None,
        "low": expectation.low if number and expectation.low == expectation.low else None,
        "high": expectation.high if number and expectation.high < float("inf") else None,
        "text": expectation.text,
        "why": expectation.why or None,
        "inside": judged.inside,
    }
