"""Lines that are told in flight: what is an event, and what is said of what is none."""

import pytest
from hypothesis import strategies as st

from ltlplan.online.checked_events import in_order
from ltlplan.online.event_sources.lines import MOST_LETTERS, event_told, events_told, meant
from tests.helpers.few import given_few
from tests.helpers.live.live_missions import PAIR
from verify.data import BadInput, parse_mission
from verify.data.events import NewFormula, RobotLeaves, events_to_json


def test_a_time_may_be_left_out():
    assert event_told(" one fails ") == RobotLeaves(time=0.0, robot="one")
    assert event_told("12.5 one leaves") == RobotLeaves(time=12.5, robot="one", fails=False)
    assert event_told("formula F a & G !b") == NewFormula(time=0.0, formula="F a & G !b")


@pytest.mark.parametrize("time", ["nan", "inf", "-inf", "-1", "1e999"])
def test_a_time_that_never_comes_is_none(time):
    with pytest.raises(BadInput, match="at least 0"):
        event_told(f"{time} one fails")


@pytest.mark.parametrize("line", ["\x1b[2J one fails", "one \x00 fails", "one fails \x9b31m x", "\u202eone fails"])
def test_what_would_play_with_a_terminal_is_shown_as_text_only(line):
    with pytest.raises(BadInput, match="cannot be shown") as refused:
        event_told(line)
    assert str(refused.value).isprintable()


def test_a_line_that_is_too_long_is_not_repeated_whole():
    with pytest.raises(BadInput, match="at most") as refused:
        event_told("formula " + "F a & " * MOST_LETTERS)
    assert len(str(refused.value)) < 200


PARTS = st.sampled_from(
    ["one", "fails", "leaves", "joins", "moves", "appears", "formula", "0,0,1", "nan,0,0", "1,2", "1e999,0,0", "0.4,0.4,-2", "0,0,0", "12", "nan", "-", "F", "((", "&", "a", "\u2028"]
)  # fmt: skip


@given_few(20, 400, st.lists(PARTS, max_size=6).map(" ".join) | st.text(max_size=60))
def test_any_text_is_an_event_or_refused_in_words(text):
    """Nothing else is raised, which would end a flight; what is an event can be written into a file and back."""
    try:
        event = event_told(text)
    except BadInput:
        return
    assert "NaN" not in events_to_json([event])


def test_a_formula_that_nests_deep_is_refused_in_words():
    mission = parse_mission(PAIR)
    for formula in ("(" * 4000, "F(" * 3000 + "left" + ")" * 3000, "!" * 9000 + "left"):
        with pytest.raises(BadInput):
            in_order(mission, (event_told(f"formula {formula}"),))


def test_each_line_is_answered_by_itself():
    told = events_told(["# who is out", "", "one fails", "two flies", "  "])
    assert told[0] == RobotLeaves(time=0.0, robot="one")
    assert isinstance(told[1], str)
    assert "'two flies' is no event" in told[1]
    assert len(told) == 2
    assert meant(["# a", " b ", ""]) == ["b"]
