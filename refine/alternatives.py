"""Alternatives tried in order: refinement's own fall-backs for a plan, by name."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeVar

from verify.data import Infeasible
from verify.data.progress import Progress

Found = TypeVar("Found")


def first_feasible(alternatives: Iterable[tuple[str, Callable[[], Found]]], tell: Progress) -> Found:
    """Return what the first feasible alternative finds.

    Args:
        alternatives: In order, each with a sentence that names it; the first one, which is as planned, may have none.
        tell: Told the name of each that is tried.

    Raises:
        Infeasible: No alternative is feasible; this is what was said of the first.
    """
    refused: Infeasible | None = None
    for name, find in alternatives:
        if name:
            tell(name, 0.0)
        try:
            return find()
        except Infeasible as error:
            refused = refused or error
    assert refused is not None
    raise refused
