"""Other words for teams whose planned ones leave robots no room beside each other."""

from __future__ import annotations

import pytest

import ltlplan
from ltlplan.pipeline import certified_team
from ltlplan.replanning.conflict_alternatives import fewer_in_a_region, no_other_words, without_a_leg_in_conflict
from ltlplan.replanning.cuts import Candidate, Conflict
from ltlplan.replanning.refusal import Refusal
from tests.helpers.missions.worlds import world
from verify.data import Infeasible, Mission, Plan, Witness

PARKED = "G(count(home) <= 1) & each(F home) & F all(!free)"
PLACES = {"home": (0.0, 0.0), "base": (1.2, 0.0), "far": (6.0, 0.0)}
STARTS = ((-1.0, 0.0), (-1.0, 1.0), (-1.0, -1.0))


def parking(formula: str = PARKED, *, places: tuple[str, ...] = ("home", "base", "far"), robots: int = 3) -> Mission:
    """Return a mission of robots that have to make room at home; to bounds alone two have room in a region, which leaves them no places."""
    regions = {name: PLACES[name] for name in places}
    extra = "separation: 0.4\nmargin: 0.05"
    return world(
        formula, robots=robots, regions=regions, radii=dict.fromkeys(regions, 0.3), starts=STARTS, team="joint", extra=extra
    )


def ends(made: Plan) -> list[str]:
    return sorted(robot.visits[-1].region for robot in made.robots.values())


def refused(made: Plan, witness: Witness) -> Refusal:
    return Refusal.of(Candidate(made), Conflict(Infeasible(witness.sentence, witness)))


@pytest.fixture(scope="module")
def first() -> Plan:
    made = ltlplan.plan(parking())
    assert ends(made) == ["base", "base", "home"]
    return made


def test_a_region_without_room_holds_fewer_robots_in_the_next_words(first: Plan) -> None:
    why = "'base' is too small."
    other = fewer_in_a_region(refused(first, Witness(claim="separation", sentence=why, region="base")))
    assert other is not None
    assert ends(other.plan) == ["base", "far", "home"]
    assert other.capacities == {"base": 1}
    assert other.plan.notes[-1].endswith(why)
    assert not other.plan.complete
    assert other.plan.method == first.method


def test_two_robots_in_conflict_are_parted_where_both_end(first: Plan) -> None:
    names = [name for name, robot in first.robots.items() if robot.visits[-1].region == "base"]
    why = "They come too near each other."
    other = fewer_in_a_region(refused(first, Witness(claim="separation", sentence=why, robot=names[0], other=names[1])))
    assert other is not None
    assert ends(other.plan) == ["base", "far", "home"]


def test_words_without_counts_do_without_a_leg_of_the_robots_in_conflict() -> None:
    made = ltlplan.plan(world("F(a & F b)", robots=2, team="own"))
    why = "They come too near each other."
    other = without_a_leg_in_conflict(refused(made, Witness(claim="separation", sentence=why, robot="quad0", other="quad1")))
    assert other is not None
    assert other.plan.words != made.words
    assert other.legs
    assert other.cuts[-1].why == why
    assert not other.cuts[-1].proved


@pytest.mark.parametrize("claim", ["limits.speed", "obstacles"])
def test_what_is_no_matter_of_room_asks_for_no_other_words(first: Plan, claim: str) -> None:
    refusal = refused(first, Witness(claim=claim, sentence="It is too fast.", robot="quad0"))
    assert fewer_in_a_region(refusal) is None
    assert without_a_leg_in_conflict(refusal) is None
    assert no_other_words(refusal) is refusal.error


@pytest.mark.slow  # a second and a half: planned twice, refined and proved
def test_robots_that_had_no_room_to_park_are_certified_elsewhere(first: Plan) -> None:
    done = certified_team(first)
    assert done.certificate.holds
    assert ends(done.plan) == ["base", "far", "home"]


def test_a_refusal_says_that_there_are_no_other_words() -> None:
    made = ltlplan.plan(parking("F(count(base) >= 2)", places=("base",), robots=2))
    with pytest.raises(Infeasible, match=r"'base' is too small.* No other words were found that would mend it\.") as refusal:
        certified_team(made)
    assert refusal.value.witness is not None
    assert refusal.value.witness.region == "base"
