"""Recorded flights in a world that changed: every region is where it was at that time, and the last formula is asked of all."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import strategies as st

from ltlplan import judge_flight
from tests.helpers.few import given_few
from tests.helpers.live.recordings import claims, dense, refused
from tests.helpers.motion.flights import plan_of, small_mission
from verify import FlightReference, Samples, check_flight, load_reference
from verify.data import BadInput, mission_to_yaml
from verify.data.events import HoopMoves, NewFormula, ObstacleAppears, RobotJoins, RobotLeaves, events_to_json, load_events
from verify.data.plan import Visit
from verify.data.sections import Agent
from verify.data.shapes.obstacle import Obstacle
from verify.recordings.flight_reference import Joined, World, of_events

ELSEWHERE = (0.0, 3.0, 1.0)
CORNERS = np.array([(0.0, 0.0, 1.0), (2.0, 0.0, 1.0), (2.0, 2.0, 1.0)])
"""At 0.5 m/s past `a` at (1, 0, 1), in it from 1.6 to 2.4 s, to the place from which nothing is near."""


def flown(robots=1, corners=CORNERS, rate=100.0, apart=1.5) -> Samples:
    legs = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    at = np.r_[0.0, np.cumsum(legs)] / 0.5
    times = np.arange(0, at[-1] + 0.5 / rate, 1 / rate)
    path = dense(times, at, corners)
    return Samples(times, {f"r{i}": path - [0, 0, apart * i] for i in range(robots)})


def verdict(mission, *events, samples=None):
    return check_flight(flown() if samples is None else samples, of_events(mission, events), max_speed=0.8, start=0.0)


def moves(time, center=ELSEWHERE):
    return HoopMoves(time=time, region="a", center=center)


def test_what_was_visited_where_it_was_then_counts():
    mission = small_mission("F a")
    assert verdict(mission, moves(5.0))
    late = check_flight(flown(), FlightReference.of_mission(moves(0).apply(mission)), max_speed=0.8, start=0.0)
    assert claims(late)["formula"] == {"fails"}  # the last world alone says the contrary


def test_what_moves_to_where_the_robot_was_does_not_count():
    mission = small_mission("F a", regions="a: {center: [0.0, 3.0, 1.0], radii: [0.2, 0.2, 0.2]}")
    late = moves(5.0, (1.0, 0.0, 1.0))
    assert claims(verdict(mission, late))["formula"] == {"fails"}
    assert check_flight(
        flown(), FlightReference.of_mission(late.apply(mission)), max_speed=0.8, start=0.0
    )  # so says the last world alone
    assert claims(verdict(mission, moves(1.0, (1.0, 0.0, 1.0))))["formula"] == {"holds"}


def test_a_region_that_moves_onto_a_robot_is_entered_then():
    mission = small_mission(
        "!a U b", regions="a: {center: [0, 3, 1], radii: [0.2, 0.2, 0.2]}\nb: {center: [2, 1, 1], radii: [0.2, 0.2, 0.2]}"
    )
    assert verdict(mission)
    broken = verdict(mission, moves(3.0, (1.5, 0.0, 1.0)))
    assert refused(broken, "formula").time == pytest.approx(3.0, abs=0.02)


def test_the_last_formula_is_asked_of_the_whole_flight():
    mission = small_mission("F a")
    assert refused(verdict(mission, NewFormula(time=6.0, formula="F a & G !a")), "formula").time == pytest.approx(1.6, abs=0.02)
    assert verdict(small_mission("G !a"), NewFormula(time=1.0, formula="F a"))


def test_a_robot_that_leaves_holds_its_last_letter_and_may_land():
    mission = small_mission("F(a & F G a)", starts=((0, 0, 1), (0, 0, -0.5)), extra="separation: 0.3")
    samples = flown(2)
    down = samples.positions["r0"] - np.maximum(samples.times - 2.0, 0)[:, None] * np.array([0, 0, 0.6])
    down[samples.times > 2.0, :2] = samples.positions["r0"][np.searchsorted(samples.times, 2.0), :2]
    landed = Samples(samples.times, {**samples.positions, "r0": np.maximum(down, [-9, -9, -0.3])})
    assert claims(verdict(mission, RobotLeaves(time=2.0, robot="r0"), samples=landed))["workspace"] == {"holds"}
    own = small_mission("F a & (!a | F G (a | free))", starts=((0, 0, 1), (0, 0, -0.5)))
    assert claims(verdict(own, RobotLeaves(time=2.0, robot="r0"), samples=landed))["formula"] == {"holds"}
    joint = own.model_copy(update={"spec": own.spec.model_copy(update={"formula": "F G a", "team": "joint"})})
    assert claims(verdict(joint, RobotLeaves(time=2.0, robot="r0"), samples=landed))["formula"] == {"holds"}
    assert claims(verdict(joint, samples=landed))["formula"] == {"fails"}


def test_a_robot_that_joins_is_one_of_the_team():
    mission = small_mission("F a", starts=((0, 0, 1),))
    joins = RobotJoins(time=1.0, robot="r1", agent=Agent(start=(0.0, 0.0, -0.5)))
    assert verdict(mission, joins, samples=flown(2))
    assert claims(verdict(mission, joins, samples=flown(2, apart=0.1)))["separation"] == {"fails"}


@given_few(10, 60, st.floats(0.5, 4.0), st.floats(0.5, 4.0), st.sampled_from(["F a", "G !a", "F(a & F(!a & F a))"]))
def test_verdicts_are_true_of_the_world_at_every_time(away, back, formula):
    """`a` goes away and comes back while the robot passes; a dense look at both says what was shown."""
    first, second = sorted((round(away, 3), round(back, 3)))
    mission = small_mission(formula)
    events = (moves(first), moves(second, (1.0, 0.0, 1.0)))
    found = claims(verdict(mission, *events))["formula"]
    inside = (max(1.6, 0.0), 2.4)
    spans = [(max(inside[0], low), min(inside[1], high)) for low, high in ((0.0, first), (second, 8.0))]
    spans = [span for span in spans if span[0] < span[1]]
    if len(spans) == 2 and spans[0][1] >= spans[1][0]:
        spans = [(spans[0][0], spans[1][1])]
    shown = {"F a": bool(spans), "G !a": not spans, "F(a & F(!a & F a))": len(spans) == 2}[formula]
    if found == {"holds"}:
        assert shown
    if found == {"fails"}:
        assert not shown
    if (
        all(abs(t - edge) > 0.05 for t in (first, second) for edge in inside)
        and second - first > 0.05
        and formula != "F(a & F(!a & F a))"
    ):
        assert found == ({"holds"} if shown else {"fails"})


# -- the file ---------------------------------------------------------------------------------------------------

EVENTS = (
    moves(1.5), HoopMoves(time=2.0, region="a", center=(1.0, 0.0, 1.0), yaw_deg=30.0), RobotLeaves(time=3.0, robot="r0", fails=False),
    RobotJoins(time=3.0, robot="r9", agent=Agent(start=(0.0, 1.0, 1.0), cost={"length": 2.0})), NewFormula(time=4.0, formula="F a"),
)  # fmt: skip


def test_events_that_were_written_are_read_again(tmp_path: Path):
    (tmp_path / "events.json").write_text(events_to_json(EVENTS))
    assert load_events(tmp_path / "events.json") == EVENTS


def test_a_folder_with_events_is_judged_with_them(tmp_path: Path):
    (tmp_path / "mission.yaml").write_text(mission_to_yaml(small_mission("F a")))
    (tmp_path / "events.json").write_text(events_to_json([moves(1.0)]))
    assert claims(check_flight(flown(), load_reference(tmp_path), max_speed=0.8, start=0.0))["formula"] == {"fails"}
    (tmp_path / "events.json").write_text(events_to_json([moves(6.0)]))
    assert check_flight(flown(), load_reference(tmp_path), max_speed=0.8, start=0.0)
    with pytest.raises(BadInput, match="not known on the recording's clock"):
        check_flight(flown(), load_reference(tmp_path), max_speed=0.8)


def test_a_table_on_another_clock_is_not_judged_with_events(tmp_path: Path):
    """It begins 4 s after take-off and passes where `a` stood until 5 s: by its own clock in time, in truth too late."""
    (tmp_path / "mission.yaml").write_text(mission_to_yaml(small_mission("F a")))
    (tmp_path / "events.json").write_text(events_to_json([moves(5.0)]))
    samples = flown()
    rows = [f"{t:.6f},{x:.6f},{y:.6f},{z:.6f}\n" for t, (x, y, z) in zip(samples.times, samples.positions["r0"], strict=True)]
    (tmp_path / "table.csv").write_text("t,r0.x,r0.y,r0.z\n" + "".join(rows))
    with pytest.raises(BadInput, match="not known on the recording's clock"):
        judge_flight(tmp_path, tmp_path / "table.csv", max_speed=0.8)
    late = judge_flight(tmp_path, tmp_path / "table.csv", max_speed=0.8, start=-4.0).verdict
    assert late.outcome != "holds"
    assert judge_flight(tmp_path, tmp_path / "table.csv", max_speed=0.8, start=0.0).verdict


def test_nothing_is_said_for_ever_of_a_mission_alone_without_a_start():
    """Into `a`, which `G !a` forbids; whether in the flight or before it nobody says."""
    asked = FlightReference.of_mission(small_mission("G !a", trace="infinite"))
    assert claims(check_flight(flown(), asked, max_speed=0.8))["formula"] == {"undecided"}
    assert claims(check_flight(flown(), asked, max_speed=0.8, start=0.0))["formula"] == {"fails"}


def test_a_start_that_is_not_known_well_leaves_open_where_the_world_had_changed():
    """The robot is in `a` from 1.6 to 2.4 s; it moves away at 2.3 s of the flight, which may have begun earlier or later."""
    mission = small_mission("F a")
    asked = of_events(mission, (moves(2.3),))
    for off, outcome in ((0.0, "holds"), (0.1, "holds"), (1.0, "undecided")):
        found = check_flight(flown(), asked, max_speed=0.8, start=(-off, off))
        assert claims(found)["formula"] == {outcome}
    asked = of_events(small_mission("G !a"), (moves(1.5),))
    for off, outcome in ((0.0, "holds"), (0.3, "undecided")):
        found = check_flight(flown(), asked, max_speed=0.8, start=(-off, off))
        assert claims(found)["formula"] == {outcome}


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda d: d.pop("format"), "format"),
        (lambda d: d.update(format=2), "format"),
        (lambda d: d.update(events={}), "events"),
        (lambda d: d["events"][0].update(event="vanishes"), "must be one of"),
        (lambda d: d["events"][0].update(time=-1), "time"),
        (lambda d: d["events"][0].update(time=9), "forward in time"),
        (lambda d: d["events"][0].update(center=[1, 2]), "center"),
        (lambda d: d["events"][0].pop("yaw_deg"), "must have the keys"),
        (lambda d: d["events"][0].update(speed=1), "must have the keys"),
        (lambda d: d["events"][2].update(fails="no"), "fails"),
        (lambda d: d["events"][3]["agent"].pop("start"), "agent"),
    ],
)
def test_files_that_hold_no_events_are_refused(tmp_path: Path, change, says):
    data = json.loads(events_to_json(EVENTS))
    change(data)
    (tmp_path / "events.json").write_text(json.dumps(data))
    with pytest.raises(BadInput, match=says):
        load_events(tmp_path / "events.json")


@pytest.mark.parametrize(
    ("event", "says"),
    [
        (HoopMoves(time=1, region="c", center=ELSEWHERE), "not a region"),
        (RobotLeaves(time=1, robot="r7"), "not a robot"),
        (RobotJoins(time=1, robot="r0", agent=Agent(start=(0, 0, 1))), "already"),
        (NewFormula(time=1, formula="F nowhere"), "nowhere"),
    ],
)
def test_events_that_cannot_be_are_refused(event, says):
    with pytest.raises(BadInput, match=says):
        verdict(small_mission("F a"), event)


GATE = "g: {center: [1.0, 0.0, 1.0], radii: [0.25, 0.25, 0.25], opening: 0.25, rim: 0.03}"


def through_the_gate(sequence: str, *events, gate=GATE):
    """Fly straight through a gate at 2 s, from behind, and stop 1 m after it."""
    mission = small_mission(hoops=gate, regions="", margin=0.05)
    mission = mission.model_copy(update={"sequence": sequence, "spec": mission.spec.model_copy(update={"formula": None})})
    straight = flown(corners=np.array([(0.0, 0.0, 1.0), (2.0, 0.0, 1.0)]))
    return claims(check_flight(straight, of_events(mission, events), max_speed=0.8, start=0.0))["passages"]


def test_a_gate_is_passed_as_it_stood_then():
    turned = {"region": "g", "center": (1.0, 0.0, 1.0), "yaw_deg": 180.0}
    away = {"region": "g", "center": (1.0, 2.0, 1.0)}
    assert through_the_gate("gF") == {"holds"}
    assert through_the_gate("gF", HoopMoves(time=3.0, **turned)) == {"holds"}
    assert through_the_gate("gF", HoopMoves(time=1.0, **turned)) == {"undecided"}
    assert through_the_gate("gR", HoopMoves(time=1.0, **turned)) == {"holds"}
    assert through_the_gate("gF", HoopMoves(time=1.0, **away)) == {"fails"}
    assert through_the_gate("gF", HoopMoves(time=1.0, **away), HoopMoves(time=1.5, region="g", center=(1.0, 0.0, 1.0))) == {
        "holds"
    }


def test_passages_of_a_gate_that_is_moved_ahead_of_a_robot_right_behind_it_cannot_be_told_apart():
    """At the very sample at which the robot is 0.2 mm behind the gate, it is moved to 0.2 mm before the robot."""
    near = GATE.replace("1.0, 0.0, 1.0", "0.9998, 0.0, 1.0")
    ahead = HoopMoves(time=2.0, region="g", center=(1.0002, 0.0, 1.0))
    assert through_the_gate("gF gF", ahead, gate=near) == {"undecided"}
    assert through_the_gate("gF gF", HoopMoves(time=2.0, region="g", center=(1.05, 0.0, 1.0)), gate=near) == {"holds"}


def test_what_changed_before_the_recording_begins_is_how_the_world_is():
    mission = small_mission("F a", regions="a: {center: [0.0, 3.0, 1.0], radii: [0.2, 0.2, 0.2]}")
    later = Samples(flown().times + 2, flown().positions)
    assert verdict(mission, moves(1.0, (1.0, 0.0, 1.0)), samples=later)
    assert claims(verdict(mission, moves(1.0, (1.0, 2.0, 2.0)), samples=later))["formula"] == {"fails"}


@pytest.mark.parametrize(
    ("events", "says"),
    [
        ([moves(3.0), moves(1.0)], "forward in time"),
        ([moves(float("nan"))], "nan"),
        ([moves(float("inf"))], "inf"),
        ([RobotLeaves(time=float("nan"), robot="r1")], "nan"),
        ([RobotLeaves(time=-1.0, robot="r1")], "before the flight"),
    ],
)
def test_times_of_events_that_say_nothing_are_refused(events, says):
    mission = small_mission("F a", starts=((0, 0, 1), (0, 0, -0.5)), extra="separation: 0.3")
    with pytest.raises(BadInput, match=says):
        verdict(mission, *events, samples=flown(2))


def test_a_stay_is_held_against_the_region_as_it_stood_then():
    """Out of the region by 0.1 m and back are two visits, though all of it happens near where the region was before."""
    mission = small_mission(margin=0.05, starts=((2.0, 0.0, 1.0),))
    back = flown(corners=np.array([(2.0, 0.0, 1.0), (1.0, 0.0, 1.0), (1.3, 0.0, 1.0)]))
    worlds = of_events(mission, [moves(0.3, (1.3, 0.0, 1.0))]).worlds
    for count, wanted in ((1, "fails"), (2, "holds")):
        plan = plan_of(mission, {"r0": [Visit(region="a")] * count})
        found = check_flight(back, FlightReference(worlds, plan=plan, margin=0.05), max_speed=0.8, start=0.0)
        assert claims(found)["visits"] == {wanted}


def test_worlds_have_the_same_regions_and_plans_the_same_robots():
    mission = small_mission("F a")
    other = small_mission("F b", regions="b: {center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}")
    two = small_mission("F a", starts=((0, 0, 1), (0, 2, 1)))
    for asked, says in (
        (FlightReference((World(0.0, mission), World(1.0, other))), "not in every world"),
        (FlightReference((World(0.0, mission),), plan=plan_of(two, {})), "The plan has robots r0, r1"),
        (FlightReference((World(0.0, mission), World(1.0, two)), plan=plan_of(mission, {})), "The plan has robots r0;"),
        (FlightReference(()), "at least one world"),
    ):
        with pytest.raises(BadInput, match=says):
            check_flight(flown(len(asked.mission.agents) if asked.worlds else 1), asked, max_speed=0.8, start=0.0)


CRATE = Obstacle.model_validate({"center": (0.0, 3.0, 1.0), "size": (0.4, 0.4, 1.0), "yaw_deg": 30.0})


def test_what_appears_and_moves_is_written_and_read_again(tmp_path: Path):
    events = (
        ObstacleAppears(time=1.0, name="crate", obstacle=CRATE),
        HoopMoves(time=2.0, region="crate", center=(0.0, 2.0, 1.0), yaw_deg=None),
    )
    (tmp_path / "events.json").write_text(events_to_json(events))
    assert load_events(tmp_path / "events.json") == events
    worlds = [world.mission for world in of_events(small_mission("F a"), events).worlds]
    assert [world.obstacles.get("crate") for world in worlds] == [None, CRATE, CRATE.changed(center=(0.0, 2.0, 1.0))]


def test_a_solid_body_counts_as_long_as_it_stands_there():
    """The robot is where the crate may stand at 6 s. From when the first world is does not matter."""
    mission = small_mission("F a")
    crate = CRATE.changed(center=(2.0, 1.0, 1.0))
    solid = mission.changed(obstacles={"crate": crate})
    for since in (0.0, 7.0):
        assert claims(check_flight(flown(), FlightReference((World(since, solid),)), max_speed=0.8, start=0.0))[
            "obstacles"
        ] == {"fails"}
    for time, outcome in ((5.0, "fails"), (7.0, "holds")):
        found = verdict(mission, ObstacleAppears(time=time, name="crate", obstacle=crate))
        assert claims(found)["obstacles"] == {outcome}


@pytest.mark.parametrize(
    ("event", "says"),
    [
        (HoopMoves(time=1.0, region="crete", center=(0, 0, 1)), "'crete' is not a region or obstacle. Did you mean 'crate'?"),
        (ObstacleAppears(time=1.0, name="a", obstacle=CRATE), "'a' is a region or an obstacle of this mission already"),
        (ObstacleAppears(time=1.0, name="crate", obstacle=CRATE), "'crate' is a region or an obstacle of this mission already"),
    ],
)
def test_what_cannot_appear_or_move_is_refused(event, says):
    mission = small_mission("F a").changed(obstacles={"crate": CRATE})
    with pytest.raises(BadInput, match=re.escape(says)):
        of_events(mission, (event,))


def test_an_obstacle_in_a_file_of_events_is_held_against_the_schema(tmp_path: Path):
    text = events_to_json((ObstacleAppears(time=1.0, name="crate", obstacle=CRATE),))
    file = tmp_path / "events.json"
    for old, new, says in (('"center"', '"centre"', "obstacle"), ('"name": "crate"', '"name": 3', "'name' must be a name")):
        file.write_text(text.replace(old, new))
        with pytest.raises(BadInput, match=says):
            load_events(file)


# -- robots that climb to a team in flight ----------------------------------------------------------------------

JOINER = RobotJoins(time=4.0, robot="r1", agent=Agent(start=(1.0, -1.5, -4.0)), climbs=2.0)


def with_a_newcomer(way, rate=100.0):
    """The one flies past `a`, the other goes its own way: corners, and when it is at each."""
    samples = flown(1, rate=rate)
    at, corners = np.array([time for time, _ in way]), np.array([place for _, place in way])
    path = np.stack([np.interp(samples.times, at, corners[:, axis]) for axis in range(3)], axis=1)
    return Samples(samples.times, {**samples.positions, "r1": path})


CLIMBS = ((0.0, (1.0, -1.5, -5.3)), (2.0, (1.0, -1.5, -5.3)), (3.9, (1.0, -1.5, -4.0)), (8.0, (1.0, -1.5, -4.0)))
"""From outside of the workspace, whose floor is at -5 m."""


def climbing_verdict(formula="F a", *, event=JOINER, way=CLIMBS, **changes):
    mission = small_mission(formula, extra="separation: 0.3", **changes)
    return claims(verdict(mission, event, samples=with_a_newcomer(way)))


def test_one_that_climbs_is_part_of_the_team_from_when_it_joins():
    found = climbing_verdict()
    assert all(outcomes == {"holds"} for outcomes in found.values()), found
    hovered = RobotJoins(time=4.0, robot="r1", agent=JOINER.agent)
    assert climbing_verdict(event=hovered)["workspace"] == {"holds", "fails"}, (
        "one that hovered all the time is judged all the time"
    )
    late = (*CLIMBS[:2], (7.9, (1.0, -1.5, -4.9)), (8.0, (1.0, -1.5, -4.9)))
    assert climbing_verdict(way=late)["workspace"] == {"holds", "fails"}, "it joins before it is in the workspace"


def test_what_one_is_in_before_it_joins_is_not_shown():
    """It climbs through `b`, which nobody may show, and is in it again later or not."""
    regions = "a: {center: [1, 0, 1], radii: [0.2, 0.2, 0.2]}\nb: {center: [1, -1.5, -4.8], radii: [0.2, 0.2, 0.2]}"
    assert climbing_verdict("F a & G !b", regions=regions)["formula"] == {"holds"}
    assert climbing_verdict("F b", regions=regions)["formula"] == {"fails"}
    back = (*CLIMBS[:3], (5.0, (1.0, -1.5, -4.0)), (7.5, (1.0, -1.5, -4.8)), (8.0, (1.0, -1.5, -4.8)))
    assert climbing_verdict("F b", way=back, regions=regions)["formula"] == {"holds"}
    hovered = RobotJoins(time=4.0, robot="r1", agent=JOINER.agent)
    assert climbing_verdict("F b", event=hovered, regions=regions)["formula"] == {"holds"}


def test_what_one_shows_first_that_joins_inside_of_a_region_cannot_be_told():
    regions = "a: {center: [1, 0, 1], radii: [0.2, 0.2, 0.2]}\nb: {center: [1, -1.5, -4], radii: [0.2, 0.2, 0.2]}"
    for formula in ("F a", "F b", "F a & G !b"):
        assert climbing_verdict(formula, regions=regions)["formula"] == {"undecided"}


@pytest.mark.parametrize(("near", "found"), [(1.0, {"holds"}), (3.0, {"fails"}), (5.0, {"fails"})])
def test_one_keeps_away_from_the_others_from_when_it_climbs(near, found):
    """It is carried past the other one, when it stands on the ground still, climbs, or is one of the team."""
    other = flown(1).positions["r0"][round(100 * near)]
    here, away = tuple(other - [0.0, 0.1, 0.0]), tuple(other - [0.0, 1.5, 1.0])
    way = ((0.0, here), (near + 0.05, here), (near + 1.9, away), (8.0, away))
    event = RobotJoins(time=5.0 if near == 3.0 else 4.0, robot="r1", agent=JOINER.agent, climbs=2.0)
    asked = of_events(small_mission("F a", extra="separation: 0.3"), [event])
    assert claims(check_flight(with_a_newcomer(way), asked, max_speed=1.8, start=0.0))["separation"] == found


@pytest.mark.parametrize(
    ("climbs", "time", "says"), [(5.0, 4.0, "must climb before it joins"), (2.0, 9.0, "not within the flight that is checked")]
)
def test_joining_at_times_that_cannot_be_is_refused(climbs, time, says):
    event = RobotJoins(time=time, robot="r1", agent=JOINER.agent, climbs=climbs)
    with pytest.raises(BadInput, match=says):
        climbing_verdict(event=event)
    with pytest.raises(BadInput, match="leave after it"):
        FlightReference((World(0.0, small_mission()),), gone={"r0": 1.0}, joined={"r0": Joined(2.0, 1.0)}).checked()


def test_when_one_climbed_is_kept_in_the_file(tmp_path: Path):
    (tmp_path / "events.json").write_text(events_to_json([JOINER]))
    assert load_events(tmp_path / "events.json") == (JOINER,)
    assert "climbs" not in events_to_json([RobotJoins(time=4.0, robot="r1", agent=JOINER.agent)])
    (tmp_path / "events.json").write_text(events_to_json([JOINER]).replace('"climbs": 2.0', '"climbs": -1'))
    with pytest.raises(BadInput, match="'climbs' must be a number of seconds"):
        load_events(tmp_path / "events.json")
