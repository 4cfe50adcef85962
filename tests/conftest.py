"""What many tests share and takes seconds to make: runs of the shipped missions."""

from __future__ import annotations

import functools
from collections.abc import Callable

import pytest

import ltlplan


@pytest.fixture(scope="session")
def shipped_run() -> Callable[[str], ltlplan.Result]:
    """Return the run of a shipped mission, made once in all tests."""
    return functools.cache(lambda name: ltlplan.run(ltlplan.load_mission(name)))
