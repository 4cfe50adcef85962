"""Flights over real links in which something fails at a random instant, two hundred for each: all end landed or holding, as is said of them.

What fails is drawn for each flight: a vehicle, the radio, or the program that flies; in every phase, a fifth of them with an interruption behind it.
Vehicles and where they are, motors, set-points and files are looked at from outside. Flights are flown beside each other, a block in a minute or two:
`pytest -m slow -n 0 -rP tests/flight/link/test_random_failures.py -k "px4 and 3"` flies one and says what became of it.
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import pytest

import ltlplan
from tests.helpers.live.failed_flights import Ended, Tally, flown_side_by_side
from tests.helpers.live.live_missions import WIDE_HOP

BLOCK = 20

pytestmark = pytest.mark.slow


def flown(fly: Callable[[int], Ended], block: int) -> Tally:
    tally = flown_side_by_side(fly, range(block * BLOCK, (block + 1) * BLOCK))
    print(tally)  # `pytest -rP` shows it
    assert tally.faults == []
    assert tally.outcomes.total() == BLOCK
    return tally


@pytest.mark.parametrize("block", range(10))
@pytest.mark.parametrize("way", ["stored", "streamed"])
def test_crazyflies(way: str, block: int) -> None:
    pytest.importorskip("cflib", reason="cflib is not installed")
    from tests.helpers.vehicles import failing_crazyflies

    tally = flown({"stored": failing_crazyflies.fly_stored, "streamed": failing_crazyflies.fly_streamed}[way], block)
    assert tally.outcomes["ended"] >= BLOCK / 4


@pytest.mark.parametrize("block", range(10))
def test_px4(block: int) -> None:
    pytest.importorskip("pymavlink", reason="pymavlink is not installed")
    from tests.helpers.vehicles.failing_px4 import fly_px4

    assert flown(fly_px4, block).outcomes["ended"] >= BLOCK / 4


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> str:
    """A run's folder."""
    out = tmp_path_factory.mktemp("hop") / "run"
    ltlplan.run(ltlplan.parse_mission(WIDE_HOP), out)
    return str(out)


@pytest.mark.parametrize("block", range(3))
def test_px4_flown_by_a_process_that_is_killed_frozen_or_interrupted(folder: str, block: int) -> None:
    pytest.importorskip("pymavlink", reason="pymavlink is not installed")
    from tests.helpers.vehicles.killed_px4 import fly_killed

    tally = flown(functools.partial(fly_killed, folder=folder), block)
    assert tally.outcomes["exit code -9"] >= 1
    assert tally.states["landed"] >= BLOCK / 4
