"""Missions with bounds in seconds: planned, timed, certified, refused; and what reads their files."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import ltlplan
import verify
from flight.exports.crazyflies.fits import require_held
from flight.monitoring.monitor import Monitor
from flight.monitoring.timed_state import TimedState, both
from ltlplan.pipeline import Certified, certified_team
from tests.helpers.few import few_of
from tests.helpers.missions.timed_rooms import room
from verify.checked_claims import checked_certificate
from verify.data import BadInput, DoesNotFit, Mission, parse_formula
from verify.data.plan import plan_from_json
from verify.data.sections import Limits


@functools.cache
def dwelling() -> tuple[Certified, Mission]:
    mission = room("F[0,8] G[0,3] dock & F[9,14] shelf & G[0,12] !pit")
    return certified_team(ltlplan.plan(mission)), mission


def test_dwells_and_windows_are_planned_and_proved() -> None:
    certified, mission = dwelling()
    claims = [claim for claim in certified.certificate.claims if claim.name == "timing"]
    assert [claim.outcome for claim in claims] == ["holds"] * 3
    assert all(claim.unit == "s" and claim.bound is not None and claim.bound > 0 for claim in claims)
    assert mission.planner.pace == 1.0  # the greatest, as none is given
    assert certified.certificate.duration > 12  # the pit is avoided for as long as is asked
    assert certified.certificate.clock_error > 0  # the reference clock is one more


def test_samples_of_the_flight_keep_its_bounds() -> None:
    certified, mission = dwelling()
    times = np.arange(0, certified.certificate.duration, 0.005)
    points = np.array([certified.team["quad0"].evaluate(float(time))[:3] for time in times])
    inside = {name: mission.regions[name].level(points) <= 1 for name in mission.regions}
    first = times[inside["dock"]][0]
    assert first <= 8
    assert inside["dock"][(times >= first + 0.1) & (times <= first + 3)].all()
    assert inside["shelf"][(times >= 9) & (times <= 14)].any()
    assert not inside["pit"][times <= 12].any()


def test_hovers_are_read_back_from_the_plan() -> None:
    certified, mission = dwelling()
    assert certified.plan.hovers
    again = plan_from_json(certified.plan.to_json(), mission)
    assert again.hovers == certified.plan.hovers
    with pytest.raises(BadInput, match="'quad0' hovers in its visit 9, which the plan does not have"):
        plan_from_json(certified.plan.to_json().replace('"visit": 0,\n   "seconds"', '"visit": 9,\n   "seconds"'), mission)


def test_the_kernel_checks_bounds() -> None:
    certified, _ = dwelling()
    checked = checked_certificate(certified.plan, certified.team, certified.certificate)
    timing = [claim for claim in checked.verdict.claims if claim.name == "timing"]
    assert len(timing) == 3
    assert not any(claim.missing for claim in timing)
    assert all(claim.proof == "checked" for claim in checked.certificate.claims if claim.name == "timing")


def test_deadlines_decide_who_does_what() -> None:
    mission = room(
        "F[0,1.4] dock & F[0,1.4] shelf",
        more=", team: joint",
        agents="  quad1: {start: [0.4, 1.6, 1.0]}",
        planner="planner: {pace: 1}",
    )
    certified = certified_team(ltlplan.plan(mission))
    assert {name: [visit.region for visit in robot.visits] for name, robot in certified.plan.robots.items()} in (
        {"quad0": ["dock"], "quad1": ["shelf"]},
        {"quad0": ["dock"], "quad1": ["pit", "shelf"]},
    )


@pytest.mark.parametrize(
    ("formula", "more", "says"),
    [
        ("F[0,5] dock & F shelf", "", "under `team: own` the robots' letters are read in any order"),
        ("G F[0,9] dock", ", trace: infinite", "under `team: own` the robots' letters are read in any order"),
        ("F dock", ", team: joint, soft: [{formula: 'F[0,3] pit', weight: 1}]", "not supported in a soft specification"),
        ("F[5,2] dock", ", team: joint", "ends before it begins"),
    ],
)
def test_bounds_without_a_meaning_are_refused(formula: str, more: str, says: str) -> None:
    with pytest.raises(BadInput, match=says):
        room(formula, more=more, agents="  quad1: {start: [0.4, 1.6, 1.0]}")


def test_a_monitor_says_at_once_what_can_no_longer_be_met() -> None:
    state = TimedState([parse_formula("F[0,5] dock"), parse_formula("G[0,4] !pit")])
    nothing, dock, pit = ({"quad0": frozenset(letter)} for letter in ((), ("dock",), ("pit",)))
    assert [state.see(t, nothing) for t in (0.0, 2.0, 4.1, 4.9)] == ["open"] * 4
    assert state.to_do == ("F[0,5] dock until 5 s",)
    assert state.see(5.0, dock) == "satisfied"
    late = TimedState([parse_formula("F[0,5] dock")])
    late.see(0.0, nothing)
    assert late.see(4.99, nothing) == "open"
    assert late.see(5.11, nothing) == "violated"
    assert late.broken == "F[0,5] dock"
    bad = TimedState([parse_formula("G[0,4] !pit")])
    bad.see(0.0, nothing)
    assert bad.see(3.0, pit) == "violated"
    short = TimedState([parse_formula("G[0,4] !pit")])
    short.see(0.0, nothing)
    assert short.end(3.0) == "violated"  # nobody wins by landing
    assert both("open", "satisfied") == "open"


def test_a_monitor_says_what_is_open_until_when() -> None:
    mission = room("F[0,8] G[0,3] dock & G (dock -> F[0,20] shelf) & F[2,9] (shelf U[0,4] pit) & F pit")
    monitor = Monitor(mission, [], margin=None, measurement=0.0, planned_acceleration=0.0)
    here = np.array([mission.agents["quad0"].start]).T
    monitor.see(0.0, here, here)
    assert monitor.to_do == (
        "F[0,8] G[0,3] dock until 11 s", "G (dock -> F[0,20] shelf)", "F[2,9] (shelf U[0,4] pit) until 13 s", "F pit"
    )  # fmt: skip


def test_recordings_are_held_to_bounds() -> None:
    mission = room("F[0,3] dock")
    times = np.linspace(0.0, 6.0, 601)

    def recorded(arrives: float) -> verify.Verdict:
        x = np.interp(times, [0.0, arrives, 6.0], [0.4, 1.6, 1.6])
        positions = np.stack([x, np.full_like(x, 0.4), np.full_like(x, 1.0)], axis=1)
        return verify.check_samples(times, positions, mission, max_speed=1.5)

    assert recorded(2.5).outcome == "holds"
    late = recorded(5.0)
    assert late.outcome == "fails"
    assert "after its deadline" in late.sentence


def test_what_recordings_break_is_not_put_down_to_their_samples() -> None:
    times = np.linspace(0.0, 6.0, 601)
    x = np.interp(times, [0.0, 5.0], [0.4, 1.35])  # it ends at the dock's edge
    positions = np.stack([x, np.full_like(x, 0.4), np.full_like(x, 1.0)], axis=1)
    late = verify.check_samples(times, positions, room("F[0,3] dock & (F dock | G !dock) & G (dock -> F pit)"), max_speed=1.5)
    assert late.outcome == "fails"
    short = verify.check_samples(times, positions, room("G[0,9] !pit"), max_speed=1.5)
    assert short.outcome == "undecided"
    assert short.sentence.startswith("`G[0,9] !pit` holds only where the flight's last letter is held for 3 s")


def test_visits_after_a_time_are_hovered_for() -> None:
    certified = certified_team(ltlplan.plan(room("F[5,10] shelf")))
    assert certified.certificate.duration > 5
    assert certified.certificate.holds


@few_of(
    1,
    ("formula", "more", "agents"),
    [
        ("G[0,9] (quad0.dock -> F[0,5] quad1.dock) & F[0,8] quad0.dock", ", team: joint", "  quad1: {start: [1.0, 0.8, 1.0]}"),
        ("G[0,20] (dock -> F[0,3] !dock) & F[0,20] dock", "", ""),
    ],
)
def test_a_region_is_left_in_time_and_what_follows_goes_on_to_the_end(formula: str, more: str, agents: str) -> None:
    certified = certified_team(ltlplan.plan(room(formula, more=more, agents=agents)))
    timing = [claim.outcome for claim in certified.certificate.claims if claim.name == "timing"]
    assert timing == ["holds", "holds"]


def test_flights_are_flown_on_every_clock_however_far_these_are_apart() -> None:
    certified = certified_team(ltlplan.plan(room("F[0,5] dock", planner="clock_error: 0.5")))
    assert [claim.outcome for claim in certified.certificate.claims if claim.name == "timing"] == ["holds"]


def test_a_flight_with_bounds_is_one_part_and_exports_that_hold_fewer_pieces_say_so() -> None:
    certified, mission = dwelling()
    assert not any(path.cuts for path in certified.team.values())
    few = mission.changed(limits=Limits(pieces=2))
    with pytest.raises(DoesNotFit, match="Bounds in seconds count no pause between parts, so that it is one: stream it"):
        require_held(few, "quad0", certified.team["quad0"])


def test_what_is_waited_for_may_be_what_is_missing() -> None:
    mission = room("F[5.7,14] shelf & !dock U[0,3.1] dock & F (dock & F[1.5,7.3] dock)")
    assert certified_team(ltlplan.plan(mission)).certificate.holds


def test_a_monitor_counts_seconds_in_pauses_too() -> None:
    mission = room("F[0,5] dock")
    here, dock = np.array([[0.4], [0.4], [1.0]]), np.array([[1.6], [0.4], [1.0]])
    for arrives, verdict in ((4.9, "satisfies"), (5.5, "breaks")):
        monitor = Monitor(mission, [], margin=None, measurement=0.0, planned_acceleration=0.0)
        monitor.see(0.0, here, here)
        monitor.pause(3.0)
        monitor.see(arrives - 0.01, here, here)
        monitor.see(arrives, dock, dock)
        monitor.finish(6.0)
        assert [
            f"the flown path {verdict} the formula" in event.sentence for event in monitor.events if event.kind == "formula"
        ] == [True]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["wall-2", "doorpuzzle-1", "rover-2", "stlcg-1", "stlcg-2"])
def test_published_problems_with_deadlines_are_flown(name: str) -> None:
    result = ltlplan.run(name)
    assert all(claim.outcome == "holds" for claim in result.certificate.claims)
    assert sum(claim.name == "timing" for claim in result.certificate.claims) == len(result.mission.timed_parts)
    assert result.log.satisfied
    assert result.log.worst_error() < result.mission.margin
