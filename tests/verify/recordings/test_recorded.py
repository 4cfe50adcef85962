"""Recorded flights, claim by claim: true ones hold, and what samples cannot tell is left open."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from tests.helpers.few import few_of
from tests.helpers.live.recordings import aside, asked, claims, fires, gates, judged, recorded, refused
from tests.helpers.motion.flights import legs, plan_of, small_mission
from verify import FlightReference, Samples, certify, check_flight
from verify.data.plan import Visit
from verify.recordings.flight_reference import World
from verify.recordings.reachable_sets import Bounds, track


@few_of(1, "made", [fires, gates])
def test_a_true_flight_is_satisfied_in_every_claim(made):
    verdict = judged(made(), recorded(made()))
    assert verdict, [claim.sentence for claim in verdict.claims if claim.outcome != "holds"]
    names = {claim.name for claim in verdict.claims}
    assert {"tube", "transitions", "visits", "passages", "rims", "workspace"} <= names
    if made is fires:
        assert {"formula", "actions", "separation"} <= names


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(("gap", "keeps"), [(0.05, False), (0.299, False), (0.301, True), (1.0, True)])
def test_robots_that_pass_each_other_between_their_samples_are_as_near_as_their_lines(gap, keeps, turned):
    """Both fly 2 m past each other, hardly faster than they have to: seen 2 m apart before and 2 m apart afterwards."""
    mission = small_mission(regions="", starts=[[-1.0, gap, 1.0], [1.0, 0.0, 1.0]], extra="separation: 0.3")
    places = {"r0": np.array([[-1.0, gap, 1.0], [1.0, gap, 1.0]]), "r1": np.array([[1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]])}
    places = {name: rows[::-1] if turned else rows for name, rows in places.items()}
    verdict = check_flight(Samples(np.array([0.0, 2.0]), places), FlightReference.of_mission(mission), max_speed=1.0 + 1e-9)
    (claim,) = (claim for claim in verdict.claims if claim.name == "separation")
    assert (claim.outcome == "holds") == keeps
    assert claim.bound == pytest.approx(gap, abs=1e-3)
    assert claim.time == pytest.approx(1.0, abs=0.01)


@few_of(2, "missed", [None, 0, 1, 2])
def test_planned_actions_of_every_lap_are_judged_where_the_robot_then_was(missed):
    regions = """a: {center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}
