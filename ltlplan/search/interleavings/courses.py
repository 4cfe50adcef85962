"""The cheapest course of events all of whose team words satisfy the formula.

A state is (node of every robot's system, what is possible): one event of one robot leads to the next. Words that satisfy under a strict
partial order of their events do so under each total order that it leaves open, so where no course is found there are no words and no
precedences. For n robots this is the product of all their systems, which the search for plans that hold in every order does without;
so it is asked only where there is none, and within a budget of its own.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ltlplan.logic.budget import TooLarge
from ltlplan.search.best_first import BestFirst
from ltlplan.search.interleavings.readings import Known, Reading, Shown
from ltlplan.systems.transition_systems import TransitionSystem

Nodes = tuple[int, ...]

_END = -1


@dataclass(frozen=True, slots=True)
class Course:
    """Steps of robots, one after another.

    Attributes:
        steps: (robot, node that it comes to).
        cost: The sum of all steps.
        reached: States that were seen.
    """

    steps: tuple[tuple[int, int], ...]
    cost: float
    reached: int


def cheapest_course(
    systems: Sequence[TransitionSystem], shown: Sequence[Sequence[Shown]], reading: Reading, most: int
) -> Course | None:
    """Return a cheapest course all of whose team words satisfy the formula, or None where there is none.

    Args:
        systems: One for each robot.
        shown: For each of them what it shows at each node.
        reading: How the formula reads their events.
        most: States that may be expanded.

    Raises:
        TooLarge: More states would have to be expanded; nothing is known.
    """
    begin = tuple(system.initial for system in systems)

    def letters(nodes: Nodes) -> tuple[Shown, ...]:
        return tuple(own[node] for own, node in zip(shown, nodes, strict=True))

    first = reading.begin(letters(begin))
    if first is None:
        return None
    places: list[tuple[Nodes, Known]] = [(begin, first)]
    index = {places[0]: 0}

    def stepped(nodes: Nodes, known: Known) -> Iterator[tuple[Nodes, Known, float]]:
        for robot, system in enumerate(systems):
            here = nodes[robot]
            for target, cost in system.edges[here]:
                moved = (*nodes[:robot], target, *nodes[robot + 1 :])
                if not is_event(system, here, target):
                    if target != here:
                        yield moved, known, cost
                    continue
                after = reading.after(known, letters(moved), robot)
                if after is not None:
                    yield moved, after, cost

    def successors(key: int) -> Iterator[tuple[int, float]]:
        if key == _END:
            return
        nodes, known = places[key]
        if reading.accepting(known):
            ends = [0.0 if s.final is None else s.final.get(n) for s, n in zip(systems, nodes, strict=True)]
            if None not in ends:
                yield _END, sum(end for end in ends if end is not None)
        for moved, after, cost in stepped(nodes, known):
            place = moved, after
            target = index.get(place)
            if target is None:
                target = index[place] = len(places)
                places.append(place)
            yield target, cost

    search = BestFirst([0], successors, ties="first")
    for expanded, (key, cost, _) in enumerate(search, start=1):
        if key == _END:
            path = [places[at][0] for at in search.path(key)[:-1]]
            return Course(tuple(_steps(path)), cost, len(places))
        if expanded > most:
            raise TooLarge(
                "Whether precedences between robots help takes",
                expanded,
                "states",
                most,
                "Simplify the formula, or use fewer robots.",
            )
    return None


def is_event(system: TransitionSystem, here: int, target: int) -> bool:
    """Tell whether a robot that goes from one node to another comes to another letter.

    Args:
        system: The robot's.
        here: The node that it leaves.
        target: The one that it comes to.
    """
    return system.labels[target] != system.labels[here]


def _steps(path: Sequence[Nodes]) -> Iterator[tuple[int, int]]:
    for before, after in itertools.pairwise(path):
        yield next((robot, b) for robot, (a, b) in enumerate(zip(before, after, strict=True)) if a != b)
