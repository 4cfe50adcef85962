import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ltlplan.missions import load_mission
from ltlplan.paths.hoops import avoid, control_points, route, route_sequence, segments
from ltlplan.paths.hoops.clearance import blocked
from ltlplan.paths.hoops.keep_out import room
from tests.helpers.missions.courses import courses
from tests.helpers.missions.hoops import REGIONS, crowded, small_mission
from tests.helpers.motion.nominal_trajectories import nominal_trajectory
from verify.data import Infeasible, Mission, Visit, Word, parse_mission
from verify.data.shapes.region import Hoop, Region

SHIPPED = ("hoops-sequence", "hoops-published")


def path_of(plan, count=4000):
    trajectory = nominal_trajectory([w.position for w in plan.waypoints], plan.times, cycle=plan.cycle_waypoint)
    times = np.linspace(0.0, trajectory.duration, count)
    return trajectory, times, trajectory.evaluate(times)[:, :3]


def stays(mission: Mission, path) -> list[str]:
    """Regions in the order in which a densely sampled path enters them."""
    found = []
    for name, region in mission.all_regions.items():
        inside = region.level(path) <= 1.0
        found += [(int(i), name) for i in np.flatnonzero(inside & ~np.concatenate([[False], inside[:-1]]))]
    return [name for _, name in sorted(found)]


# The sequencer


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_sequences_give_their_words_in_continuous_space(name):
    mission = load_mission(name)
    plan = route_sequence(mission)
    _, _, path = path_of(plan)
    assert stays(mission, path) == [visit.region for visit in plan.visits]
    assert plan.times[0] == 0.0
    assert np.all(np.diff(plan.times) > 0)
    if plan.cycle_waypoint is not None:
        assert plan.waypoints[-1].position == plan.waypoints[plan.cycle_waypoint].position
    agent = mission.agents["quad0"]
    assert plan.waypoints[0].position == agent.start
    assert agent.end is None or plan.waypoints[-1].position == agent.end


def test_control_points_are_visited_in_flight_order():
    mission = load_mission("hoops-sequence")
    plan = route_sequence(mission)
    for index, visit in enumerate(plan.visits):
        served = [w for w in plan.waypoints if w.visit == index and w.role != "via"]
        points = control_points(mission.hoops[visit.region])
        first, last = points.ends(visit.direction)
        assert np.allclose([w.position for w in served], [first, points.centre, last])
        assert [w.role for w in served] == (
            ["rear", "centre", "front"] if visit.direction == "F" else ["front", "centre", "rear"]
        )


def test_times_are_lengths_of_primitives_over_the_speed():
    mission = load_mission("hoops-published")
    plan = route_sequence(mission)
    primitives = segments(mission, plan)
    assert np.allclose(np.diff(plan.times), [p.length / 0.45 for p in primitives])
    assert {p.kind for p in primitives} >= {"STRAIGHT", "S_CURVE", "U_TURN"}


def test_the_spline_is_three_times_continuously_differentiable_at_every_joint():
    for name in SHIPPED:
        trajectory, _, _ = path_of(route_sequence(load_mission(name)))
        for order in range(4):
            values = trajectory.derivative_coefficients(order)[:, :3]
            ends = [
                [np.polynomial.polynomial.polyval(t, c) for c in v] for v, t in zip(values, trajectory.durations, strict=True)
            ]
            scale = 1 + np.abs(ends).max()
            assert np.allclose(ends[:-1], values[1:, :, 0], atol=1e-7 * scale)
            if trajectory.cycle is not None:
                assert np.allclose(ends[-1], values[trajectory.cycle, :, 0], atol=1e-7 * scale)


