from dataclasses import replace
from fractions import Fraction

import pytest

from tests.helpers.words.timelines import APART, END, at, fill, mission, timeline
from verify.model_checking.timeline import Change, InternalChange, Relations, Timeline
from verify.model_checking.transitions import no_word_is_a_trace
from verify.model_checking.word_claims import judge_transitions

WORLD = {"start": "home", "edges": (("home", "a"), ("a", "b"), ("b", "c"))}
ONE_WAY = {**WORLD, "directed": True}


def judged(line: Timeline, environment=WORLD, relations: Relations = APART):
    return judge_transitions(mission("true", environment=environment), {line.robot: line}, relations)[0]


def test_along_the_edges():
    assert judged(timeline("q0", ("a", 2, 3), ("b", 4, 5), ("c", 6, 7)))
    assert judged(timeline("q0"))
    assert judged(timeline("q0", ("a", 2, 3), ("b", 4, 5), ("a", 6, 7)))


def test_coming_back_to_the_region_just_left():
    assert judged(timeline("q0", ("a", 2, 3), ("a", 4, 5)), ONE_WAY)
    assert judged(timeline("q0", ("a", 2, 3), edge=0.1))
    assert judged(timeline("q0", ("a", 2, 3), ("b", 4, 5), ("a", 6, 7)), ONE_WAY).outcome == "fails"


def test_a_missing_edge():
    verdict = judged(timeline("q0", ("a", 2, 3), ("c", 6, 7)))
    assert verdict.outcome == "fails"
    assert verdict.claim == "transitions"
    assert (verdict.robot, verdict.region, verdict.visit, verdict.time) == ("q0", "c", 1, 6.0)
    assert "q0 can enter c straight from a" in verdict.sentence
    assert "From a it may go to b." in verdict.sentence
    assert [sorted(letter) for _, letter in verdict.readings()] == [[], ["a"], [], ["c"]]


def test_from_the_start_only_where_it_leads():
    verdict = judged(timeline("q0", ("b", 2, 3)))
    assert "straight from its start (home)" in verdict.sentence


def test_a_region_that_is_only_grazed_may_be_missed():
    grazing = timeline("q0", ("a", 2, 3), ("c", 8, 9), grazes=(("b", 5, 6),))
    verdict = judged(grazing)
    assert verdict.outcome == "fails"
    assert "it may miss b on the way" in verdict.sentence
    assert judged(timeline("q0", ("a", 2, 3), ("b", 5, 6), ("c", 8, 9), edge=0.1))


def test_a_graze_of_a_wrong_region_is_refused():
    assert judged(timeline("q0", ("a", 2, 3), grazes=(("c", 5, 6),))).outcome == "fails"


def test_a_robot_that_starts_in_a_region_starts_there():
    inside = Timeline(
        "q0", {"a": "no", "b": "must", "c": "no"}, (Change(at(2), "b", "no"), Change(at(4), "c", "must")), Fraction(END)
    )
    assert judged(inside)
    outside = Timeline(
        "q0", {"a": "must", "b": "no", "c": "no"}, (Change(at(2), "a", "no"), Change(at(4), "c", "must")), Fraction(END)
    )
    assert judged(outside).outcome == "fails"


def test_without_an_environment_everything_is_joined():
    assert judged(timeline("q0", ("c", 2, 3), ("a", 4, 5)), None)


def test_nested_regions_are_entered_from_outside_in():
    nested = Relations(nested=frozenset({("b", "a")}))
    both = Timeline(
        "q0",
        {"a": "no", "b": "no", "c": "no"},
        (Change(at(2), "a", "must"), Change(at(2), "b", "must")),
        Fraction(END),
    )
    assert judged(both, relations=nested)
    assert judged(both, {"start": "home", "edges": (("home", "b"), ("b", "c"))}, nested).outcome == "fails"


def test_regions_that_are_one_are_entered_along_the_edges_of_both_orders():
    """Letters with one of them alone are none, so single steps do not show what is entered."""
    one = Relations(nested=frozenset({("a", "b"), ("b", "a")}))
    both = Timeline("q0", dict.fromkeys("abc", "no"), (Change(at(2), "a", "must"), Change(at(2), "b", "must")), Fraction(END))
    verdict = judged(both, relations=one)
    assert (verdict.outcome, verdict.region, verdict.time) == ("fails", "b", 2.0)
    joined = {"start": "home", "edges": (("home", "a"), ("home", "b"), ("a", "b"))}
    assert judged(both, joined, one)
    assert judged(both, {**joined, "directed": True}, one).outcome == "fails"  # from b to a
    assert judged(both, None, one)
    asked = mission("true", environment=WORLD)
    assert not no_word_is_a_trace(asked, both, one)  # a, then b
    assert no_word_is_a_trace(mission("true", environment={**WORLD, "edges": (("home", "c"),)}), both, one)


