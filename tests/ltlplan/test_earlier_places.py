"""Modules that docs named by other names: they are imported from there with a warning."""

from __future__ import annotations

import importlib
import sys

import pytest


@pytest.mark.parametrize(
    ("earlier", "now", "name"),
    [
        ("ltlplan.paths.optimiser.cross_entropy", "ltlplan.paths.cross_entropy.cross_entropy", "improve"),
        ("ltlplan.service.computing.batches", "ltlplan.service.execution.batches", "run_batch"),
        ("ltlplan.service.computing.workers", "ltlplan.service.execution.workers", "LocalWorkers"),
        ("ltlplan.service.computing.clusters", "ltlplan.service.execution.clusters", "Cluster"),
    ],
)
def test_what_docs_named_otherwise_is_found_with_a_warning(earlier: str, now: str, name: str) -> None:
    sys.modules.pop(earlier, None)
    with pytest.warns(DeprecationWarning, match=f"is {now} now"):
        found = importlib.import_module(earlier)
    assert getattr(found, name) is getattr(importlib.import_module(now), name)