def moved(mission: Mission, angle: float, shift) -> Mission:
    """The whole world turned about z and moved; the workspace is widened to hold both."""
    c, s = math.cos(angle), math.sin(angle)

    def at(point):
        x, y, z = point
        return (c * x - s * y + shift[0], s * x + c * y + shift[1], z + shift[2])

    hoops = {
        name: Hoop(center=at(h.center), yaw_deg=h.yaw_deg + math.degrees(angle), radii=h.radii, opening=h.opening, rim=h.rim)
        for name, h in mission.hoops.items()
    }
    agents = {
        name: a.model_copy(update={"start": at(a.start), "end": None if a.end is None else at(a.end)})
        for name, a in mission.agents.items()
    }
    box = mission.workspace.model_copy(update={"min": (-50.0, -50.0, -50.0), "max": (50.0, 50.0, 50.0)})
    return mission.model_copy(update={"hoops": hoops, "agents": agents, "workspace": box})


@given(st.floats(-3.1, 3.1), st.tuples(*[st.floats(-10, 10)] * 3))
@settings(max_examples=10, deadline=None)
def test_a_plan_moves_and_turns_with_the_world(angle, shift):
    mission = load_mission("hoops-sequence")
    here = route_sequence(moved(mission, 0.0, (0.0, 0.0, 0.0)))
    there = route_sequence(moved(mission, angle, shift))
    c, s = math.cos(angle), math.sin(angle)
    turned = np.array([w.position for w in here.waypoints]) @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + np.array(shift)
    assert np.allclose([w.position for w in there.waypoints], turned, atol=1e-6)
    assert np.allclose(there.times, here.times, atol=1e-6)
    assert [w.role for w in there.waypoints] == [w.role for w in here.waypoints]


@pytest.mark.slow
def test_random_courses_never_enter_a_hoop_that_is_not_next_in_the_sequence():
    crowds = courses(seed=11, count=8, hoops=5, passages=3) + courses(seed=12, count=3, hoops=8, passages=5)
    for mission, plan in crowds:
        _, _, path = path_of(plan)
        assert stays(mission, path) == [visit.region for visit in plan.visits]
        for hoop in mission.hoops.values():  # nor do they meet a ring
            points = control_points(hoop)
            own = (path - points.centre) @ points.frame
            near = np.abs(own[:, 0]) <= hoop.rim / 2 + mission.vehicle.radius
            across = np.linalg.norm(own[near][:, 1:], axis=1)
            clear = mission.vehicle.radius
            assert np.all((across < hoop.opening - clear) | (across > hoop.opening + hoop.rim + clear))
        assert np.all(path >= mission.workspace.min)
        assert np.all(path <= mission.workspace.max)


def test_the_same_hoop_can_be_flown_again_and_turned_about():
    for sequence in ("h0F h0F", "h0F h0R", "h0R h0R h0F"):
        mission = small_mission(sequence=sequence)
        plan = route_sequence(mission)
        _, _, path = path_of(plan)
        assert stays(mission, path) == ["h0"] * len(sequence.split())
        assert " ".join(f"{v.region}{v.direction}" for v in plan.visits) == sequence


def test_a_cycle_closes_on_its_first_control_point():
    mission = small_mission(sequence="(h0F)*", spec="{trace: infinite}")
    plan = route_sequence(mission)
    assert plan.cycle_visit == 0
    assert plan.waypoints[plan.cycle_waypoint].role == "rear"
    assert str(plan.word) == "{} ({h0} {})^w"


def test_an_idle_robot_stays_where_it_is():
    mission = load_mission("firefighting")
    plan = route(mission, "quad1", ())
    assert [w.role for w in plan.waypoints] == ["start"]
    assert plan.times == (0.0,)
    assert plan.cost == 0.0


def test_firefighting_goes_through_water_smoke_and_loc2():
    mission = load_mission("firefighting")
    plan = route(
        mission, "quad0", [Visit(region="water", actions=mission.robot.actions), Visit(region="smoke"), Visit(region="loc2")]
    )
    _, _, path = path_of(plan)
    assert stays(mission, path) == ["water", "smoke", "loc2"]
    assert [v.direction for v in plan.visits] == ["F", "F", "F"]
    assert plan.visits[0].actions == mission.robot.actions


