"""The judge's tests notice faults in the judge."""

from __future__ import annotations

import ast
import subprocess
import sys

import pytest

from tests.mutation.sites import ROOT, draw, faults, plant


def test_a_planted_fault_changes_one_expression() -> None:
    path = ROOT / "verify" / "motion" / "membership" / "statuses.py"
    plain = ast.unparse(ast.parse(path.read_text())).splitlines()
    for fault in list(faults(path))[::25]:
        planted = ast.unparse(plant(fault)).splitlines()
        assert len(planted) == len(plain)
        assert sum(a != b for a, b in zip(plain, planted, strict=True)) == 1


def test_a_draw_depends_on_its_seed_alone() -> None:
    first, again, other = (draw(5, seed, "verify/trace_checking") for seed in (1, 1, 2))
    assert first == again != other


@pytest.mark.slow
def test_every_planted_fault_is_noticed_or_changes_nothing() -> None:
    """200 random faults, drawn with a fixed seed; about half an hour on two cores."""
    done = subprocess.run([sys.executable, "-m", "tests.mutation", "--count", "200"], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-5000:] + done.stderr[-2000:]
    assert "200 faults" in done.stdout
