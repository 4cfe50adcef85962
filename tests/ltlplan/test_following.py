"""A team is slowed where its simulated flight strays, three times at most; then its nominal times are tried."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import flight
import ltlplan
import verify
from flight import Conditions
from ltlplan.following import RESERVE, followed
from ltlplan.pipeline import attempted, certified_team
from ltlplan.replanning.cuts import Candidate, Certified, Conflict, Flight
from refine import refine
from tests.helpers.few import few_of
from tests.helpers.missions.random_missions import random_mission
from tests.helpers.motion.plans_by_hand import ball, room, straight
from verify.data import Infeasible, NotCertified, Plan, Witness
from verify.data.sections import Agent, Planner
from verify.data.shapes.region import Region

MARGIN = 0.05
ALLOWED = (1.0 - RESERVE) * MARGIN


def made(pace: float | str = 1.0, cost: str = "length") -> Plan:
    """Return a straight flight through a ball, its time planned as the mission's pace says."""
    regions: dict[str, Region] = {"a": ball(0, 0)}
    planner = Planner.model_validate({"pace": pace, "cost": {cost: 1.0}})
    mission = room(regions, {"q": Agent(start=(-1.5, 0.0, 1.0))}, margin=MARGIN, planner=planner)
    return Plan(mission=mission, robots={"q": straight((-1.5, 0, 1), (0, 0, 1), (1.5, 0, 1), visits={1: "a"})})


def certified(pace: float | str = 1.0, cost: str = "length") -> Certified:
    """Return the flight with its certificate, and costs that weigh its time."""
    found = attempted(Candidate(made(pace, cost)))
    assert isinstance(found, Flight)
    return Certified(found.plan, found.team, found.certificate, 1)


class Simulation:
    """Flights whose greatest errors are scripted, at the middle of each flight."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *errors: float) -> None:
        self.errors, self.flown = list(errors), list[dict[str, Any]]()
        monkeypatch.setattr(flight, "fly", self)

    def __call__(self, plan: Plan, team: dict[str, Any], certificate: Any, **_: object) -> SimpleNamespace:
        assert certificate.holds
        worst = self.errors[len(self.flown)]
        self.flown.append(team)
        times = np.linspace(0.0, team["q"].duration, 201)
        error = worst * np.exp(-(((times - times[100]) / 0.1) ** 2))[:, None]
        return SimpleNamespace(times=times, error=error, worst_error=lambda: worst, plan=plan)


def nominal(candidate: Candidate) -> Flight | Conflict:
    assert candidate.pace == "nominal"
    return attempted(candidate)


def never(candidate: Candidate) -> Flight | Conflict:
    raise AssertionError(candidate)


follow: Callable[..., tuple[Certified, Any]] = partial(followed, seed=0, conditions=Conditions())


def test_a_team_that_stays_within_its_reserve_is_flown_as_planned(monkeypatch: pytest.MonkeyPatch) -> None:
    before, simulation = certified(), Simulation(monkeypatch, 0.99 * ALLOWED)
    done, log = follow(before, never)
    assert done is before
    assert (log.worst_error(), len(simulation.flown)) == (0.99 * ALLOWED, 1)


def test_nominal_times_are_flown_as_planned(monkeypatch: pytest.MonkeyPatch) -> None:
    before, simulation = certified("nominal"), Simulation(monkeypatch, 3 * MARGIN)
    assert follow(before, never)[0] is before
    assert len(simulation.flown) == 1


def test_a_team_is_slowed_where_it_strays_until_it_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    before, simulation = certified(cost="time"), Simulation(monkeypatch, 1.2 * ALLOWED, 1.05 * ALLOWED, 0.9 * ALLOWED)
    done, log = follow(before, never)
    lasts = [team["q"].duration for team in simulation.flown]
    assert lasts == sorted(set(lasts))
    assert lasts[-1] < 2.0 * lasts[0]
    assert done.team == simulation.flown[-1]
    assert log.plan == done.plan
    assert done.certificate.to_json() == verify.judge(done.plan, done.team).to_json()
    assert [note for note in done.plan.notes if "a robot strays 48.0 mm; 80 % of the margin are allowed" in note] == [
        *done.plan.notes[-1:]
    ]
    assert done.plan.cost == pytest.approx(before.plan.cost + lasts[-1] - lasts[0])


def test_nominal_times_are_tried_after_three_rounds(monkeypatch: pytest.MonkeyPatch) -> None:
    before, simulation = certified(cost="time"), Simulation(monkeypatch, *[1.5 * MARGIN] * 4, 1.1 * ALLOWED)
    done, log = follow(before, nominal)
    assert len(simulation.flown) == 5
    assert log.worst_error() == 1.1 * ALLOWED
    assert done.team == refine(made(), pace="nominal") == simulation.flown[-1]
    assert "the plan's own times are flown" in done.plan.notes[-1]
    assert done.plan.cost == pytest.approx(before.plan.cost + done.team["q"].duration - before.team["q"].duration)


@few_of(2, ("share", "planned", "kept"), [(0.9, True, 0.9), (0.9, False, 0.9), (1.2, False, 1.2), (1.2, True, 1.3)])
def test_where_no_flight_keeps_the_reserve_the_best_within_the_margin_is_kept_and_else_the_planned_times(
    share: float, planned: bool, kept: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    errors = [(share + more) * MARGIN for more in (0.2, 0.0, 0.1, 0.1, 0.1)]
    simulation = Simulation(monkeypatch, *errors)

    def refused(candidate: Candidate) -> Flight | Conflict:
        return nominal(candidate) if planned else Conflict(Infeasible("No flight."))

    done, log = follow(certified(), refused)
    assert len(simulation.flown) == 4 + planned
    assert log.worst_error() == pytest.approx(kept * MARGIN)
    assert done.certificate.holds


def test_a_flight_that_is_slower_than_the_planned_times_gives_way_to_them(monkeypatch: pytest.MonkeyPatch) -> None:
    before = certified()
    slow = refine(made(), pace=0.05)
    monkeypatch.setattr("refine.slowing.slowed_at", lambda _team, _dips: slow)
    simulation = Simulation(monkeypatch, 1.2 * MARGIN, 0.5 * ALLOWED, 0.5 * ALLOWED)
    done, _ = follow(before, nominal)
    assert simulation.flown[1:] == [slow, done.team]
    assert done.team == certified("nominal").team
    assert before.certificate.duration < done.certificate.duration < slow["q"].duration
    assert any("the flight is no shorter: the plan's own times are flown" in note for note in done.plan.notes)


def test_nominal_times_are_refined_until_they_are_certified(monkeypatch: pytest.MonkeyPatch) -> None:
    Simulation(monkeypatch, *[1.5 * MARGIN] * 4, 0.5 * MARGIN)
    seen: list[tuple[Witness, ...]] = []

    def refused_once(candidate: Candidate) -> Flight | Conflict:
        seen.append(candidate.witnesses)
        found = nominal(candidate)
        assert isinstance(found, Flight)
        if len(seen) > 1:
            return found
        tight = candidate.plan.changed(mission=candidate.plan.mission.changed(margin=0.31))  # more than the ball has room for
        return Flight(found.plan, found.team, verify.judge(tight, found.team))

    done, _ = follow(certified(), refused_once)
    assert len(seen) == 2
    assert not seen[0]
    assert seen[1]
    assert done.certificate.holds
    assert done.rounds == 3


def test_a_team_whose_slower_flight_is_not_certified_goes_on_to_nominal_times(monkeypatch: pytest.MonkeyPatch) -> None:
    before = certified()
    simulation = Simulation(monkeypatch, 1.5 * MARGIN, 0.5 * MARGIN)
    judge = verify.judge

    def endured(plan: Plan, team: dict[str, Any], **options: Any) -> Any:
        lasts = team["q"].duration
        short = 11.0 + (0.9 * lasts if before.team["q"].duration < lasts < 0.9 * made().robots["q"].times[-1] else 1.1 * lasts)
        limits = plan.mission.limits.model_copy(update={"endurance": short})
        return judge(plan.changed(mission=plan.mission.changed(limits=limits)), team, **options)

    monkeypatch.setattr(verify, "judge", endured)
    done, _ = follow(before, nominal)
    assert len(simulation.flown) == 2
    assert done.team == refine(made(), pace="nominal")


GUSTY = """
format: 1
name: gusty
spec: {formula: F a & F b}
regions:
  a: {center: [0.8, 0.9, 1.2], radii: [0.3, 0.3, 0.3]}
  b: {center: [1.0, -0.9, 0.9], radii: [0.3, 0.3, 0.3]}
