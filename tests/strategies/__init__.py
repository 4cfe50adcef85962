"""What hypothesis draws from: formulas, words and label timelines over the names a, b and c."""

from __future__ import annotations

from fractions import Fraction

from hypothesis import strategies as st

from verify.behaviour.timeline import Change, Enclosure, Timeline
from verify.data import Formula, Word

NAMES = ("a", "b", "c")
_UNARY = ("!", "F", "G")
_BINARY = ("&", "|", "xor", "->", "<->", "U", "W", "R", "M")


def formulas(*, with_next: bool = False, names: tuple[str, ...] = NAMES, size: int = 12) -> st.SearchStrategy[Formula]:
    """Formulas, with X and X[!] or without."""
    unary = (*_UNARY, "X", "X[!]") if with_next else _UNARY
    leaves = st.sampled_from([Formula("name", (), name) for name in names] + [Formula("true"), Formula("false")])

    def grow(inner: st.SearchStrategy[Formula]) -> st.SearchStrategy[Formula]:
        return st.one_of(
            st.builds(lambda op, x: Formula(op, (x,)), st.sampled_from(unary), inner),
            st.builds(lambda op, x, y: Formula(op, (x, y)), st.sampled_from(_BINARY), inner, inner),
        )

    return st.recursive(leaves, grow, max_leaves=size)


def letters(names: tuple[str, ...] = NAMES) -> st.SearchStrategy[frozenset[str]]:
    """Letters, the empty one included."""
    return st.frozensets(st.sampled_from(names))


def finite_words(most: int = 5) -> st.SearchStrategy[Word]:
    """Non-empty finite words."""
    return st.lists(letters(), min_size=1, max_size=most).map(Word.of)


def lassos() -> st.SearchStrategy[Word]:
    """Infinite words with a short prefix and cycle."""
    return st.builds(Word.of, st.lists(letters(), max_size=3), st.lists(letters(), min_size=1, max_size=3))


def words() -> st.SearchStrategy[Word]:
    """Finite words and lassos."""
    return finite_words() | lassos()


DURATION = Fraction(12)


@st.composite
def timelines(draw: st.DrawFn, robot: str = "quad0", names: tuple[str, ...] = NAMES) -> Timeline:
    """Timelines of 12 s with crossings, spells of may, touching and overlapping enclosures."""
    initial: dict[str, str] = {}
    changes: list[Change] = []
    for name in names:
        status = initial[name] = draw(st.sampled_from(["no", "no", "no", "may", "must"]))
        time = Fraction(0)
        for _ in range(draw(st.integers(0, 3))):
            time += draw(st.integers(0, 6)) if time else draw(st.integers(1, 6))
            width = draw(st.sampled_from([0, 0, 1, 2]))
            if time + width > DURATION:
                break
            status = draw(st.sampled_from([s for s in ("no", "may", "must") if s != status]))
            changes.append(Change(Enclosure(time, time + width), name, status))
            time += width
    changes.sort(key=lambda change: change.time.low)
    return Timeline(robot, initial, tuple(changes), DURATION)
