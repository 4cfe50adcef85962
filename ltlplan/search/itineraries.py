"""What robots do along paths of their systems: visits, actions, words and costs."""

from __future__ import annotations

import itertools

from ltlplan.allocation import Itinerary
from ltlplan.systems.transition_systems import Node, TransitionSystem
from ltlplan.systems.visit_log import VisitLog
from verify.data import InternalError, Visit, Word
from verify.data.language.word import stutter_free
from verify.data.shapes.inequalities import Point


def itinerary(system: TransitionSystem, path: tuple[int, ...]) -> Itinerary:
    """Read visits, actions, word and cost off a path of a robot's system."""
    log = _followed(system, path)
    return Itinerary(log.visits, word_along(system, path), None, path_cost(system, path), log.stops)


def path_cost(system: TransitionSystem, path: tuple[int, ...]) -> float:
    """Return the sum of the costs along a path; a letter that is read once more where the robot is costs nothing."""
    total = 0.0
    for source, target in itertools.pairwise(path):
        if source != target:
            total += min(cost for node, cost in system.edges[source] if node == target)
    return total


def word_along(system: TransitionSystem, path: tuple[int, ...]) -> Word:
    """Return the labels along a path, without immediate repetitions."""
    return Word(tuple(system.labels[node] for node in path)).compressed()


def visits_of(system: TransitionSystem, path: tuple[int, ...]) -> list[Visit]:
    """Return the visits that a path makes, in the order in which they begin, with their actions."""
    return list(_followed(system, path).visits)


def _followed(system: TransitionSystem, path: tuple[int, ...]) -> VisitLog:
    log = VisitLog()
    previous: Node | None = None
    rests: tuple[str, Point | None] | None = None
    for index in path:
        node = system.nodes[index]
        new = log.enter(node.regions)
        at = None if node.flying else (node.place, node.position)
        # an end that is no region's middle is flown to as the last point, and is a stop only in a region that is new
        if at not in (None, rests) and (node.position is None or previous is None or new):
            log.stop(node.place)
        rests = at
        if previous is not None and previous.internal != node.internal:
            change = (previous.internal, node.internal)
            log.act(next(a for a in system.actions if (a.source, a.target) == change and a.at in node.regions))
        previous = node
    return log


def lasso_itinerary(system: TransitionSystem, prefix: tuple[int, ...], cycle: tuple[int, ...], laps: int) -> Itinerary:
    """Read an infinite path: visits of prefix and one lap, and the word, turned so that the cycle begins with a visit.

    Args:
        system: What the robot can do.
        prefix: Nodes before the cycle.
        cycle: Nodes of one lap.
        laps: How many laps count.

    Raises:
        InternalError: The cycle changes internal states for ever inside one region, which no robot flies.
    """
    cycle = tuple(node for node, after in zip(cycle, (*cycle[1:], cycle[0]), strict=True) if node != after) or cycle[:1]
    path, labels = (*prefix, *cycle), system.labels
    entering = [i for i in range(len(cycle)) if _enters(system, path, len(prefix) + i, cycle)]
    if not entering:  # the cycle stays where it is
        letters = stutter_free(labels[node] for node in path)
        visits = tuple(visits_of(system, path))
        hover = tuple(dict.fromkeys(system.labels[node] for node in cycle))
        if len(hover) > 1:  # internal changes for ever, inside one region
            raise InternalError("A cycle of actions inside one region is not flown.")
        return Itinerary(visits, Word(letters[:-1], (letters[-1],)), len(visits), path_cost(system, path))
    turn = entering[0]
    prefix, cycle = (*prefix, *cycle[:turn]), (*cycle[turn:], *cycle[:turn])
    before = visits_of(system, prefix)
    lap = visits_of(system, (*prefix, *cycle))[len(before) :]
    cost = path_cost(system, (*prefix, cycle[0]))
    path_cost_of_lap = path_cost(system, (*cycle, cycle[0]))
    word = Word(stutter_free(labels[node] for node in prefix), stutter_free(labels[node] for node in cycle))
    return Itinerary((*before, *lap), word, len(before), cost + laps * path_cost_of_lap)


def _enters(system: TransitionSystem, path: tuple[int, ...], index: int, cycle: tuple[int, ...]) -> bool:
    previous = path[index - 1] if index > 0 else cycle[-1]
    if index == len(path) - len(cycle):
        previous = cycle[-1]
    return system.nodes[previous].flying and not system.nodes[path[index]].flying
