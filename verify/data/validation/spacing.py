"""Least distances between robots, and the reserve of given points beyond a margin: one rule for mission files
and refinement.

A certificate at margin m asks that nominal paths, hovers included, keep `separation` and 2 m, where with `separation_z` distances
in z count k = separation / separation_z and the margins max(1, k) times. The vehicle's numbers are rounded, so a little more
is asked of the points that a mission gives.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal, Protocol

from verify.data.sections import Agent
from verify.data.shapes.inequalities import Point

ROUNDING = 1e-4
"""m on top of the margin that a start or an end keeps from walls, borders and rims."""
_APART = 1e-3
"""m on top of separation and margins that robots keep where they start and end."""
_FLOWN = 5e-4
"""m on top of them that flights keep in between: less, so that a robot that begins next to another one can leave."""


@dataclass(frozen=True, slots=True)
class Spacing:
    """The distance that nominal paths keep.

    Attributes:
        distance: m between centres, at all times.
        z_scale: Distances in z count this many times.
        skew: s by which two robots' clocks may be apart while they keep it.
    """

    distance: float
    z_scale: float
    skew: float = 0.0

    @property
    def at_rest(self) -> float:
        """The distance that starts keep, and ends, in m."""
        return self.distance + (_APART - _FLOWN)

    def between(self, a: Point, b: Point) -> float:
        """Return the distance of two points, in m, as it counts here."""
        return math.hypot(a[0] - b[0], a[1] - b[1], self.z_scale * (a[2] - b[2]))


def spacing(separation: float, separation_z: float | None, margin: float) -> Spacing:
    """Return how far robots keep apart.

    Args:
        separation: m, between centres.
        separation_z: m, taller clearance in z; None or 0 for the same in all directions.
        margin: m.
    """
    z_scale = separation / separation_z if separation_z else 1.0
    return Spacing(separation + 2 * margin * max(1.0, z_scale) + _FLOWN, z_scale)


class Separated(Protocol):
    """Source of least distances between robots, such as a mission."""

    @property
    def separation(self) -> float:
        """m, between centres."""
        ...

    @property
    def separation_z(self) -> float | None:
        """m, taller clearance in z; None for the same in all directions."""
        ...

    @property
    def margin(self) -> float:
        """M."""
        ...


def spacing_of(mission: Separated) -> Spacing:
    """Return how far a mission's robots keep apart."""
    return spacing(mission.separation, mission.separation_z, mission.margin)


@dataclass(frozen=True, slots=True)
class Crowded:
    """Two robots that start, or are to end, nearer to each other than they may.

    Attributes:
        first: One robot.
        second: The other one.
        what: Whether they start or end there.
        distance: m between them, as it counts.
    """

    first: str
    second: str
    what: Literal["start", "end"]
    distance: float


def crowded(agents: Mapping[str, Agent], kept: Spacing) -> Iterator[Crowded]:
    """Yield the pairs of robots whose starts, or whose ends, are too near each other, in the mission's order."""
    for (first, a), (second, b) in itertools.combinations(agents.items(), 2):
        places: tuple[tuple[Literal["start", "end"], Point | None, Point | None], ...]
        places = (("start", a.start, b.start), ("end", a.end, b.end))
        for what, p, q in places:
            if p is not None and q is not None and kept.between(p, q) < kept.at_rest:
                yield Crowded(first, second, what, kept.between(p, q))


def needed(kept: Spacing, separation: float, margin: float) -> str:
    """Return how far apart robots must be and what that is the sum of, for messages.

    Args:
        kept: The rule, with the margin in it.
        separation: m, between centres.
        margin: m.
    """
    stretch = max(1.0, kept.z_scale)
    twice = f"{2 * stretch:g} times the margin {margin:g} m" if stretch > 1.0 else f"twice the margin {margin:g} m"
    counts = "" if kept.z_scale == 1.0 else f", where a distance in z counts {kept.z_scale:g} times"
    return f"{kept.at_rest:g} m is needed: separation {separation:g} m, {twice} and {_APART:g} m for rounding{counts}"
