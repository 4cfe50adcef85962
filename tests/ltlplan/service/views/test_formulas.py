"""A formula in words, its names, its automata as drawings."""

import pytest

from ltlplan import Mission, load_mission, parse_mission
from ltlplan.missions import shipped_mission_text
from ltlplan.service.views.formulas import automaton_states, in_words, known_names, part_automata
from tests.helpers.words.timelines import mission as by_hand


def _asking(formula: str) -> Mission:
    return parse_mission(shipped_mission_text("firefighting").replace("F loc1 & F loc2 & G(smoke -> carrying)", f'"{formula}"'))


def test_the_formula_of_the_paper_in_words() -> None:
    mission = load_mission("firefighting")
    assert in_words(mission) == (
        "At some time in loc1.",
        "At some time in loc2.",
        "Always: if in smoke, then in state carrying.",
    )


@pytest.mark.parametrize(
    ("formula", "said"),
    [
        ("!smoke U carrying", "Not in smoke until in state carrying, which must come."),
        ("G F loc1", "Again and again in loc1."),
        ("F G loc1", "From some time on always in loc1."),
        ("F (loc1 & !smoke)", "At some time: in loc1 and not in smoke."),
        ("loc1 R (smoke | free)", "(in smoke or in free flight) until in loc1 too, or to the end."),
        ("F loc1 | F loc2", "(at some time in loc1) or (at some time in loc2)."),
        ("!(loc1 & loc2)", "It is not so that (in loc1 and in loc2)."),
    ],
)
def test_operators_in_words(formula: str, said: str) -> None:
    assert in_words(_asking(formula)) == (said,)


def test_bounds_are_said_of_a_bounded_response() -> None:
    mission = parse_mission(shipped_mission_text("stlcg-1"))
    spec = {**mission.spec.model_dump(), "formula": "G F[0,10] b2 & (b2 W[0,5] c) & F[3,3] b2 & F[1.25,1000000.5] c"}
    assert in_words(mission.changed(spec=spec)) == (
        "Always: within 10 s in b2.",
        "In b2 until in c, or for all that time (within 5 s).",
        "After 3 s in b2.",
        "Between 1.25 and 1000000.5 s from then in c.",
    )


def test_soft_parts_are_said_after_the_formula() -> None:
    mission = _asking("F loc1")
    wishing = mission.changed(spec={**mission.spec.model_dump(), "soft": [{"formula": "F loc2", "weight": 2.5}]})
    assert in_words(wishing) == ("At some time in loc1.", "Wished for, with weight 2.5: at some time in loc2.")


def test_names_say_what_they_are() -> None:
    names = known_names(load_mission("firefighting"))
    assert names["smoke"] == "hoop"
    assert names["carrying"] == "internal state"
    assert names["free"] == "in no region"
    assert "quad0." not in names
    assert known_names(by_hand("F q0.a", team="joint", robots=2))["q1."].startswith("this robot")


def test_each_part_has_its_automaton_and_its_states_move_on() -> None:
    mission = load_mission("firefighting")
    parts = {str(part): automaton for part, automaton in part_automata(mission)}
    assert list(parts) == ["F loc1", "F loc2", "G (smoke -> carrying)"]
    reached = automaton_states(parts["F loc1"], [(0.0, frozenset()), (2.0, frozenset({"loc1"})), (3.0, frozenset())])
    assert [time for time, _ in reached] == [0.0, 2.0]
    assert parts["F loc1"].is_accepting(reached[-1][1][0])
    broken = automaton_states(parts["G (smoke -> carrying)"], [(1.0, frozenset({"smoke"}))])
    assert broken[-1] == (1.0, ())


@pytest.mark.parametrize(
    ("formula", "said"),
    [
        ("F(count(a) >= 2)", "At some time at least two robots are in a."),
        ("G(count(a & water) < 2)", "Always fewer than two robots are in a and in state water."),
        ("G all(b -> water)", "Always all robots are such that if in b, then in state water."),
        ("each(F a)", "For each robot: at some time in a."),
        ("q0.a U q1.water", "Q0 in a until q1 in state water, which must come."),
    ],
)
def test_counts_in_words(formula: str, said: str) -> None:
    assert in_words(by_hand(formula, team="joint", robots=3)) == (said,)
