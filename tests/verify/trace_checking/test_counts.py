import itertools
from random import Random

import pytest

from tests.helpers.words.plain_team_words import at_once, holds, in_turn
from tests.helpers.words.random_counts import random_counting_formula
from verify import check_team, check_word
from verify.data import BadInput, FormulaError, parse_formula
from verify.data.language.counting import written_out
from verify.data.language.formula import FALSE, TRUE, Formula

ROBOTS = ("quad0", "quad1", "quad2")


def random_words(rng: Random, robots=ROBOTS):
    letters = [frozenset(), frozenset({"a"}), frozenset({"b"}), frozenset({"a", "b"})]
    return {name: tuple(rng.choice(letters) for _ in range(rng.randint(1, 3))) for name in robots}


def against_brute_force(rng: Random, robots=ROBOTS) -> tuple[str, str]:
    words = random_words(rng, robots)
    formula = random_counting_formula(rng, rng.randint(1, 7), robots)
    verdict = check_team(formula, words, "joint")
    assert verdict.sequential.outcome == ("holds" if all(holds(formula, word) for word in in_turn(words)) else "fails"), (
        str(formula),
        words,
    )
    assert verdict.parallel.outcome == ("holds" if all(holds(formula, word) for word in at_once(words)) else "fails"), (
        str(formula),
        words,
    )
    return verdict.sequential.outcome, verdict.parallel.outcome


def test_words_of_teams_against_a_plain_evaluator():
    rng = Random(1)
    found = {against_brute_force(rng) for _ in range(60)}
    assert found >= {("holds", "holds"), ("fails", "fails")}


@pytest.mark.slow
def test_words_of_many_teams_against_a_plain_evaluator():
    rng = Random(2)
    found = {against_brute_force(rng, ROBOTS[: rng.randint(1, 3)]) for _ in range(4000)}
    assert found >= {("holds", "holds"), ("fails", "fails"), ("holds", "fails")}


def test_renaming_and_permuting_robots_changes_no_verdict():
    rng = Random(3)
    for _ in range(40):
        words = random_words(rng)
        formula = random_counting_formula(rng, rng.randint(1, 6), ROBOTS)
        new = dict(zip(ROBOTS, rng.sample(["x", "y", "z"], 3), strict=True))
        renamed = parse_formula(str(formula))
        for old, name in new.items():
            renamed = parse_formula(str(renamed).replace(f"{old}.", f"{name}."))
        before = check_team(formula, words, "joint")
        after = check_team(renamed, {new[name]: word for name, word in reversed(words.items())}, "joint")
        assert (before.sequential.outcome, before.parallel.outcome) == (after.sequential.outcome, after.parallel.outcome)


def test_robots_that_show_the_same_may_change_places_where_none_is_named():
    words = {"quad0": [[], ["a"]], "quad1": [[], ["b"], []], "quad2": [["a"]]}
    for order in itertools.permutations(words):
        shuffled = dict(zip(order, words.values(), strict=True))
        assert check_team("F(count(a) >= 2) & G(count(b) <= 1)", shuffled, "joint")


def test_a_robot_that_idles_changes_nothing_of_lower_bounds():
    rng = Random(4)
    for _ in range(30):
        words = random_words(rng, ROBOTS[:2])
        text = rng.choice(["F(count(a) >= 2)", "F(count(a & !b) >= 1) & F b", "(!b U count(a) >= 2) | G(count(b) <= 1)"])
        more = {**words, "idle": ([],)}
        assert [bool(v) for v in vars_of(check_team(text, words, "joint"))] == [
            bool(v) for v in vars_of(check_team(text, more, "joint"))
        ]


def vars_of(verdict):
    return verdict.sequential, verdict.parallel


def test_counts_come_to_what_they_say():
    def out(text, robots=ROBOTS):
        return str(written_out(parse_formula(text), robots))

    assert out("count(a) >= 1") == out("some(a)") == "a"
    assert out("count(a) > 1") == "count(a) >= 2"
    assert out("all(a)") == "!(count(!a) >= 1)"
    assert out("count(a & b) == 2") == "count(a & b) >= 2 & !(count(a & b) >= 3)"
    assert out("each(F a -> count(b) >= 2)", ROBOTS[:2]) == ("(F quad0.a -> count(b) >= 2) & (F quad1.a -> count(b) >= 2)")
    assert written_out(parse_formula("count(a) >= 4"), ROBOTS) == FALSE
    assert written_out(parse_formula("count(a) >= 0"), ROBOTS) == TRUE
    assert out("F(quad0.a & count(b) >= 1 & all(a))", ("quad0",)) == "F ((a & b) & a)"


