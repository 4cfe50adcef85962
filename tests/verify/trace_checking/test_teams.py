import itertools
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.helpers.few import given_few
from tests.strategies import finite_words, formulas
from verify import check_team, check_word
from verify.data import BadInput, Formula, Letter, Word, parse_formula
from verify.logic.semantics import satisfies

Words = tuple[tuple[Letter, ...], ...]


def word(text: str) -> list[set[str]]:
    """`, a b, c` is the word {} {a, b} {c}."""
    return [set(letter.split()) for letter in text.split(",")]


def union(letters) -> Letter:
    return frozenset().union(*letters)


def one_after_another(words: Words, order: tuple[int, ...], reading: str) -> list[Letter]:
    if reading == "own":
        return [letter for robot in order for letter in words[robot]]
    found: list[Letter] = []
    for position, robot in enumerate(order):
        held = union([words[r][-1] for r in order[:position]] + [words[r][0] for r in order[position + 1 :]])
        found += [letter | held for i, letter in enumerate(words[robot]) if not position or i]
    return found


def all_at_once(words: Words, most: int, reading: str):
    """Yield every team word of up to `most` letters, shortest first."""
    if reading == "own":
        frontier = {((-1,) * len(words), ())}
    else:
        start = (0,) * len(words)
        frontier = {(start, (union(w[0] for w in words),))}
    for _ in range(most):
        following = set()
        for at, read in frontier:
            if reading == "own":
                for robot, letters in enumerate(words):
                    for index in (at[robot], at[robot] + 1):
                        if 0 <= index < len(letters):
                            moved = (*at[:robot], index, *at[robot + 1 :])
                            following.add((moved, (*read, letters[index])))
            else:
                if all(i + 1 == len(w) for i, w in zip(at, words, strict=True)):
                    yield read
                choices = [(i, i + 1) if i + 1 < len(w) else (i,) for i, w in zip(at, words, strict=True)]
                for moved in itertools.product(*choices):
                    following.add((moved, (*read, union(w[i] for i, w in zip(moved, words, strict=True)))))
        frontier = following
        if reading == "own":
            yield from (read for at, read in frontier if all(i + 1 == len(w) for i, w in zip(at, words, strict=True)))


def is_a_reading(words: Words, names: list[str], readings) -> bool:
    """Tell whether (robot, letter) pairs are a team word under the own reading."""
    reached = {(-1,) * len(words)}
    for name, letter in readings:
        robot = names.index(name)
        reached = {
            (*at[:robot], index, *at[robot + 1 :])
            for at in reached
            for index in (at[robot], at[robot] + 1)
            if 0 <= index < len(words[robot]) and words[robot][index] == letter
        }
    return tuple(len(w) - 1 for w in words) in reached


teams = st.lists(finite_words(most=3), min_size=1, max_size=3) | st.lists(finite_words(most=2), min_size=4, max_size=4)
readings = st.sampled_from(["own", "joint"])


@given_few(10, 60, formulas(with_next=True, size=8), teams, readings)
def test_one_after_another_against_all_orders(formula, team, reading):
    names = [f"q{i}" for i in range(len(team))]
    words = tuple(w.prefix for w in team)
    verdict = check_team(formula, dict(zip(names, team, strict=True)), reading).sequential
    spelled = [one_after_another(words, order, reading) for order in itertools.permutations(range(len(team)))]
    assert bool(verdict) == all(satisfies(formula, Word(tuple(w))) for w in spelled)
    if not verdict:
        assert [letter for _, letter in verdict.readings()] in spelled
        assert not satisfies(formula, Word(tuple(letter for _, letter in verdict.readings())))


@given_few(4, 20, formulas(size=8), teams, readings)
def test_all_at_once_against_plain_enumeration(formula, team, reading):
    names = [f"q{i}" for i in range(len(team))]
    words = tuple(w.prefix for w in team)
    verdict = check_team(formula, dict(zip(names, team, strict=True)), reading).parallel
    length = sum(map(len, words))
    most = min(length + 1, 7 if reading == "own" else 6)
    shortest = next((w for w in all_at_once(words, most, reading) if not satisfies(formula, Word(w))), None)
    if shortest is not None:
        assert verdict.outcome == "fails"
        assert len(verdict.readings()) == len(shortest)
    if verdict.outcome == "fails":
        assert not satisfies(formula, Word(tuple(letter for _, letter in verdict.readings())))
        if reading == "own":
            assert is_a_reading(words, names, verdict.readings())


