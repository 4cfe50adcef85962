from collections.abc import Iterator
from random import Random

import pytest

from tests.helpers.missions.random_teams import random_formula
from tests.helpers.words.linearisations import broken, events_of
from verify import check_ordered, check_team
from verify.data import BadInput, Formula, parse_formula

Words = dict[str, tuple[frozenset[str], ...]]
Pairs = list[tuple[tuple[str, int], tuple[str, int]]]


def word(text: str) -> tuple[frozenset[str], ...]:
    """`, a b, c` is the word {} {a, b} {c}."""
    return tuple(frozenset(letter.split()) for letter in text.split(","))


A_THEN_OUT = {"quad0": word(", a, "), "quad1": word(", b")}


def test_a_letter_that_is_held_on_is_not_read_before_others_for_sure() -> None:
    entered, left = (("quad0", 1), ("quad1", 1)), (("quad0", 2), ("quad1", 1))
    assert check_ordered("!b U a", A_THEN_OUT, [left]).outcome == "holds"
    assert check_ordered("!b U a", A_THEN_OUT, [entered]).outcome == "fails"
    assert check_ordered("!b U a", A_THEN_OUT, [entered], "joint").outcome == "holds"
    assert check_ordered("!b U a & G !(a & b)", A_THEN_OUT, [entered], "joint").outcome == "fails"


def test_a_meeting_is_a_precedence_of_coming_before_leaving() -> None:
    both = (("quad1", 1), ("quad0", 2))
    assert check_ordered("F count(a | b) >= 2", A_THEN_OUT, [both, (("quad0", 1), ("quad1", 1))], "joint")
    assert not check_ordered("F count(a | b) >= 2", A_THEN_OUT, [], "joint")


def test_events_that_are_ordered_never_share_an_instant() -> None:
    words = {"quad0": word("a, "), "quad1": word(", b")}
    assert check_ordered("F !(a | b)", words, [(("quad0", 1), ("quad1", 1))], "joint").outcome == "holds"
    assert check_ordered("F !(a | b)", words, [], "joint").outcome == "fails"


def test_precedences_in_a_circle_are_kept_by_no_flight() -> None:
    verdict = check_ordered("true", A_THEN_OUT, [(("quad0", 2), ("quad1", 1)), (("quad1", 1), ("quad0", 1))])
    assert verdict.outcome == "fails"
    assert "go round in a circle" in verdict.sentence


@pytest.mark.parametrize("event", [("quad0", 0), ("quad0", 3), ("quad9", 1), ("quad0", True)])
def test_what_is_no_event_is_refused(event: tuple[str, int]) -> None:
    with pytest.raises(BadInput, match="A precedence names"):
        check_ordered("F a", A_THEN_OUT, [(event, ("quad1", 1))])


def test_a_counterexample_is_a_team_word_of_everybody() -> None:
    words = {**A_THEN_OUT, "quad2": word("c"), "quad3": word("c")}
    verdict = check_ordered("G !c", words, [(("quad0", 2), ("quad1", 1))])
    assert verdict.outcome == "fails"
    assert {robot for robot, _ in verdict.readings()} == set(words)


@pytest.mark.slow
def test_without_precedences_it_is_the_claim_of_all_interleavings() -> None:
    rng = Random(3)
    for _ in range(150):
        formula, words = random_formula(rng, 4), _words(rng)
        for reading in ("own", "joint"):
            expected = check_team(formula, words, reading).parallel.outcome
            assert check_ordered(formula, words, [], reading).outcome == expected


def _words(rng: Random) -> Words:
    letters = [frozenset[str](), frozenset("a"), frozenset("b"), frozenset("ab"), frozenset("c")]
    return {f"quad{i}": tuple(rng.choice(letters) for _ in range(rng.randint(1, 3))) for i in range(rng.randint(1, 3))}


def _small_teams(seed: int, cases: int, most: int) -> Iterator[tuple[Formula, Words, Pairs]]:
    """Yield random formulas, words of few letters in all, and precedences; some of these go round in a circle, most do not."""
    rng = Random(seed)
    for _ in range(cases):
        formula, words = random_formula(rng, rng.randint(2, 6)), _words(rng)
        if sum(map(len, words.values())) > most:
            continue
        events = events_of(words)
        rng.shuffle(events)
        events.sort(key=lambda event: event[1])
        pairs = [(e, f) for i, e in enumerate(events) for f in events[i + 1 :] if e[0] != f[0] and rng.random() < 0.4]
        yield formula, words, pairs


