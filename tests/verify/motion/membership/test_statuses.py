import itertools
from fractions import Fraction

import numpy as np
import pytest

from tests.helpers.few import few_of
from tests.helpers.motion.flights import legs, plan_of, quantised, small_mission, wandering
from tests.helpers.words.second_reading import compare, crossings, inside, membership
from verify.data.shapes.region import Region
from verify.data.trajectory import Trajectory
from verify.motion.membership.polynomials import membership_polynomials
from verify.motion.membership.statuses import changes, statuses
from verify.motion.paths import read_team
from verify.motion.regions import Ellipsoid, are_disjoint, extent, lies_inside, relations

THREE = """a: {center: [0.5, 0.0, 1.0], radii: [0.3, 0.4, 0.5], yaw_deg: 30}
b: {center: [-0.4, 0.3, 1.2], radii: [0.5, 0.3, 0.4], yaw_deg: -20}
c: {center: [0.0, -0.4, 0.7], radii: [0.25, 0.25, 0.25]}"""


def spans_of(mission, trajectory, margin=Fraction(0)):
    return statuses(membership_polynomials(read_team(mission, {"r0": trajectory})), margin)["r0"]


def mission_at(trajectory, regions=THREE, **options):
    """A mission whose robot starts where the trajectory does (the starts of random flights may lie anywhere)."""
    mission = small_mission(regions=regions, **options)
    agent = mission.agents["r0"].model_copy(update={"start": tuple(trajectory.coefficients[0, :3, 0])})
    return mission.model_copy(update={"agents": {"r0": agent}})


def check_cover(spans, end):
    for row in spans.values():
        assert row[0].start == 0
        assert row[-1].stop == end
        for a, b in itertools.pairwise(row):
            assert a.stop == b.start
            assert a.mark != b.mark
            assert {a.mark, b.mark} != {"no", "must"}


@pytest.mark.slow
def test_the_second_exact_method_finds_the_same_switches():
    rng = np.random.default_rng(0)
    told = left_open = 0
    for _ in range(40):  # 10 000 of them: tests/benchmarks/certificates.py
        trajectory = wandering(rng, pieces=int(rng.integers(1, 4)))
        mission = mission_at(trajectory)
        check_cover(spans_of(mission, trajectory), sum(map(Fraction, trajectory.durations.tolist())))
        sure, unsure = compare(trajectory, mission)
        told, left_open = told + sure, left_open + unsure
    assert told > 0.95 * (told + left_open)


def test_statuses_hold_for_every_point_within_the_margin():
    rng = np.random.default_rng(1)
    for _ in range(25):
        trajectory = wandering(rng, pieces=2)
        mission = mission_at(trajectory)
        margin = Fraction(int(rng.integers(0, 120)), 1000)
        spans = spans_of(mission, trajectory, margin)
        for name, region in mission.all_regions.items():
            for span in spans[name]:
                if span.mark not in ("no", "must"):
                    continue
                for share in (0.0, 0.5, 1.0, *rng.uniform(size=3)):
                    time = float(span.start + (span.stop - span.start) * Fraction(float(share)))
                    point = trajectory.evaluate(min(time, trajectory.duration))[:3]
                    push = rng.normal(size=3)
                    gradient = region.shape @ (point - np.array(region.center))
                    for direction in (push, gradient, -gradient):
                        size = np.linalg.norm(direction)
                        moved = point + direction / size * float(margin) * (1 - 1e-9) if size else point
                        assert (
                            (float(region.level(moved)) <= 1 + 1e-9)
                            if span.mark == "must"
                            else (float(region.level(moved)) > 1 - 1e-9)
                        )


def test_a_tube_is_less_sure_than_every_narrower_one():
    rng = np.random.default_rng(2)
    for _ in range(10):
        trajectory = wandering(rng, pieces=2)
        mission = mission_at(trajectory)
        narrow, wide = (spans_of(mission, trajectory, Fraction(m, 100)) for m in (3, 8))
        for name in mission.all_regions:
            for span in wide[name]:
                if span.mark in ("no", "must"):
                    middle = (span.start + span.stop) / 2
                    assert next(s for s in narrow[name] if s.start <= middle <= s.stop).mark == span.mark


BALL = "a: {center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}"


