"""Orders of visits against brute force, and what is known of deadlines before any flight."""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Iterator

import pytest

import ltlplan
from ltlplan.pipeline import certified_team
from ltlplan.replanning.timing.plans_in_time import late_by_straight_ways, orders_in_time, planned_without_bounds
from ltlplan.replanning.timing.visit_orders import Orders, Stop
from ltlplan.systems.due_visits import DueVisit, due_visits
from ltlplan.systems.gaps import straight_travel
from tests.helpers.few import few_of
from tests.helpers.missions.timed_rooms import room
from verify.data import Infeasible, NotCertified, parse_formula
from verify.data.language.formula import TRUE

SECOND = {"more": ", team: joint", "agents": "  quad1: {start: [0.4, 1.6, 1.0]}"}


def all_routes(visits: tuple[DueVisit, ...], robots: tuple[str, ...]) -> Iterator[dict[str, tuple[Stop, ...]]]:
    """Yield every share of visits among robots, in every order, at every place."""
    for order in itertools.permutations(visits):
        for ends in itertools.combinations_with_replacement(range(len(order) + 1), len(robots) - 1):
            limits = [0, *ends, len(order)]
            shares = [order[i:j] for i, j in itertools.pairwise(limits)]
            options = [
                [Stop(robot, region, due) for who, region in due.places if who == robot]
                for robot, share in zip(robots, shares, strict=True)
                for due in share
            ]
            owners = [robot for robot, share in zip(robots, shares, strict=True) for _ in share]
            for stops in itertools.product(*options):
                routes = {robot: tuple(s for s, owner in zip(stops, owners, strict=True) if owner == robot) for robot in robots}
                counted = [[s.due.apart for s in route if s.due.apart >= 0] for route in routes.values()]
                if all(len(set(each)) == len(each) for each in counted):
                    yield routes


def lateness(routes: dict[str, tuple[Stop, ...]], travel: dict[tuple[str | None, str], float]) -> float:
    """Return how late conjuncts are in all where each robot flies its stops one after another, as early as may be."""
    late: dict[object, float] = {}
    for route in routes.values():
        begun: list[tuple[str, float, float]] = []
        for stop in route:
            time = max(travel[None, stop.region], stop.due.begin)
            for region, begin, lasts in begun:
                way = travel[region, stop.region]
                time = max(time, begin + (way + lasts if way else 0.0))
            begun.append((stop.region, time, stop.due.lasts))
            late[stop.due.asked] = max(late.get(stop.due.asked, 0.0), time - stop.due.end)
    return sum(max(each, 0.0) for each in late.values())


@few_of(7, "seed", range(60))
def test_the_least_that_orders_miss_is_that_of_all_orders(seed: int) -> None:
    rng = random.Random(seed)
    robots, regions = ("r0", "r1")[: rng.choice([1, 2])], "abc"
    travel = {(one, other): rng.choice([0.0, rng.uniform(0.1, 3.0)]) for one in (None, *regions) for other in regions}
    travel |= {(region, region): 0.0 for region in regions}
    visits: list[DueVisit] = []
    for number in range(rng.choice([2, 3, 4])):
        places = tuple((robot, region) for robot in robots for region in rng.sample(regions, rng.choice([1, 1, 2])))
        begin = rng.choice([0.0, rng.uniform(0.0, 3.0)])
        due = DueVisit(
            parse_formula(f"F p{number}"),
            places,
            begin,
            begin + rng.uniform(0.2, 4.0),
            rng.choice([0.0, rng.uniform(0.0, 2.0)]),
        )
        visits.append(due)
    if len(robots) == 2 and rng.random() < 0.5:
        both = tuple((robot, "a") for robot in robots)
        visits += [DueVisit(TRUE, both, 0.0, rng.uniform(0.5, 3.0), apart=1)] * 2
    asked = tuple(visits)
    least = min(lateness(routes, travel) for routes in all_routes(asked, robots))
    found = Orders(asked, lambda _, start, region: travel[start, region]).least_late()
    assert found is not None
    assert sum(found.values()) == pytest.approx(least, abs=1e-5)
    orders = Orders(asked, lambda _, start, region: travel[start, region])
    assert orders.none_in_time == (least > 1e-5)
    in_time = list(Orders(asked, lambda _, start, region: travel[start, region]).in_time())
    expected = {str(routes) for routes in all_routes(asked, robots) if lateness(routes, travel) < 1e-6}
    assert {str({robot: routes.get(robot, ()) for robot in robots}) for routes in in_time} == expected


@pytest.mark.parametrize(
    ("formula", "due"),
    [
        ("F[2,9] dock", [("dock", 2, 9, 0)]),
        ("F[0,9] G[1,4] dock", [("dock", 1, 10, 3)]),
        ("G[3,5] dock", [("dock", 3, 3, 2)]),
        ("F[0,9] (dock & F[1,2] shelf)", [("dock", 0, 9, 0), ("shelf", 1, 11, 0)]),
        ("!pit U[1,4] dock", [("dock", 1, 4, 0)]),
        ("F[0,4] (dock | shelf)", [("dock", 0, 4, 0)]),
        ("G[0,5] (dock | shelf)", [("dock", 0, 0, 0)]),  # it may go from one to the other
        ("G[0,5] !pit & F[0,2] dock", [("dock", 0, 2, 0)]),
        ("F[0,4] dock & F dock", [("dock", 0, 4, 0)]),
    ],
)
def test_visits_that_are_due_are_read_from_the_formula(formula: str, due: list[tuple[str, float, float, float]]) -> None:
    found = due_visits(room(formula))
    assert [(visit.places[0][1], visit.begin, visit.end, visit.lasts) for visit in found] == due


