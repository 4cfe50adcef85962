"""Timelines of what was seen of a flight: a robot's letter changes between the two samples around the change."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from flight.model.timing import STEP
from verify.data import Letter, Mission
from verify.logic.verdict import Verdict
from verify.model_checking.timeline import Change, Enclosure, InternalChange, Relations, Status, Timeline
from verify.model_checking.word_claims import judge_formula, judged_as_one

_GRAIN = Fraction(1, 10**9)


def seen_timeline(
    mission: Mission, robot: str, times: NDArray[np.float64], letters: Sequence[Letter], actions: Sequence[InternalChange]
) -> Timeline:
    """Return the label timeline of what was seen of a robot.

    Args:
        mission: Names the regions.
        robot: Its name.
        times: Of the samples, s. Shape (n,).
        letters: What it showed at each.
        actions: Its internal changes, in order.
    """
    regions = tuple(mission.all_regions)
    shown = [letter & frozenset(regions) for letter in letters]
    initial: dict[str, Status] = {region: "must" if region in shown[0] else "no" for region in regions}
    changes = [
        Change(Enclosure(on_grid(before) + _GRAIN, on_grid(after)), region, "must" if region in now else "no")
        for before, after, old, now in zip(times[:-1].tolist(), times[1:].tolist(), shown[:-1], shown[1:], strict=True)
        for region in now ^ old
    ]
    first = mission.initial_letter(robot)
    return Timeline(robot, initial, tuple(changes), on_grid(float(times[-1])), first, tuple(actions))


def judged_words(mission: Mission, timelines: Mapping[str, Timeline]) -> Verdict:
    """Return the verdict on what was seen of all robots: of the formula and of what it bounds in seconds.

    Args:
        mission: What is asked.
        timelines: What was seen, by robot.
    """
    verdicts = judge_formula(mission, timelines, Relations())
    found = judged_as_one(verdicts)
    return replace(found, sentence=" ".join(verdict.sentence for verdict in verdicts)) if found else found


def on_grid(seconds: float) -> Fraction:
    """Return a time on the simulation's grid as an exact number."""
    return Fraction(round(seconds / STEP), round(1 / STEP))
