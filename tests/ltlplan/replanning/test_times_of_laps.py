"""Missions whose laps are bounded in seconds: planned, paced, certified for ever, refused; and what reads their files."""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np
import pytest

import ltlplan
import refine
from flight.monitoring.timed_state import TimedState
from ltlplan.pipeline import Certified, certified_team
from ltlplan.report.summary import timing_sentences
from tests.ltlplan.replanning.test_times import room
from verify.checked_claims import checked_certificate
from verify.data import Infeasible, Mission, NotCertified, parse_formula
from verify.data.files.mission_file import parse_mission
from verify.data.plan import Hover
from verify.testing.assertions import assert_satisfies

INFINITE = ", trace: infinite, repeat: 2"
PAGE = Path(__file__).resolve().parents[3] / "docs" / "time.md"
ANOTHER = "  quad1: {start: [0.4, 1.6, 1.0]}"


def patrol(formula: str) -> Certified:
    return certified_team(ltlplan.plan(room(formula, more=INFINITE)))


@functools.cache
def dwelling() -> tuple[Certified, Mission]:
    section = PAGE.read_text(encoding="utf-8").partition("## Laps for ever")[2]
    mission = parse_mission(section.partition("```yaml\n")[2].partition("```")[0])
    return certified_team(ltlplan.plan(mission)), mission


def lap_of(certified: Certified) -> float:
    path = certified.team["quad0"]
    assert path.cycle is not None
    return path.duration - float(path.knots[path.cycle])


def timing(certified: Certified) -> list[str]:
    return [claim.outcome for claim in certified.certificate.claims if claim.name == "timing"]


@pytest.mark.slow
def test_a_patrol_is_flown_as_gently_as_its_bounds_allow() -> None:
    loose, tight = (patrol(f"G F[0,{most}] dock & G F[0,{most}] shelf") for most in (9, 2.5))
    assert timing(loose) == timing(tight) == ["holds", "holds"]
    assert lap_of(tight) < 2.5 < lap_of(loose)
    assert lap_of(tight) > 2.25  # slower than at pace 1, at which nothing would be left over


def test_a_patrol_that_is_asked_for_too_often_is_refused_with_what_it_misses() -> None:
    with pytest.raises(
        NotCertified, match=r"The least that these words miss at this pace: `G F\[0,2\] dock` by 0\.\d+ s"
    ) as error:
        patrol("G F[0,2] dock & G F[0,2] shelf")
    assert "after its deadline" in str(error.value)


def test_returns_that_no_lap_can_make_are_refused_at_once() -> None:
    for more in ("G F[0,9] shelf", "G F shelf", "G F[0,9] G[0,2] shelf"):
        with pytest.raises(Infeasible, match=r"`G F\[0,0.65\] dock` cannot hold: .*, shelf and back take 0\.7 s, 0\.05 s more"):
            ltlplan.plan(room(f"G F[0,0.65] dock & {more}", more=INFINITE))
    with pytest.raises(Infeasible, match=r"`G F\[0,0.3\] dock` cannot hold: .* quad0 comes there at 0\.\d+ s"):
        ltlplan.plan(room("G F[0,0.3] dock", more=INFINITE))


@pytest.mark.slow
def test_the_mission_of_the_page_keeps_its_dwells_and_responses_in_every_lap() -> None:
    certified, _ = dwelling()
    assert timing(certified) == ["holds", "holds"]
    assert [(hover.robot, hover.visit) for hover in certified.plan.hovers] == [("quad0", 0)]
    assert any("laps follow one another without a wait" in line for line in timing_sentences(certified.certificate))


def test_samples_of_many_laps_keep_their_bounds() -> None:
    certified, mission = dwelling()
    path = certified.team["quad0"].flattened(6)
    times = np.arange(0, path.duration, 0.01)
    points = np.array([path.evaluate(float(time))[:3] for time in times])
    inside = {name: mission.regions[name].level(points) <= 1 for name in ("dock", "shelf")}
    starts = [times[i] for i in range(len(times) - 220) if inside["dock"][i : i + 199].all()]
    assert np.diff([0.0, *starts]).max() <= 9
    shelf = times[inside["shelf"]]
    assert all(((shelf >= time) & (shelf <= time + 6)).any() for time in times[inside["dock"]] if time < path.duration - 6)


