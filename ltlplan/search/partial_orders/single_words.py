"""A single team word of `own` that satisfies a formula, where no precedences make all of them do so.

Each letter is read when it helps, so that this is what an interleaving can do at best. That is a sentence for a person, and no plan: a
robot cannot choose when a letter that it holds is looked at.
"""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from ltlplan.logic.automaton import DEAD
from ltlplan.logic.budget import TooLarge
from ltlplan.search.partial_orders.event_sequences import Course, Nodes, is_event
from ltlplan.search.partial_orders.reachable_state_sets import Reading, Shown
from ltlplan.systems.transition_systems import TransitionSystem

_Node = tuple[Nodes, tuple[int, ...], int]
"""Where robots are, the conjuncts' states, and the robots not yet read, as bits."""


@dataclass(frozen=True, slots=True)
class SingleWord:
    """One team word.

    Attributes:
        course: The steps of the robots, in order.
        readings: (robot, node) of each letter that is read.
    """

    course: Course
    readings: tuple[tuple[int, int], ...]


def single_word(
    systems: Sequence[TransitionSystem], shown: Sequence[Sequence[Shown]], reading: Reading, most: int
) -> SingleWord | None:
    """Return a shortest team word of `own` that satisfies the formula, or None where there is none.

    Args:
        systems: One for each robot.
        shown: For each of them what it shows at each node.
        reading: How the formula reads them.
        most: States that may be expanded.

    Raises:
        TooLarge: More would have to be.
    """
    parts = reading.marks.parts
    letters = [[reading.marks.letter(own[0]) for own in each] for each in shown]
    begin: _Node = (tuple(s.initial for s in systems), tuple(part.initial for part in parts), (1 << len(systems)) - 1)
    came: dict[_Node, _Node | None] = {begin: None}
    queue = deque([begin])
    expanded = 0
    while queue:
        node = queue.popleft()
        nodes, states, unread = node
        expanded += 1
        ends = all(s.final is None or n in s.final for s, n in zip(systems, nodes, strict=True))
        if not unread and ends and all(part.accepting(state) for part, state in zip(parts, states, strict=True)):
            return _word(came, node)
        if expanded > most:
            raise TooLarge("Looking for a single interleaving takes", expanded, "states", most)
        following: list[_Node] = []
        for robot, system in enumerate(systems):
            bit = 1 << robot
            after = tuple(part.step(state, letters[robot][nodes[robot]]) for part, state in zip(parts, states, strict=True))
            if DEAD not in after:
                following.append((nodes, after, unread & ~bit))
            for target, _ in system.edges[nodes[robot]]:
                event = is_event(system, nodes[robot], target)
                if not (event and unread & bit):
                    moved = (*nodes[:robot], target, *nodes[robot + 1 :])
                    following.append((moved, states, unread | bit if event else unread))
        for other in following:
            if other not in came:
                came[other] = node
                queue.append(other)
    return None


def _word(came: dict[_Node, _Node | None], node: _Node) -> SingleWord:
    path: list[_Node] = [node]
    while (before := came[path[-1]]) is not None:
        path.append(before)
    path.reverse()
    steps: list[tuple[int, int]] = []
    readings: list[tuple[int, int]] = []
    for (nodes, _, unread), (moved, _, left) in itertools.pairwise(path):
        robot = next((r for r, (a, b) in enumerate(zip(nodes, moved, strict=True)) if a != b), None)
        if robot is not None:
            steps.append((robot, moved[robot]))
        elif unread != left:
            who = (unread & ~left).bit_length() - 1
            readings.append((who, nodes[who]))
    return SingleWord(Course(tuple(steps), 0.0, len(came)), tuple(readings))
