"""Published case studies for teams: their formulas on places of ours, planned to the cheapest words, flown and certified."""

from __future__ import annotations

import pytest

import ltlplan
from ltlplan.allocation import Allocation
from ltlplan.pipeline import certified_team
from ltlplan.reproduction import published
from ltlplan.search.exact import assign
from tests.helpers.few import few_of
from verify import check_team
from verify.data import Mission

CASES = {case.id: case for case in published.CASES}


def planned(case: str) -> tuple[Mission, Allocation]:
    """Return a case and its words, which hold in every order unless robots wait for each other."""
    mission = CASES[case].mission()
    plan = assign(mission)
    words = {name: robot.word for name, robot in plan.robots.items()}
    laps = mission.spec.trace == "infinite"  # what they show depends on their times: the certificate says it
    assert laps or plan.meetings or check_team(mission.formula, words, team=mission.spec.team).sequential
    return mission, plan


@few_of(
    2,
    ("case", "cost"),
    [
        ("bai-second", 19.424),
        ("schillinger-second", 84.0),
        ("schillinger-second-joint", 84.0),
        ("schillinger-third", 38.0),
        pytest.param("schillinger-third-joint", 43.083, marks=pytest.mark.slow),
        ("five-gather", 30.828),
        ("ten-meet", 73.484),
        ("thirty-meet", 241.030),
    ],
)
def test_published_cases_are_planned_to_the_cheapest_words(case: str, cost: float) -> None:
    _, plan = planned(case)
    assert plan.complete
    assert plan.cost == pytest.approx(cost, abs=1e-3)


@few_of(
    2,
    ("case", "cost"),
    [
        ("bai-first", 12.236),
        ("lomap-fifth", 10.236),
        ("meeting", 11.606),
        ("meeting-longest", 5.803),
    ],
)
def test_laps_of_published_cases_are_the_cheapest(case: str, cost: float) -> None:
    _, plan = planned(case)
    assert plan.cost == pytest.approx(cost, abs=1e-3)
    assert plan.complete
    assert plan.lower_bound == pytest.approx(cost, abs=1e-3)
    assert all(robot.cycle_visit is not None for robot in plan.robots.values())


def test_what_is_picked_up_is_carried_to_its_desk_around_public_places() -> None:
    _, plan = planned("schillinger-second")
    carried: list[str] = []
    for robot in plan.robots.values():
        word = robot.word.prefix
        assert not any("carry" in letter and letter & {"n6_5", "n7_5"} for letter in word)
        carried += [name for letter in word for name in letter if name.startswith("left") and "d" + name[4:] in letter]
    assert set(carried) == {"left5", "left7", "left10"}


@pytest.mark.parametrize("case", ["five-gather", "ten-meet"])
def test_those_who_gather_wait_for_each_other(case: str) -> None:
    _, plan = planned(case)
    assert plan.meetings


@pytest.mark.slow
@pytest.mark.parametrize("case", [case.id for case in published.CASES if case.flown])
def test_published_cases_are_flown_and_certified(case: str) -> None:
    done = certified_team(ltlplan.plan(CASES[case].mission()))
    assert done.certificate.holds
    for name, path in done.team.items():
        assert max(end - begin for begin, end in path.parts) <= 31, f"a Crazyflie does not hold what {name} flies"
