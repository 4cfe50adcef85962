"""Paths through regions that overlap or lie in each other: the word that the exact search found is the one that is flown and proved."""

from ltlplan.paths.hoops import route_itinerary
from ltlplan.pipeline import certified_team, plan
from ltlplan.search.exact import assign
from tests.helpers.few import few_of
from tests.helpers.missions.overlaps import CASES, NEST, holds_when_sampled, mission_of, overlapping, sampled_word


@few_of(2, "case", CASES)
def test_the_exact_search_s_words_are_flown_and_proved(case, pace):
    mission = mission_of(case)
    made = plan(mission, seed=1, pace=pace)
    assert str(made.words["quad0"]) == CASES[case][3]
    done = certified_team(made)
    assert all(claim.outcome == "holds" for claim in done.certificate.claims)
    assert sampled_word(mission, done.team["quad0"]) == made.words["quad0"]
    assert holds_when_sampled(mission, done.team)


def test_a_region_that_is_passed_on_the_way_is_no_stop_and_one_may_be_come_back_to():
    through = assign(mission_of("through a region in another")).robots["quad0"]
    assert [visit.region for visit in through.visits] == ["room", "desk", "c"]
    assert through.stops == (1, 2)
    back = overlapping("F (desk & F (room & !desk)) & G !free", (-0.5, 0.0, 1.2), regions=NEST)
    does = assign(back).robots["quad0"]
    assert str(does.word) == "{room} {desk, room} {room}"
    path = route_itinerary(back, "quad0", does)
    assert [visit.region for visit in path.visits] == ["room", "desk"]


def test_regions_in_which_a_robot_begins_are_listed_as_they_are_left():
    both = assign(mission_of("out of two, as they lie")).robots["quad0"].visits
    other = assign(mission_of("out of two, the other way about")).robots["quad0"].visits
    assert [visit.region for visit in both] == ["a", "b", "c"]
    assert [visit.region for visit in other] == ["b", "a", "b", "c"]  # through b again, which is on the way
