"""The shipped sequence of hoops, flown by what is on board: in the order of, and near, what the compiled firmware gave."""

from __future__ import annotations

import pytest

from tests.helpers.vehicles.firmware_flights import FIRMWARE, flown_here


@pytest.mark.slow
def test_flights_are_near_those_of_the_compiled_firmware_and_in_their_order():
    found = list(flown_here())
    assert len(found) == len(FIRMWARE) == 7
    for firmware, rms, worst in found:
        assert (rms, worst) == pytest.approx((firmware.rms, firmware.worst), rel=0.4), firmware.name
    assert [rms for _, rms, _ in found] == sorted(rms for _, rms, _ in found)
    assert [worst for _, _, worst in found] == sorted(worst for _, _, worst in found)
