"""The tube of a recorded flight: within the margin of the plan at every time, whatever happened between samples."""

from __future__ import annotations

import itertools

import numpy as np

from verify.arithmetic.intervals import Interval
from verify.claims.claim import Claim
from verify.recordings.alignment import Alignment
from verify.recordings.geometric_claims import recorded_claim
from verify.recordings.planned_paths import Floats, PlannedPath
from verify.recordings.reachable_sets import Cells, Track, least

_SHARE = 8
"""A sample that is to show that the robot was outside is compared with shifts that move the plan by this part of the margin."""

_MOST = 10_000
"""Parts of the interval of shifts that are looked at; more cannot be told."""


def tube_claim(track: Track, path: PlannedPath, alignment: Alignment, margin: float, end: float) -> Claim:
    """Check one robot against its planned path, for every shift that the alignment allows.

    Args:
        track: Where it was.
        path: Where it should have been.
        alignment: When the flight began on the recording's clock.
        margin: delta, m.
        end: T of the team, s: from then on nothing is planned.
    """
    robot = track.robot
    if not alignment.trusted:
        sentence = f"{robot}'s distance from its plan cannot be told: {alignment.sentence}"
        return recorded_claim("tube", "undecided", sentence, robot=robot, limit=margin)
    outside = _outside(track, path, alignment, margin, end)
    if outside is not None:
        distance, time = outside
        sentence = f"{robot} is at least {distance:.6g} m from its plan at {time:.4f} s; the margin is {margin:g} m."
        return recorded_claim("tube", "fails", sentence, robot=robot, bound=distance, limit=margin, time=time)
    found = least(track, _NegatedDistance(path, alignment), float(np.nextafter(-margin, -np.inf)))
    bound = -found.low
    if found.proved:
        sentence = f"{robot} stays within {bound:.4f} m of its plan at every time; the margin is {margin:g} m."
        return recorded_claim("tube", "holds", sentence, robot=robot, bound=bound, limit=margin, time=found.time)
    sentence = f"{robot} may be up to {bound:.6g} m from its plan at {found.time:.4f} s; the margin is {margin:g} m."
    return recorded_claim("tube", "undecided", sentence, robot=robot, bound=bound, limit=margin, time=found.time)


class _NegatedDistance:
    """The distance from the plan with its sign turned, so that it has to stay above the margin's."""

    def __init__(self, path: PlannedPath, alignment: Alignment) -> None:
        self.path, self.alignment = path, alignment

    def __call__(self, cells: Cells) -> tuple[Interval, Floats, Floats]:
        """Enclose it in the middle of cells, with how much further off the robot may be elsewhere in them.

        From the middle on, the chord's point and the plan part as their velocities differ; a shift moves the plan by its speed.
        """
        middle, half = self.alignment.low / 2 + self.alignment.high / 2, cells.half
        around = (self.alignment.high - self.alignment.low) / 2 * (1 + 1e-12)
        times = cells.times(cells.middle) - middle
        lost = 8 * np.spacing(np.abs(times) + abs(middle) + half)
        wanted, off = self.path.position(times, lost)
        distance = np.linalg.norm(cells.centres - wanted, axis=1)
        rounding = distance * 1e-12 + off
        length = np.diff(cells.track.times)[cells.gap]
        flown = (cells.track.positions[cells.gap + 1] - cells.track.positions[cells.gap]) / length[:, None]
        planned = self.path.velocity(times)
        apart = np.linalg.norm(flown - planned, axis=1) * (1 + 1e-6) + 1e-9
        first, last = times - half - around - lost, times + half + around + lost
        turned = self.path.turned(first, last)
        reach = half + around + lost
        bend = self.path.acceleration * reach * reach / 2 + turned * reach
        shifted = np.linalg.norm(planned, axis=1) * around
        change = apart * half + shifted + bend + self.path.jumped(first, last)
        # past an end of the plan its velocity is 0 on one side only; that is a turn of the velocity as any other
        return (
            Interval(-distance - rounding, -distance + rounding),
            change * (1 + 1e-9),
            shifted + self.path.acceleration * around * around / 2,
        )


def _outside(track: Track, path: PlannedPath, alignment: Alignment, margin: float, end: float) -> tuple[float, float] | None:
    """Return how far outside a sample shows the robot to be whatever the shift, m, and when, s; None where none does."""
    index = track.samples
    width = alignment.high - alignment.low
    parts = int(np.ceil(width * path.fastest * _SHARE / max(margin, 1e-6))) if width > 0 else 1
    if not len(index) or parts > _MOST:
        return None
    edges = np.linspace(alignment.low, alignment.high, parts + 1)
    worst: tuple[float, float] | None = None
    for low, high in itertools.pairwise(edges.tolist()):
        inside = index[(track.times[index] >= high) & (track.times[index] <= low + end)]
        if not len(inside):
            return None
        times = track.times[inside] - (low + high) / 2
        around = np.full(len(inside), (high - low) / 2 * (1 + 1e-9)) + 8 * np.spacing(np.abs(times) + abs(low) + abs(high))
        wanted, off = path.position(times, around)
        sure = np.linalg.norm(track.positions[inside] - wanted, axis=1) * (1 - 1e-12) - off - track.bounds.error
        sure -= path.jumped(times - around, times + around)
        at = int(np.argmax(sure))
        if not sure[at] > margin:
            return None
        if worst is None or sure[at] < worst[0]:
            worst = float(sure[at]), float(track.times[inside[at]])
    return worst
