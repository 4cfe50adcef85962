from fractions import Fraction
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.helpers.few import given_few
from tests.helpers.words.timelines import APART, END, at, fill, mission, random_readings, random_signal, random_unions, timeline
from tests.strategies import formulas, timelines
from verify.data import BadInput, InternalError, Word
from verify.logic.normal_form import normal_form
from verify.logic.semantics import satisfies
from verify.model_checking.inclusion import Broken, holds_for_all
from verify.model_checking.robot_letters import from_timeline
from verify.model_checking.team_graph import OwnGraph
from verify.model_checking.timeline import Change, Enclosure, InternalChange, Relations, Timeline
from verify.model_checking.word_claims import judge_formula


def judged(formula: str, *lines: Timeline, team: str = "own", relations: Relations = APART, **options):
    trace = "finite" if lines[0].cycle is None else "infinite"
    asked = mission(formula, team=team, robots=len(lines), trace=trace)
    return judge_formula(asked, {line.robot: line for line in lines}, relations, **options)[0]


FLOWN = given(formulas(size=8), st.lists(timelines(), min_size=1, max_size=3), st.sampled_from(["own", "joint"]), st.randoms())


@settings(max_examples=6, deadline=None)
@FLOWN
def test_no_possible_flight_breaks_what_is_said_to_hold(formula, lines, team, rng: Random):
    assert_no_flight_breaks_it(formula, lines, team, rng)


@pytest.mark.slow
@settings(max_examples=300, deadline=None)
@FLOWN
def test_of_many_none_breaks_what_is_said_to_hold(formula, lines, team, rng: Random):
    assert_no_flight_breaks_it(formula, lines, team, rng)


def assert_no_flight_breaks_it(formula, lines, team, rng: Random):
    asked = mission(str(formula), team=team, robots=len(lines))
    named = {f"q{i}": Timeline(f"q{i}", line.initial, line.changes, line.duration) for i, line in enumerate(lines)}
    verdict = judge_formula(asked, named, Relations(), budget=5_000)[0]
    for _ in range(25):
        signals = [random_signal(line, rng) for line in named.values()]
        flown = [signal for signal in signals if signal is not None]
        if len(flown) < len(signals):
            continue
        letters = random_readings(flown, lines[0].duration, rng) if team == "own" else random_unions(flown, rng)
        assert not verdict or satisfies(asked.formula, Word(letters))
    if verdict.outcome == "fails":
        assert not satisfies(asked.formula, Word(tuple(letter for _, letter in verdict.readings())))
        assert len(verdict.times) == len(verdict.readings())
        assert all(0 <= low <= high <= 12 for low, high in verdict.times)
        assert [low for low, _ in verdict.times] == sorted(low for low, _ in verdict.times)


@given_few(4, 20, formulas(size=8), st.lists(timelines(), min_size=1, max_size=2), st.sampled_from(["own", "joint"]))
def test_parallel_implies_timed(formula, lines, team):
    asked = mission(str(formula), team=team, robots=len(lines))
    named = {f"q{i}": Timeline(f"q{i}", line.initial, line.changes, line.duration) for i, line in enumerate(lines)}
    parallel = judge_formula(asked, named, Relations(), times="parallel", budget=5_000)[0]
    timed = judge_formula(asked, named, Relations(), budget=5_000)[0]
    assert not parallel or timed.outcome != "fails"
    wide = judge_formula(asked, named, Relations(), clock_error=Fraction(2), budget=5_000)[0]
    assert not wide or timed.outcome != "fails"
    assert not parallel or wide.outcome != "fails"


def test_a_visit_is_one_visit_only_without_a_margin():
    once = "F a & !F(a & F(!a & F a))"
    assert judged(once, timeline("q0", ("a", 4, 6)))
    verdict = judged(once, timeline("q0", ("a", 4, 6), edge=0.1))
    assert verdict.outcome == "fails"
    assert [sorted(letter) for _, letter in verdict.readings()] == [[], ["a"], [], ["a"], []]
    assert 3.9 <= verdict.time <= 6.1
    assert judged("F a & G !b", timeline("q0", ("a", 4, 6), edge=0.1))


