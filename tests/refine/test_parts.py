"""Flights that a vehicle cannot hold at once, refined in parts: common rests of a team, laps that are uploaded once."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from ltlplan import plan
from ltlplan.pipeline import certified_team
from refine import refine
from tests.refine.test_laps import patrol
from verify import certify, judge
from verify.data import BadInput, DoesNotFit, Mission, Trajectory

ROW = {f"g{i}": {"center": (-1.5 + 1.0 * (i % 4), -1.0 + 1.0 * (i // 4), 1.0), "radii": (0.25, 0.25, 0.25)} for i in range(8)}


def row(formula: str, agents: dict, *, pieces: int = 8, **more) -> Mission:
    return Mission.model_validate(
        {
            "name": "row",
            "spec": {"formula": formula},
            "regions": ROW,
            "agents": agents,
            "vehicle": "crazyflie-2.1",
            "limits": {"pieces": pieces},
            "workspace": {"min": (-3.0, -3.0, 0.2), "max": (3.0, 3.0, 2.0)},
            "planner": {"iterations": 0},
            **more,
        }
    )


def joints(path: Trajectory) -> list[Fraction]:
    return [sum(map(Fraction, path.durations[:cut].tolist()), Fraction(0)) for cut in path.cuts]


def at_rest(path: Trajectory) -> bool:
    return all(np.abs(path.evaluate(path.knots[list(path.cuts)], order)).max() < 1e-3 for order in (1, 2, 3))


@pytest.mark.slow
def test_one_robot_rests_where_its_flight_is_cut() -> None:
    made = plan(row(" & ".join(f"F {name}" for name in ROW), {"q0": {"start": (-2.4, -1.4, 1.0)}}))
    with pytest.raises(DoesNotFit, match="the target holds 8"):
        refine(made)
    done = certified_team(made)
    path = done.team["q0"]
    assert path.cuts
    assert max(end - begin for begin, end in path.parts) <= 8
    assert at_rest(path)
    assert any(note.startswith("q0 flies ") and "parts" in note for note in done.plan.notes)


def test_a_team_is_cut_at_common_rests(pace: float | str) -> None:
    """q1 has a short way, rests at its end while q0 goes on, and is cut with it."""
    kinds = {"robots": {"busy": {}, "other": {}}}
    regions = {name: {**body, "only": ["busy"]} for name, body in ROW.items()} | {
        "h": {"center": (2.4, 2.4, 1.0), "radii": (0.25, 0.25, 0.25), "only": ["other"]}
    }
    agents = {"q0": {"start": (-2.4, -1.4, 1.0), "robot": "busy"}, "q1": {"start": (2.4, 0.0, 1.0), "robot": "other"}}
    asked = " & ".join(f"F {name}" for name in regions)
    done = certified_team(plan(row(asked, agents, pieces=10, regions=regions, **kinds), pace=pace))
    first, second = done.team.values()
    assert first.cuts
    assert joints(first) == joints(second)
    for path in (first, second):
        assert at_rest(path)
        assert max(end - begin for begin, end in path.parts) <= 10
    assert certify(done.plan, done.team, clock_error=0.02).holds
    pauses = [3.7] * len(first.cuts)
    paused = {"q0": first.paused(pauses), "q1": second.paused([pause + 0.02 for pause in pauses])}
    assert judge(done.plan, paused, largest=False).holds, "what is flown with pauses, and skew of the starts, is as certified"


@pytest.mark.slow
def test_laps_that_do_not_fit_are_flown_from_rest_to_rest() -> None:
    agents = {"q0": {"start": (-1.0, -1.5, 1.0)}}
    made = plan(patrol("G F west & G F east", repeat=10, agents=agents))
    moving = refine(made, max_pieces=1000)["q0"]
    done = certified_team(made)
    path = done.team["q0"]
    assert moving.cuts == ()
    assert path.cycle in path.cuts
    assert at_rest(path)
    assert len(path.flattened(10)) > 31
    assert max(end - begin for begin, end in path.parts) <= 31
    assert path.flown_parts(10)[-10:] == (len(path.parts) - 1,) * 10, "one lap is one part, which is started ten times"


def test_where_no_parts_are_found_the_flight_is_left_whole(pace: float | str) -> None:
    """Two robots with one goal each, whose ways have no point between start and goal at which both could rest."""
    two = {name: ROW[name] for name in ("g0", "g3")}
    regions = {**two, "between": {"center": (-1.95, -1.7, 1.0), "radii": (0.3, 0.3, 0.3)}}
    agents = {"q0": {"start": (-2.4, -2.4, 1.0)}, "q1": {"start": (2.4, -1.4, 1.0)}}
    done = certified_team(plan(row("F g0 & F g3 & G !between", agents, pieces=2, regions=regions), pace=pace))
    assert all(path.cuts == () for path in done.team.values())
    assert max(map(len, done.team.values())) > 2
    assert any("stream it" in note for note in done.plan.notes)


@pytest.mark.slow
def test_more_laps_than_files_hold_are_refused_with_how_many_do() -> None:
    made = plan(patrol("G F west & G F east", repeat=4000, agents={"q0": {"start": (-1.0, -1.5, 1.0)}}))
    with pytest.raises(BadInput, match=r"in 4000 laps, and files hold 4096: at most \d+ laps are written"):
        refine(made)


@pytest.mark.slow
def test_laps_of_a_team_are_cut_where_they_begin() -> None:
    """They rest there anyway: what is flown is what is flown of fewer laps."""
    made = plan(patrol("G F west & G F east & G F north", repeat=9))
    whole = refine(made, max_pieces=1000)
    for name, path in certified_team(made).team.items():
        assert path.cuts == (path.cycle,)
        assert path == Trajectory(whole[name].durations, whole[name].coefficients, cycle=path.cycle, cuts=path.cuts)


def test_what_holds_any_number_of_pieces_is_not_cut(pace: float | str) -> None:
    made = plan(row(" & ".join(f"F {name}" for name in ROW), {"q0": {"start": (-2.4, -1.4, 1.0)}}, pieces=4096, vehicle={
        **patrol("G F west").vehicle.model_dump(), "name": "streamed", "pieces": 4096,
    }), pace=pace)  # fmt: skip
    path = certified_team(made).team["q0"]
    assert len(path) > 8
    assert path.cuts == ()