def line(y: float, start: float = 0.0, stop: float = 2.0, z: float = 1.0) -> Trajectory:
    """Fly along x at constant speed, as plain float64 (labels do not mind the ends)."""
    coefficients = np.zeros((1, 4, 8))
    coefficients[0, :3, 0] = [start, y, z]
    coefficients[0, 0, 1] = stop - start
    return Trajectory([1.0], coefficients)


@pytest.mark.parametrize("depth", [1e-2, 1e-4, 1e-6, 1e-9])
def test_a_graze_is_an_entry_and_an_exit(depth):
    radius = 0.2
    inner, outer = line(radius - depth), line(radius + depth)
    mission = mission_at(inner, BALL)
    assert [s.mark for s in spans_of(mission, inner)["a"]] == ["no", "switch", "must", "switch", "no"]
    assert [s.mark for s in spans_of(mission_at(outer, BALL), outer)["a"]] == ["no"]


def test_a_tangency_is_may():
    # 0.25 is exact in binary, and so is the matrix 16 I, so the line touches the ball in exactly one point
    touching = line(0.25)
    mission = mission_at(touching, "a: {center: [1.0, 0.0, 1.0], radii: [0.25, 0.25, 0.25]}")
    spans = spans_of(mission, touching)["a"]
    assert [s.mark for s in spans] == ["no", "may", "no"]
    assert spans[1].start <= Fraction(1, 2) <= spans[1].stop
    assert spans[1].stop - spans[1].start < Fraction(1, 1000)


def test_a_path_on_the_boundary_is_may_throughout():
    coefficients = np.zeros((1, 4, 8))
    coefficients[0, :3, 0] = [1.25, 0.0, 1.0]
    still = Trajectory([1.0], coefficients)
    mission = mission_at(still, "a: {center: [1.0, 0.0, 1.0], radii: [0.25, 0.25, 0.25]}")
    assert [s.mark for s in spans_of(mission, still)["a"]] == ["may"]


def test_a_start_on_the_boundary_is_may_and_never_a_guess():
    leaving = line(0.0, 1.25, 3.0)
    mission = mission_at(leaving, "a: {center: [1.0, 0.0, 1.0], radii: [0.25, 0.25, 0.25]}")
    spans = spans_of(mission, leaving)["a"]
    assert [s.mark for s in spans] == ["may", "no"]
    assert spans[0].stop < Fraction(1, 1000)


@pytest.mark.parametrize(("margin", "edge"), [(Fraction(0), 0.75), (Fraction(1, 16), 0.6875)])
@pytest.mark.parametrize("beyond", [2.0**-25, 2.0**-38, 2.0**-46])
def test_an_edge_that_is_passed_right_before_a_piece_ends_is_passed(margin, edge, beyond):
    ending = line(0.0, 0.0, edge + beyond)
    mission = mission_at(ending, "a: {center: [1.0, 0.0, 1.0], radii: [0.25, 0.25, 0.25]}")
    spans = spans_of(mission, ending, margin)["a"]
    assert [span.mark for span in spans] in (["no", "may"], ["no", "may", "must"], ["no", "switch", "must"])
    assert spans[0].stop <= Fraction(edge) / Fraction(edge + beyond)
    assert spans[0].stop > 1 - Fraction(1, 1000)
    assert spans[-1].stop == 1


def test_a_simple_root_at_a_dyadic_instant_is_one_switch():
    passing = line(0.0, 0.0, 2.0)
    mission = mission_at(passing, "a: {center: [1.0, 0.0, 1.0], radii: [0.25, 0.25, 0.25]}")
    spans = spans_of(mission, passing)["a"]  # enters at x = 0.75, t = 3/8
    assert [s.mark for s in spans] == ["no", "switch", "must", "switch", "no"]
    assert spans[1].start <= Fraction(3, 8) <= spans[1].stop


def test_two_roots_a_nanosecond_apart_are_two_switches():
    radius = 0.2
    depth = radius - np.sqrt(radius**2 - 1e-18)  # inside for 2e-9 m at 2 m/s
    trajectory = line(radius - max(depth, 1e-17), 0.0, 2.0)
    marks = [s.mark for s in spans_of(mission_at(trajectory, BALL), trajectory)["a"]]
    _, roots = crossings(trajectory, small_mission(regions=BALL).all_regions["a"])
    assert marks.count("switch") == len(roots) or "may" in marks


