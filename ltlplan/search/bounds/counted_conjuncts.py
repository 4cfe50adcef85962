"""Lower bounds from each conjunct that counts robots by itself: on the sums of the marks that it sees, and nothing else.

Any move that exists anywhere may be made there at its least cost, shared out among the conjuncts whose marks it changes, so that the
conjuncts' amounts may be added up.
"""

from __future__ import annotations

from ltlplan.logic.automaton import DEAD
from ltlplan.search.bounds.conjunct_graph import ConjunctGraph
from ltlplan.search.counting.classes import Classes
from ltlplan.search.counting.counting_propositions import States, Sums
from ltlplan.search.team_reading import UNREACHABLE

_Node = tuple[int, Sums]
"""A state of a conjunct, and the sums of the marks that it sees."""

MOST_ABSTRACT = 5_000
"""States of one conjunct, with the sums that it sees, up to which what is left of it is estimated."""


class ConjunctBound:
    """Lower bounds on what is left, from each conjunct by itself.

    Args:
        classes: The team's.
    """

    def __init__(self, classes: Classes) -> None:
        self._marks, self._robots = classes.marks, sum(classes.begin)
        moves = [move for found in classes.moves for move in found]
        seen = [conjunct.seen for conjunct in classes.marks.conjuncts]
        kinds: list[dict[tuple[Sums, ...], float]] = [{} for _ in seen]
        for move in moves:
            shown = (classes.resting[move.source], *move.marks)
            cut = [tuple(tuple(marks[i] for i in own) for marks in shown) for own in seen]
            changed = [index for index, way in enumerate(cut) if len(set(way)) > 1]
            for index in changed:
                price = move.cost / len(changed)
                kinds[index][cut[index]] = min(price, kinds[index].get(cut[index], UNREACHABLE))
        begin = classes.sums(classes.begin)
        self._rest = [self._distances(index, kinds[index], tuple(begin[i] for i in seen[index])) for index in range(len(seen))]

    def __call__(self, states: States, sums: Sums) -> float:
        """Return a lower bound; `UNREACHABLE` where a conjunct is out of reach.

        Args:
            states: The conjuncts' states.
            sums: How many robots make each mark.
        """
        total = 0.0
        for own, state, rest in zip(self._marks.conjuncts, states, self._rest, strict=True):
            if rest is not None:
                total += rest.get((state, own.cut(sums)), UNREACHABLE)
        return total

    def _distances(self, index: int, kinds: dict[tuple[Sums, ...], float], begin: Sums) -> dict[tuple[int, Sums], float] | None:
        """Return the least sum of prices from each state with its sums to acceptance; None where there are too many."""
        own = self._marks.conjuncts[index]
        nothing = (0,) * len(own.seen)  # moves of which the conjunct sees nothing: it reads the letter again
        ways = list((kinds | {(nothing, nothing): 0.0}).items())
        nodes, back = [(own.read(own.part.initial, begin), begin)], dict[_Node, list[tuple[_Node, int]]]()
        for state, sums in nodes:  # grows while it is walked
            for number, (way, _) in enumerate(ways):
                others = tuple(s - m for s, m in zip(sums, way[0], strict=True))
                if any(total < 0 for total in others):
                    continue
                after, at = state, sums
                for marks in way[1:]:
                    at = tuple(o + m for o, m in zip(others, marks, strict=True))
                    after = own.read(after, at)
                if after == DEAD or max(at, default=0) > self._robots:
                    continue
                if (after, at) not in back and (after, at) != nodes[0]:
                    nodes.append((after, at))
                back.setdefault((after, at), []).append(((state, sums), number))
            if len(nodes) > MOST_ABSTRACT:
                return None
        goals = frozenset(node for node in nodes if own.part.accepting(node[0]))
        graph = ConjunctGraph(nodes, back, goals, own.part.mask, range(len(ways)))
        return graph.costs({number: price for number, (_, price) in enumerate(ways)}, goals)
