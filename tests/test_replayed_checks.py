"""Trees and invariants of the shipped missions' proofs, checked again by the checkers that are proved, and so are edits of them."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path

import pytest

from ltlplan.missions import shipped_missions
from tests.helpers.kernel_records import recorded
from tests.helpers.proved_checkers import ask

pytestmark = pytest.mark.slow
EDITS = 8
"""Of each invariant."""


@pytest.mark.parametrize("mission", shipped_missions())
def test_proved_checkers_say_what_the_kernel_says(checkers: Path, shipped_folder: Callable[[str], Path], mission: str) -> None:
    draw, found = random.Random(mission), recorded(shipped_folder(mission))
    trees = found.trees + [tree.edited(draw) for tree in found.trees if len(tree.marks) > 1 or draw.random() < 0.2]
    invariants = found.invariants + [one.edited(draw) for one in found.invariants for _ in range(EDITS)]
    says = [tree.says() for tree in trees]
    assert ask(checkers, (tree.asked() for tree in trees)) == says
    assert "refused" not in says[: len(found.trees)]
    assert "refused" in says
    says = [one.says() for one in invariants]
    assert ask(checkers, (one.asked() for one in invariants)) == says
    assert "no" not in says[: len(found.invariants)]
    assert "no" in says
