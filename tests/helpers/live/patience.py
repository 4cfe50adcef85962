"""Live flights in tests beside other tests: a machine that runs those, too, stalls for longer than the 0.2 s of a real flight."""

from __future__ import annotations

import importlib

import pytest

UNSEEN = 0.7
"""s that a robot may be unseen, and nobody may look."""
LATE = 0.45
"""s by which a set-point may be late: vehicles level out 0.5 s after their last one."""
_WHAT = {
    **{f"flight.monitoring.thresholds.{name}": UNSEEN for name in ("FRESH", "SLOW")},
    "flight.link.tracking_monitor.FRESH": UNSEEN,
    "flight.link.streaming.LATE": LATE,
}


@pytest.fixture(autouse=True)
def patient(monkeypatch) -> None:
    """Let robots be unseen, and set-points be late, for a while: in every test of the modules that import this."""
    for name, seconds in _WHAT.items():
        monkeypatch.setattr(name, seconds)


def be_patient() -> None:
    """Do the same in a process of its own, to its end."""
    for name, seconds in _WHAT.items():
        module, _, attribute = name.rpartition(".")
        setattr(importlib.import_module(module), attribute, seconds)
