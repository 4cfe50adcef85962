"""Missions are planned, refined and judged as before."""

from __future__ import annotations

import pytest

from tests.golden import CHANGED, cases, differences, golden, mission_of, platform, result
from tests.helpers.few import few_of

QUICK = ("shipped firefighting", "random 0", "random 2", "random 3", "random 4")


@few_of(2, "case", QUICK)
def test_results_are_as_before(case: str) -> None:
    wanted, found = golden()[1][case], result(case)
    assert found.keys() == wanted.keys()
    assert sorted(map(str, found["claims"])) == sorted(map(str, wanted["claims"]))
    assert found["words"].keys() == wanted["words"].keys()
    named = mission_of(case).written.names()
    assert _shown(found) & named == _shown(wanted) & named, "a path may pass other regions where that is shorter"
    assert found["cost"] == pytest.approx(wanted["cost"], rel=0.1), "more than two processors differ by"


def _shown(found: dict) -> set[str]:
    """Return what the team shows in all, whoever does."""
    words = found["words"].values()
    return {name for word in words for letter in [*word["prefix"], *(word["cycle"] or [])] for name in letter}


@pytest.mark.slow
@pytest.mark.parametrize("case", cases())
def test_all_results_are_as_before_to_the_last_bit(case: str) -> None:
    where, wanted = golden()
    if where != platform():
        pytest.skip(f"the golden results were made elsewhere: {where}")
    differs = differences(wanted[case], result(case))
    if case in CHANGED:
        assert differs, f"{case} is as it was; take it off the list of changes"
    else:
        assert not differs


def test_every_case_has_a_golden_result() -> None:
    assert list(golden()[1]) == cases()
    assert set(CHANGED) <= set(cases())


def test_what_differs_is_named() -> None:
    assert differences({"cost": 1.0, "words": {}}, {"cost": 2.0, "words": {}, "claims": []}) == ["claims", "cost"]
