"""Greatest difference between the clocks of a team: as a mission states it, or as a common start by broadcast leaves it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from fractions import Fraction

from verify.data.mission import Mission
from verify.data.trajectory import Trajectory

START_SKEW = 0.02
"""s between the first robot that a radio's broadcast starts and the last one, where a vehicle's profile does not say."""
CLOCK_DRIFT = 1e-4
"""Share of the time since the last common start by which two clocks drift apart, where a vehicle's profile does not say."""

_STEP = 10_000
"""Steps in a second that the value is rounded up to."""


def clock_error_of(mission: Mission, since_start: Fraction | float) -> float:
    """Return how far apart two clocks of a mission's team may be, in s: what it says, or skew of a common start and drift.

    Radios start their robots one after the other. The drift is that at the end of the time given, for all of it. Bounds in seconds are
    read on a reference clock, which is one more clock. A single robot without such bounds has nobody to differ from.

    Args:
        mission: Carries `clock_error`, `radios` and the vehicles.
        since_start: The longest time from a common start, s.
    """
    if len(mission.agents) < 2 and not mission.timed_parts:
        return 0.0
    if mission.clock_error is not None:
        return float(mission.clock_error)
    vehicles = [mission.vehicle_of(agent) for agent in mission.agents]
    skew = max(START_SKEW if v.start_skew is None else v.start_skew for v in vehicles) * (mission.radios or 1)
    drift = max(CLOCK_DRIFT if v.clock_drift is None else v.clock_drift for v in vehicles)
    return math.ceil((Fraction(str(skew)) + Fraction(str(drift)) * Fraction(since_start)) * _STEP) / _STEP


def since_common_start(mission: Mission, team: Mapping[str, Trajectory]) -> Fraction:
    """Return the longest time that a team flies from a common start: a flight's, its longest part's, or that of all laps.

    Parts begin with a common start, laps that are parts too; other laps are flown one after the other.

    Args:
        mission: Says how many laps.
        team: Its flights.
    """
    longest = Fraction(0)
    for path in team.values():
        knots = [Fraction(0)]
        for duration in path.durations.tolist():
            knots.append(knots[-1] + Fraction(duration))
        starts = [Fraction(0), *(knots[cut] for cut in path.cuts), knots[-1]]
        longest = max(longest, *(stop - start for start, stop in itertools.pairwise(starts)))
        if path.cycle is not None and path.cycle not in path.cuts:
            longest = max(longest, knots[-1] + (mission.spec.repeat - 1) * (knots[-1] - knots[path.cycle]))
    return longest