def test_the_kernel_leaves_bounds_of_laps_to_the_judge() -> None:
    certified, _ = dwelling()
    checked = checked_certificate(certified.plan, certified.team, certified.certificate).certificate
    assert [claim.proof for claim in checked.claims if claim.name == "timing"] == ["judged", "judged"]
    assert [claim.proof for claim in checked.claims if claim.name == "formula"] == ["checked"]


def test_assertions_know_bounds_of_laps() -> None:
    certified, mission = dwelling()
    path = certified.team["quad0"]
    assert_satisfies(path, "G F[0,9] G[0,2] dock", mission)
    with pytest.raises(AssertionError, match=r"asked at .* s, `G\[0,2\] dock` comes at .* s, .* s after its deadline"):
        assert_satisfies(path, "G F[0,4] G[0,2] dock", mission)


@pytest.mark.slow
def test_teams_are_slowed_as_a_whole_and_counted() -> None:
    mission = room("G F[0,8] count(dock | shelf) >= 2 & G F[0,12] quad0.free", more=f", team: joint{INFINITE}", agents=ANOTHER)
    certified = certified_team(ltlplan.plan(mission))
    assert timing(certified) == ["holds", "holds"]
    assert not certified.plan.hovers
    assert {path.duration for path in certified.team.values()} == {certified.certificate.duration}


def test_a_monitor_leaves_laps_open_and_says_what_can_no_longer_be_met() -> None:
    nothing, dock = ({"quad0": frozenset(letter)} for letter in ((), ("dock",)))
    state = TimedState([parse_formula("G F[0,5] dock")])
    assert [state.see(time, letter) for time, letter in ((0.0, nothing), (4.0, dock), (5.0, nothing), (9.0, nothing))] == [
        "open"
    ] * 4
    assert state.end(9.5, finite=False) == "open"
    late = TimedState([parse_formula("G F[0,5] dock")])
    assert [late.see(time, letter) for time, letter in ((0.0, dock), (1.0, nothing), (5.9, nothing))] == ["open"] * 3
    assert late.see(6.2, nothing) == "violated"


@pytest.mark.slow
def test_hovers_of_a_plan_are_flown_in_the_part_of_a_team_s_laps_that_they_belong_to() -> None:
    made = ltlplan.plan(room("F quad0.pit & G F quad0.dock & G F quad0.shelf", more=f", team: joint{INFINITE}", agents=ANOTHER))
    robot = made.robots["quad0"]
    assert robot.cycle_visit is not None
    assert 0 < robot.cycle_visit < len(robot.visits)

    def lasts(*hovers: Hover) -> tuple[float, float]:
        path = refine.refine(made.model_copy(update={"hovers": hovers}), max_pieces=40)["quad0"]
        assert path.cycle is not None
        return float(path.knots[path.cycle]), path.duration - float(path.knots[path.cycle])

    once, again = lasts()
    before, _ = lasts(Hover(robot="quad0", visit=0, seconds=2.0))
    _, within = lasts(Hover(robot="quad0", visit=len(robot.visits) - 1, seconds=2.0))
    assert before > once + 1.5
    assert within > again + 1.5


@pytest.mark.slow
def test_a_team_hovers_in_its_laps_for_dwells() -> None:
    """Robots that visit more than one place hover where a dwell is asked for; laps of all are as long as those of the robot that needs longest."""
    mission = room(
        "G F[0,20] G[0,5] dock & G F[0,20] G[0,5] pit & G F[0,20] shelf", more=f", team: joint{INFINITE}", agents=ANOTHER
    )
    certified = certified_team(ltlplan.plan(mission))
    begins = {name: robot.cycle_visit or 0 for name, robot in certified.plan.robots.items()}
    assert any(hover.visit >= begins[hover.robot] for hover in certified.plan.hovers)
    assert timing(certified) == ["holds"] * 3
    assert {path.duration for path in certified.team.values()} == {certified.certificate.duration}
