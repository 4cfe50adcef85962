import re
from decimal import Context, localcontext
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.helpers.few import few_of
from verify.data.errors import BadInput
from verify.data.language.counting import written_out
from verify.data.language.formula import FALSE, Formula, check_formula
from verify.data.language.formula_error import FormulaError
from verify.data.language.formula_reader import MAX_DEPTH, parse_formula
from verify.data.language.relaxation import relaxed, tightened, without_idle_bounds
from verify.logic.normal_form import normal_form

spot = pytest.importorskip("spot")


@pytest.mark.parametrize("name", ["Gate1", "FIRE", "Xray", "alive", "hoopF", "G1", "U2", "Wind", "true1", "X_1"])
def test_names_that_begin_like_operators_are_names(name: str) -> None:
    formula = parse_formula(f"F {name}", {name})
    assert formula == Formula("F", (Formula("name", (), name),))
    assert spot.formula(formula.quoted()) == spot.formula.F(spot.formula.ap(name))


@pytest.mark.parametrize(
    ("text", "spaced"),
    [("GFa", "G F a"), ("a & FGp0", "F G p0"), ("Fb", "F b"), ("XXa", "X X a"), ("GFGate & F Gate", "G F Gate"),
     ("aUb | a | b", "a U b"), ("FGab", "F G ab")],
)  # fmt: skip
def test_operators_without_spaces_are_one_name_that_does_not_exist(text: str, spaced: str) -> None:
    glued = spaced.replace(" ", "")
    with pytest.raises(FormulaError) as caught:
        parse_formula(text)
    assert f"`{glued}` is one name here; write `{spaced}`" in str(caught.value)
    assert caught.value.position == text.index(glued)
    with pytest.raises(FormulaError, match=r"is not a name of this mission\. `.*` is one name here; write `"):
        parse_formula(text, {"a", "b", "p0", "Gate"})
    assert parse_formula(text.replace(glued, f'"{glued}"')) == parse_formula(text, shown={glued})
    assert parse_formula(text, {"a", "b", "Gate", glued}) == parse_formula(text, shown={glued})


def test_names_that_do_not_occur_are_names() -> None:
    for name in ("Gate1", "FIRE", "Xray", "Goal", "G1", "Final_leg", "GPS", "FX", "X_1", "UWB"):
        assert parse_formula(f"F {name}") == Formula("F", (Formula("name", (), name),))


@pytest.mark.parametrize("seed", range(60))
def test_what_spot_prints_without_spaces_is_read_as_spot_does_or_refused(seed: int) -> None:
    random = next(iter(spot.randltl(["a", "loc1", "Gate"], seed=seed, tree_size=12)))
    text, names = random.to_str("spot"), {"a", "loc1", "Gate"}
    glued = set(re.findall(r"\w+", text)) - names - {"F", "G", "X", "U", "W", "R", "M", "xor"}
    if any(name.lstrip("FGX") for name in glued - {"0", "1"}):
        with pytest.raises(FormulaError, match="is one name here"):
            parse_formula(text, names)
    else:
        assert spot.formula(parse_formula(text, names).quoted()) == random


@pytest.mark.parametrize(
    ("text", "spaced"),
    [("FG(a)", "F G a"), ("GF(a & b) | GF!a", "G F (a & b) | G F !a"), ("G(FG(a))", "G F G a"), ('XX"a"', "X X a"),
     ("FGX[!]a", "F G X[!] a"), ("GF a", "G F a"), ("FG[]a", "F G G a")],
)  # fmt: skip
def test_operators_without_spaces_where_no_name_can_stand(text: str, spaced: str) -> None:
    assert parse_formula(text) == parse_formula(spaced)
    assert spot.formula(text) == spot.formula(parse_formula(text).quoted())


@few_of(50, "seed", range(150))
def test_reads_random_formulas_as_spot_does(seed: int) -> None:
    random = next(iter(spot.randltl(4, seed=seed, tree_size=18)))
    formula = parse_formula(random.to_str("spot", True))
    assert spot.formula(formula.quoted()) == random
    assert spot.formula(str(formula)) == random
    assert parse_formula(str(formula)) == formula