@pytest.mark.parametrize(("seed", "cases"), [(0, 60), pytest.param(1, 400, marks=pytest.mark.slow)])  # each team is written out
def test_all_linearisations_agree_with_words_that_are_written_out(seed: int, cases: int) -> None:
    most = 6
    for formula, words, pairs in _small_teams(seed, cases, most):
        for reading in ("own", "joint"):
            verdict = check_ordered(formula, words, pairs, reading)
            found = broken(formula, words, pairs, reading, most)
            if found is not None or len(verdict.readings()) <= most:
                assert (verdict.outcome == "fails") == (found is not None), (str(formula), words, pairs, reading)


def test_a_formula_may_ask_for_the_next_letter() -> None:
    words = {"quad0": word(", a, a"), "quad1": word("b")}
    assert check_ordered(parse_formula("F(a & X a)"), words, [], "joint").outcome == "holds"


def test_events_that_a_conjunct_does_not_see_are_left_out_of_its_order() -> None:
    """Fifteen of thirty robots gather: their order is nothing to who sees all at home."""
    gather = {f"quad{i}": word(", a, , home") for i in range(15)}
    words = {**gather, **{f"quad{i}": word(", home") for i in range(15, 30)}}
    pairs = [((one, 1), (other, 2)) for one in gather for other in gather if one != other]
    formula = "F(count(a) >= 15) & F all(home)"
    assert check_ordered(formula, words, pairs, "joint").outcome == "holds"
    assert check_ordered(formula, words, pairs[1:], "joint").outcome == "fails"


def test_what_comes_between_unseen_keeps_the_order_of_what_is_seen() -> None:
    words = {"quad0": word(", a"), "quad1": word(", c, d"), "quad2": word(", b")}
    between = [(("quad0", 1), ("quad1", 1)), (("quad1", 2), ("quad2", 1))]
    assert check_ordered("!b U a & F !(a & b)", words, between, "joint").outcome == "holds"
    assert check_ordered("!b U a", words, between[1:], "joint").outcome == "fails"


def _teams_of_equals(seed: int, cases: int) -> Iterator[tuple[Formula, Words, Pairs]]:
    """Yield random formulas, words of which two are the same, and precedences that see no difference, or now and then do."""
    rng = Random(seed)
    letters = [frozenset[str](), frozenset("a"), frozenset("b"), frozenset("ab")]
    for _ in range(cases):
        one = tuple(rng.choice(letters) for _ in range(rng.randint(2, 3)))
        words = {"quad0": one, "quad1": one, "quad2": tuple(rng.choice(letters) for _ in range(rng.randint(1, 2)))}
        events = events_of(words)
        pairs = {(e, f) for e in events for f in events if e[0] != f[0] and e[1] <= f[1] and rng.random() < 0.15}
        change = {"quad0": "quad1", "quad1": "quad0", "quad2": "quad2"}
        if rng.random() < 0.7:  # else robots that only look alike
            pairs |= {((change[r], i), (change[s], j)) for (r, i), (s, j) in pairs}
        yield random_formula(rng, rng.randint(2, 6)), words, sorted(pairs)


@pytest.mark.parametrize(("seed", "cases"), [(0, 150), pytest.param(1, 4000, marks=pytest.mark.slow)])
def test_robots_that_are_alike_are_followed_as_how_many(seed: int, cases: int) -> None:
    for formula, words, pairs in _teams_of_equals(seed, cases):
        verdict = check_ordered(formula, words, pairs, "joint")
        found = broken(formula, words, pairs, "joint", 9)
        assert (verdict.outcome == "fails") == (found is not None or "circle" in verdict.sentence), (str(formula), words, pairs)


@pytest.mark.parametrize(("seed", "cases"), [(0, 12), pytest.param(1, 600, marks=pytest.mark.slow)])  # each team is written out
def test_robots_that_are_alike_go_on_one_after_another_under_own(seed: int, cases: int) -> None:
    most = 7
    for formula, words, pairs in _teams_of_equals(seed, cases):
        if sum(map(len, words.values())) <= most - 1:
            verdict = check_ordered(formula, words, pairs, "own")
            found = broken(formula, words, pairs, "own", most)
            if found is not None or len(verdict.readings()) <= most:
                fails = found is not None or "circle" in verdict.sentence
                assert (verdict.outcome == "fails") == fails, (str(formula), words, pairs)