@pytest.mark.parametrize(
    "text",
    [
        "count(a & !b) >= 2",
        "F quad0.a & !all(a | free)",
        "each(F a U quad1.b)",
        "G some(a -> b)",
        "!(count(a) < 10) U quad0.free",
    ],
)
def test_printed_and_read_again(text):
    formula = parse_formula(text)
    assert str(formula) == text.replace("F a U", "F a U")
    assert parse_formula(str(formula)) == formula


def test_a_count_that_is_not_so_is_written_in_parentheses():
    assert str(parse_formula("!count(a) >= 2")) == "!(count(a) >= 2)"
    assert parse_formula("!(count(a) >= 2)") == parse_formula("!count(a) >= 2")


@pytest.mark.parametrize(
    ("text", "position", "says"),
    [
        ("F quad7.a", 2, "'quad7' is not a robot of this mission. Did you mean 'quad"),
        ("F quad0.dok", 8, "'dok' is not a name"),
        ("F quad0", 2, "It is a robot; write `quad0.p`"),
        ("count(F a) >= 2", 6, "`F` is about other times"),
        ("count(count(a) > 1) >= 2", 6, "counts robots again"),
        ("some(quad0.a)", 11, "names a robot"),
        ("each(each(a))", 5, "leave the inner one out"),
        ("G count(a) >= -1", 2, "never below 0"),
        ("F count(a)", 2, "compare it"),
        ("F count(a) = 2", 11, "written `==`"),
        ("F count(a) >= x", 14, "a whole number of robots"),
        ("F count", 2, "needs parentheses"),
        ("F count(a >= 2", 10, "is not part of a formula"),
        ("F quad0.", 8, "the name of what this robot shows"),
        ("a >= 2", 2, "`>` is not part of a formula"),
        ("12", 0, "`1` is not part of a formula"),
    ],
)
def test_what_cannot_be_read_is_named_with_its_place(text, position, says):
    with pytest.raises(FormulaError) as error:
        parse_formula(text, {"a", "b", "dock"}, robots=ROBOTS)
    assert error.value.position == position
    assert says in str(error.value)


def test_counts_need_a_team_and_common_time():
    words = {"quad0": [["a"]], "quad1": [["b"]]}
    with pytest.raises(BadInput, match=r'`count\(a\) >= 2` speaks of several robots at one time; under "own"'):
        check_team("F count(a) >= 2", words)
    with pytest.raises(BadInput, match="a single word says nothing"):
        check_word("F quad0.a", [["a"]])
    with pytest.raises(BadInput, match="'quad2' is not a robot of this team"):
        check_team("F quad2.a", words, "joint")
    with pytest.raises(BadInput, match=r"'quad0\.a' cannot stand beside counts"):
        check_team("F quad0.a", {"quad0": [["quad0.a"]]}, "joint")


def test_a_failure_says_how_many_show_what():
    verdict = check_team("G count(a) <= 1", {"quad0": [[], ["a"]], "quad1": [[], ["a"]]}, "joint").parallel
    assert verdict.outcome == "fails"
    assert "count(a) >= 2" in verdict.sentence
    assert verdict.readings()[-1][1] >= {"a", "count(a) >= 2"}


def test_formulas_keep_what_counts_have():
    count = parse_formula("count(a) >= 2")
    assert count.substitute({"a": Formula("name", (), "b")}) == parse_formula("count(b) >= 2")
    assert parse_formula("quad0.a").substitute({"a": parse_formula("!b & c")}) == parse_formula("!quad0.b & quad0.c")
    with pytest.raises(BadInput, match="do not fit"):
        check_team(Formula("count", (Formula("name", (), "a"),)), {"q": [["a"]]}, "joint")


def test_a_free_robot_is_not_all_robots_free():
    assert written_out(parse_formula("some(free)"), ROBOTS) == parse_formula("count(free) >= 1")
    words = {"quad0": ({"free"},), "quad1": ({"a"},)}
    assert check_team("some(free)", words, "joint").parallel.outcome == "holds"
    assert check_team("count(free) == 1", words, "joint").parallel.outcome == "holds"
    assert check_team("all(free)", words, "joint").parallel.outcome == "fails"
