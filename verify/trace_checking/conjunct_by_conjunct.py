"""Common parts of claims about a team's words: the words as given, each conjunct by itself, and Spot's second opinion."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from verify.data.errors import BadInput, InternalError
from verify.data.language.counting import atoms, require_names, require_plain, written_out
from verify.data.language.formula import Formula
from verify.data.language.word import Letter, Word
from verify.data.sections import TeamReading
from verify.logic.explanation import show
from verify.logic.normal_form import Normal, conjuncts, normal_form, to_formula
from verify.logic.progression import OutOfBudget
from verify.logic.spot_opinion import some_word_breaks
from verify.logic.vacuity import vacuous_parts
from verify.logic.verdict import Verdict
from verify.model_checking.inclusion import letter_graph
from verify.model_checking.team_graph import TeamGraph
from verify.trace_checking.counterexamples import Reading, refuted
from verify.trace_checking.word_verdict import Letters, as_formula, as_word

SPOT_BUDGET = 3_000
"""States of a team, written down, up to which Spot is asked as well."""

Failure = tuple[Sequence[Reading], str]
"""A team word that breaks the formula, and how the robots come to give it."""


def as_team(formula: str | Formula, words: Mapping[str, Letters], reading: TeamReading) -> tuple[Formula, dict[str, Word]]:
    """Return a formula over a team's letters, written out, and each robot's word.

    Args:
        formula: In Spot's syntax.
        words: Each robot's word: a `Word`, or a sequence of sets of names.
        reading: "own" or "joint".

    Raises:
        FormulaError: The text is no formula.
        BadInput: No robots, an empty word, another reading, or a formula under "own" that counts robots.
    """
    if reading not in ("own", "joint"):
        raise BadInput(f'team must be "own" or "joint", not {reading!r}.')
    if not isinstance(words, Mapping) or not words:  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
        raise BadInput('words must name at least one robot, such as {"quad0": [set(), {"a"}]}.')
    given = {str(name): as_word(word, owner=f"{name}'s word") for name, word in words.items()}
    shown = frozenset[str]().union(*(word.names() for word in given.values()))
    formula = as_formula(formula, shown)
    if formula.counts:
        if reading == "own":
            require_plain(formula, 'under "own" each letter is one robot\'s by itself; give team="joint"')
        require_names(sorted(formula.names() | shown))
        formula = written_out(formula, tuple(given))
    return formula, given


def decided(
    formula: Formula,
    words: Mapping[str, tuple[Letter, ...]],
    claim: str,
    broken: Callable[[Normal], Failure | None],
    holds: str,
) -> Verdict:
    """Decide a claim, conjunct by conjunct; of several counterexamples return a shortest.

    Args:
        formula: What is claimed of the words.
        words: Each robot's letters.
        claim: Its name.
        broken: Returns a team word that breaks one conjunct, or None; raises OutOfBudget.
        holds: What is said where it holds, without the full stop.

    Raises:
        InternalError: Two independent answers disagree.
    """
    doubts: list[str] = []
    failures: list[Failure] = []
    for part in conjuncts(normal_form(formula)):
        try:
            failure = broken(part)
        except OutOfBudget as error:
            doubts.append(f"`{show(to_formula(part))}` could not be decided for the `{claim}` claim: {error}.")
            continue
        if failure is not None:
            failures.append(failure)
    if failures:
        readings, how = min(failures, key=lambda failure: len(failure[0]))
        return refuted(formula, claim, readings, how)
    if doubts:
        return Verdict("undecided", doubts[0], claim=claim)
    vacuous = () if atoms(formula) else vacuous_parts(formula, [Word(word) for word in words.values()])
    note = f" But {vacuous[0]}" if vacuous else ""
    return Verdict("holds", f"{holds}.{note}", claim=claim, vacuous=vacuous)


def require_second_opinion(graph: TeamGraph, part: Normal, *, broken: bool) -> None:
    """Ask Spot the same, where the team's words are few enough to be written down.

    Args:
        graph: The team's words, not yet walked.
        part: The conjunct.
        broken: What progression answered.

    Raises:
        InternalError: Spot says otherwise.
        MissingEngine: Spot is absent.
    """
    try:
        theirs = some_word_breaks(letter_graph(graph, part.propositions, SPOT_BUDGET), part)
    except OutOfBudget:
        return
    if theirs != broken:
        raise InternalError(
            f"Two independent answers about `{show(to_formula(part))}` disagree: progression says that it "
            f"{'fails' if broken else 'holds'}, Spot that it {'fails' if theirs else 'holds'}. This is a bug of ltlplan's."
        )
