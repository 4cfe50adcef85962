"""The search over the paths of one robot: its nodes that matter, and the states of what reads their letters."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator
from typing import TypeVar

from ltlplan.search.label_setting import BestFirst
from ltlplan.search.reduced_graph import ReducedGraph

_DONE = -1  # in place of a node, where a robot's path is complete
State = TypeVar("State", bound=Hashable)


def path_search(
    graph: ReducedGraph,
    robot: int,
    begin: tuple[int, State],
    read: Callable[[State, int], State | None],
    may_end: Callable[[State], bool] | None = None,
    left: Callable[[tuple[int, State]], float] | None = None,
) -> BestFirst[tuple[int, State]]:
    """Return a search over the paths of one robot: over its nodes that matter, and the states of what reads their letters.

    Args:
        graph: The team's.
        robot: By index.
        begin: Its node, and the state there.
        read: The state after a letter; None where nothing is to be gone on with.
        may_end: Whether a path may end in a state; the search then ends at `is_done`. None: it walks all paths, of equal costs those
            that were reached first.
        left: Lower bound on what is left (A*).
    """
    label = graph.label[robot]

    def successors(key: tuple[int, State]) -> Iterator[tuple[tuple[int, State], float]]:
        node, state = key
        if node == _DONE:
            return
        here = graph.successors(robot, node)
        if may_end is not None and here.ending is not None and may_end(state):
            yield (_DONE, begin[1]), here.ending
        for target, step in here.edges:
            after = read(state, label[target])
            if after is not None:
                yield (target, after), step

    if left is None:
        return BestFirst([begin], successors, ties="first")
    return BestFirst([begin], successors, lambda key: 0.0 if key[0] == _DONE else left(key))


def is_done(key: tuple[int, object]) -> bool:
    """Tell whether a path is complete, the node before being the last one.

    Args:
        key: That a `path_search` yields.
    """
    return key[0] == _DONE
