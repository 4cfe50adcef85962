"""Graph of hovers in a mission's regions and of straight lines between them: E of Def. 4.2, laid out in space.

Everything that says what a robot can do stands on this one: the systems A that the exact search and the products walk
(`robot_systems`), and the visits by which MTAC-E and teams in flight move on (`ltlplan.mtac.agent_moves`). It says which region may
be entered from where, which regions a robot is in on the way, and which actions a point permits; costs and internal states are
theirs to add.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ltlplan.free_space.free_space import FreeSpace, Place
from ltlplan.systems.region_labels import Layout, Location
from ltlplan.systems.routes import Routes
from ltlplan.systems.transition_systems import environment_of
from verify.data import Letter, Mission
from verify.data.language.sequence import Direction
from verify.data.sections import Action
from verify.data.shapes.inequalities import Point


@dataclass(frozen=True, slots=True)
class RestPoint:
    """Point where a robot can hover: the middle of a region, or a point of its own, such as its start.

    Attributes:
        place: The region, or the environment's start vertex.
        entered: The region entered last.
        location: The point and the regions around it.
        position: The point, where it is not the middle of the region.
        side: The direction in which a hoop is flown through, where ways around obstacles depend on it.
    """

    place: str
    entered: str
    location: Location
    position: Point | None = None
    side: Direction | None = None


@dataclass(frozen=True, slots=True)
class Transition:
    """A way to the next point.

    Attributes:
        end: Where it leads.
        letters: The regions in between, or None for the free flight after the last point.
        length: Of the shortest way there is around obstacles, m; None where it is the straight line, or a way out and back.
    """

    end: RestPoint
    letters: tuple[Letter, ...] | None
    length: float | None = None


class RegionGraph:
    """The points at which robots rest in a mission, and the ways between them.

    Attributes:
        mission: Whose regions.
        environment: Which regions can be entered after which.
        layout: How the regions lie.
        places: The middles of the regions that can be visited.
        space: Where robots can fly, in a world with obstacles.
    """

    def __init__(
        self,
        mission: Mission,
        *,
        places: Collection[str] | None = None,
        layout: Layout | None = None,
        radius: float | None = None,
        closed: frozenset[str] = frozenset(),
    ) -> None:
        """Lay out a mission's regions.

        Args:
            mission: Whose regions and environment.
            places: Regions that robots may visit; all of them where None.
            layout: How the mission's regions lie, where that is known already.
            radius: Of the vehicles, m; by default of the mission's.
            closed: Regions that legs lead around, as the formula may forbid them.
        """
        self.mission = mission
        self.space = FreeSpace.of(mission, radius) if mission.obstacles else None
        self._routes = Routes(mission, radius, closed)
        self._asked: set[Place] = set()
        self._known: dict[RestPoint, tuple[Transition, ...]] = {}
        self.environment = environment_of(mission)
        self.layout = layout or Layout(mission)
        self.places = {
            name: location
            for name, location in self.layout.middles.items()
            if location.clear and (places is None or name in places) and _fits(mission, name)
        }
        self._around = {region: self.layout.around(region) for region in self.layout.regions}
        self._holding: dict[str, list[str]] = {region: [] for region in self.layout.regions}
        """For each region, the places whose middle lies in it."""
        for name, location in self.places.items():
            for region in location.inside:
                self._holding[region].append(name)
        self._order = {name: index for index, name in enumerate(self.places)}
        sets = {id(regions): frozenset(regions) for regions in self.environment.successors.values()}
        self._next = {vertex: sets[id(regions)] for vertex, regions in self.environment.successors.items()}

    def middles(self, region: str) -> tuple[RestPoint, ...]:
        """Return the rest points of a robot that has entered a region and is in its middle: one, or one for each side of a hoop."""
        return tuple(RestPoint(region, region, self.places[region], side=side) for side in self._sides(region))

    def standing(self, location: Location, visited: str | None = None) -> RestPoint:
        """Return the rest point of a robot that hovers anywhere.

        Args:
            location: Where it hovers.
            visited: The region that it visited last, if it is in none.
        """
        place = location.inside[-1] if location.inside else self.environment.start
        return RestPoint(place, self.begun_in(location.inside) or visited or place, location, location.point)

    def begun_in(self, inside: Sequence[str]) -> str | None:
        """Return the vertex of a robot that begins in some regions; None in free flight.

        It may have entered any of them last, so where the mission gives edges, it goes on only where each of them leads: that is a
        vertex of its own.

        Args:
            inside: The regions that hold it, outermost first.
        """
        if len(inside) < 2 or self.mission.environment is None:
            return inside[-1] if inside else None
        vertex = " & ".join(inside)
        if vertex not in self._next:
            self._next[vertex] = frozenset.intersection(*(self._next[region] for region in inside))
        return vertex

    def around(self, point: RestPoint) -> tuple[str, ...] | None:
        """Return the regions that a robot is in just after it has left a point's place; None where that is not clear."""
        if not point.location.inside:
            return ()
        return self._around[point.place] if len(point.location.inside) == len(self.layout.middles[point.place].inside) else None

    def transitions(self, point: RestPoint) -> Iterable[Transition]:
        """Return every way on from a point."""
        if self.space is None:
            return self._straight(point)
        if point not in self._known:
            self._known[point] = tuple(self._around_obstacles(point))
        return self._known[point]

    def length(self, point: RestPoint, end: Location) -> float:
        """Return how long the shortest way from a rest point to a point of its own is, m; infinite where there is none.

        Args:
            point: Where it begins.
            end: Where it ends.
        """
        place, before = self.exit(point)
        return before + self._metres(place, Place(end.point, frozenset(end.inside)))

    def lengths(self, start: Point | str, region: str) -> list[float]:
        """Return how long the ways from a point or a region's middle to a region's middle are, by each side of hoops, m.

        Args:
            start: A point in m, or a region.
            region: Where they end.
        """
        if self._routes.straight:
            regions = self.layout.regions
            return [math.dist(regions[start].center if isinstance(start, str) else start, regions[region].center)]
        if isinstance(start, str):
            points = [RestPoint(start, start, self.layout.middles[start], side=side) for side in self._sides(start)]
        else:
            points = [self.standing(self.layout.at(start))]
        found: list[float] = []
        for point in points:
            place, before = self.exit(point)
            if place not in self._asked:  # of all places at once, that is sooner
                self._asked.add(place)
                self._routes.lengths(place, [entry for name in self.places for _, entry, _ in self.entries(name)])
            found += [before + self._metres(place, entry) + after for _, entry, after in self.entries(region)]
        return found

    def _metres(self, start: Place, end: Place) -> float:
        """Return how long a way is, m; in a world without obstacles, where none was found, the straight line: whoever lays paths finds out."""
        length = float(self._routes.lengths(start, [end])[0])
        return length if self.space is not None or math.isfinite(length) else math.dist(start.point, end.point)

    def _straight(self, point: RestPoint) -> Iterator[Transition]:
        """Yield the ways on from a point where there are no obstacles."""
        around = self.around(point)
        for target in self._targets(point):
            location = self.places[target]
            outside = tuple(name for name in location.inside if name != target)
            start, letters = frozenset(point.location.inside), None
            if around is not None and around == outside and (self._around[target] is not None or not outside):
                start = frozenset(around)
                path: tuple[Letter, ...] = (start, frozenset(location.inside))
            elif target == point.place and point.position is None:
                continue
            else:
                found = self.layout.way(point.location, location)
                if found is None:
                    continue
                path, letters = found, found[1:-1]
            entered = self.last_entered(point.entered, path)
            if entered is not None:
                yield Transition(RestPoint(target, entered, location), letters)

    def _around_obstacles(self, point: RestPoint) -> Iterator[Transition]:
        """Yield the ways on from a point through free space."""
        around = self.around(point)
        start, before = self.exit(point)
        entries = [(target, *entry) for target in self._targets(point) for entry in self.entries(target)]
        lengths = self._routes.lengths(start, [place for _, _, place, _ in entries])
        for (target, side, place, after), length in zip(entries, lengths, strict=True):
            location, again = self.places[target], target == point.place and point.position is None
            if not math.isfinite(length) or (again and side is None and around is None):
                continue
            outside = tuple(name for name in location.inside if name != target)
            freely = around is not None and around == outside and (self._around[target] is not None or not outside)
            path: tuple[Letter, ...] = (frozenset(around or ()), frozenset(location.inside))
            letters: tuple[Letter, ...] | None = None
            if not freely or (outside and not again):
                shown = self._shown(point, start, place, location)
                if shown is None:
                    continue
                if not freely or shown[1:] != path:
                    path, letters = shown, shown[1:-1]
            entered = self.last_entered(point.entered, path)
            if entered is not None:
                metres = None if again and side is None else before + float(length) + after
                yield Transition(RestPoint(target, entered, location, side=side), letters, metres)

    def _shown(self, point: RestPoint, start: Place, place: Place, end: Location) -> tuple[Letter, ...] | None:
        """Return the sets of regions on the way through free space from a point to a place; None where their order is not clear."""
        way = self._routes.way(start, place)
        if way is None:
            return None
        whole = [np.array(point.location.point), *way, np.array(end.point)]
        kept = [at for k, at in enumerate(whole) if k == 0 or not np.allclose(at, whole[k - 1], atol=1e-9)]
        if len(kept) == 2:
            return self.layout.way(point.location, end)
        return self.layout.along(point.location, np.array(kept), end)

    def _sides(self, region: str) -> tuple[Direction | None, ...]:
        return ("F", "R") if self.space is not None and region in self.mission.hoops else (None,)

    def entries(self, target: str) -> Iterator[tuple[Direction | None, Place, float]]:
        """Yield where ways to a region's middle end: there, or on either side of a hoop; with how far it is from there."""
        for side in self._sides(target):
            if side is None:
                location = self.layout.middles[target]
                yield side, Place(location.point, frozenset(location.inside)), 0.0
            else:
                yield side, *self._beside(target, ahead=side == "R")

    def exit(self, point: RestPoint) -> tuple[Place, float]:
        """Return where ways from a rest point begin, and how far that is from it."""
        hoop = self.mission.hoops.get(point.place)
        if hoop is None or self.space is None or (point.position is None and point.side is None):
            return Place(point.location.point, frozenset(point.location.inside)), 0.0
        if point.position is None:
            return self._beside(point.place, ahead=point.side == "F")
        offset = np.array(point.position) - np.array(hoop.center)
        place, _ = self._beside(point.place, ahead=bool(offset @ np.array(hoop.normal) >= 0.0))
        return place, math.dist(point.position, place.point)

    def _beside(self, name: str, *, ahead: bool) -> tuple[Place, float]:
        """Return the control point in front of a hoop or behind it, and how far it is from the hoop's middle."""
        hoop = self.mission.hoops[name]
        reach = hoop.reach or 0.0
        x, y, z = (c + (reach if ahead else -reach) * n for c, n in zip(hoop.center, hoop.normal or (), strict=True))
        return Place((x, y, z), frozenset(self.layout.at((x, y, z)).inside)), reach

    def last_entered(self, entered: str, path: Sequence[Letter]) -> str | None:
        """Return the region entered last on a path, or None where an edge for it is missing.

        Args:
            entered: The region entered last before.
            path: The regions that a robot is in, one set after another.
        """
        for before, after in itertools.pairwise(path):
            for region in after - before:  # one at most: borders are passed one by one
                if region not in self._next[entered]:
                    return None
                entered = region
        return entered

    def actions(self, point: RestPoint) -> Iterator[Action]:
        """Yield the actions that are permitted at a point, whatever the internal state."""
        return (action for action in self.mission.robot.actions if action.at in point.location.inside)

    def _targets(self, point: RestPoint) -> list[str]:
        """Return the places to which there may be a way: an edge leads into them, or nothing new is entered on the way."""
        reached = {place for region in self._next[point.entered] for place in self._holding[region]}
        reached.update(place for region in point.location.inside for place in self._holding[region])
        return sorted(reached, key=self._order.__getitem__)


def _fits(mission: Mission, region: str) -> bool:
    """Return whether the mission's vehicle fits through a region's opening, if it has one."""
    hoop = mission.hoops.get(region)
    return hoop is None or hoop.opening > mission.vehicle.radius + mission.margin
