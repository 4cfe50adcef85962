"""What hypothesis draws from: formulas, words and label timelines over the names a, b and c. Most of it is shipped."""

from __future__ import annotations

from fractions import Fraction

from hypothesis import strategies as st

from verify.data import Word
from verify.model_checking.timeline import Change, Enclosure, Timeline
from verify.testing import formulas, lassos, letters
from verify.testing import words as finite_words

__all__ = ["NAMES", "finite_words", "formulas", "lassos", "letters", "timelines", "words"]

NAMES = ("a", "b", "c")


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