def test_a_region_that_is_closed_is_not_entered_beside_one_that_is_the_same():
    one = Relations(nested=frozenset({("a", "b"), ("b", "a")}))
    both = Timeline("q0", dict.fromkeys("abc", "no"), (Change(at(2), "a", "must"), Change(at(2), "b", "must")), Fraction(END))
    shut = mission("true")
    shut = shut.model_copy(update={"regions": {**shut.regions, "b": shut.regions["b"].model_copy(update={"only": ("truck",)})}})
    (verdict,) = judge_transitions(shut, {"q0": both}, one)
    assert verdict.outcome == "fails"
    assert "can enter b, which is open to truck only" in verdict.sentence


def test_a_room_next_door_is_left_again_by_going_back():
    """A robot in room a may touch b through their wall, and goes on from a straight into c, where no edge joins b and c."""
    rooms = {"start": "home", "edges": (("home", "a"), ("a", "b"), ("a", "c"))}
    line = Timeline(
        "q0",
        {"a": "must", "b": "no", "c": "no"},
        (
            *(Change(at(2), "b", "may"), Change(at(3), "b", "no")),
            *(Change(at(5), "a", "may"), Change(at(5), "c", "may"), Change(at(6), "a", "no"), Change(at(6), "c", "must")),
        ),
        Fraction(END),
    )
    walls = Relations(frozenset({("b", "c")}))
    assert judged(line, rooms, walls)
    assert judged(line, {**rooms, "directed": True}, walls).outcome == "fails"  # no edge leads from b back to a
    assert judged(line, {**rooms, "edges": (("home", "a"), ("a", "c"))}, walls).outcome == "fails"


def test_actions_where_they_are_permitted():
    assert judged(timeline("q0", ("a", 2, 4), edge=0.1, actions=(fill(3),)))
    assert judged(timeline("q0", ("a", 2, 4), actions=(fill(2),))).outcome == "fails"  # at the very edge


@pytest.mark.parametrize(
    ("action", "says"),
    [
        (fill(5), "can happen outside a"),
        (fill(3, where="b"), "permitted at: a"),
        (replace(fill(3), source="wet"), "is made in state dry"),
        (replace(fill(3), target="steam"), "a state that the robot does not have"),
        (replace(fill(3), source="dry", target="dry", propositions=frozenset()), "permitted at: nowhere"),
        (replace(fill(3), propositions=frozenset()), "but wet has {water}"),
    ],
)
def test_actions_that_are_not_permitted(action: InternalChange, says):
    verdict = judged(timeline("q0", ("a", 2, 4), actions=(action,)))
    assert verdict.outcome == "fails"
    assert says in verdict.sentence


def test_the_internal_state_at_the_start():
    line = replace(timeline("q0"), internal=frozenset({"water"}))
    assert "starts with {water}, not {}" in judged(line).sentence


def test_every_lap_starts_where_the_last_one_ended():
    assert judged(timeline("q0", ("a", 4, 5), ("b", 8, 9), cycle=2))
    verdict = judged(timeline("q0", ("a", 4, 5), ("b", 8, 9), ("c", 12, 13), cycle=2))
    assert verdict.outcome == "fails"
    assert verdict.region == "a"  # in the second lap, straight from c
    twice = timeline("q0", ("a", 4, 8), cycle=2, actions=(fill(6),))
    assert "is made in state wet" in judged(twice).sentence


def test_each_robot_has_its_own_verdict():
    asked = mission("true", robots=2, environment=WORLD)
    lines = {"q0": timeline("q0", ("a", 2, 3)), "q1": timeline("q1", ("c", 2, 3))}
    assert [verdict.outcome for verdict in judge_transitions(asked, lines, APART)] == ["holds", "fails"]


def test_what_an_agent_brings_from_before_time_0():
    asked = mission("true", robots=2, environment=WORLD)
    came = asked.agents["q1"].model_copy(update={"internal": "wet", "visited": "b"})
    asked = asked.model_copy(update={"agents": {**asked.agents, "q1": came}})
    wet = frozenset({"water"})

    def verdict(line: Timeline):
        return judge_transitions(asked, {line.robot: line}, APART)[0]

    assert verdict(replace(timeline("q1", ("c", 2, 3)), internal=wet))
    assert verdict(replace(timeline("q0", ("a", 2, 3))))
    assert "starts with {}, not {water}" in verdict(timeline("q1", ("c", 2, 3))).sentence
    assert verdict(replace(timeline("q1", ("c", 2, 3), ("a", 4, 5)), internal=wet)).outcome == "fails"
    assert "is made in state wet" in verdict(replace(timeline("q1", ("a", 2, 4), actions=(fill(3),)), internal=wet)).sentence
    assert "straight from its start (home)" in verdict(timeline("q0", ("c", 2, 3))).sentence
