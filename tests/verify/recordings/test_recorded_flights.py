"""Flights that the simulator flew and knows, recorded with bounded faults: what the judge says of them is so.

`python tests/benchmarks/recordings.py 10000` does the same with as many flights as are asked for, and says what came of them.
"""

from __future__ import annotations

import pytest

from tests.helpers.live.recorded_flights import campaign


@pytest.mark.slow
def test_no_flight_that_is_called_satisfied_left_its_tube_or_broke_a_claim(tmp_path):
    tally = campaign(1, 60, tmp_path, together=20)
    assert tally.faults == []
    assert tally.flights == 60
    assert tally.outcomes["holds"] >= 1
    assert tally.outcomes["fails"] >= 1
    assert 1 <= tally.left < 60


@pytest.mark.slow
@pytest.mark.parametrize("thousand", range(10))
def test_of_ten_thousand_flights_none_is_called_what_it_is_not(thousand, tmp_path):
    tally = campaign(1000 + 10 * thousand, 1000, tmp_path)
    print(tally.said)  # `pytest -rP` shows it
    assert tally.faults == []
    assert tally.flights == 1000
    assert min(tally.outcomes["holds"], tally.outcomes["fails"], tally.left) >= 1
