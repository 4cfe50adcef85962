"""Strategies for formulas, letters and words, of one robot and of teams.

Everything shrinks to what is short: formulas to one name, words to one empty letter, counts to `count(a) >= 1`.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from functools import cache, partial

from verify.data.errors import BadInput
from verify.data.language.formula import FALSE, TRUE, Comparison, Formula, Operator
from verify.data.language.word import Letter, Word
from verify.data.sections import SoftPart
from verify.testing.engine import SearchStrategy
from verify.testing.engine import strategies as st

NAMES = ("a", "b", "c")
ROBOTS = ("quad0", "quad1")
_NEXT: tuple[Operator, ...] = ("X", "X[!]")
_BOOLEAN: tuple[Operator, ...] = ("&", "|", "->", "xor", "<->")
_TEMPORAL: tuple[Operator, ...] = ("U", "W", "R", "M")
_COMPARISONS: tuple[Comparison, ...] = (">=", "<=", "==", "<", ">")
_COUNTED = 3
"""Names that stand in one count, at most."""


def formulas(
    names: Sequence[str] = NAMES, *, robots: Sequence[str] = (), with_next: bool = False, size: int = 12
) -> SearchStrategy[Formula]:
    """Formulas of every operator; `str` of one is text for a mission file.

    Args:
        names: The propositions that may occur, such as regions and `free`.
        robots: Names of a team under `team: joint`: then `NAME.p`, `count(B) >= k`, `all(B)`, `some(B)` and `each(f)` occur too,
            with k from 0 to one more than there are robots.
        with_next: Whether X and X[!] occur, which missions do not take.
        size: How many names, constants and counts one formula has at most.

    Raises:
        BadInput: There are no names, or `size` is below 1.
    """
    if size < 1:
        raise BadInput(f"size must be 1 or more, not {size}.")
    return _formulas(tuple(_some(names)), tuple(robots), with_next, size)


def letters(names: Sequence[str] = NAMES) -> SearchStrategy[Letter]:
    """Letters, the empty one included: sets of names that hold together.

    Args:
        names: The propositions.
    """
    held = st.tuples(*[st.booleans()] * len(_some(names)))  # a set that is drawn as such does not shrink to its smallest
    return held.map(lambda which: frozenset(itertools.compress(names, which)))


def words(names: Sequence[str] = NAMES, *, most: int = 5) -> SearchStrategy[Word]:
    """Finite words of one robot; letters may repeat.

    Args:
        names: The propositions.
        most: How many letters a word has at most.
    """
    return st.builds(Word.of, st.lists(letters(names), min_size=1, max_size=most))


def lassos(names: Sequence[str] = NAMES, *, most: int = 3) -> SearchStrategy[Word]:
    """Infinite words of one robot: a prefix, which may be empty, and a cycle that repeats for ever.

    Args:
        names: The propositions.
        most: How many letters prefix and cycle have at most, each.
    """
    return st.builds(Word.of, st.lists(letters(names), max_size=most), st.lists(letters(names), min_size=1, max_size=most))


def team_words(
    robots: Sequence[str] = ROBOTS, names: Sequence[str] = NAMES, *, most: int = 3
) -> SearchStrategy[dict[str, Word]]:
    """Finite words of a team, one for each robot, as `verify.check_team` takes them. Robots that idle have one letter.

    Args:
        robots: Their names.
        names: The propositions.
        most: How many letters one robot's word has at most.
    """
    return st.fixed_dictionaries({robot: words(names, most=most) for robot in robots})


def soft_parts(
    names: Sequence[str] = NAMES, *, robots: Sequence[str] = (), most: int = 3
) -> SearchStrategy[tuple[SoftPart, ...]]:
    """Draw soft specifications: formulas with weights, for `spec.soft`.

    Args:
        names: The propositions.
        robots: As for `formulas`.
        most: How many soft specifications there are at most.
    """
    return _soft_parts(tuple(_some(names)), tuple(robots), most)


@cache  # hypothesis looks through a new strategy as a whole, which takes longer than drawing from it
def _formulas(names: Sequence[str], robots: Sequence[str], with_next: bool, size: int) -> SearchStrategy[Formula]:
    plain = [_name(name) for name in names]
    leaves: SearchStrategy[Formula] = st.sampled_from([*plain, TRUE, FALSE])
    grow = partial(_grown, with_next=with_next)
    if robots:
        within = st.recursive(leaves | _counts(names, len(robots)), grow, max_leaves=max(size // 2, 1))
        each = st.builds(partial(_applied, "each"), within)
        leaves = leaves | _of_robots(names, robots) | _counts(names, len(robots)) | each
    return st.recursive(leaves, grow, max_leaves=size)


@cache
def _soft_parts(names: Sequence[str], robots: Sequence[str], most: int) -> SearchStrategy[tuple[SoftPart, ...]]:
    text = st.builds(str, formulas(names, robots=robots, size=4))
    weights = st.integers(1, 8).map(float) | st.sampled_from([0.25, 0.5, 1.5, 100.0])
    return st.lists(st.builds(_soft_part, text, weights), max_size=most).map(tuple)


def _soft_part(formula: str, weight: float) -> SoftPart:
    return SoftPart(formula=formula, weight=weight)


def _some(names: Sequence[str]) -> Sequence[str]:
    if isinstance(names, str) or not names:
        raise BadInput(f"names must be a sequence of one name or more, such as ('a', 'b'), not {names!r}.")
    return names


def _name(name: str, robot: str = "") -> Formula:
    return Formula("name", (), name, robot=robot)


def _applied(operator: Operator, *arguments: Formula) -> Formula:
    return Formula(operator, arguments)


def _grown(inner: SearchStrategy[Formula], *, with_next: bool = False, temporal: bool = True) -> SearchStrategy[Formula]:
    unary: tuple[Operator, ...] = ("!", *(("F", "G") if temporal else ()), *(_NEXT if with_next else ()))
    binary = (*_BOOLEAN, *(_TEMPORAL if temporal else ()))
    return st.builds(_applied, st.sampled_from(unary), inner) | st.builds(_applied, st.sampled_from(binary), inner, inner)


def _counts(names: Sequence[str], robots: int) -> SearchStrategy[Formula]:
    """Counts of robots, at one time or ever, and `all` and `some`, of a Boolean combination of names."""
    leaves = st.sampled_from([_name(name) for name in names])
    counted = st.recursive(leaves, partial(_grown, temporal=False), max_leaves=_COUNTED)
    bounds = st.tuples(st.sampled_from(_COMPARISONS), st.sampled_from([1, *range(2, robots + 2), 0]))
    numbers = st.sampled_from(("count", "ever"))
    return st.builds(lambda number, what, bound: Formula(number, (what,), bound=bound), numbers, counted, bounds) | st.builds(
        _applied, st.sampled_from(("all", "some")), counted
    )


def _of_robots(names: Sequence[str], robots: Sequence[str]) -> SearchStrategy[Formula]:
    return st.builds(_name, st.sampled_from(names), st.sampled_from(robots))
