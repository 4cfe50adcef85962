"""Visits that a robot's events belong to, so that a plan can name the events."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ltlplan.systems.transition_systems import TransitionSystem
from ltlplan.systems.visit_log import VisitLog
from verify.data.plan import Done, Due, Precedence

Event = tuple[int, int]
"""A robot, by number, and the index of the letter of its word that it comes to."""

Pair = tuple[Event, Event]
"""The first event is over before the second happens."""

_DONE: Mapping[Done, int] = {"left": 0, "entered": 1, "acted": 2}
_DUE: Mapping[Due, int] = {"enters": 0, "leaves": 1, "acts": 2}


@dataclass(frozen=True, slots=True)
class EventName:
    """Actions of a robot as it comes to a letter.

    Attributes:
        done: (what it has done then, index of visit).
        due: (what it does then, index of visit).
    """

    done: tuple[tuple[Done, int], ...]
    due: tuple[tuple[Due, int], ...]


def event_names(system: TransitionSystem, path: Sequence[int]) -> list[EventName]:
    """Return the names of a path's events: those of letter 1, 2 and so on of its word.

    Args:
        system: The robot's.
        path: Its nodes.
    """
    log, label, regions, internal = VisitLog(), system.labels[path[0]], frozenset[str](), ""
    found: list[tuple[list[tuple[Done, int]], list[tuple[Due, int]]]] = []
    acted: dict[int, list[int]] = {}
    for step, index in enumerate(path):
        node = system.nodes[index]
        left = [log.current(region) for region in sorted(regions - node.regions)]
        new = log.enter(node.regions)
        if step and system.labels[index] != label:
            entered = [log.current(region) for region in new]
            done: list[tuple[Done, int]] = [*(("left", visit) for visit in left), *(("entered", visit) for visit in entered)]
            due: list[tuple[Due, int]] = [*(("enters", visit) for visit in entered), *(("leaves", visit) for visit in left)]
            if node.internal != internal:
                change = internal, node.internal
                at = next(a.at for a in system.actions if (a.source, a.target) == change and a.at in node.regions)
                acted.setdefault(log.current(at), []).append(len(found))
            found.append((done, due))
        label, regions, internal = system.labels[index], node.regions, node.internal
    lasting = {log.current(region) for region in regions}
    for visit, events in acted.items():
        found[events[0]][1].append(("acts", visit))
        if visit not in lasting:  # else its actions come later the longer the others fly
            found[events[-1]][0].append(("acted", visit))
    place = log.numbers
    return [
        EventName(tuple((what, place[visit]) for what, visit in done), tuple((what, place[visit]) for what, visit in due))
        for done, due in found
    ]


class Names:
    """Precedences between events of a team, as plans say them.

    Args:
        systems: One for each robot.
        paths: Their nodes.
    """

    def __init__(self, systems: Sequence[TransitionSystem], paths: Sequence[Sequence[int]]) -> None:
        self._robots = [system.robot for system in systems]
        self._names = [event_names(system, path) for system, path in zip(systems, paths, strict=True)]

    def precedence(self, pair: Pair) -> Precedence | None:
        """Return a precedence as a plan says it, in the plainest way; None where there is no name for it."""
        (robot, event), (other, waiting) = pair
        if not 0 < event <= len(self._names[robot]) or not 0 < waiting <= len(self._names[other]):
            return None  # what comes to a place to end at, outside all regions, shows no letter
        done, due = self._names[robot][event - 1].done, self._names[other][waiting - 1].due
        if not done or not due:
            return None
        (what, visit), (waits, later) = min(done, key=lambda d: _DONE[d[0]]), min(due, key=lambda d: _DUE[d[0]])
        return Precedence(first=(self._robots[robot], visit), then=(self._robots[other], later), done=what, due=waits)


def unlikeness(precedence: Precedence) -> tuple[int, int]:
    """Return how unlike a precedence is to the plainest one, that one robot enters when another has left."""
    return _DONE[precedence.done] + _DUE[precedence.due], _DUE[precedence.due]
