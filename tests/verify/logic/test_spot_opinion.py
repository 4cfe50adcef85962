import importlib

import pytest

from tests.helpers.words.timelines import APART, timeline
from verify import check_team, check_word
from verify.data import MissingEngine, parse_formula
from verify.data.errors import InternalError
from verify.logic import spot_opinion
from verify.logic.normal_form import normal_form
from verify.logic.progression import OutOfBudget
from verify.logic.spot_opinion import some_word_breaks
from verify.model_checking import inclusion
from verify.model_checking.inclusion import letter_graph
from verify.model_checking.robot_letters import from_timeline
from verify.model_checking.team_graph import OwnGraph


def graph_of(names: set[str]):
    return letter_graph(OwnGraph([from_timeline(timeline("q0", ("a", 1, 2), ("b", 3, 4)), APART)], timed=False), names)


def test_the_process_of_its_own_says_the_same(monkeypatch):
    for text, breaks in (("F(a & F b)", False), ("F(b & F a)", True), ("G(a -> F c)", True)):
        part = normal_form(parse_formula(text))
        monkeypatch.setattr(spot_opinion, "EASY", 8)
        here = some_word_breaks(graph_of(set("abc")), part)
        monkeypatch.setattr(spot_opinion, "EASY", 0)
        assert some_word_breaks(graph_of(set("abc")), part) == here == breaks


def test_a_process_that_outgrows_its_limits_is_out_of_budget(monkeypatch):
    monkeypatch.setattr(spot_opinion, "EASY", 0)
    monkeypatch.setattr(spot_opinion.sys, "executable", "/bin/false")
    with pytest.raises(OutOfBudget, match="second opinion"):
        some_word_breaks(graph_of({"a"}), normal_form(parse_formula("F a")))


def test_without_spot_words_are_judged_and_teams_say_what_is_missing(monkeypatch):
    real = importlib.import_module

    def absent(name: str, *rest: str):
        if name in ("spot", "buddy"):
            raise ImportError(name)
        return real(name, *rest)

    monkeypatch.setattr(spot_opinion.importlib, "import_module", absent)
    spot_opinion._negation.cache_clear()
    assert check_word("F a", [["a"]])
    with pytest.raises(MissingEngine, match="pip install spottl"):
        check_team("F a & F spotless", {"q0": [["a"]]})


def test_what_few_robots_prove_of_a_large_team_needs_spots_agreement(monkeypatch):
    """Of thirty robots that pass a one is followed, the others' letters coming at any time."""
    team = {f"q{i}": [[], ["a"], []] for i in range(30)}
    asked: list[int] = []

    def agreeing(graph, normal):
        asked.append(graph.states)
        return some_word_breaks(graph, normal)

    monkeypatch.setattr(inclusion, "some_word_breaks", agreeing)
    assert check_team("F a", team).parallel
    assert len(asked) == 1
    assert asked[0] < 10
    monkeypatch.setattr(inclusion, "some_word_breaks", lambda graph, normal: True)
    with pytest.raises(InternalError, match="disagree"):
        check_team("F a", team)


def test_names_that_spot_would_misread():
    team = {"q0": [["FIRE"], ["Gate1"]]}
    assert check_team("F FIRE & F Gate1", team)
    assert check_team("F alive & F p0", {"q0": [["alive", "p0"]]})
