"""A plugin for pytest: all trees and invariants that the kernel looks at in tests, whatever it says of them, are put to the proved checkers as well.

`KERNEL_REPLAY` is the program that was extracted from the proofs. The last line of the output counts what was compared, and what was refused.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Iterator, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from tests.helpers.kernel.kernel_records import Invariant, Tree, noting
from tests.helpers.kernel.proved_checkers import ask
from verify.kernel import checking, timelines, trees, words
from verify.kernel.team import Team
from verify.kernel.trees import Part
from verify.kernel.words import Configuration

AT_ONCE = 2000
counted: Counter[str] = Counter()
differ: list[str] = []
_cases: dict[str, str] = {}
_known: set[int] = set()
_leaves, _check_invariant = trees.leaves, words._check_invariant


def leaves(whole: Part, marks: Iterator[str]) -> Iterator[tuple[Fraction, str, Part]]:
    """Yield what the kernel finds, and note what it was given."""
    taken: list[str] = []

    try:
        yield from _leaves(whole, noting(marks, taken))
    finally:
        _note(Tree(whole, tuple(taken)))


def check_invariant(team: Team, levels: Sequence[int | None], sets: Sequence[Sequence[Configuration]]) -> None:
    """Have the kernel check an invariant, and note it if it has the team's spans."""
    if len(sets) == team.size:
        _note(Invariant(team, tuple(levels), tuple(map(tuple, sets))))
    _check_invariant(team, levels, sets)


def _note(one: Tree | Invariant) -> None:
    case = one.asked()
    if hash(case) not in _known:
        _known.add(hash(case))
        _cases[case] = one.says()
        if len(_cases) >= AT_ONCE:
            _compare()


def _compare() -> None:
    found = ask(Path(os.environ["KERNEL_REPLAY"]), _cases)
    assert len(found) == len(_cases)
    differ.extend(case for (case, says), other in zip(_cases.items(), found, strict=True) if says != other)
    counted.update(
        f"{case.split()[0]}: {'refused' if says in ('refused', 'no') else 'checked'}" for case, says in _cases.items()
    )
    _cases.clear()


def pytest_configure() -> None:
    """Put these in the others' place."""
    for module in (checking, timelines, trees, words):
        for name, other in (("leaves", leaves), ("_check_invariant", check_invariant)):
            if hasattr(module, name):
                setattr(module, name, other)


def pytest_sessionfinish(session: pytest.Session) -> None:
    _compare()
    if differ:
        session.exitstatus = 1


def pytest_terminal_summary(terminalreporter: Any) -> None:
    for case in differ[:3]:
        terminalreporter.write_line(f"differs: {case[:2000]}")
    terminalreporter.write_line(f"replayed: {json.dumps({'differ': len(differ), **counted})}")
