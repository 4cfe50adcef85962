"""The judge that follows robots apart, held against the one that interleaves them all."""

from __future__ import annotations

from fractions import Fraction
from random import Random

import pytest

from tests.helpers.few import few_of
from tests.helpers.missions.random_teams import random_formula, random_timeline
from tests.helpers.words.plain_word_judge import plainly
from tests.helpers.words.timelines import APART, mission, timeline
from verify.data import InternalError, Word
from verify.logic.normal_form import conjuncts, normal_form
from verify.logic.progression import OutOfBudget
from verify.logic.semantics import satisfies
from verify.model_checking.compositional.compositional_check import some_word_breaks_apart
from verify.model_checking.compositional.relevant_robots import letters_of, that_matter
from verify.model_checking.compositional.violation_automaton import BreakingWords
from verify.model_checking.robot_letters import from_timeline
from verify.model_checking.team_graph import OwnGraph
from verify.model_checking.timeline import Relations
from verify.model_checking.word_claims import judge_formula


@pytest.mark.parametrize(
    ("seed", "teams", "budget"),
    [(1, 150, 400), *(pytest.param(seed, 2_500, 4_000, marks=pytest.mark.slow) for seed in range(2, 12))],
)
def test_the_answer_is_that_of_all_robots_together(seed: int, teams: int, budget: int) -> None:
    rng = Random(seed)
    decided = 0
    for number in range(teams):
        lines = [
            random_timeline(rng, f"q{i}", busy=rng.choice([0.2, 0.6]))
            for i in range(rng.choice([1, 2, 2, 3] if seed > 1 else [1, 2, 2]))
        ]
        asked = mission(str(random_formula(rng, rng.randint(2, 9 if seed > 1 else 6))), robots=len(lines))
        timed, clock_error = rng.random() < 0.75, Fraction(rng.choice([0, 0, 1, 2]))
        plain = plainly(
            asked.formula, lines, Relations(), "own", timed=timed, clock_error=clock_error, budget=budget, spot=seed > 1
        )
        (verdict,) = judge_formula(
            asked,
            {line.robot: line for line in lines},
            Relations(),
            clock_error=clock_error,
            times="timed" if timed else "parallel",
            detail="answer" if rng.random() < 0.9 else "counterexample",
        )
        if plain != "undecided":
            assert verdict.outcome == plain, (seed, number, asked.spec.formula)
            decided += 1
        if verdict.counterexample is not None:
            assert not satisfies(asked.formula, Word(tuple(letter for _, letter in verdict.readings())))
    assert decided > 0.8 * teams


@pytest.mark.parametrize(("seed", "count"), [(1, 40), pytest.param(2, 2_000, marks=pytest.mark.slow)])
def test_leaving_robots_out_changes_nothing_and_spot_finds_the_same_words(seed: int, count: int) -> None:
    rng = Random(seed)
    for _ in range(count):
        robots = [
            from_timeline(random_timeline(rng, f"q{i}", busy=rng.choice([0.2, 0.6])), Relations())
            for i in range(rng.randint(1, 5))
        ]
        for part in conjuncts(normal_form(random_formula(rng, rng.randint(2, 7)))):
            words = BreakingWords(part, letters_of(robots, part.propositions))
            answers = [
                some_word_breaks_apart(r, words, timed=True, budget=20_000) for r in (robots, that_matter(robots, words))
            ]
            assert answers[0] == answers[1]
            if rng.random() < 0.2:
                assert words.spot_agrees()


@pytest.mark.parametrize(("seed", "broken"), [(284389589, True), (264755562, True), (594002372, False)])
def test_configurations_that_are_known_are_not_followed_again(seed: int, broken: bool) -> None:
    """Without that some of these walks never end, and others meet a thousand configurations."""
    rng = Random(seed)
    robots = [from_timeline(random_timeline(rng, f"q{i}", busy=0.6), Relations()) for i in range(4)]
    part = normal_form(random_formula(rng, 6))
    words = BreakingWords(part, letters_of(robots, part.propositions))
    assert some_word_breaks_apart(robots, words, timed=True, budget=100) is broken


