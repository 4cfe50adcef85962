"""A fault planted anywhere in the kernel is noticed, or changes nothing."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.helpers.few import few_of
from tests.mutation.battery import UNITS, WORDS, noticed, noticed_by_proofs
from tests.mutation.kernel_equivalent import EQUIVALENT
from tests.mutation.sites import Fault, draw

SEED = 1


def kernel_faults(number: int | None) -> list[Fault]:
    """Return faults of the kernel, but for its command, which `test_contract` runs as a process."""
    every = [fault for fault in draw(None, SEED, "verify/kernel", wide=True) if Path(fault.path).stem != "__main__"]
    return every[:number]


@few_of(1, "number", [2, 10])
def test_proofs_of_true_flights_notice_most_faults(number: int) -> None:
    assert 2 * sum(map(noticed_by_proofs, kernel_faults(number))) >= number


@pytest.mark.slow
def test_all_faults_in_the_kernel_are_noticed() -> None:
    drawn = [fault for fault in kernel_faults(200) if fault.name not in EQUIVALENT]
    assert len(drawn) > 170
    assert [fault.name for fault in drawn if not noticed(fault, Path(fault.path).stem)] == []


@pytest.mark.slow
@pytest.mark.parametrize("stem", sorted({*UNITS, *WORDS}))
def test_nothing_is_noticed_where_there_is_no_fault(stem: str) -> None:
    assert noticed(None, stem) == ""


def test_every_fault_on_the_list_is_still_one() -> None:
    known = {fault.name for fault in kernel_faults(None)}
    assert sorted(EQUIVALENT.keys() - known) == []
