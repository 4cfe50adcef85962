"""Stays in regions along a sampled flight: a filter that tells whether a path is worth handing to the judge.

A *stay* in a region is a maximal interval in which the path is within the margin of it (the region grown by the margin),
as the certificate counts visits.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from refine.spline.spline import Spline
from verify.data import Mission, RobotPlan, Witness
from verify.data.shapes.region import Region

Floats = NDArray[np.float64]

Change = tuple[str, int, Literal["enters", "leaves"]]
"""A region, the number of the stay there, and what happens."""

_INSTANT = 1e-9
"""s within which two times are the same: sums of durations are rounded."""
_SAMPLES = np.linspace(0.0, 1.0, 201)


@dataclass(frozen=True)
class SampledStay:
    """One stay: enters at `start`, leaves at `end` (s), and comes as deep as `level` (1 is the region's own boundary)."""

    region: str
    start: float
    end: float
    level: float


def stays(path: Spline, regions: dict[str, Region], margin: float) -> tuple[SampledStay, ...]:
    """Return all stays in order of their start.

    Args:
        path: Three axes or more.
        regions: By name.
        margin: m by which each is grown.
    """
    points = path.sample(_SAMPLES)[..., :3].reshape(-1, 3)
    times = (path.knots[:-1, None] + path.durations[:, None] * _SAMPLES).ravel()
    found: list[SampledStay] = []
    low, high = points.min(axis=0), points.max(axis=0)
    for name, region in regions.items():
        reach = region.outer_radius * (1.0 + max(margin, 0.0) / region.inner_radius) * (1 + 1e-9)
        if any(a - reach > x or x > b + reach for a, x, b in zip(low, region.center, high, strict=True)):
            continue
        level = np.sqrt(region.level(points))
        near = np.concatenate([[False], level <= 1.0 + margin / region.inner_radius, [False]])
        edges = np.flatnonzero(near[1:] != near[:-1])
        for begin, end in zip(edges[::2], edges[1::2], strict=True):
            found.append(SampledStay(name, float(times[begin]), float(times[end - 1]), float(level[begin:end].min())))
    return tuple(sorted(found, key=lambda stay: (stay.start, stay.end, stay.region)))


def violations(path: Spline, mission: Mission, name: str, robot: RobotPlan, clearance: float = 0.0) -> tuple[Witness, ...]:
    """Return what the judge would refuse about a robot's visits, as far as samples show it.

    Stays are counted with the margin, and with `clearance` m more and less of it: a path that just about leaves a region and comes
    back may be one stay or two.

    Args:
        path: Three axes or more.
        mission: Gives regions and margin.
        name: The robot's.
        robot: Its visits.
        clearance: m.
    """
    found, wanted = stays(path, mission.all_regions, mission.margin), [visit.region for visit in robot.visits]
    for by in (0.0, clearance, -clearance) if clearance else (0.0,):
        counted = found if by == 0.0 else stays(path, mission.all_regions, mission.margin + by)
        seen = [stay.region for stay in counted]
        if seen == wanted:
            continue
        index = next((i for i, (s, w) in enumerate(zip(seen, wanted, strict=False)) if s != w), min(len(seen), len(wanted)))
        extra = counted[index] if index < len(counted) else None
        sentence = (
            f"{name}'s path comes, within the margin, to {', then '.join(seen) or 'no region'}; "
            f"its plan visits {', then '.join(wanted) or 'none'}."
        )
        return (
            Witness(
                claim="visits",
                sentence=sentence,
                robot=name,
                region=wanted[index] if extra is None else extra.region,
                time=None if extra is None else extra.start,
                visit=index if index < len(wanted) else None,
            ),
        )
    result = []
    for index, stay in enumerate(found):
        needed = 1.0 - mission.margin / mission.all_regions[stay.region].inner_radius
        if stay.level >= needed:
            sentence = f"{name}: visit {index} comes to {stay.level:.3f} of '{stay.region}', which is not {mission.margin:g} m inside it."
            result.append(
                Witness(claim="visits", sentence=sentence, robot=name, region=stay.region, visit=index, time=stay.start)
            )
    return tuple(result)


def certain_orders(path: Spline, mission: Mission) -> frozenset[tuple[Change, Change]]:
    """Return which label changes certainly come before which others, in all words that the judge may read from a path.

    A label changes somewhere within the margin of its region's boundary, so that changes may be so near to each other that either may
    come first. What holds where a flight begins comes before all else, and what is never left after all else; the end of a flight counts
    as leaving a region without a name.

    Args:
        path: Three axes or more.
        mission: Gives regions and margin.
    """
    deep = stays(path, mission.all_regions, -mission.margin)
    spans: dict[Change, tuple[float, float]] = {("", 0, "leaves"): (path.duration, path.duration)}
    counts: Counter[str] = Counter()
    for stay in stays(path, mission.all_regions, mission.margin):
        within = [each for each in deep if each.region == stay.region and stay.start <= each.start <= stay.end]
        entered = min((each.start for each in within), default=stay.end)
        left = max((each.end for each in within), default=stay.start)
        ends = -np.inf if stay.start <= 0.0 else entered, np.inf if stay.end >= path.duration - _INSTANT else left
        number = counts[stay.region]
        counts[stay.region] += 1
        spans[stay.region, number, "enters"] = min(stay.start, ends[0]), ends[0]
        spans[stay.region, number, "leaves"] = ends[1], max(stay.end, ends[1])
    return frozenset((one, other) for one, (_, by) in spans.items() for other, (earliest, _) in spans.items() if by < earliest)
