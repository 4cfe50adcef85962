"""Automata that forget all but the last letter: laps of a word are laps of theirs."""

from __future__ import annotations

from ltlplan.logic.automaton import Automaton


def closes_at_once(automaton: Automaton) -> bool:
    """Tell whether an automaton forgets all but the last letter, as that of `G F a` does: each letter leads to one state, from wherever.

    Then it is back in its state after every lap of a word, and the product's lassos are all there are.
    """
    first = {target: guard for guard, target in automaton.edges[0]}
    return automaton.deterministic and all({target: guard for guard, target in edges} == first for edges in automaton.edges)
