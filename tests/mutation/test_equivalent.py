"""The list of planted faults that change nothing names faults that can be planted."""

import pytest

from tests.mutation.equivalent import EQUIVALENT
from tests.mutation.sites import ROOT, faults


@pytest.mark.slow
def test_every_fault_on_the_list_is_still_one() -> None:
    known = {fault.name for path in (ROOT / "verify").rglob("*.py") for fault in faults(path)}
    assert sorted(EQUIVALENT.keys() - known) == []