def test_three_crossings_within_microseconds_are_three_switches():
    # x = 1/4 + h with h = u (u^2 - d^2), u = t - 1/2, d = 2^-20: out, in and out again where |h| < 2^-61, below any rounding
    square = 2.0**-40
    coefficients = np.zeros((1, 4, 8))
    coefficients[0, :3, 0] = [0.125 + square / 2, 0.0, 1.0]
    coefficients[0, 0, 1:4] = [0.75 - square, -1.5, 1.0]
    wobbling = Trajectory([1.0], coefficients)
    mission = mission_at(wobbling, "a: {center: [0.0, 0.0, 1.0], radii: [0.25, 0.25, 0.25]}")
    spans = spans_of(mission, wobbling)["a"]
    assert [s.mark for s in spans] == ["must", "switch", "no", "switch", "must", "switch", "no"]
    for span, crossing in zip(spans[1::2], (-1, 0, 1), strict=True):
        assert span.start <= Fraction(1, 2) + crossing * Fraction(1, 2**20) <= span.stop
    for span in spans[0::2]:
        assert inside(wobbling, mission.all_regions["a"], (span.start + span.stop) / 2) == (span.mark == "must")


def test_an_exit_and_re_entry_between_two_samples_is_seen():
    # a bump of 2 ms across the boundary: a 100 Hz sampler that misses the bump sees nothing
    coefficients = np.zeros((3, 4, 8))
    coefficients[:, 2, 0] = 1.0
    coefficients[:, 0, 0] = [1.19, 1.19, 1.19]
    coefficients[1, 0, 1:3] = [0.02 * 4 / 0.002, -0.02 * 4 / 0.002**2]
    trajectory = Trajectory([0.5005, 0.002, 0.5], coefficients)
    mission = mission_at(trajectory, BALL)
    sampled = trajectory.evaluate(np.arange(0, 1, 0.01))[:, :3]
    assert np.all(mission.all_regions["a"].level(sampled) <= 1)
    marks = [s.mark for s in spans_of(mission, trajectory)["a"]]
    assert marks == ["must", "switch", "no", "switch", "must"]


def test_the_step_between_two_pieces_is_labelled():
    coefficients = np.zeros((2, 4, 8))
    coefficients[:, 2, 0] = 1.0
    coefficients[:, 0, 0] = [0.0, 2.0]  # a jump of 2 m right through the region
    trajectory = Trajectory([1.0, 1.0], coefficients)
    mission = mission_at(trajectory, BALL)
    spans = spans_of(mission, trajectory)["a"]
    assert spans[0].mark == spans[-1].mark == "no"
    assert any(span.mark != "no" and span.start == span.stop == 1 for span in spans)
    inward = np.array(coefficients)
    inward[1, 0, 0] = 1.0  # a jump into it: one switch at exactly one instant
    spans = spans_of(mission, Trajectory([1.0, 1.0], inward))["a"]
    assert [(s.mark, s.start, s.stop) for s in spans] == [("no", 0, 1), ("switch", 1, 1), ("must", 1, 2)]


def test_the_hover_after_the_end_is_labelled_until_the_teams_end():
    mission = small_mission(regions=BALL, starts=[[0.0, 0.0, 1.0], [0.0, 2.0, 1.0]])
    first, second = legs([[0, 0, 1], [1, 0, 1]]), legs([[0, 2, 1], [2, 2, 1]], speed=0.2)
    paths = read_team(mission, {"r0": first, "r1": second})
    spans = statuses(membership_polynomials(paths), Fraction(1, 20))["r0"]["a"]
    assert spans[-1].mark == "must"
    assert spans[-1].stop == paths.end == Fraction(second.duration)


def test_changes_follow_the_spans():
    trajectory = line(0.0)
    mission = mission_at(trajectory, BALL)
    initial, found = changes(spans_of(mission, trajectory))
    assert initial == {"a": "no"}
    assert [c.status for c in found] == ["must", "no"]
    assert all(c.time.low < c.time.high for c in found)
    initial, found = changes(spans_of(mission, trajectory, Fraction(1, 20)))
    assert [c.status for c in found] == ["may", "must", "may", "no"]
    assert all(c.time.low == c.time.high for c in found)


def test_a_margin_as_large_as_the_region_leaves_no_must():
    trajectory = legs([[0, 0, 1], [1, 0, 1]])
    marks = [s.mark for s in spans_of(small_mission(regions=BALL), trajectory, Fraction(1, 5))["a"]]
    assert marks == ["no", "may"]


