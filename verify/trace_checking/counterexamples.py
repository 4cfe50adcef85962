"""Team words that break a formula, as verdicts with a sentence."""

from __future__ import annotations

from collections.abc import Sequence

from verify.data.errors import InternalError
from verify.data.language.formula import Formula
from verify.data.language.word import Letter, Word, show_letter
from verify.logic.explanation import explain
from verify.logic.semantics import satisfies
from verify.logic.verdict import TEAM, Verdict

Reading = tuple[str, int | None, Letter]
"""One reading: robot (or the team), index of its letter, letter."""


def refuted(formula: Formula, claim: str, readings: Sequence[Reading], how: str) -> Verdict:
    """Return the verdict on a claim that a team word breaks.

    Args:
        formula: What the word was to satisfy.
        claim: What was asked.
        readings: The word, position by position.
        how: How the robots come to give it; begins the sentence.

    Raises:
        InternalError: The word satisfies the formula: a bug of ours.
    """
    word = Word(tuple(letter for _, _, letter in readings))
    if satisfies(formula, word):
        raise InternalError("A counterexample satisfies the formula after all. This is a bug of ltlplan's.")

    def where(position: int) -> str:
        robot, index, letter = readings[position]
        if index is None:
            return f"the team's letter {position + 1}, {show_letter(letter)}"
        return f"{robot}'s letter {index + 1}, {show_letter(letter)}"

    reason = explain(formula, word, where)
    at = None if reason.position is None else readings[reason.position]
    return Verdict(
        "fails",
        how + reason.sentence,
        tuple((robot, letter) for robot, _, letter in readings),
        claim=claim,
        robot=None if at is None or at[0] == TEAM else at[0],
        visit=None if at is None else at[1],
    )
