"""How near to a region samples may be and still prove that a robot was not in it."""

from __future__ import annotations

import numpy as np
import pytest

from verify.data.shapes.region import Region
from verify.recordings.sampled_timelines import sampled_timeline

BALL = Region.model_validate({"center": (0.0, 0.0, 0.0), "radii": (1.0, 1.0, 1.0)})


@pytest.mark.parametrize(("aside", "status"), [(1.31, "no"), (1.29, "may"), (0.69, "must"), (0.71, "may")])
def test_a_flight_past_a_ball_is_told_to_a_centimetre(aside: float, status: str) -> None:
    """It may bend 296 mm from its chord, which passes the ball's centre in its middle, or begins and ends near it."""
    half = 0.85 if aside > 1 else 0.0
    speed = 1.8 if aside > 1 else 2 * np.sqrt(1.8**2 - 1.7**2) / 2
    positions = np.array([[-half, aside, 0.0], [half, aside, 0.0]])
    line = sampled_timeline("r0", np.array([0.0, 1.0]), positions, {"ball": BALL}, speed=speed)
    found = {line.initial["ball"], *(change.status for change in line.changes)}
    assert found == ({status} if status != "may" else {"may", "no"} if aside > 1 else {"may", "must"})