@given_few(10, 60, formulas(with_next=True, size=8), teams, readings)
def test_parallel_implies_sequential(formula, team, reading):
    found = check_team(formula, {f"q{i}": w for i, w in enumerate(team)}, reading)
    assert not found.parallel or found.sequential
    assert bool(found) == (bool(found.sequential) and bool(found.parallel))


@given_few(6, 40, formulas(size=8), teams, readings, st.integers(2, 3))
def test_repeating_letters_changes_no_verdict(formula, team, reading, times):
    def repeated(w: Word) -> Word:
        return Word(tuple(letter for letter in w.prefix for _ in range(times)))

    plain = check_team(formula, {f"q{i}": w for i, w in enumerate(team)}, reading)
    again = check_team(formula, {f"q{i}": repeated(w) for i, w in enumerate(team)}, reading)
    assert plain.sequential.outcome == again.sequential.outcome
    assert plain.parallel.outcome == again.parallel.outcome


@settings(max_examples=40, deadline=None)
@given(formulas(size=8), finite_words(most=4), readings)
def test_a_team_of_one_is_a_word(formula, alone, reading):
    found = check_team(formula, {"q0": alone}, reading)
    assert bool(found.sequential) == bool(found.parallel) == bool(check_word(formula, alone))


FIREFIGHTING = "F loc1 & F loc2 & G(smoke -> carrying)"
CARRIER = word(", water, water carrying, carrying, smoke carrying, carrying, loc2 carrying")


def test_a_hovering_robot_is_read_before_and_after_another():
    found = check_team("!F(a & F(b & F a))", {"q0": word(", a, "), "q1": word(", b, ")})
    assert found.sequential
    assert found.parallel.outcome == "fails"
    assert [r for r, letter in found.parallel.readings() if letter] == ["q0", "q1", "q0"]


def test_sequential_does_not_imply_parallel():
    formula = "F a & F c & G(a -> (!c U b)) & G(c -> (!a U d))"
    found = check_team(formula, {"q0": word("a, b"), "q1": word("c, d")})
    assert found.sequential
    assert found.parallel.outcome == "fails"
    assert len(found.parallel.readings()) == 4


@pytest.mark.parametrize(
    ("formula", "team"),
    [
        ("G(a -> F b)", ["b, a, a", "", ", , "]),
        ("G a", ["b, , a", "b, a", ", , b"]),
        ("G !(a & b)", ["b, b, b", ", b", "b, a, a"]),
    ],
)
def test_a_shortest_counterexample_counts_repeated_letters(formula, team):
    """Robots that repeat a letter do so while others go on: shortened words alone hide what can happen at once."""
    words = tuple(tuple(frozenset(letter) for letter in word(text)) for text in team)
    found = check_team(formula, {f"q{i}": list(letters) for i, letters in enumerate(words)}, "joint").parallel
    parsed = parse_formula(formula)
    shortest = next(w for w in all_at_once(words, 6, "joint") if not satisfies(parsed, Word(w)))
    assert len(found.readings()) == len(shortest)
    assert not satisfies(parsed, Word(tuple(letter for _, letter in found.readings())))


def test_pairwise_decomposition_is_not_enough():
    formula = "F p0 & F p1 & (F p1 U p2)"
    pairs = [("p0", "p1, p2"), ("p0, p1", "p2")]
    for first, second in pairs:
        assert check_team(formula, {"q0": word(first), "q1": word(second)}).sequential.outcome in ("holds", "fails")
    found = check_team(formula, {"q0": word("p0"), "q1": word("p1"), "q2": word("p2")}).sequential
    assert found.outcome == "fails"
    order = [robot for robot, _ in found.readings()]
    assert order == ["q1", "q0", "q2"]