def test_counts_ask_for_visits_of_different_robots() -> None:
    found = due_visits(room("F[0,4] count(dock | shelf) >= 2", **SECOND))
    assert len(found) == 2
    assert found[0].apart == found[1].apart >= 0
    assert len(found[0].places) == 4


def test_ways_take_at_least_what_the_vehicle_needs() -> None:
    mission = room("F[0,9] dock")
    travel = straight_travel(mission)
    limits = mission.limits_of("quad0")
    metres = 1.6 - 0.25 - 0.4  # to the near face
    assert travel("quad0", None, "dock") >= metres / limits.speed
    assert travel("quad0", None, "dock") == pytest.approx(
        math.sqrt(2 * metres / limits.acceleration)
        if metres <= limits.speed**2 / 2 / limits.acceleration
        else metres / limits.speed + limits.speed / 2 / limits.acceleration
    )
    assert travel("quad0", "dock", "shelf") == pytest.approx(0.7 / limits.speed)


def test_another_order_is_taken_where_the_cheapest_is_late() -> None:
    mission = room("F[5.4,12.51] pit & F[0,2.4] shelf")
    cheapest = planned_without_bounds(mission, ltlplan.plan)
    assert [visit.region for visit in cheapest.robots["quad0"].visits] == ["pit", "shelf"]
    assert "`F[0,2.4] shelf` by 3." in late_by_straight_ways(cheapest)
    planned = ltlplan.plan(mission)
    assert [visit.region for visit in planned.robots["quad0"].visits] == ["shelf", "pit"]
    assert any(note.startswith("Planned in another order of visits than the cheapest") for note in planned.notes)
    assert certified_team(planned).certificate.holds


@pytest.mark.slow
def test_places_are_visited_again_where_windows_ask_for_it() -> None:
    certified = certified_team(ltlplan.plan(room("F[0,1.2] dock & F[4,5] dock & F[2,3] shelf")))
    assert [visit.region for visit in certified.plan.robots["quad0"].visits] == ["dock", "shelf", "dock"]


@pytest.mark.slow
def test_orders_that_leave_no_time_in_flight_are_given_up_for_others() -> None:
    certified = certified_team(ltlplan.plan(room("F[0,2.4] dock & F[0.94,2.4] pit & F[2.74,3.36] shelf")))
    assert certified.certificate.holds


@pytest.mark.slow
def test_a_second_robot_goes_where_one_would_be_late() -> None:
    apart = {**SECOND, "agents": "  quad1: {start: [0.4, 0.8, 1.0]}"}
    untimed = ltlplan.plan(room("F dock & F shelf", **apart))
    assert sum(bool(robot.visits) for robot in untimed.robots.values()) == 1
    certified = certified_team(ltlplan.plan(room("F[0,1.4] dock & F[0,1.4] shelf", **apart)))
    assert all(robot.visits for robot in certified.plan.robots.values())
    counted = certified_team(ltlplan.plan(room("F[0,2] count(dock | shelf) >= 2 & F[0,1.5] pit", **SECOND)))
    assert counted.certificate.holds


def test_a_faster_robot_goes_where_the_nearer_one_would_be_late() -> None:
    slow = "  quad1: {start: [1.0, 0.9, 1.0], limits: {speed: 0.2}}"
    mission = room("F[0,1.6] dock", more=", team: joint", agents=slow)
    assert orders_in_time(mission) == [parse_formula("F quad0.dock", robots=("quad0", "quad1"))]
    certified = certified_team(ltlplan.plan(mission))
    assert {name: len(robot.visits) for name, robot in certified.plan.robots.items()} == {"quad0": 1, "quad1": 0}


def test_deadlines_that_no_order_keeps_are_refused_with_the_least_that_is_missed() -> None:
    with pytest.raises(
        Infeasible,
        match=r"`F\[0,0.1\] shelf` cannot hold: by straight ways, .* quad\d comes there at 0\.\d+ s.* What would help: a later deadline",
    ):
        ltlplan.plan(room("F[0,0.1] shelf"))
    with pytest.raises(Infeasible, match="No order of visits keeps all deadlines") as refused:
        ltlplan.plan(room("F[0,0.9] shelf & F[0,0.8] dock & F[0,5] pit"))
    assert "The least that is missed: `F[0,0.9] shelf` by 0." in str(refused.value)
    assert "Without `F[0,0.9] shelf` or `F[0,0.8] dock` the others may be kept." in str(refused.value)


@pytest.mark.slow
def test_a_flight_that_is_late_in_all_orders_is_refused_with_what_would_have_to_be_given_up() -> None:
    with pytest.raises(NotCertified) as refused:
        certified_team(ltlplan.plan(room("F[0,1.2] shelf & F[0,1.2] dock")))
    said = str(refused.value)
    assert "The least that these words miss at this pace: `F[0,1.2] shelf` by 0." in said
    assert "By straight ways they come to `F[0,1.2] shelf` at 0.9" in said
    assert "Without `F[0,1.2] shelf` the others may be kept." in said
    assert "were refined, too, and not certified" in said


def test_a_late_flight_at_a_low_pace_is_told_of_greater_ones() -> None:
    with pytest.raises(NotCertified, match=r"`planner.pace` is 0.3; a greater one, up to 1, flies faster."):
        certified_team(ltlplan.plan(room("F[0,1.2] dock", planner="planner: {pace: 0.3}")))
