"""How verdicts are written."""

import pytest

from verify import check_word
from verify.logic.verdict import show_readings


@pytest.mark.parametrize(("count", "shown"), [(24, 24), (25, 25), (26, 25), (100, 25)])
def test_long_words_are_cut_in_the_middle(count, shown):
    readings = tuple((f"q{i}", frozenset({"a"})) for i in range(count))
    parts = show_readings(readings).split(", ")
    assert len(parts) == shown
    assert (parts[0], parts[-1]) == ("q0 {a}", f"q{count - 1} {{a}}")
    assert (parts[12] == "...") == (count > 24)


def test_a_robot_is_named_where_it_changes():
    letter = frozenset({"b"})
    assert show_readings((("q0", letter), ("q0", frozenset()), ("q1", letter), ("q0", letter))) == "q0 {b}, {}, q1 {b}, q0 {b}"


@pytest.mark.parametrize(
    ("word", "says"),
    [
        ([{"a"}, {"b"}], "`a` gives way there, where `b` comes: `R` asks for both"),
        ([{"a"}, set(), {"b"}], "`a` gives way there before `b` has"),
    ],
)
def test_what_gives_way_as_the_awaited_comes_is_said_so(word: list[set[str]], says: str) -> None:
    verdict = check_word("b R a", word)
    assert verdict.outcome == "fails"
    assert says in verdict.sentence