def test_plain_regions_are_visited_where_the_route_touches_them_and_the_flight_may_end_there():
    text = """
format: 1
name: plain
spec: {formula: F a & F b}
regions:
  a: {center: [0, 0, 1], radii: [0.3, 0.2, 0.2]}
  b: {center: [1.2, 0.8, 1], radii: [0.2, 0.2, 0.2]}
  c: {center: [0.6, 0.4, 1], radii: [0.2, 0.2, 0.2]}
agents: {quad0: {start: [-1, 0, 1]}}
vehicle: crazyflie-2.1
workspace: {min: [-2, -2, 0.2], max: [2, 2, 2]}
"""
    mission = parse_mission(text)
    plan = route(mission, "quad0", [Visit(region="a"), Visit(region="b")])
    _, _, path = path_of(plan)
    assert stays(mission, path) == ["a", "b"]  # c stands between and is passed by
    deep = mission.margin + 0.3 * (0.2 - mission.margin)
    assert np.linalg.norm(np.subtract(plan.waypoints[-1].position, (1.2, 0.8, 1.0))) == pytest.approx(0.2 - deep, abs=1e-4)
    assert "b" in plan.word.letters[-1]


# Sides


def test_the_nearest_side_is_taken_and_a_given_side_is_kept():
    mission = load_mission("hoops-ltl")
    assert route(mission, "quad0", [Visit(region="hoop0")]).visits[0].direction == "F"
    assert route(mission, "quad0", [Visit(region="hoop0", direction="R")]).visits[0].direction == "R"


def brute_force(mission, names, cycle):
    best = math.inf
    for choice in range(2 ** len(names)):
        visits = [Visit(region=n, direction="FR"[choice >> i & 1]) for i, n in enumerate(names)]
        try:
            plan = route(mission, "quad0", visits, cycle)
        except Infeasible:
            continue
        best = min(best, sum(p.length for p in segments(mission, plan)))
    return best


def test_the_cheapest_sides_are_no_longer_than_any_other_choice():
    mission = load_mission("hoops-ltl")
    names = ["hoop0", "hoop2", "hoop1"]
    plan = route(mission, "quad0", [Visit(region=n) for n in names], 0, directions="cheapest")
    assert sum(p.length for p in segments(mission, plan)) <= brute_force(mission, names, 0) * 1.02


# AVOID and refusals


def test_avoid_takes_the_nearer_point_and_several_in_a_row():
    hoops = "\n".join(
        f"h{i}: {{center: [{x}, {y}, 1], yaw_deg: 0, radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}}"
        for i, (x, y) in enumerate([(1.5, 1.5), (-0.6, 0.1), (0.7, 0.1)])
    )
    mission = small_mission(hoops=hoops, sequence="h0F")
    start, end = np.array([-1.7, 0.0, 1.0]), np.array([1.7, 0.0, 1.0])
    points = avoid(mission, room(mission), start, end)
    sides = [p.region for p in points if p.role == "avoid"]
    assert sides == ["h1", "h2"]
    assert all(p.position[1] < 0 for p in points)  # the nearer side
    stops = [start, *(p.position for p in points), end]
    assert all(blocked(a, b, room(mission)) is None for a, b in itertools.pairwise(stops))


def keeps_clear(mission, stops):
    """Tell, by dense samples and a hoop's definition alone, whether straight lines enter no hoop and meet no ring."""
    line = np.concatenate([np.linspace(a, b, 400) for a, b in itertools.pairwise(stops)])
    for hoop in mission.hoops.values():
        offset = line - np.array(hoop.center)
        along = offset @ np.array(hoop.normal)
        across = np.linalg.norm(offset - along[:, None] * np.array(hoop.normal), axis=1)
        wide = hoop.opening + hoop.rim + mission.vehicle.radius
        if np.any(np.linalg.norm(offset, axis=1) <= 0.2) or np.any((np.abs(along) <= hoop.rim / 2) & (across <= wide)):
            return False
    return True


