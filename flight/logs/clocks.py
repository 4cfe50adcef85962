"""Robots that were recorded each by itself, brought together on one clock: the mission's, 0 where the flight began.

Files that robots wrote themselves have clocks of their own, which began when their robots were switched on. No fit tells how far they
lie apart: it would fit away what is to be checked. So it is told, by one instant that is named on every clock, or nothing is read.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from flight.logs.import_options import RecordingOptions
from flight.logs.recordings import Recording
from flight.model.attitude import Floats
from verify.data import BadInput
from verify.data.storage.tables import since


@dataclass(frozen=True, eq=False, slots=True)
class Seen:
    """One robot, as its recording saw it.

    Attributes:
        counts: Times as whole multiples of 10**power s, on the recording's clock, going forward.
        power: 0 or less.
        places: m; NaN where it was not seen. Shape (n, 3).
        rounding: How far times (s) and positions (m) may be off for how they were written.
        covers: From when to when its file holds anything or says that it does, in the same multiples; `counts` lie within.
    """

    counts: Sequence[int]
    power: int
    places: Floats
    rounding: tuple[float, float]
    covers: tuple[int, int]

    @property
    def first(self) -> Fraction:
        """Its first time, s, exact."""
        return Fraction(self.counts[0]) * Fraction(10) ** self.power


def require_common_start(told: RecordingOptions, robots: Sequence[str], source: str) -> None:
    """Reject to bring files with clocks of their own together where nobody says how.

    Args:
        told: What is told of them.
        robots: Names in the mission.
        source: Names the files in messages.

    Raises:
        BadInput: There are several robots, and no start.
    """
    if len(robots) > 1 and told.start is None:
        example = ",".join(f"{robot}=12.3" for robot in robots[:2]) + (",..." if len(robots) > 2 else "")
        raise BadInput(
            f"{source} holds a file a robot, whose clocks may have begun at different times: say when the flight began on each of them "
            f"(--start {example}, in s of its own file), or once for all where they share a clock (--start 12.3)."
        )


def on_one_clock(
    seen: Mapping[str, Seen], told: RecordingOptions, source: str, *, shared: bool, beside: Sequence[Seen] = ()
) -> Recording:
    """Bring robots together on one clock, every sample at its own time.

    Args:
        seen: By robot, in the mission's order.
        told: What is told of the recording.
        source: Names it in messages.
        shared: Whether it has one clock for all of them, so that where no start is told its first sample is 0.
        beside: What else was recorded on that clock; it counts for what the recording covers.

    Raises:
        BadInput: A robot was never seen, its times do not go forward, or the clocks are not known to agree.
    """
    robots = tuple(seen)
    for robot, one in seen.items():
        if not len(one.counts):
            raise BadInput(f"{source} has no sample of {robot}.")
        back = np.flatnonzero(np.diff(np.array(one.counts, dtype=object)) <= 0)
        if len(back):
            k = int(back[0])
            at = [float(Fraction(one.counts[i]) * Fraction(10) ** one.power) for i in (k, k + 1)]
            raise BadInput(
                f"{source}: {robot}'s times must go forward, but {at[1]:.6f} s follows {at[0]:.6f} s (sample {k + 1})."
            )
    zeros = told.begins(robots)
    if zeros is None:
        if not shared:
            require_common_start(told, robots, source)
        zeros = dict.fromkeys(robots, min(one.first for one in seen.values()))
    own = {robot: np.array(since(one.counts, one.power, zeros[robot])) for robot, one in seen.items()}
    times = np.unique(np.concatenate(list(own.values())))
    position = np.full((len(times), len(robots), 3), np.nan)
    for j, (robot, at) in enumerate(own.items()):
        position[np.searchsorted(times, at), j] = seen[robot].places
    ends = [end for robot, one in seen.items() for end in since(one.covers, one.power, zeros[robot])]
    ends += [end for one in beside for end in since(one.covers, one.power, zeros[robots[0]])]
    late, off = (max(one.rounding[i] for one in seen.values()) for i in (0, 1))
    several = isinstance(told.start, Mapping)
    if several:  # each clock may be off on its own
        late += told.start_error
    zero = 0.0 if several else float(zeros[robots[0]])
    return Recording(robots, times, position, (late, off), _said(zeros, told), zero, (min(ends), max(ends)))


def _said(zeros: Mapping[str, Fraction], told: RecordingOptions) -> tuple[str, ...]:
    """Say what was told of several clocks."""
    if not isinstance(told.start, Mapping) or len(zeros) < 2:
        return ()
    at = ", ".join(f"{float(zero):g} s of {robot}'s" for robot, zero in zeros.items())
    off = f", each within {told.start_error:g} s" if told.start_error else ""
    return (
        f"Robots have clocks of their own, taken to run at one rate: {at} are one and the same instant, when the flight began, as was told{off}.",
    )
