"""Random teams in random rooms: cost and duration against bounds of their own, and what must change neither."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ltlplan
from tests.helpers.missions.counted_halls import longest_alone
from tests.helpers.missions.room_bounds import RoomBounds
from tests.helpers.missions.room_figures import Figure, flown, measured
from tests.helpers.missions.room_teams import Box, Door, RoomTeam, drawn

DURATION, COST = 1.3, 1.1
"""Shares of the bounds that are asked of medians."""
SEEDS = range(28)
SAME = 1e-6
"""By how much costs and durations of what is the same mission may differ."""
OWN = [0, 5, 6, 7, 12, 13, 14, 19, 20, 21, 26, 27, 28, 33, 34, 35]
"""Missions whose robots are read on their own, whose paths are improved by draws."""
IN_THE_WAY = 0.03
"""By how much a region may change a cost beside what it changes its bound: planned ways lead around all regions that they do not visit."""
MIRRORED = 0.01
"""By how much durations of a mission and of its mirror image may differ."""


def two_rooms(formula: str = "F a") -> RoomTeam:
    """Return two rooms with a door 0.5 m wide between them, where one robot starts beside the door's axis and one on it."""
    return RoomTeam(
        kind="shared",
        hall=Box((-2.0, -1.0), (2.0, 1.0)),
        height="low",
        solid=(Box((-0.1, -1.2), (0.1, -0.25)), Box((-0.1, 0.25), (0.1, 1.2))),
        doors=(Door((-0.1, 0.1), (-0.25, 0.25)),),
        places={"a": Box((1.0, -0.3), (1.6, 0.3))},
        starts={"q0": (-1.0, 0.0), "q1": (-1.5, 0.0)},
        ends={},
        tasks={"": ("a",)},
        formula=formula,
        joint=False,
    )


def test_bounds_are_those_that_can_be_counted_by_hand() -> None:
    bounds = RoomBounds(two_rooms(), speed=0.5)
    assert bounds.cost == pytest.approx(2.05, rel=1e-3)  # to the edge, and the margin further
    assert bounds.duration({"q0": ["a"]}) == pytest.approx(2.05 / 0.5, rel=1e-3)
    both = bounds.duration({"q0": ["a"], "q1": ["a"]})
    assert both == pytest.approx(2.55 / 0.5, rel=1e-3)  # the second one is later than the door asks for anyway


def test_a_narrow_door_makes_robots_late_that_come_to_it_together() -> None:
    beside = replace(two_rooms(), starts={"q0": (-1.0, 0.3), "q1": (-1.0, -0.3)})
    one, both = (RoomBounds(beside, 1.0).duration(visited) for visited in ({"q0": ["a"]}, {"q0": ["a"], "q1": ["a"]}))
    assert one + 0.1 < both < one + 0.4


def test_a_wall_is_flown_around() -> None:
    shut = replace(two_rooms(), solid=(Box((-0.1, -1.2), (0.1, 0.5)),), doors=())
    least = RoomBounds(shut, 1.0).cost
    corner = np.hypot(0.9, 0.5) + 0.2 + np.hypot(0.95, 0.25)  # around its edge itself, to a nearer point of the place
    assert corner < least < corner + 0.12


@pytest.mark.slow
def test_a_small_mission_is_flown_within_twice_its_bounds() -> None:
    figure = measured(drawn(13))
    assert not figure.refusal
    assert 1.0 <= figure.cost < 2.0
    assert figure.nominal < 2.0
    assert figure.paced < DURATION


@pytest.fixture(scope="module")
def figures() -> list[Figure]:
    """Figures of four missions of each kind."""
    return [measured(drawn(seed)) for seed in SEEDS]


@pytest.mark.slow
def test_costs_are_never_below_their_bound(figures: list[Figure]) -> None:
    assert min(figure.cost for figure in figures if not figure.refusal) >= 1.0


@pytest.mark.slow
def test_the_median_cost_and_the_median_of_planned_times_are_near_their_bounds(figures: list[Figure]) -> None:
    assert np.nanmedian([figure.cost for figure in figures]) <= COST
    assert np.nanmedian([figure.nominal for figure in figures]) <= DURATION