def test_a_graze_may_or_may_not_be_a_visit():
    grazing = timeline("q0", grazes=(("b", 3, 4),))
    assert judged("F b", grazing).outcome == "fails"
    assert judged("G !b", grazing).outcome == "fails"
    assert judged("F b | G !b", grazing)


def test_overlapping_crossings_come_in_either_order():
    line = Timeline(
        "q0",
        {"a": "must", "b": "no", "c": "no"},
        (Change(at(4, 6), "a", "no"), Change(at(5, 7), "b", "must")),
        Fraction(END),
    )
    assert judged("F(a & b)", line, relations=Relations()).outcome == "fails"
    assert judged("G !(a & b)", line, relations=Relations()).outcome == "fails"
    assert judged("F(a & b) | F free", line, relations=Relations())
    assert judged("G !(a & b) & F free", line)  # apart: it must leave the one before it comes to the other


def test_a_path_through_a_common_edge_touches_both_or_neither():
    """Closed regions and a continuous path: leaving one and entering another at one instant is being in both."""
    line = Timeline(
        "q0",
        {"a": "must", "b": "no", "c": "no"},
        (Change(at(5), "a", "no"), Change(at(5), "b", "must")),
        Fraction(END),
    )
    assert judged("F(a & b) | F(!a & !b)", line, relations=Relations())
    inside = Relations(nested=frozenset({("a", "b")}))
    assert judged("G(a -> b)", Timeline("q0", {"a": "may", "b": "may", "c": "no"}, (), Fraction(END)), relations=inside)


def test_the_action_falls_into_the_visit():
    line = timeline("q0", ("a", 2, 4), ("b", 8, 9), edge=0.1, actions=(fill(3),))
    assert judged("G(b -> water) & F(a & !water) & F(a & water)", line)
    late = timeline("q0", ("a", 2, 4), ("b", 8, 9), actions=(fill(8.5),))
    assert judged("G(b -> water)", late).outcome == "fails"


def test_a_hovering_robot_is_read_before_and_after_another():
    hovering = timeline("q0", ("a", 2, 8))
    asked = "!F(a & F(b & F a))"
    assert judged(asked, hovering, timeline("q1", ("b", 9, 10)))
    verdict = judged(asked, hovering, timeline("q1", ("b", 4, 6)))
    assert verdict.outcome == "fails"
    assert judged(asked, hovering, timeline("q1", ("b", 8, 9))).outcome == "fails"  # equal times, in any order
    assert judged(asked, hovering, timeline("q1", ("b", 9, 10)), times="parallel").outcome == "fails"


def test_clocks_that_are_off_bring_events_together():
    lines = timeline("q0", ("a", 2, 5)), timeline("q1", ("b", 6, 7))
    asked = "!F(a & F(b & F a))"
    assert judged(asked, *lines)
    assert judged(asked, *lines, clock_error=Fraction(1, 4))
    assert judged(asked, *lines, clock_error=Fraction(1, 2)).outcome == "fails"
    assert judged("!F(b & F a)", timeline("q0", ("a", 2, 3), ("b", 4, 5)), clock_error=Fraction(9))  # its own clock


def test_a_letter_may_be_read_late():
    """q0 enters a first, but may be read there only after q1 was read in b."""
    lines = timeline("q0", ("a", 2, 8)), timeline("q1", ("b", 4, 6))
    assert judged("!b W a", *lines).outcome == "fails"
    assert judged("!b W a", timeline("q0", ("a", 2, 3)), timeline("q1", ("b", 4, 6)))


def test_each_whole_letter_is_read_even_where_a_conjunct_cannot_see_why():
    """q0 stays in a; it must be read again after q1's b, because meanwhile it comes to c as well."""
    still = Timeline("q0", {"a": "must", "b": "no", "c": "no"}, (), Fraction(END))
    busy = Timeline(
        "q0", {"a": "must", "b": "no", "c": "no"}, (Change(at(9), "c", "must"), Change(at(10), "c", "no")), Fraction(END)
    )
    other = timeline("q1", ("b", 4, 6))
    assert judged("G(b -> F a)", still, other, relations=Relations()).outcome == "fails"
    assert judged("G(b -> F a)", busy, other, relations=Relations())