@pytest.mark.parametrize(
    "text",
    ["a -> b -> c", "a <-> b -> c", "a U b U c", "a W b R c", "!a U b", "F a U b", "a & b | c ^ d", "a xor b & c", "G a -> F b",
     "!F!a", "a | b & c U d", "a M b W c", "[]<>a", "a => b <=> c", "a && b || !c", "X a & X[!] b", "(a)", "~a", "1 U 0"],
)  # fmt: skip
def test_precedence_is_spots(text: str) -> None:
    assert spot.formula(parse_formula(text).quoted()) == spot.formula(text)


@given(st.recursive(
    st.sampled_from([Formula("name", (), n) for n in ("a", "b", "Gate1")] + [FALSE]),
    lambda inner: st.builds(lambda op, f: Formula(op, (f,)), st.sampled_from(["!", "F", "G", "X", "X[!]"]), inner)
    | st.builds(lambda op, f, g: Formula(op, (f, g)), st.sampled_from(["&", "|", "xor", "->", "<->", "U", "W", "R", "M"]), inner, inner),
    max_leaves=12,
))  # fmt: skip
@settings(max_examples=200, deadline=None)
def test_a_formula_reads_back_as_itself(formula: Formula) -> None:
    assert parse_formula(str(formula)) == formula
    assert parse_formula(formula.quoted()) == formula


@pytest.mark.parametrize(
    ("text", "position", "says"),
    [
        ("", 0, "empty"),
        ("F ", 2, "ends where"),
        ("a & & b", 4, "stands where"),
        ("(a | b", 0, "never closed"),
        ("(a b)", 3, "An operator is missing before it"),
        ("F(ab(a))", 4, "not expected"),
        ("a b", 2, "not expected"),
        ("a)", 1, "no partner"),
        ("a @ b", 2, "not part of a formula"),
        ("F[2:3] a", 1, r"`F\[2:3\]` needs two bounds with a comma between them, such as `F\[0,10\]`"),
        ("F[3] a", 1, r"such as `F\[0,3\]`"),
        ("a U[5, 2] b", 3, r"`U\[5, 2\]` ends before it begins"),
        ("a & G[-1,2] b", 5, r"looks back; time is counted in seconds from now"),
        ("F[0,10 s] a", 1, r"is in seconds already; write 10 without its unit"),
        ("F[0,nan] a", 1, r"'nan' in `F\[0,nan\]` is no number of seconds"),
        ("F[inf,inf] a", 1, r"begins never; only the second bound may be `inf`"),
        ("FG_[0,inf) a", 3, r"`G\[0,inf\)` is no `G` that is bounded in seconds. Both ends belong to the time"),
        ("X[0,1] a", 1, r"`X` has no bounds in seconds"),
        ("ab[1]", 2, "SERE"),
        ("{a;b}", 0, "SERE"),
        ("F U", 2, "stands where"),
    ],
)
def test_faults_are_pointed_at(text: str, position: int, says: str) -> None:
    with pytest.raises(FormulaError, match=says) as caught:
        parse_formula(text)
    assert caught.value.position == position
    assert str(caught.value).splitlines()[-1] == "  " + " " * position + "^"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("F a and F b", "Write `&` for 'and'."),
        ("not a", "Write `!` for 'not'."),
        ("f a", "Write `F` for 'f'."),
        ("a b", "An operator is missing before it."),
        ("a && && b", "`&&` stands where a proposition is expected.\n"),
    ],
)
def test_words_for_operators_get_a_hint(text: str, says: str) -> None:
    with pytest.raises(FormulaError) as caught:
        parse_formula(text)
    assert says in str(caught.value)


def test_every_unknown_name_is_reported_with_the_nearest_known() -> None:
    with pytest.raises(FormulaError) as caught:
        parse_formula("F smok & G !watr", {"smoke", "water"})
    assert len(caught.value.reasons) == 2
    assert "Did you mean 'smoke'?" in str(caught.value)
    assert "Did you mean 'water'?" in str(caught.value)


@pytest.mark.parametrize("text", ["X a", "F X[!] a"])
def test_next_is_refused_where_time_is_continuous(text: str) -> None:
    assert parse_formula(text).uses_next()
    with pytest.raises(FormulaError, match="no next step"):
        parse_formula(text, allow_next=False)


