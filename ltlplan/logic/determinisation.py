"""Deterministic automata on finite words: subsets of states, and the smallest automaton of a language.

The subset construction is Rabin and Scott's (1959), the refinement of states Moore's (1956).
"""

from __future__ import annotations

from ltlplan.logic.automaton import Automaton, trimmed
from ltlplan.logic.budget import DEFAULT_BUDGET, Budget, TooLarge
from ltlplan.logic.decision_diagrams import FALSE, DecisionDiagrams
from verify.data import BadInput


def determinised(automaton: Automaton, *, budget: Budget = DEFAULT_BUDGET) -> Automaton:
    """Return the smallest deterministic automaton of a finite automaton's language.

    Raises:
        BadInput: It is a Büchi automaton; these are made deterministic by Spot, where it can, in `translate`.
        TooLarge: It has more states than the budget allows.
    """
    if automaton.trace == "infinite":
        raise BadInput("A Büchi automaton is not made deterministic by this; many have no deterministic equal.")
    return minimise(determinise(automaton, budget=budget))


def determinise(automaton: Automaton, *, budget: Budget = DEFAULT_BUDGET) -> Automaton:
    """Return a deterministic automaton with the same language, whose states are sets of the given one's states.

    Raises:
        TooLarge: There are more sets than the budget allows.
    """
    if automaton.deterministic:
        return automaton
    diagrams = automaton.diagrams
    sets: dict[frozenset[int], int] = {frozenset({automaton.initial}): 0}
    waiting = list(sets)
    edges: list[list[tuple[int, int]]] = []
    for states in waiting:  # grows while it is walked
        outgoing: list[tuple[int, int]] = []
        for targets, guard in diagrams.split(edge for state in sorted(states) for edge in automaton.edges[state]).items():
            if targets:
                if targets not in sets:
                    if len(sets) >= budget.automaton:
                        raise TooLarge("The deterministic automaton has", len(sets) + 1, "states", budget.automaton)
                    sets[targets] = len(sets)
                    waiting.append(targets)
                outgoing.append((guard, sets[targets]))
        edges.append(outgoing)
    accepting = [index for states, index in sets.items() if not automaton.accepting.isdisjoint(states)]
    return trimmed(automaton.trace, diagrams, edges, 0, accepting)


def minimise(automaton: Automaton) -> Automaton:
    """Return the smallest deterministic automaton with the language of a deterministic one (Moore's refinement)."""
    diagrams = automaton.diagrams
    block = [int(state in automaton.accepting) for state in automaton.states]
    count = len(set(block))
    while True:
        signatures: dict[tuple[int, frozenset[tuple[int, int]]], int] = {}
        finer: list[int] = []
        for state in automaton.states:
            ways: dict[int, int] = {}
            for guard, target in automaton.edges[state]:
                ways[block[target]] = diagrams.disjunction(ways.get(block[target], FALSE), guard)
            finer.append(signatures.setdefault((block[state], frozenset(ways.items())), len(signatures)))
        block = finer
        if len(signatures) == count:
            break
        count = len(signatures)
    edges: list[list[tuple[int, int]]] = [[] for _ in range(count)]
    done: set[int] = set()
    for state in automaton.states:
        if block[state] not in done:
            done.add(block[state])
            edges[block[state]] = [(guard, block[target]) for guard, target in automaton.edges[state]]
    accepting = {block[state] for state in automaton.accepting}
    return trimmed(automaton.trace, diagrams, edges, block[automaton.initial], accepting)


def intersection(first: Automaton, second: Automaton, *, budget: Budget = DEFAULT_BUDGET) -> Automaton:
    """Return the deterministic automaton of the words that both deterministic automata on finite words accept.

    Args:
        first: A deterministic automaton on finite words.
        second: Another one.
        budget: Bound on the states.

    Raises:
        TooLarge: It has more states than the budget allows.
    """
    diagrams = DecisionDiagrams(sorted({*first.propositions, *second.propositions}))
    memos: tuple[dict[int, int], dict[int, int]] = ({}, {})
    pairs: dict[tuple[int, int], int] = {(first.initial, second.initial): 0}
    waiting = list(pairs)
    edges: list[list[tuple[int, int]]] = []
    for one, two in waiting:  # grows while it is walked
        outgoing: list[tuple[int, int]] = []
        for guard, target in first.edges[one]:
            left = diagrams.copy_from(first.diagrams, guard, memos[0])
            for other, other_target in second.edges[two]:
                both = diagrams.conjunction(left, diagrams.copy_from(second.diagrams, other, memos[1]))
                if both != FALSE:
                    pair = (target, other_target)
                    if pair not in pairs:
                        if len(pairs) >= budget.automaton:
                            raise TooLarge("The product automaton has", len(pairs) + 1, "states", budget.automaton)
                        pairs[pair] = len(pairs)
                        waiting.append(pair)
                    outgoing.append((both, pairs[pair]))
        edges.append(outgoing)
    accepting = [i for (one, two), i in pairs.items() if one in first.accepting and two in second.accepting]
    return trimmed("finite", diagrams, edges, 0, accepting)