b: {center: [0.0, 1.0, 1.0], radii: [0.2, 0.2, 0.2]}"""
    robot = """robot: {initial: dry, states: {dry: [], wet: [wet]}, actions: [{from: dry, to: wet, at: a}, {from: wet, to: dry, at: b}]}"""
    mission = small_mission("G F wet", regions=regions, margin=0.05, trace="infinite", extra=robot)
    mission = mission.model_copy(update={"spec": mission.spec.model_copy(update={"repeat": 3})})
    fill, empty = mission.robot.actions
    plan = plan_of(mission, {"r0": [Visit(region="a", actions=(fill,)), Visit(region="b", actions=(empty,))]})
    lasso = plan.robots["r0"].model_copy(update={"cycle_visit": 0})
    plan = plan.model_copy(update={"robots": {"r0": lasso}})
    path = legs([[0, 0, 1], [0, 0, 1.5], [1, 0, 1], [0, 1, 1], [0, 0, 1.5]], cycle=1)
    made = plan, {"r0": path}, certify(plan, {"r0": path})
    knot = float(path.knots[1])
    lap = path.duration - knot
    filled = next(action.time for action in made[2].actions if action.source == "dry")
    times = [filled + k * lap for k in range(3)]
    change = (lambda name, t, p: p) if missed is None else aside([0, 0, 0.5], times[missed], robot="r0")
    verdict = judged(made, recorded(made, change, end=knot + 3 * lap), max_speed=2.0)
    (claim,) = (claim for claim in verdict.claims if claim.name == "actions")
    assert claim.outcome == ("holds" if missed is None else "fails")
    if missed is not None:
        assert claim.time == pytest.approx(times[missed], abs=1e-6)
        assert (claim.witness.region, claim.witness.visit) == ("a", 0)


def test_cells_of_a_track_are_no_shorter_than_their_time_and_way():
    """However often gaps are halved: half their time, and half their chord, are bounded from above in exact numbers."""
    rng = np.random.default_rng(4)
    times, places = np.cumsum(rng.uniform(0.003, 2.0, 40)), rng.normal(size=(40, 3))
    cells = track("r0", times, places, Bounds(1e4, 0.0), start=float(times[0]), stop=float(times[-1])).cells()
    for _ in range(4):
        for gap, low, high, half, along in zip(cells.gap, cells.low, cells.high, cells.half, cells.along, strict=True):
            share = (Fraction(float(high)) - Fraction(float(low))) / 2
            assert share * (Fraction(float(times[gap + 1])) - Fraction(float(times[gap]))) <= Fraction(float(half))
            step = [Fraction(float(b)) - Fraction(float(a)) for a, b in zip(places[gap], places[gap + 1], strict=True)]
            assert share**2 * sum(x * x for x in step) <= Fraction(float(along)) ** 2
        cells = cells.halved()


def test_an_action_while_the_robot_was_not_seen_cannot_be_told():
    instant = fires()[2].actions[0].time
    hole = lambda name, t, p: np.where(((abs(t - instant) < 0.4) & (name == "quad0"))[:, None], np.nan, p)  # noqa: E731
    verdict = judged(fires(), recorded(fires(), hole))
    (action,) = (claim for claim in verdict.claims if claim.name == "actions")
    assert (action.outcome, action.witness.region) == ("undecided", "water")
    assert claims(verdict)["formula"] == {"undecided"}


@pytest.mark.parametrize(("begin", "cut"), [(0.9, 0.0), (0.0, 0.9)])
def test_a_recording_that_does_not_cover_the_flight_proves_no_tube(begin, cut):
    samples = recorded(fires(), begin=begin, end=fires()[2].duration - cut)
    verdict = judged(fires(), samples)
    assert claims(verdict)["tube"] == {"undecided"}
    where = [claim.time for claim in verdict.claims if claim.name == "tube"]
    assert all(time <= begin + 0.01 or time >= fires()[2].duration - cut - 0.01 for time in where)


def test_too_few_samples_cannot_tell_and_a_hole_neither():
    assert judged(gates(), recorded(gates(), rate=3)).outcome == "undecided"
    holed = recorded(fires(), lambda name, t, p: np.where(((t > 3) & (t < 4) & (name == "quad0"))[:, None], np.nan, p))
    verdict = judged(fires(), holed)
    assert verdict.outcome == "undecided"
    tubes = {claim.robot: claim for claim in verdict.claims if claim.name == "tube"}
    assert tubes["quad0"].outcome == "undecided"
    assert 3 <= tubes["quad0"].time <= 4
    assert tubes["quad1"].outcome == "holds"


def test_time_is_aligned_for_the_whole_team_and_never_robot_by_robot():
    def late(name, times, places):
        by = 0.6 if name == "quad0" else 0.0
        return fires()[1][name].evaluate(np.maximum(times - by, 0))[:, :3]

    for start in (None, 0.0, 0.6):
        assert not judged(fires(), recorded(fires(), late), start=start)
    together = recorded(
        fires(), lambda name, t, _: fires()[1][name].evaluate(np.maximum(t - 0.6, 0))[:, :3], end=fires()[2].duration + 1
    )
    unknown = judged(fires(), together, start=None)
    assert unknown.alignment.fitted == pytest.approx(0.6, abs=0.01)
    assert claims(unknown)["tube"] == claims(unknown)["actions"] == {"undecided"}
    assert claims(unknown)["separation"] == claims(unknown)["workspace"] == {"holds"}
    assert judged(fires(), together, start=0.6)
    assert judged(fires(), together, start=0.0).outcome == "fails"
    plan, team, certificate = fires()
    lenient = replace(FlightReference.of_certificate(certificate, team, plan), clock_error=0.65)
    trusted = check_flight(together, lenient, max_speed=1.2)
    assert trusted.alignment.trusted
    assert "undecided" in claims(trusted)["tube"]  # not for every start from 0 to 0.6 s


def test_a_fitted_start_is_stated_with_its_interval():
    verdict = judged(gates(), recorded(gates()), start=None)
    assert verdict
    assert verdict.alignment.low <= 0 <= verdict.alignment.high
    assert verdict.alignment.high - verdict.alignment.low >= 0.01
    assert any("cannot be told apart" in sentence for sentence in verdict.assumptions)
    assert verdict.to_dict()["start"]["fitted"] == verdict.alignment.fitted


def test_assumptions_are_stated():
    said = " ".join(judged(fires(), recorded(fires()), error=0.001).assumptions)
    for what in ("lasts", "1.2 m/s", "0.001 m", "began at 0 s", "planned actions"):
        assert what in said
    assert f"(as planned, {fires()[2].duration:.4f} s)" in said


def test_where_the_start_is_not_known_all_of_the_recording_is_judged_and_that_is_said():
    late = recorded(fires(), lambda name, t, _: fires()[1][name].evaluate(np.maximum(t - 2, 0))[:, :3], end=12.0)
    verdict = judged(fires(), late, start=None)
    assert not verdict.alignment.trusted
    assert any("12.0000 s of the recording (all of it)." in sentence for sentence in verdict.assumptions)


def test_rows_after_the_end_of_the_flight_are_not_judged_and_that_is_said():
    end = fires()[2].duration

    def landing(name, times, places):
        return places - np.maximum(times - end - 0.5, 0)[:, None] * np.array([0, 0, 1.0])

    verdict = judged(fires(), recorded(fires(), landing, end=end + 2))
    assert verdict
    assert any("rows beyond are not judged" in sentence for sentence in verdict.assumptions)


def test_what_is_given_as_float32_or_lists_is_judged_in_float64():
    given = recorded(gates())
    short = {name: places.astype(np.float32) for name, places in given.positions.items()}
    wide = {name: places.astype(np.float64) for name, places in short.items()}
    lists = {name: places.tolist() for name, places in wide.items()}
    bounds = [
        [claim.bound for claim in judged(gates(), Samples(times, positions)).claims]
        for times, positions in ((given.times, wide), (given.times, short), (given.times.tolist(), lists))
    ]  # fmt: skip
    assert bounds[0] == bounds[1] == bounds[2]


def test_digits_that_a_recording_lacks_are_an_error_as_well():
    exact = judged(gates(), recorded(gates()))
    coarse = judged(gates(), replace(recorded(gates()), rounding=(0.0005, 0.0005)))
    bound = {v: next(c.bound for c in v.claims if c.name == "tube") for v in (exact, coarse)}
    assert bound[coarse] > bound[exact] + 5e-4


def test_a_region_that_the_robot_does_not_start_in_is_visited_from_the_first_row_on():
    """The plan starts 0.8 m in front of the gate; who is in it when the recording begins has come to it."""
    plan = gates()[0]
    free = replace(asked(gates()), plan=plan_of(plan.mission, {"quad0": plan.robots["quad0"].visits[1:]}))
    inside = float(np.argmax(gates()[1]["quad0"].evaluate(np.arange(0, 8, 0.001))[:, 0] >= 0)) / 1000
    free = replace(free, team=None)
    verdict = check_flight(recorded(gates(), begin=inside), free, max_speed=1.2)
    assert refused(verdict, "visits").region == "gate0"
    whole = check_flight(recorded(gates(), begin=inside), replace(free, plan=plan), max_speed=1.2)
    assert claims(whole)["visits"] == {"holds"}
    there = plan.mission.agents["quad0"].model_copy(update={"start": (0.0, 0.0, 1.0)})
    starts = FlightReference(
        (World(0.0, plan.mission.model_copy(update={"agents": {"quad0": there}})),), plan=free.plan, margin=0.05
    )
    assert claims(check_flight(recorded(gates(), begin=inside), starts, max_speed=1.2))["visits"] == {"holds"}


def filled_before(samples: Samples, begin: float, filled: float) -> Samples:
    """Return a log from `begin` on in which quad0 carries water from `filled` on."""
    kept = samples.times >= begin
    letters = {
        name: [frozenset({"carrying"} if name == "quad0" and t >= filled else ()) for t in samples.times[kept]]
        for name in samples.positions
    }
    return Samples(samples.times[kept], {name: p[kept] for name, p in samples.positions.items()}, letters)


def test_what_a_log_shows_first_came_about_since_the_flight_began():
    """A log that begins with the action done says that it was made before, where it may have been made."""
    visit = next(span for span in fires()[2].timelines["quad0"].changes if span.region == "water" and span.status == "must")
    enters, instant = float(visit.time.high), fires()[2].actions[0].time
    for begin, wanted in ((instant + 0.05, "undecided"), (0.2, "fails")):
        verdict = judged(fires(), filled_before(recorded(fires()), begin, begin), start=0.0)
        assert "fails" not in claims(verdict)["transitions"]
        action = next(c for c in verdict.claims if c.name == "actions" and c.robot == "quad0")
        assert action.outcome == wanted
        assert claims(verdict)["formula"] == {wanted}
    between = judged(fires(), filled_before(recorded(fires()), 0.0, instant), start=instant - 0.005)
    assert claims(between)["actions"] == {"holds"}
    assert enters < instant


def test_an_action_that_is_due_after_a_logs_last_row_may_have_been_made():
    instant = fires()[2].actions[0].time
    verdict = judged(fires(), filled_before(recorded(fires(), end=instant - 0.1), 0.0, instant))
    assert next(c.outcome for c in verdict.claims if c.name == "actions" and c.robot == "quad0") == "undecided"


# -- against continuous paths that agree with the samples -------------------------------------------------------