@pytest.mark.parametrize("text", ["(" * 3000 + "a" + ")" * 3000, "!" * 5000 + "a", "a U " * 5000 + "a", "a & " * 60_000 + "a"])
def test_hostile_texts_end_with_an_error(text: str) -> None:
    with pytest.raises(FormulaError, match=str(MAX_DEPTH) + "|characters"):
        parse_formula(text)


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("F[0,10] a", "F[0,10] a"),
        ("<> [1, 2.50] a", "F[1,2.5] a"),
        ("GF[0,.5]a", "G F[0,0.5] a"),
        ("a U[2,inf] b & c", "a U[2,inf] b & c"),
        ("[] [0,1] (a -> b R[1,1] a)", "G[0,1] (a -> b R[1,1] a)"),
    ],
)
def test_bounds_in_seconds_are_read_and_shown(text: str, shown: str) -> None:
    formula = parse_formula(text)
    assert str(formula) == shown
    assert parse_formula(shown) == formula
    assert formula.timed


def test_bounds_survive_what_is_made_of_a_formula() -> None:
    formula = parse_formula("F[0,3] (a & free)")
    assert str(formula.substitute({"free": parse_formula("!b")})) == "F[0,3] (a & !b)"
    assert str(written_out(parse_formula("each(F[0,3] a)"), ("r", "s"))) == "F[0,3] r.a & F[0,3] s.a"


def test_whoever_reads_words_refuses_bounds_in_seconds() -> None:
    formula = parse_formula("G (a -> F[0,3] b)")
    with pytest.raises(BadInput, match=r"`F\[0,3\] b` is bounded in seconds, which words do not measure"):
        normal_form(formula)
    with pytest.raises(BadInput, match="no automaton over words measures"):
        formula.quoted()
    with pytest.raises(BadInput, match="its arguments or its name do not fit"):
        check_formula(Formula("F", (Formula("name", (), "a"),), window=(Fraction(2), Fraction(1))))


@pytest.mark.parametrize(
    ("text", "asked", "tried"),
    [
        ("F[0,15] G[0,5] a & G[0,15] !c", "F a & !c", "F a & G !c"),
        ("G[0,8] (c | F[0,10] c)", "c | F c", "G (c | F c)"),
        ("!(F[0,3] a)", "!a", "G !a"),
        ("G[2,5] a", "true", "G a"),
        ("a W[0,4] b", "a | b", "a W b"),
        ("a U[2,5] b", "a U b", "a U b"),
        ("F[0,inf] a", "F a", "F a"),
        ("!(a U[0,3] b)", "!b", "!a R !b"),
    ],
)
def test_words_are_asked_what_follows_from_bounds(text: str, asked: str, tried: str) -> None:
    formula = without_idle_bounds(parse_formula(text))
    assert (str(relaxed(formula)), str(tightened(formula))) == (asked, tried)


@pytest.mark.parametrize("text", ["F[0,\u0661\u0660] a", "F[0,\uff11\uff10] a"])
def test_bounds_are_written_in_plain_digits(text: str) -> None:
    with pytest.raises(FormulaError, match="no number of seconds"):
        parse_formula(text)


@pytest.mark.parametrize("text", ["F[" + "0" * 90_000 + "] a", "F[0," + "1" * 90_000 + "] a", "F[0," * 20_000 + "a"])
def test_a_long_window_is_not_repeated_in_its_message(text: str) -> None:
    with pytest.raises(FormulaError) as caught:
        parse_formula(text)
    assert len(str(caught.value)) < 1500


def test_a_long_conjunction_is_handled_without_recursion() -> None:
    text = " & ".join(f"F a{i}" for i in range(900))
    formula, again = parse_formula(text), parse_formula(text)
    assert formula == again
    assert hash(formula) == hash(again)
    assert formula.substitute({"a7": FALSE}) != formula
    assert len(formula.conjuncts()) == len(formula.of("quad0").names()) == 900
    counted = parse_formula(f"{text} & count(b) >= 2", robots=("one", "two"))
    assert str(written_out(counted, ("one", "two"))) == str(counted)


def test_bounds_are_written_in_full_whatever_precision_decimals_have() -> None:
    text = "F[0.000000000001,999999999999.999999999999] a"
    with localcontext(Context(prec=3)):
        assert str(parse_formula(text)) == text
