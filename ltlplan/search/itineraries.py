"""Itineraries of robots along paths of their systems: visits, actions, words and costs."""

from __future__ import annotations

import itertools
from collections.abc import Mapping

from ltlplan.allocation import Itinerary
from ltlplan.systems.transition_systems import Node, TransitionSystem
from ltlplan.systems.visit_log import VisitLog
from verify.data import Mission, Word
from verify.data.language.word import stutter_free
from verify.data.shapes.inequalities import Point


def itinerary(system: TransitionSystem, path: tuple[int, ...]) -> Itinerary:
    """Read visits, actions, word and cost off a path of a robot's system."""
    log = _followed(system, path)
    return Itinerary(log.visits, word_along(system, path), None, path_cost(system, path), log.stops)


def path_cost(system: TransitionSystem, path: tuple[int, ...]) -> float:
    """Return the sum of the costs along a path; a letter that is read once more where the robot is costs nothing."""
    steps = (step for step in itertools.pairwise(path) if step[0] != step[1])
    return sum((min(cost for node, cost in system.edges[source] if node == target) for source, target in steps), 0.0)


def word_along(system: TransitionSystem, path: tuple[int, ...]) -> Word:
    """Return the labels along a path, without immediate repetitions."""
    return Word(tuple(system.labels[node] for node in path)).compressed()


def _followed(system: TransitionSystem, path: tuple[int, ...], middles: Mapping[str, Point] | None = None) -> VisitLog:
    """Return the visits along a path. Where middles of regions are given, one that two share is one stop, in the region that is new."""
    log, shared = VisitLog(), middles or {}
    previous: Node | None = None
    rests: tuple[str, Point | None] | None = None
    for index in path:
        node = system.nodes[index]
        new = log.enter(node.regions)
        at = None if node.flying else (node.place, node.position)
        # an end that is no region's middle is flown to as the last point, and is a stop only in a region that is new
        stays = shared and previous is not None and not previous.flying and _place(previous, shared) == _place(node, shared)
        if at not in (None, rests) and not stays and (node.position is None or previous is None or new):
            log.stop(_named(node, new, shared))
        rests = at
        if previous is not None and previous.internal != node.internal:
            change = (previous.internal, node.internal)
            log.act(next(a for a in system.actions if (a.source, a.target) == change and a.at in node.regions))
        previous = node
    return log


def _named(node: Node, new: tuple[str, ...], middles: Mapping[str, Point]) -> str:
    """Return the region that a rest is said to be in: its place, or one that is new there and has the same middle."""
    if node.place in new or node.position is not None:
        return node.place
    middle = _place(node, middles)
    return next((region for region in new if middle is not None and middles[region] == middle), node.place)


def _place(node: Node, middles: Mapping[str, Point]) -> Point | None:
    """Return where a node stands: its position, or its place's middle."""
    return middles.get(node.place) if node.position is None else node.position


def lasso_itinerary(mission: Mission, system: TransitionSystem, prefix: tuple[int, ...], cycle: tuple[int, ...]) -> Itinerary:
    """Read an infinite path: visits of prefix and one lap, and the word, turned so that the cycle begins with a visit.

    Args:
        mission: Gives regions, and how many laps count.
        system: What the robot can do.
        prefix: Nodes before the cycle.
        cycle: Nodes of one lap.

    Raises:
        InternalError: The cycle changes internal states for ever inside one region, which no robot flies.
    """
    labels, laps = system.labels, mission.spec.repeat
    middles = {name: region.center for name, region in mission.all_regions.items()}
    cycle = tuple(node for node, after in zip(cycle, (*cycle[1:], cycle[0]), strict=True) if node != after) or cycle[:1]
    path = (*prefix, *cycle)
    entering = [i for i in range(len(cycle)) if _enters(system, path, len(prefix) + i, cycle)]
    if not entering:  # the cycle stays where it is
        letters = stutter_free(labels[node] for node in path)
        log = _followed(system, path, middles)
        word = Word(letters[:-1], (letters[-1],))
        return Itinerary(log.visits, word, len(log.visits), path_cost(system, path), log.stops)
    laid = [_lap_from(system, prefix, cycle, turn, middles) for turn in entering]
    prefix, cycle, log = next((lap for lap in laid if _begins_anew(system, *lap, middles)), laid[0])
    begins = len(_followed(system, prefix).visits)
    stops = log.stops if _begins_anew(system, prefix, cycle, log, middles) else None
    cost = path_cost(system, (*prefix, cycle[0]))
    word = Word(stutter_free(labels[node] for node in prefix), stutter_free(labels[node] for node in cycle))
    return Itinerary(log.visits, word, begins, cost + laps * path_cost(system, (*cycle, cycle[0])), stops)


def _lap_from(
    system: TransitionSystem, prefix: tuple[int, ...], cycle: tuple[int, ...], turn: int, middles: Mapping[str, Point]
) -> tuple[tuple[int, ...], tuple[int, ...], VisitLog]:
    """Return the lasso whose cycle begins some nodes later, and what is visited by its first lap's end."""
    prefix, cycle = (*prefix, *cycle[:turn]), (*cycle[turn:], *cycle[:turn])
    if _rests_there(system, prefix, cycle[0]):  # the first lap would not come to where the others do
        turn = next(i for i in range(1, len(cycle) + 1) if _enters(system, cycle, i % len(cycle), cycle))
        prefix, cycle = (*prefix, *cycle[:turn]), (*cycle[turn:], *cycle[:turn])
    return prefix, cycle, _followed(system, (*prefix, *cycle), middles)


def _begins_anew(
    system: TransitionSystem, prefix: tuple[int, ...], cycle: tuple[int, ...], log: VisitLog, middles: Mapping[str, Point]
) -> bool:
    """Tell whether no visit under way when the lap begins has actions later, or a rest where another visit begins."""
    before = _followed(system, prefix, middles)
    begun = before.visits
    if any(now.actions != then.actions for now, then in zip(log.visits, begun, strict=False)):
        return False
    comes_to = system.nodes[cycle[0]].regions - (system.nodes[prefix[-1]].regions if prefix else frozenset[str]())
    return not comes_to or any(stop >= len(begun) for stop in log.stops[len(before.stops) :][:1])


def _rests_there(system: TransitionSystem, prefix: tuple[int, ...], first: int) -> bool:
    """Tell whether a robot rests in the regions of the cycle's first node already, at its start, or where several hold it."""
    if not prefix:
        return len(system.nodes[first].regions) > 1
    before = system.nodes[prefix[-1]]
    return not before.flying and before.regions == system.nodes[first].regions


def _enters(system: TransitionSystem, path: tuple[int, ...], index: int, cycle: tuple[int, ...]) -> bool:
    previous = path[index - 1] if index > 0 else cycle[-1]
    if index == len(path) - len(cycle):
        previous = cycle[-1]
    before, after = system.nodes[previous], system.nodes[path[index]]
    return not after.flying and (before.flying or not after.regions <= before.regions)
