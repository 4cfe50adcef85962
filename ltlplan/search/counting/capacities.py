"""Upper bounds on the number of robots in a region, at their separation: proved, never a guess of how many fit.

Robots that are surely in a region have their centres in it less the margin, and any two of them keep a least distance d. Of n points
within a radius R of some point, squared distances to each other add up to at most n^2 R^2 (Rankin 1955), so that n is no more than
d^2 / (d^2 - 2 R^2) where R is below d / sqrt(2). A region that is longer than that is cut into boxes, and holds no more than they do together.
With `separation_z` all of it is said of a world in which z is stretched.

Where fewer fit than that, refinement says so of a plan, and planning is asked again with these capacities.
"""

from __future__ import annotations

import bisect
import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ltlplan.search.counting.counting_propositions import shows
from ltlplan.search.explanations.inquiry import all_of
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Formula, Mission
from verify.data.arrays import Floats
from verify.data.language.counting import Atom
from verify.data.shapes.region import Region

_ROUNDING = 1e-6
"""m by which robots may be nearer and regions larger than is computed, so that a bound never is too small."""
_MANY = 1_000_000
_SETS = 100
"""Sets of robots by name, more than there is room for, of which each region is asked."""
_LARGEST = 20.0
"""By how many times its size a region is thought to be made larger, to say what would do, in steps of `_GRAIN`."""
_GRAIN = 0.01


@dataclass(frozen=True, eq=False, slots=True)
class Room:
    """A region as a place for several robots.

    Attributes:
        region: Its body.
        apart: m between the centres of robots.
        margin: m that centres are inside the region.
        z_scale: Distances in z count this many times.
    """

    region: Region
    apart: float
    margin: float
    z_scale: float

    @classmethod
    def of(cls, mission: Mission, name: str) -> Room:
        """Return a region of a mission, for any of its robots.

        Args:
            mission: Of several robots.
            name: The region's.
        """
        z_scale = mission.separation / mission.separation_z if mission.separation_z else 1.0
        least = min(mission.least_distance(one, other) for one, other in itertools.combinations(mission.agents, 2))
        margin = mission.margin
        return cls(mission.all_regions[name], least + 2.0 * margin * max(1.0, z_scale), margin, z_scale)

    def most(self, robots: int, *, scale: float = 1.0) -> int:
        """Return a number of robots, at most those that are asked about, that are surely not exceeded.

        Args:
            robots: How many there are.
            scale: How many times as large, in each direction, the region is thought to be.
        """
        half = np.array(self.region.half_lengths) * scale - self.margin
        if min(half) < 0.0:
            return 0
        reach = (self.region.outer_radius * scale - self.margin) * max(1.0, self.z_scale)
        best = min(robots, _within(min(reach, self._radius(half)), self.apart))
        for parts in _parts(2 * robots) if best > 1 else ():
            best = min(best, self._in_boxes(parts, half, scale, best))
        return best

    def scale_for(self, robots: int) -> float | None:
        """Return how many times as large, in each direction, the region must be at the least to hold some robots; None: very many."""
        grid = range(int(_LARGEST / _GRAIN) + 1)
        steps = bisect.bisect_left(grid, robots, key=lambda steps: self.most(robots, scale=1.0 + steps * _GRAIN))
        return 1.0 + steps * _GRAIN if steps < len(grid) else None

    def _radius(self, half: Floats) -> float:
        """Return the radius of the ball around a box, as distances count."""
        return float(np.linalg.norm(half * (1.0, 1.0, self.z_scale)))

    def _in_boxes(self, parts: tuple[int, int, int], half: Floats, scale: float, best: int) -> int:
        """Return how many the region surely does not exceed, cut into so many boxes along its axes; `best` where not fewer."""
        each = _within(self._radius(half / parts), self.apart)
        if each >= best:
            return best
        axes = [h * (2.0 * np.arange(n) + 1.0 - n) / n for h, n in zip(half, parts, strict=True)]
        middles = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3) / scale
        far = 1.0 + float(np.linalg.norm(half / parts)) / scale / self.region.inner_radius + _ROUNDING
        levels = self.region.level(np.array(self.region.center) + middles)
        return each * int(np.sum(np.sqrt(levels) <= far))


def _within(radius: float, apart: float) -> int:
    """Return how many points at least `apart` from each other lie within a radius, at most; very many where nothing is said."""
    square, twice = (apart - _ROUNDING) ** 2, 2.0 * (radius + _ROUNDING) ** 2
    return int(square / (square - twice)) if twice < 0.999 * square else _MANY


def _parts(most: int) -> Iterator[tuple[int, int, int]]:
    """Yield the numbers of boxes along three axes, no more than `most` in all."""
    return ((x, y, z) for x, y in itertools.product(range(1, most + 1), repeat=2) for z in range(1, most // (x * y) + 1))


def small_rooms(mission: Mission, systems: Sequence[TransitionSystem], capacities: Mapping[str, int]) -> dict[str, int]:
    """Return the regions that hold fewer robots than there are, with how many at most.

    Args:
        mission: Of several robots.
        systems: What they can do.
        capacities: Robots that regions hold, where refinement found no places for more.
    """
    robots = len(mission.agents)
    visited = {region for system in systems for node in system.nodes for region in node.regions}
    known: dict[object, int] = {}
    found: dict[str, int] = {}
    for name in (region for region in mission.all_regions if region in visited):
        body = mission.all_regions[name].body
        if body not in known:
            known[body] = Room.of(mission, name).most(robots)
        most = min(known[body], capacities.get(name, robots))
        if most < robots:
            found[name] = most
    return found


def most_that_show(
    counted: Formula, systems: Iterable[TransitionSystem], rooms: Mapping[str, int]
) -> tuple[int, tuple[str, ...]] | None:
    """Return how many robots satisfy a Boolean combination of names at once at most, and the regions in which they are then.

    Args:
        counted: What each robot's letter is asked.
        systems: What robots can do.
        rooms: How many robots small regions hold.

    Returns:
        None where robots that are in no small region satisfy it.
    """
    within: set[str] = set()
    for letter, regions in {(s.labels[i], node.regions) for s in systems for i, node in enumerate(s.nodes)}:
        if shows(counted, letter):
            small = [(rooms[region], region) for region in regions if region in rooms]
            if not small:
                return None
            within.add(min(small)[1])
    return sum(rooms[region] for region in within), tuple(sorted(within))


def laws_of_rooms(known: Iterable[Atom], rooms: Mapping[str, int]) -> list[Formula]:
    """Return requirements that no more robots that a formula names are in small regions at once than these hold.

    Args:
        known: The formula's propositions that are no plain names.
        rooms: How many robots small regions hold.
    """
    named: dict[str, list[Formula]] = {}
    for atom in known:
        if atom.robot and atom.counted.name in rooms:
            named.setdefault(atom.counted.name, []).append(atom.formula)
    crowds = (
        crowd
        for region, those in sorted(named.items())
        for crowd in itertools.islice(itertools.combinations(those, rooms[region] + 1), _SETS)
    )
    return [Formula("G", (Formula("!", (all_of(crowd),)),)) for crowd in crowds]