@pytest.mark.parametrize(("seed", "teams", "budget"), [(1, 80, 400), pytest.param(2, 5_000, 4_000, marks=pytest.mark.slow)])
def test_of_unions_robots_that_show_nothing_are_left_out(
    seed: int, teams: int, budget: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("verify.model_checking.formula_judge.FEW", 1)
    rng = Random(seed)
    for number in range(teams):
        lines = [random_timeline(rng, f"q{i}", busy=rng.choice([0.1, 0.4])) for i in range(rng.choice([2, 2, 3]))]
        asked = mission(str(random_formula(rng, rng.randint(2, 9 if seed > 1 else 6))), robots=len(lines), team="joint")
        clock_error = Fraction(rng.choice([0, 0, 1, 2]))
        plain = plainly(asked.formula, lines, Relations(), "joint", clock_error=clock_error, budget=budget, spot=seed > 1)
        team = {line.robot: line for line in lines}
        (verdict,) = judge_formula(asked, team, Relations(), clock_error=clock_error, detail="answer")
        assert plain in ("undecided", verdict.outcome), (seed, number, asked.spec.formula)


def can_be_read(graph: OwnGraph, names: list[str], readings: tuple) -> bool:
    """Follow readings through the graph of all robots."""

    def silently(states: set) -> set:
        found, work = set(states), list(states)
        while work:
            for observation, after in graph.steps(work.pop()):
                if observation is None and after not in found:
                    found.add(after)
                    work.append(after)
        return found

    states = silently({state for _, state in graph.initial()})
    for name, letter in readings:
        asked = names.index(name), letter
        read = [step for state in states for step in graph.steps(state)]
        states = silently({after for seen, after in read if seen is not None and (seen.robot, seen.letter) == asked})
    return any(graph.is_final(state) for state in states)


@pytest.mark.parametrize(("seed", "teams"), [(1, 40), pytest.param(2, 3_000, marks=pytest.mark.slow)])
def test_a_counterexample_that_is_put_together_is_a_word_of_the_team(
    seed: int, teams: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("verify.model_checking.formula_judge.FEW", 0)
    rng = Random(seed)
    for _ in range(teams):
        lines = [random_timeline(rng, f"q{i}", busy=rng.choice([0.2, 0.5])) for i in range(rng.choice([1, 2, 2, 3]))]
        asked = mission(str(random_formula(rng, rng.randint(2, 7))), robots=len(lines))
        timed, clock_error = rng.random() < 0.75, Fraction(rng.choice([0, 0, 1]))
        times = "timed" if timed else "parallel"
        team = {line.robot: line for line in lines}
        (verdict,) = judge_formula(asked, team, Relations(), clock_error=clock_error, times=times, detail="counterexample")
        if verdict.outcome == "fails":
            graph = OwnGraph([from_timeline(line, Relations()) for line in lines], timed=timed, clock_error=clock_error)
            assert can_be_read(graph, list(team), verdict.readings())
            assert not satisfies(asked.formula, Word(tuple(letter for _, letter in verdict.readings())))


def goals(robots: int, edge: float = 0.0) -> list:
    """Robots that deliver all at once: each comes to a and then to b."""
    return [timeline(f"q{i}", ("a", 2 + i / 100, 5), ("b", 8, 11 + i / 100), edge=edge) for i in range(robots)]


@pytest.mark.parametrize("robots", [3, 30])
@few_of(1, "edge", [0.0, 0.3])
def test_thirty_robots_that_do_the_same_at_once(robots: int, edge: float) -> None:
    asked = mission("G(a -> F b) & F(a & F b) & G !c & F G !a & (!b U a)", robots=robots)
    lines = {line.robot: line for line in goals(robots, edge)}
    assert judge_formula(asked, lines, APART)[0]
    late = {**lines, "q1": timeline("q1", ("a", 2, 5), ("b", 7, 8), ("a", 12, 13), edge=edge)}
    verdict = judge_formula(asked, late, APART, detail="answer" if robots == 3 else "counterexample")[0]
    assert verdict.outcome == "fails"
    if robots > 3:
        assert {name for name, _ in verdict.readings()} == set(late)
        assert verdict.robot == "q1"


def test_unions_of_thirty_robots_that_are_at_a_dock_one_after_another() -> None:
    lines = [timeline(f"q{i}", ("ab"[i % 2], 1 + i / 2, 1.3 + i / 2), edge=0.05) for i in range(30)]
    asked = mission("G !(a & b) & F a & F b & G(a -> F !a)", robots=30, team="joint")
    assert judge_formula(asked, {line.robot: line for line in lines}, APART)[0]
    lines[7] = timeline("q7", ("b", 4.3, 5), edge=0.05)
    verdict = judge_formula(asked, {line.robot: line for line in lines}, APART, detail="answer")[0]
    assert verdict.outcome == "fails"


def test_what_is_counted_is_a_budget() -> None:
    lines = goals(6)
    part = normal_form(mission("G(a -> F b)").formula)
    robots = [from_timeline(line, APART) for line in lines]
    words = BreakingWords(part, letters_of(robots, part.propositions))
    with pytest.raises(OutOfBudget, match="more than 5 configurations"):
        some_word_breaks_apart(robots, words, timed=True, budget=5)
    assert not some_word_breaks_apart(robots, words, timed=True, budget=500)


def test_a_word_that_spot_finds_otherwise_is_our_bug(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("verify.model_checking.compositional.team_answers.some_word_breaks", lambda *_: True)
    with pytest.raises(InternalError, match="bug of ltlplan's"):
        judge_formula(mission("F(a & F(b & F(c | a)))"), {"q0": timeline("q0", ("a", 1, 2), ("b", 3, 4), ("a", 5, 6))}, APART)
