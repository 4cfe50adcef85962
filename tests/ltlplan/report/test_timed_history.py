"""Bounds in seconds on pages: what is drawn of the true formula, of slack, and of the point of no return."""

from __future__ import annotations

import functools

import pytest

import ltlplan
from ltlplan.pipeline import Certified, certified_team
from ltlplan.report.charts import label_chart, truth_chart
from ltlplan.report.history.bounds import serving, timed_bars, timed_stands, timed_truth
from ltlplan.report.history.letters import LetterInterval
from ltlplan.report.history.to_do import still_to_do
from ltlplan.report.replay import replay_of
from ltlplan.systems.due_visits import due_visits
from tests.helpers.missions.timed_rooms import room
from verify.data import parse_formula


@functools.cache
def flown() -> Certified:
    return certified_team(ltlplan.plan(room("F[0,8] G[0,3] dock & F[9,14] shelf & G[0,12] !pit")))


def spans(*ends: tuple[float, float, str]) -> dict[str, list[LetterInterval]]:
    return {"quad0": [LetterInterval(begin, end, frozenset(name.split())) for begin, end, name in ends]}


def test_sub_formulas_are_drawn_with_their_bounds() -> None:
    letters = spans((0.0, 2.0, ""), (2.0, 6.0, "dock"), (6.0, 10.0, ""))
    truth = timed_truth(parse_formula("F[0,3] dock & !G[0,1] dock"), letters, 10.0)
    found = {name: [(each.start, each.end) for each in mine] for name, mine in truth.items()}
    assert found["F[0,3] dock"] == [(0.0, 6.0)]
    assert found["G[0,1] dock"] == [(2.0, 5.0)]
    assert found["F[0,3] dock & !G[0,1] dock"] == [(0.0, 2.0), (5.0, 6.0)]


def test_parts_stand_by_their_bounds() -> None:
    parts = [parse_formula("F[0,3] dock"), parse_formula("G[0,4] !pit"), parse_formula("F[0,1] dock")]
    letters = spans((0.0, 2.0, ""), (2.0, 6.0, "dock"), (6.0, 10.0, ""))
    rows = timed_stands(parts, letters, [0.0, 1.5, 2.0, 5.0])
    assert [[how for _, how in row] for row in rows] == [
        ["open", "open", "open"],
        ["open", "open", "broken"],
        ["done", "open", "broken"],
        ["done", "done", "broken"],
    ]


@pytest.mark.slow
def test_the_list_of_what_is_to_do_names_the_true_formula() -> None:
    certified = flown()
    replay = replay_of(certified.plan, certified.team, certified.certificate)
    rows = still_to_do(certified.plan.mission, replay.playing.letters, replay.readings)
    assert [part for part, _ in rows[0][1]] == ["F[0,8] G[0,3] dock", "F[9,14] shelf", "G[0,12] !pit"]
    assert [how for _, how in rows[0][1]] == ["open"] * 3
    assert [how for _, how in rows[-1][1]] == ["done"] * 3
    assert [time for time, _ in rows] == sorted(time for time, _ in rows)


def test_slack_and_the_point_of_no_return_are_on_the_axis() -> None:
    certified = flown()
    mission, certificate = certified.plan.mission, certified.certificate
    slack = [claim.bound for claim in certificate.claims if claim.name == "timing"]
    rows, bars = timed_bars(certificate, certificate.duration)
    assert rows == ["F[0,8] G[0,3] dock", "F[9,14] shelf", "G[0,12] !pit"]
    later = [bar for bar in bars if "all may come" in bar.text]
    assert [bar.end - bar.start for bar in later] == pytest.approx(slack[:2])
    dock, shelf = due_visits(mission)
    first, second = (serving(mission, certificate.timelines, visit) for visit in (dock, shelf))
    assert first is not None
    assert second is not None
    assert (first.region, first.left, second.region, second.left) == ("dock", None, "shelf", "dock")
    assert first.begin <= first.latest < 8.0
    assert second.latest == pytest.approx(14.0 - 0.7 / mission.limits_of("quad0").speed)
    replay = replay_of(certified.plan, certified.team, certificate)
    chart = label_chart(certificate, replay.playing.letters, replay.end, None)
    assert "point of no return: at" in chart
    drawn = truth_chart(mission, replay.playing.letters, replay.readings, replay.end, None)
    assert "G[0,3] dock" in drawn