def test_thin_and_tiny_regions():
    thin = "a: {center: [1.0, 0.0, 1.0], radii: [0.0001, 2.0, 2.0], yaw_deg: 17}"
    trajectory = line(0.01)
    marks = [s.mark for s in spans_of(mission_at(trajectory, thin), trajectory)["a"]]
    assert marks == ["no", "switch", "must", "switch", "no"]
    assert [s.mark for s in spans_of(mission_at(trajectory, thin), trajectory, Fraction(1, 100))["a"]] == ["no", "may", "no"]


def test_the_scale_of_a_region_bounds_its_stored_matrix():
    rng = np.random.default_rng(3)
    for _ in range(50):
        radii = tuple(float(r) for r in rng.uniform(0.05, 2, 3))
        region = Region(center=(0.0, 0.0, 0.0), radii=radii, yaw_deg=float(rng.uniform(-180, 180)))
        found = extent(Ellipsoid.of(region))
        for _ in range(20):
            direction = rng.normal(size=3)
            exact = [Fraction(float(x)) for x in direction]
            matrix = [[Fraction(x) for x in row] for row in region.matrix]
            level = sum(exact[i] * matrix[i][j] * exact[j] for i in range(3) for j in range(3))
            length2 = sum(x * x for x in exact)
            assert length2 / found.reach**2 <= level <= found.scale**2 * length2
        assert float(found.scale) == pytest.approx(1 / min(radii), rel=1e-9)


def random_region(rng, spread=0.6):
    return Region(
        center=tuple(float(x) for x in rng.uniform(-spread, spread, 3)),
        radii=tuple(float(r) for r in rng.uniform(0.05, 0.8, 3)),
        yaw_deg=float(rng.uniform(-180, 180)),
    )


@few_of(1, "count", [40, 150])
def test_relations_are_never_wrong(count):
    rng = np.random.default_rng(4)
    apart = within = 0
    for _ in range(count):
        a, b = random_region(rng), random_region(rng)
        first, second = Ellipsoid.of(a), Ellipsoid.of(b)
        sphere = rng.normal(size=(4000, 3))
        sphere *= (rng.uniform(size=4000) ** (1 / 3) / np.linalg.norm(sphere, axis=1))[:, None]
        points = np.array(a.center) + sphere @ np.linalg.cholesky(np.linalg.inv(a.shape)).T
        in_b = b.level(points) <= 1
        if are_disjoint(first, second):
            apart += 1
            assert not in_b.any()
        if lies_inside(first, second):
            within += 1
            assert in_b.all()
    assert apart > 5
    shrunk = 0
    for _ in range(30):
        outer = random_region(rng)
        inner = outer.model_copy(update={"radii": tuple(0.9 * r for r in outer.radii), "matrix": None})
        inner = Region(center=outer.center, radii=inner.radii, yaw_deg=outer.yaw_deg)
        shrunk += lies_inside(Ellipsoid.of(inner), Ellipsoid.of(outer))
        assert not lies_inside(Ellipsoid.of(outer), Ellipsoid.of(inner))
    assert shrunk == 30


def test_relations_of_a_mission_are_sorted_pairs():
    mission = small_mission(
        regions="""big: {center: [1.0, 0.0, 1.0], radii: [0.5, 0.5, 0.5]}
inner: {center: [1.1, 0.0, 1.0], radii: [0.2, 0.1, 0.2], yaw_deg: 40}
far: {center: [-1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}
touching: {center: [-1.3, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}"""
    )
    found = relations(mission)
    assert found.disjoint == {("big", "far"), ("far", "inner"), ("big", "touching"), ("inner", "touching")}
    assert found.nested == {("inner", "big")}


def test_the_second_method_agrees_with_samples():
    trajectory = wandering(np.random.default_rng(5), pieces=2)
    region = small_mission(regions=THREE).all_regions["a"]
    for k in range(40):
        time = Fraction(k, 40) * Fraction(trajectory.duration)
        level = float(region.level(trajectory.evaluate(float(time))[:3]))
        if abs(level - 1) > 1e-9:
            assert inside(trajectory, region, time) == (level <= 1)
    assert membership(trajectory, 0, region).degree() <= 14
    assert quantised(trajectory) == trajectory
    assert plan_of(small_mission(), {}).robots["r0"].visits == ()