@pytest.mark.slow
def test_the_median_duration_is_near_that_of_the_longest_flight_alone(figures: list[Figure]) -> None:
    assert np.nanmedian([figure.paced for figure in figures]) <= DURATION


@pytest.mark.slow
def test_all_of_them_are_flown(figures: list[Figure]) -> None:
    assert not [seed for seed, figure in zip(SEEDS, figures, strict=True) if figure.refusal]


@pytest.mark.slow
def test_robots_that_take_turns_in_a_low_hall_end_where_nobody_passes_after_them() -> None:
    lasts, made = flown(ltlplan.plan(drawn(25).mission("0.7")))
    assert lasts < 1.6 * longest_alone(made)


def cost_of(team: RoomTeam, more: dict[str, Box] | None = None) -> float:
    """Return what a mission's plan costs, m."""
    cost = ltlplan.plan(team.mission(more=more)).cost
    assert cost is not None
    return cost


def assert_costs_stay(seed: int) -> None:
    """Assert that mirroring, renaming and reordering robots change no cost, and another region only what it is in the way."""
    team = drawn(seed)
    cost = cost_of(team)
    assert cost_of(team.renamed()) == pytest.approx(cost, rel=1e-9)
    for other in (team.mirrored(), team.reordered()):
        assert cost_of(other) == pytest.approx(cost, rel=SAME)
    if more := team.unrelated(seed):
        around = RoomBounds(team, 1.0, more.values()).cost / RoomBounds(team, 1.0).cost
        assert cost_of(team, more) == pytest.approx(cost * around, rel=IN_THE_WAY)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(28))
def test_costs_owe_nothing_to_names_order_and_sides(seed: int) -> None:
    assert_costs_stay(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3, 4, 9, 11, 15, 16])
def test_durations_owe_nothing_to_names_and_order_and_little_to_sides(seed: int) -> None:
    """Joint missions, whose plans are the same but for names; places beside each other are tried in an order that a mirror changes."""
    team = drawn(seed)
    lasts = [flown(ltlplan.plan(other.mission()))[0] for other in (team, team.renamed(), team.reordered(), team.mirrored())]
    assert lasts[1:3] == pytest.approx([lasts[0], lasts[0]], rel=SAME)
    assert lasts[3] == pytest.approx(lasts[0], rel=MIRRORED)


@pytest.mark.slow
@pytest.mark.parametrize("seed", OWN)
def test_paths_that_are_improved_by_draws_owe_nothing_to_names_order_and_sides(seed: int) -> None:
    """One draw serves all robots, along axes that the path itself gives."""
    team = drawn(seed)
    plans = [ltlplan.plan(each.mission()) for each in (team, team.renamed(), team.reordered(), team.mirrored())]
    assert [made.cost for made in plans[1:]] == pytest.approx([plans[0].cost] * 3, rel=SAME)
    lasts = [flown(made)[0] for made in plans]
    assert lasts[1:] == pytest.approx([lasts[0]] * 3, rel=SAME)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3, 4, 8, 9, 10, 11, 15, 16, 18, 22, 24, 25, *OWN])
def test_durations_owe_nothing_to_a_region_that_is_not_in_the_way(seed: int) -> None:
    """Missions whose region is not in the way: the bounds are the same with it."""
    team = drawn(seed)
    more = team.unrelated(seed)
    assert RoomBounds(team, 1.0, more.values()).cost == pytest.approx(RoomBounds(team, 1.0).cost, rel=1e-9)
    plans = [ltlplan.plan(team.mission(more=regions)) for regions in ({}, more)]
    assert plans[1].cost == pytest.approx(plans[0].cost, rel=SAME)
    assert flown(plans[1])[0] == pytest.approx(flown(plans[0])[0], rel=SAME)


@pytest.mark.parametrize("seed", [pytest.param(4, marks=pytest.mark.slow), 11])
def test_robots_take_turns_in_the_same_order_beside_a_region_that_is_not_named(seed: int) -> None:
    """Their order was looked for among states of all regions, and given up for the order in which robots are listed."""
    team = drawn(seed)
    plain, beside = (ltlplan.plan(team.mission(more=more)) for more in ({}, team.unrelated(seed)))
    assert beside.precedences == plain.precedences
    assert beside.words == plain.words
