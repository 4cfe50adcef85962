"""Transitions: every word of a robot is a trace of its transition system, whatever its labels leave open.

Regions that are entered one after another are joined by an edge, with free flight between. A robot comes from the region that it entered last, and
from those to which it has *gone back*: it left that region while it still was in one that an edge joins to it. All ways through the robot's
places (`places`) are walked, with the regions from which it may be taken to come. Internal states change by planned actions alone;
`timelines` checks those.
"""

from __future__ import annotations

from .labels import Relations, Timeline
from .places import Places, places_of
from .refused import Refused
from .statement import Statement

MOST_STATES = 100_000


def check_transitions(statement: Statement, robot: str, timeline: Timeline, relations: Relations) -> None:
    """Check that all words of a robot are traces of its transition system.

    Args:
        statement: Has the robot's edges, and what is closed to it.
        robot: Its name.
        timeline: What it may show.
        relations: Letters that they exclude are left out.

    Raises:
        Refused: One is not, or that would take too long to tell.
    """
    system = statement.robots[robot]
    places = places_of(timeline, None, frozenset(statement.regions), relations)
    seen = {(place, frozenset({vertex})) for place in places.initial for vertex in places.inside[place] or {system.vertex}}
    if any(places.inside[place] & system.closed for place in places.initial):
        raise Refused(f"{robot} may begin in a region that is closed to it")
    waiting = list(seen)
    while waiting:
        place, vertices = waiting.pop()
        before = places.inside[place]
        for target in _following(places, place):
            came = places.inside[target] - before
            if len(came) > 1:
                _require_one_by_one(places, place, target)
                continue
            after = vertices
            for region in came:
                joined = system.edges is None or any(region == v or region in system.edges.get(v, ()) for v in vertices)
                if region in system.closed or not joined:
                    raise Refused(f"{robot} may enter {region} from {min(vertices)}, where no edge that is open to it leads")
                after = came
            if system.edges is not None:
                left = vertices & before - places.inside[target]
                after = after.union(*(places.inside[target] & system.edges.get(v, frozenset()) for v in left))
            if (target, after) not in seen:
                if len(seen) >= MOST_STATES:
                    raise Refused(f"not covered by the kernel: {robot} may go too many ways")
                seen.add((target, after))
                waiting.append((target, after))


def _following(places: Places, place: int) -> list[int]:
    """Return the next places; after the copy of a lap the copy again."""
    found = list(places.following[place])
    if places.slots[place].lap == 2:
        found += [target for target in places.following[place - places.shift] if places.slots[target].lap == 2]
    return found


def _require_one_by_one(places: Places, place: int, target: int) -> None:
    """Refuse regions that are entered at one instant unless that is walked one after the other as well."""
    between = (t for t in _following(places, place) if target in _following(places, t))
    if not any(len(places.inside[t] - places.inside[place]) == 1 and places.inside[place] < places.inside[t] for t in between):
        raise Refused(f"{places.robot} may enter several regions at once")
