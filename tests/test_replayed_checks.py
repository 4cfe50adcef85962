"""Trees and invariants of the shipped missions' proofs, checked again by the checkers that are proved, and so are edits of them."""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from ltlplan.missions import shipped_missions
from tests.helpers.kernel.kernel_records import recorded
from tests.helpers.kernel.proved_checkers import ask
from tests.mutation.sites import ROOT

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


def test_proved_checkers_agree_on_every_proof_of_the_suite(checkers: Path) -> None:
    """All that the kernel looks at in its own tests and in those of audits, true or not (`kernel_replay`)."""
    files = ["tests/verify/kernel", "tests/verify/third_party/test_audit_proof.py"]
    command = [sys.executable, "-m", "pytest", "-n", "0", "-q", "-p", "tests.helpers.kernel.kernel_replay", *files]
    environment = {**os.environ, "KERNEL_REPLAY": str(checkers)}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-5000:]
    (line,) = (line for line in done.stdout.splitlines() if line.startswith("replayed: "))
    found = json.loads(line.removeprefix("replayed: "))
    assert found["differ"] == 0
    assert min(found["tree: checked"], found["tree: refused"]) > 500
    assert all(found[f"{kind}: {says}"] for kind in ("own", "team", "own-laps") for says in ("checked", "refused"))