def test_the_published_assignment_is_refused_with_its_reason():
    team = {"quad0": CARRIER, "quad1": word(", smoke, "), "quad2": word(", loc1, ")}
    found = check_team(FIREFIGHTING, team)
    for verdict in (found.sequential, found.parallel):
        assert verdict.outcome == "fails"
        assert verdict.robot == "quad1"
        assert verdict.visit == 1
        assert "`smoke` holds there but `carrying` does not" in verdict.sentence
    del team["quad1"]
    assert check_team(FIREFIGHTING, team)


def test_under_joint_one_robots_water_is_anothers():
    team = {"q0": word("carrying"), "q1": word(", smoke")}
    assert check_team("G(smoke -> carrying)", team, "joint")
    assert not check_team("G(smoke -> carrying)", team, "own")


def test_docks_are_not_shared():
    team = {"q0": word(", dock_a, "), "q1": word(", dock_b, ")}
    found = check_team("G !(dock_a & dock_b)", team, "joint")
    assert found.sequential
    assert found.parallel.outcome == "fails"
    assert len(found.parallel.readings()) == 3
    assert found.parallel.robot is None, "the letter that breaks it is the team's"
    assert check_team("G !(dock_a & dock_b)", team, "own")


def test_vacuous_parts_are_named():
    found = check_team(FIREFIGHTING, {"q0": word(", loc1"), "q1": word(", loc2")})
    assert found
    assert "`smoke` never happens" in found.sequential.vacuous[0]
    assert "`smoke` never happens" in found.parallel.vacuous[0]


def test_many_robots_with_a_goal_each():
    team = {f"q{i}": word(f", p{i}, ") for i in range(30)}
    assert check_team(" & ".join(f"F p{i}" for i in range(30)), team)
    assert check_team(" & ".join(f"F p{i}" for i in range(31)), team).parallel.outcome == "fails"


def test_idle_robots_cost_nothing_and_are_read():
    team = {"q0": CARRIER, "q1": word(", loc1, "), **{f"idle{i}": word("") for i in range(98)}}
    assert check_team(FIREFIGHTING, team)
    found = check_team(FIREFIGHTING + " & F gone", team).parallel
    assert {robot for robot, _ in found.readings()} == set(team)


def test_a_budget_that_runs_out_is_undecided():
    everyone = [f"p{i}" for i in range(5)]
    formula = " | ".join(f"F({a} & F({b} & F {a}))" for a, b in itertools.permutations(everyone, 2))
    team = {name: word(f", {name}, , {name}") for name in everyone}
    found = check_team(formula, team, budget=200)
    assert found.parallel.outcome == "undecided"
    assert not found.parallel
    assert "200 configurations" in found.parallel.sentence


@pytest.mark.slow
def test_many_alike_are_counted_and_not_permuted():
    team = {f"q{i}": word(", a, " if i % 2 else ", b, ") for i in range(13)}
    assert math.factorial(13) > 10**9  # orders
    assert check_team("G(a -> F b) | G(b -> F a)", team).sequential
    found = check_team("G(a -> F b)", team, budget=20_000)
    assert found.sequential.outcome == found.parallel.outcome == "fails"


@pytest.mark.parametrize(
    ("words", "reading", "says"),
    [
        ({}, "own", "at least one robot"),
        ([["a"]], "own", "at least one robot"),
        ({"q0": []}, "own", "at least one letter"),
        ({"q0": "ab"}, "own", "q0's word is a text"),
        ({"q0": [["a"]]}, "both", '"own" or "joint"'),
        ({"q0": Word.of([], [["a"]]), "q1": [["a"]]}, "own", "certify the flight"),
    ],
)
def test_bad_input(words, reading, says):
    with pytest.raises(BadInput, match=says):
        check_team("F a", words, reading)


def test_one_robot_may_fly_a_lasso():
    found = check_team("G F a", {"q0": Word.of([[]], [["a"], []])})
    assert found.sequential
    assert found.parallel


def test_formulas_may_be_given_as_values():
    assert check_team(Formula("F", (parse_formula("a"),)), {"q0": [["a"]]})