agents: {quad0: {start: [-1.2, 0, 1]}}
vehicle: crazyflie-2.1
workspace: {min: [-2.5, -2.5, 0.2], max: [2.5, 2.5, 2]}
margin: 0.05
planner: {pace: 1}
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("conditions", "slowed"),
    [
        (Conditions(wind="1"), False),
        (Conditions(controller="lee"), True),
        (Conditions(wind="2+1"), True),
        (Conditions(wind="4+2"), True),
    ],
)
def test_a_flight_is_slowed_for_its_controller_and_its_wind(conditions: Conditions, slowed: bool) -> None:
    team = certified_team(ltlplan.plan(ltlplan.parse_mission(GUSTY)))
    alone = flight.fly(team.plan, team.team, team.certificate, seed=0, conditions=conditions)
    done, log = follow(team, attempted, conditions=conditions)
    assert done.certificate.to_json() == verify.judge(done.plan, done.team).to_json()
    assert done.certificate.holds
    assert (alone.worst_error() > ALLOWED) == (done.team["quad0"].duration > team.team["quad0"].duration) == slowed
    assert log.worst_error() <= alone.worst_error()


@pytest.mark.slow
def test_a_flight_that_no_slowing_keeps_in_its_tube_is_not_exported(tmp_path: Path) -> None:
    team = certified_team(ltlplan.plan(ltlplan.parse_mission(GUSTY)))
    done, log = follow(team, attempted, conditions=Conditions(controller="profile", noise=0.001, wind="4+2"))
    assert done.certificate.holds
    assert log.tube == "outside"
    with pytest.raises(NotCertified, match="strayed"):
        flight.export(done.team, done.certificate, tmp_path / "files", flight=log)


@few_of(1, ("seed", "robots", "paces"), [(1, 2, (0.7,)), *((seed, None, (0.7, 1.0)) for seed in range(12))])
@pytest.mark.slow
def test_flights_of_random_missions_keep_their_reserve_and_are_no_slower_than_planned(
    seed: int, robots: int | None, paces: tuple[float, ...]
) -> None:
    mission = random_mission(seed, robots=robots, samples=20, rounds=2)
    nominal = ltlplan.run(mission, pace="nominal")
    for pace in paces:
        done = ltlplan.run(mission, pace=pace)
        assert done.certificate.holds
        assert done.log.worst_error() <= max((1.0 - RESERVE) * mission.margin, nominal.log.worst_error())
        assert done.certificate.duration <= nominal.certificate.duration