def test_joint_letters_are_unions():
    docks = timeline("q0", ("a", 2, 5)), timeline("q1", ("b", 5, 7))
    assert judged("G !(a & b)", *docks, team="own")
    verdict = judged("G !(a & b)", *docks, team="joint")
    assert verdict.outcome == "fails"
    assert verdict.time == 5
    assert judged("G !(a & b)", timeline("q0", ("a", 2, 5)), timeline("q1", ("b", 6, 7)), team="joint")


def test_a_robot_that_breaks_a_formula_by_itself_is_named():
    verdict = judged("G !b", timeline("q0", ("a", 2, 3)), timeline("q1", ("b", 5, 6)))
    assert verdict.outcome == "fails"
    assert verdict.robot == "q1"


def test_vacuous_parts_are_named():
    verdict = judged("G(b -> water)", timeline("q0", ("a", 2, 3)))
    assert verdict
    assert "`b` never happens" in verdict.vacuous[0]
    assert not judged("G(b -> F a)", timeline("q0", ("b", 1, 2), ("a", 3, 4))).vacuous


def test_free_is_shown_as_it_was_written():
    verdict = judged("G !free", timeline("q0", ("a", 2, 3)))
    assert "`G !free` fails" in verdict.sentence


def test_laps_choose_anew():
    line = timeline("q0", ("a", 4, 6), grazes=(("b", 10, 11),), cycle=2)
    assert judged("G F a", line)
    assert judged("G F b", line).outcome == "fails"
    assert judged("F G !b", line).outcome == "fails"  # every lap may take the graze
    assert judged("G F b | F G !b", line)
    verdict = judged("G(a -> !b U a) & G !(b & F b)", line)
    assert verdict.outcome == "fails"
    assert isinstance(verdict.counterexample, Word)
    assert verdict.counterexample.cycle


def test_a_hover_is_a_cycle():
    line = Timeline("q0", {"a": "no", "b": "no", "c": "no"}, (Change(at(3), "a", "must"),), Fraction(END), cycle=Fraction(10))
    assert judged("F G a", line)
    assert judged("G F !a", line).outcome == "fails"


def test_a_spell_of_may_that_never_ends_is_left_by_the_lap():
    line = Timeline("q0", {"a": "may", "b": "no", "c": "no"}, (), Fraction(END), cycle=Fraction(0))
    assert judged("G F a | F G !a", line)
    assert judged("G F a", line).outcome == "fails"


@given_few(6, 40, formulas(size=6), timelines(), st.integers(0, 11))
def test_tableau_and_spot_agree_on_laps(formula, line, cycle):
    """Their disagreement would be an InternalError."""
    lap = Timeline("q0", line.initial, line.changes, line.duration, cycle=Fraction(cycle))
    verdict = judge_formula(mission(str(formula), trace="infinite"), {"q0": lap}, Relations())[0]
    assert verdict.outcome in ("holds", "fails")
    if verdict.outcome == "fails":
        assert not satisfies(mission(str(formula)).formula, verdict.counterexample)


def test_contradictory_timelines_are_our_bug_and_not_a_proof():
    line = Timeline("q0", {"a": "must", "b": "must", "c": "no"}, (), Fraction(END))
    with pytest.raises(InternalError, match="contradicts itself"):
        judged("G(a | b)", line)


def test_disagreement_with_spot_is_reported(monkeypatch):
    monkeypatch.setattr("verify.model_checking.inclusion.some_word_breaks", lambda *_: True)
    graph = OwnGraph([from_timeline(timeline("q0", ("a", 1, 2)), APART)], timed=False)
    with pytest.raises(InternalError, match="bug of ltlplan's"):
        holds_for_all(graph, normal_form(mission("F a & F(b | F a)").formula), budget=77)


def test_out_of_budget_is_undecided():
    lines = [timeline(f"q{i}", ("a", 1 + i, 10 + i), ("b", 12, 14), edge=0.5) for i in range(4)]
    verdict = judged("G(a -> F(b & F a)) | F(b & G(a -> F c))", *lines, budget=50)
    assert verdict.outcome == "undecided"
    assert "50 configurations" in verdict.sentence
    assert not verdict


