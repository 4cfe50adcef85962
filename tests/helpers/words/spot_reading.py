"""Spot's own answer about one word: an evaluator that shares nothing with ours."""

from __future__ import annotations

import spot

from verify.data import Formula, Letter, Word


def spot_accepts(formula: Formula, word: Word) -> bool:
    """Tell whether Spot thinks that a word satisfies a formula (LTLf for a finite word)."""
    names = sorted(formula.names())
    renamed = formula.substitute({name: Formula("name", (), f"p{i}") for i, name in enumerate(names)})
    asked = spot.formula(renamed.quoted())

    def letter(held: Letter, *, alive: str) -> str:
        return " & ".join([alive, *(f"{'' if name in held else '!'}p{i}" for i, name in enumerate(names))])

    if word.cycle is None:
        asked = spot.from_ltlf(asked, "alive")
        text = "; ".join([*(letter(held, alive="alive") for held in word.prefix), "cycle{!alive}"])
    else:
        prefix = [letter(held, alive="1") for held in word.prefix]
        cycle = "; ".join(letter(held, alive="1") for held in word.cycle)
        text = "; ".join([*prefix, f"cycle{{{cycle}}}"])
    automaton = spot.translate(asked)
    return spot.parse_word(text, automaton.get_dict()).as_automaton().intersects(automaton)
