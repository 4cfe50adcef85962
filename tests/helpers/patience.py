"""Live flights in tests beside other tests: a machine that runs those, too, stalls for longer than the 0.2 s of a real flight."""

from __future__ import annotations

import pytest

UNSEEN = 0.7
"""s that a robot may be unseen."""
LATE = 0.45
"""s by which a set-point may be late: vehicles level out 0.5 s after their last one."""


@pytest.fixture(autouse=True)
def patient(monkeypatch) -> None:
    """Let robots be unseen, and set-points be late, for a while: in every test of the modules that import this."""
    for module in ("watch", "checks", "reaction"):
        monkeypatch.setattr(f"flight.link.{module}.FRESH", UNSEEN)
    monkeypatch.setattr("flight.link.streaming.LATE", LATE)
