"""Shipped missions take no more work than was reviewed."""

from __future__ import annotations

import pytest

from ltlplan.missions import shipped_missions
from tests.work_counts import counted, wanted

QUICK = ("firefighting",)


def assert_no_more(name: str) -> None:
    found, most = counted(name), wanted()[name]
    assert found.keys() == most.keys()
    more = {key: (count, most[key]) for key, count in found.items() if count > 1.1 * most[key]}
    assert not more, f"{name} takes more work than was reviewed (found, reviewed): {more}"


@pytest.mark.parametrize("name", QUICK)
def test_a_quick_mission_takes_no_more_work_than_was_reviewed(name: str) -> None:
    assert_no_more(name)


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in shipped_missions() if name not in QUICK])
def test_shipped_missions_take_no_more_work_than_was_reviewed(name: str) -> None:
    assert_no_more(name)


def test_every_shipped_mission_has_reviewed_counts() -> None:
    assert set(wanted()) == set(shipped_missions())
    assert wanted()["warehouse"]["bending evaluations"] <= 1500, "the budget of a group, and the try that it ends in"
