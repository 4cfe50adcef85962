"""Where robots rest in a mission's regions, and the straight ways from one such point to the next: E of Def. 4.2, laid out in space.

Everything that says what a robot can do stands on this one: the systems A that the exact search and the products walk
(`robot_systems`), and the visits by which MTAC-E and teams in flight move on (`ltlplan.mtac.agent_moves`). It says which region may
be entered from where, which regions a robot is in on the way, and which actions a point permits; costs and internal states are
theirs to add.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

from ltlplan.systems.region_labels import Layout, Location
from ltlplan.systems.transition_systems import environment_of
from verify.data import Letter, Mission
from verify.data.sections import Action
from verify.data.shapes.inequalities import Point


@dataclass(frozen=True, slots=True)
class RestPoint:
    """Where a robot can be at rest: the middle of a region, or a point of its own, such as its start.

    Attributes:
        place: The region, or the environment's start vertex.
        entered: The region entered last.
        location: The point and the regions around it.
        position: The point, where it is not the middle of the region.
    """

    place: str
    entered: str
    location: Location
    position: Point | None = None


@dataclass(frozen=True, slots=True)
class Transition:
    """A way to the next point.

    Attributes:
        end: Where it leads.
        letters: The regions in between, or None for the free flight after the last point.
    """

    end: RestPoint
    letters: tuple[Letter, ...] | None


class RegionGraph:
    """The points at which robots rest in a mission, and the ways between them.

    Attributes:
        mission: Whose regions.
        environment: Which regions can be entered after which.
        layout: How the regions lie.
        places: The middles of the regions that can be visited.
    """

    def __init__(self, mission: Mission, *, places: Collection[str] | None = None, layout: Layout | None = None) -> None:
        """Lay out a mission's regions.

        Args:
            mission: Whose regions and environment.
            places: Regions that robots may visit; all of them where None.
            layout: How the mission's regions lie, where that is known already.
        """
        self.mission = mission
        self.environment = environment_of(mission)
        self.layout = layout or Layout(mission)
        self.places = {
            name: location
            for name, location in self.layout.middles.items()
            if location.clear and (places is None or name in places)
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

    def middle(self, region: str) -> RestPoint:
        """Return the rest point of a robot that has entered a region and is in its middle."""
        return RestPoint(region, region, self.places[region])

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

    def transitions(self, point: RestPoint) -> Iterator[Transition]:
        """Yield every way on from a point."""
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
