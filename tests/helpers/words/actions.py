"""What words do to the states of an automaton, found by trying all of them."""

from __future__ import annotations

from ltlplan.logic.automaton import DEAD, Automaton


def actions_of_words(automaton: Automaton, most: int = 400) -> list[tuple[int, ...]] | None:
    """Return what each word does to each state, of all words however long; None where there are more than `most` actions."""
    steps = {tuple(automaton.successor(s, letter) for s in automaton.states) for letter in automaton.letters}
    found = [tuple(automaton.states)]
    known = set(found)
    for word in found:  # grows while it is walked
        for step in steps:
            longer = tuple(DEAD if at == DEAD else step[at] for at in word)
            if longer not in known:
                known.add(longer)
                found.append(longer)
        if len(found) > most:
            return None
    return found