def test_bad_calls():
    with pytest.raises(BadInput, match="at least one robot"):
        judge_formula(mission("F a"), {}, APART)
    with pytest.raises(BadInput, match="negative"):
        judged("F a", timeline("q0"), clock_error=Fraction(-1))
    with pytest.raises(BadInput, match="must not have a cycle"):
        judge_formula(mission("F a"), {"q0": timeline("q0", cycle=1)}, APART)
    with pytest.raises(BadInput, match="must have a cycle"):
        judge_formula(mission("F a", trace="infinite"), {"q0": timeline("q0")}, APART)


def test_an_unknown_instant_of_an_action_is_any_within_its_window():
    window = InternalChange(Fraction(3), "", "", "", -1, frozenset({"water"}), Fraction(5))
    line = timeline("q0", ("a", 4, 6), actions=(window,))
    assert judged("F(a & !water) | F(a & water)", line)
    assert judged("F(a & !water)", line).outcome == "fails"
    assert judged("F(!a & water & F a)", line).outcome == "fails"


def test_the_answer_is_kept_for_flights_with_the_same_orders_of_events():
    robots = [from_timeline(timeline("q0", ("a", start, 9)), APART) for start in (1, 2)]
    part = normal_form(mission("F b").formula)
    answers = [holds_for_all(OwnGraph([robot], timed=True), part) for robot in robots]
    assert isinstance(answers[0], Broken)
    assert answers[0] is answers[1]


def test_a_hundred_robots_of_which_two_matter():
    lines = [timeline("q0", ("a", 2, 8)), timeline("q1", ("b", 4, 6)), *(timeline(f"q{i}") for i in range(2, 100))]
    assert judged("F a & F b & G !c", *lines)
    verdict = judged("!F(a & F(b & F a))", *lines)
    assert verdict.outcome == "fails"
    assert {robot for robot, _ in verdict.readings()} == {line.robot for line in lines}


def test_what_a_cut_timeline_leaves_out_proves_nothing():
    """b lies inside a: cut down to b, the formula's only region, the timeline no longer says that the robot is in a."""
    nested = Relations(nested=frozenset({("b", "a")}))
    grazing = timeline("q0", ("a", 2, 10), grazes=(("b", 5, 6),))
    verdict = judged("G !b", grazing, relations=nested)
    assert verdict.outcome == "fails"
    assert ("q0", frozenset("ab")) in verdict.readings()
    inside = timeline("q0", ("a", 2, 10), ("b", 5, 6))
    assert judged("F b", inside, relations=nested)
    assert judged("G(b -> a)", grazing, relations=nested)
    assert nested.among({"b"}).allows(frozenset("b"))
    assert not nested.allows(frozenset("b"))


def test_what_holds_in_whatever_order_letters_come_is_not_followed_letter_by_letter():
    """No robot is ever at two places, whoever is where and when: that needs no robot's order, however long."""
    times = [(i / 5, (i + 0.5) / 5) for i in range(60)]
    lines = [timeline(f"q{i}", *(("ab"[i % 2], start, stop) for start, stop in times)) for i in range(5)]
    assert judged("G !(a & b)", *lines, budget=100)
    assert judged("F (a & F b)", *lines, budget=300)


@pytest.mark.parametrize(("second", "outcome"), [(2, "holds"), (1, "fails")])
def test_robots_that_change_at_different_times_do_not_change_together(second: int, outcome: str) -> None:
    """Between 1 and 2 s the team holds `a` alone; where both come at 1 s, nothing says that it does."""

    def line(robot: str, region: str, time: int) -> Timeline:
        instant = Enclosure(Fraction(time), Fraction(time))
        return Timeline(robot, {"a": "no", "b": "no"}, (Change(instant, region, "must"),), Fraction(5))

    lines = line("q0", "a", 1), line("q1", "b", second)
    assert judged("a R !b", *lines, team="joint").outcome == outcome
    assert judged("!b U (a & !b)", *lines, team="joint").outcome == outcome