def test_two_hoops_in_each_others_way_are_passed_by_the_points_of_both():
    mission = crowded([(0.223, 0.815, 1.177, 62.0), (-0.253, 0.236, 1.239, 120.4)])
    start, end = control_points(mission.hoops["h0"]).rear, control_points(mission.hoops["h1"]).front
    points = avoid(mission, room(mission), start, end)
    assert points
    assert keeps_clear(mission, [start, *(p.position for p in points), end])


@pytest.mark.slow
def test_avoid_keeps_clear_of_all_hoops_between_the_control_points_of_crowded_ones():
    rng, found = np.random.default_rng(7), []
    for _ in range(6):
        places = []
        while len(places) < 9:
            place = rng.uniform([-1.3, -1.3, 0.8], [1.3, 1.3, 1.6])
            if all(np.linalg.norm(place - other[:3]) > 0.75 for other in places):
                places.append((*place, rng.uniform(-180, 180)))
        mission = crowded(places)
        ends = [p for hoop in mission.hoops.values() for p in (control_points(hoop).front, control_points(hoop).rear)]
        free = [p for p in ends if blocked(p, p, room(mission)) is None]
        for a, b in rng.permutation(len(free))[:16].reshape(-1, 2):
            points = avoid(mission, room(mission), free[a], free[b])  # no pair of them is refused
            assert keeps_clear(mission, [free[a], *(p.position for p in points), free[b]])
            found.append(len({p.region for p in points}))
    assert np.all(np.bincount(found)[:3] > 0)  # free lines, one hoop in the way, several in a row


def test_the_same_mission_gives_the_same_plan():
    ((mission, plan),) = courses(seed=2, count=1)
    assert route_sequence(mission) == plan


# Lassos over regions, and flights that begin or end inside one


@pytest.mark.parametrize(
    ("start", "names", "cycle", "entered"),
    [
        ("[-1, 0, 1]", ["a", "b"], 0, ["a", "b", "a"]),
        ("[-1, 0, 1]", ["a"], 0, ["a"]),
        ("[-1, 0, 1]", ["a", "a", "b"], 1, ["a", "a", "b"]),
        ("[-1, 0, 1]", ["a", "b"], 2, ["a", "b"]),
        ("[0.1, 0, 1]", ["a", "b"], 0, ["a", "b", "a"]),
        ("[0.1, 0, 1]", ["a"], 0, ["a", "a"]),
    ],
)
def test_a_lasso_over_regions_repeats_its_cycles_first_waypoint_in_one_region_or_in_free_flight(start, names, cycle, entered):
    mission = parse_mission(REGIONS.format(start=start))
    plan = route(mission, "quad0", [Visit(region=n) for n in names], cycle)
    trajectory, _, path = path_of(plan)
    assert [v.region for v in plan.visits] == entered
    assert stays(mission, path) == entered
    first, last = plan.waypoints[plan.cycle_waypoint], plan.waypoints[-1]
    assert last.position == first.position
    around = [name for name, region in mission.all_regions.items() if region.level(np.array(first.position)) <= 1]
    if cycle < len(names):  # a lap begins where the one before ended, or outside every region, so that its visits are whole
        assert around in ([], [entered[-1]] if len(entered) > len(names) else [])
    lap = trajectory.flattened(3)
    again = lap.evaluate(np.linspace(0, lap.duration, 6000))[:, :3]
    once = entered[plan.cycle_visit :] if plan.cycle_visit < len(entered) else []
    assert stays(mission, again) == entered + 2 * once


def test_a_word_that_ends_in_free_flight_leads_out_of_a_plain_region() -> None:
    mission = load_mission("firefighting")
    site = Region(center=(-0.9, -0.8, 1.0), radii=(0.25, 0.25, 0.25))
    mission = mission.model_copy(update={"regions": {"site": site}, "environment": None})
    stays = route(mission, "quad0", (Visit(region="site"),))
    leaves = route(mission, "quad0", (Visit(region="site"),), word=Word.of([[], ["site"], []]))
    assert site.level(np.array(stays.waypoints[-1].position)) < 1.0
    assert site.level(np.array(leaves.waypoints[-1].position)) > (1.0 + mission.margin / 0.25) ** 2
