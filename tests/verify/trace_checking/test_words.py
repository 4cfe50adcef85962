import pytest

from tests.helpers.few import given_few
from tests.strategies import formulas, words
from verify import check_team, check_word
from verify.data import BadInput, FormulaError, Word
from verify.logic.semantics import satisfies
from verify.trace_checking.word_verdict import parse_word


@given_few(33, 200, formulas(with_next=True), words())
def test_the_verdict_is_the_semantics_and_says_why(formula, word):
    verdict = check_word(formula, word)
    assert bool(verdict) == satisfies(formula, word)
    assert verdict.outcome == ("holds" if verdict else "fails")
    assert verdict.sentence
    assert (verdict.counterexample is None) == bool(verdict)


def test_which_letter_and_which_part():
    verdict = check_word("F loc & G(smoke -> carrying)", [[], ["smoke"], ["loc"]])
    assert not verdict
    assert verdict.visit == 1
    assert "`G (smoke -> carrying)` fails at letter 2 of 3, {smoke}" in verdict.sentence
    assert "`carrying` does not" in verdict.sentence


def test_operators_without_spaces_are_no_name_that_never_happens():
    for ask in (lambda: check_word("GFa", [{"a"}]), lambda: check_team("GFa", {"r0": [{"a"}], "r1": [set()]})):
        with pytest.raises(FormulaError, match="`GFa` is one name here; write `G F a`"):
            ask()
    assert check_word("GFa", [{"GFa"}])
    assert check_word('!"GFa"', [{"a"}])
    assert check_word("FG(a)", [{"a"}])


def test_what_never_happens_has_no_letter():
    verdict = check_word("G !b & F a", [[], ["c"]])
    assert verdict.visit is None
    assert verdict.sentence == "`F a` fails: `a` never happens."


def test_the_published_run_holds_only_vacuously():
    verdict = check_word("G(F hoop0 -> !hoop1 U hoop2 & F hoop1)", [[], ["hoop1"], []], [["hoop2"], []])
    assert verdict
    assert verdict.vacuous
    assert "`F hoop0` never happens" in verdict.vacuous[0]


def test_a_disjunction_under_always_can_be_vacuous_too():
    assert check_word("G(!a | b)", [["b"]]).vacuous
    assert not check_word("G(!a | b)", [["a", "b"]]).vacuous
    assert not check_word("!a | b", [["b"]]).vacuous


def test_word_and_cycle_in_every_form():
    assert check_word("G F a", [], [["a"]])
    assert check_word("G F a", Word.of([], [["a"]]))
    assert check_word("F a", ({"a"} for _ in range(1)))


@pytest.mark.parametrize(
    ("word", "cycle", "says"),
    [
        ("ab", None, "is a text"),
        ([], None, "at least one letter"),
        (["ab"], None, "a letter is a set of names"),
        ([[1]], None, "no name"),
        ([3], None, "no set"),
        (3, None, "no sequence"),
        ([["a"]], [], "cycle needs at least one letter"),
        ([["a"]], "a", "is a text"),
        (Word.of([], [["a"]]), [["a"]], "cycle already"),
    ],
)
def test_bad_words(word, cycle, says):
    with pytest.raises(BadInput, match=says):
        check_word("F a", word, cycle)


def test_bad_formulas():
    with pytest.raises(FormulaError):
        check_word("F a &", [["a"]])
    with pytest.raises(BadInput, match="not int"):
        check_word(3, [["a"]])  # type: ignore[arg-type]


def test_spots_notation():
    assert parse_word("1; a; b & c; cycle{d; 1}") == Word.of([[], ["a"], ["b", "c"]], [["d"], []])
    assert parse_word("a&!b & c;true") == Word.of([["a", "c"], []])
    assert parse_word('cycle{"x y"}') == Word.of([], [["x y"]])
    assert parse_word(" a_1 ") == Word.of([["a_1"]])


@pytest.mark.parametrize("text", ["", ";", "a;", "a b", "a &", "& a", "!", "a | b", "0", "!1", "cycle{", "cycle{}", "cycle{a}; b", "a cycle{b}", "}", "F", "cycle{cycle{a}}", "a;;b", "!!a"])  # fmt: skip
def test_bad_notation_is_refused_with_a_caret(text):
    with pytest.raises(BadInput) as error:
        parse_word(text)
    assert "^" in str(error.value)


def test_words_measure_no_seconds() -> None:
    for text in ("F[0,10] a", "G F[1,2] a", "!(b U[0,3] a)"):
        with pytest.raises(BadInput, match="which words do not measure"):
            check_word(text, [set(), {"a"}])
        with pytest.raises(BadInput, match="which words do not measure"):
            check_team(text, {"r": Word((frozenset(), frozenset({"a"})))})
    assert check_word("F[0,inf] a", [set(), {"a"}])  # bounds that bound nothing
    assert check_team("F[0,inf] a", {"r": Word((frozenset(), frozenset({"a"})))}).sequential
