"""Limits of legs: when a robot is on its way to a region, against dense samples and where regions hold or overlap each other."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import pytest

from tests.helpers.few import few_of
from tests.helpers.kernel.witnesses import Right, around, assert_refused, judged
from tests.helpers.motion.flights import legs, plan_of, quantised, small_mission
from verify.data.mission import Mission
from verify.data.plan import Plan, Visit
from verify.data.trajectory import Trajectory
from verify.data.validation.faults import MissionError


def limited_plan(mission: Mission, visits: str, cycle_visit: int | None = None) -> Plan:
    plan = plan_of(mission, {"r0": [Visit(region=region) for region in visits]})
    robot = plan.robots["r0"].model_copy(update={"cycle_visit": cycle_visit})
    return plan.model_copy(update={"robots": {"r0": robot}})


def world(regions: str, leg: str, *, start: tuple[float, float, float] = (0.0, 0.0, 1.0), margin: float = 0.03) -> Mission:
    return small_mission(regions=regions, starts=[start], margin=margin, extra=f"limits: {{legs: {{{leg}}}}}")


def joined(*parts: Trajectory, cycle: int | None = None) -> Trajectory:
    durations, coefficients = (np.concatenate([getattr(p, key) for p in parts]) for key in ("durations", "coefficients"))
    return Trajectory(durations, coefficients, cycle=cycle)


def kept(plan: Plan, team: dict[str, Trajectory]) -> bool:
    """Tell whether the limits of legs are kept; some flights here are harder than the vehicle's own limits allow."""
    return all(claim.outcome == "holds" for claim in judged(plan, team).claims if claim.name.startswith("limits.legs"))


NESTED = """h: {center: [3.0, 0.0, 1.0], radii: [2.0, 1.0, 1.0]}
a: {center: [3.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}
b: {center: [4.2, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}"""
"""A house h with rooms a and b in it."""


@pytest.mark.parametrize("inside", [False, True])
def test_a_house_around_a_region_ends_no_way_there(inside):
    """0.8 m/s on average reach 1.75 m/s: before the house or in it, on the way to the room in it."""
    points = [[0, 0, 1], [0.6, 0, 1], [3, 0, 1]]
    fast, slow = (0.2, 0.8) if inside else (0.8, 0.2)
    team = {"r0": joined(legs(points[:2], speed=fast), legs(points[1:], speed=slow))}
    peak = 2.1875 * 0.8
    assert_refused(
        judged(limited_plan(world(NESTED, "a: {speed: 0.5}"), "ha"), team),
        Right("limits.legs.speed", "r0", "a", 1, off=around(peak - 0.5, 1e-3), says="1.75"),
    )
    assert kept(limited_plan(world(NESTED, f"a: {{speed: {peak * 1.001}}}"), "ha"), team)


def test_within_a_house_a_way_begins_where_the_room_before_ends():
    to_a, to_b = legs([[0, 0, 1], [3, 0, 1]], speed=0.8), legs([[3, 0, 1], [4.2, 0, 1]], speed=0.2)
    plan = limited_plan(world(NESTED, "b: {speed: 0.5}"), "hab")
    assert judged(plan, {"r0": joined(to_a, to_b)}).holds
    swift = legs([[3, 0, 1], [4.2, 0, 1]], speed=0.3)
    assert_refused(judged(plan, {"r0": joined(to_a, swift)}), Right("limits.legs.speed", "r0", "b", 2, off=around(0.156, 1e-2)))


@few_of(2, "gap", [-0.1, -0.001, 0.0, 0.02, 0.05])
def test_regions_that_overlap_or_come_within_the_margin_hide_no_way(gap):
    """The way to b leads through a, which is not left for sure before b is entered."""
    regions = f"""a: {{center: [1.5, 0.0, 1.0], radii: [0.5, 0.5, 0.5]}}
b: {{center: [{2.5 + gap}, 0.0, 1.0], radii: [0.5, 0.5, 0.5]}}"""
    team = {"r0": joined(legs([[0, 0, 1], [1.5, 0, 1]], speed=0.8), legs([[1.5, 0, 1], [2.6, 0, 1]], speed=0.2))}
    plan = limited_plan(world(regions, "b: {speed: 0.5}"), "ab")
    assert_refused(judged(plan, team), Right("limits.legs.speed", "r0", "b", 1, around(0.94, 0.1), off=around(1.25, 1e-3)))
    apart = regions.replace(str(2.5 + gap), "2.57")
    assert judged(limited_plan(world(apart, "b: {speed: 0.5}"), "ab"), team).holds


A = "a: {center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}"
AB = A + "\nb: {center: [3.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}"


def out_and_back(depth: float, out: float, seconds: float) -> Trajectory:
    """Fly along x from `depth` inside of a to `out` outside of it and back, and on to rest."""
    inside, outside = 1.2 - depth, 1.2 + out
    way = legs([[inside, 0, 1], [outside, 0, 1], [inside, 0, 1]], speed=1.0)
    durations = np.full(2, np.float32(seconds), dtype=np.float64)
    return quantised(
        Trajectory(durations, way.coefficients * (way.durations / durations)[:, None, None] ** np.arange(8))
    )  # fmt: skip


@few_of(1, "limited", ["a", "b"])
@pytest.mark.parametrize(("depth", "seconds"), [(0.1, 0.2), (0.05, 0.15)])
def test_an_excursion_within_the_margin_is_on_the_way(limited, depth, seconds):
    """Out of a by 0.015 m and back, with a margin of 0.03 m: one visit, in which the robot hurries by itself."""
    before, hurry = legs([[0, 0, 1], [1.2 - depth, 0, 1]], speed=0.2), out_and_back(depth, 0.015, seconds)
    team = {"r0": joined(before, hurry, legs([[1.2 - depth, 0, 1], [3, 0, 1]], speed=0.2))}
    middle = float(before.duration + seconds)
    plan = limited_plan(world(AB, f"{limited}: {{acceleration: 8.0}}"), "ab")
    visit = "ab".index(limited)
    (claim,) = assert_refused(
        judged(plan, team), Right("limits.legs.acceleration", "r0", limited, visit, (middle - seconds, middle + seconds))
    )
    out = np.linspace(middle - seconds, middle + seconds, 4001)
    away = team["r0"].evaluate(out)[:, 0] > 1.2 - 0.03
    peak = np.linalg.norm(team["r0"].evaluate(out[away], 2)[:, :3], axis=1).max()
    assert claim.bound == pytest.approx(peak, rel=1e-2)
    assert kept(limited_plan(world(AB, f"{limited}: {{acceleration: {peak * 1.02}}}"), "ab"), team)


def hurried_start_of_a_lap() -> Trajectory:
    """Hover in a for 3 s; then lap after lap out of a by 0.015 m and back in a hurry, on to b, and back into a."""
    hurry, there = out_and_back(0.05, 0.015, 0.15), [1.15, 0, 1]
    return joined(legs([there], hold=3.0), hurry, legs([there, [3, 0, 1], there], speed=0.2), cycle=1)


def lap_world(leg: str) -> Mission:
    return small_mission(
        regions=AB,
        starts=[(float(np.float32(1.15)), 0.0, 1.0)],
        margin=0.03,
        trace="infinite",
        extra=f"limits: {{legs: {{{leg}}}}}",
    )


def test_an_excursion_just_after_the_seam_is_on_the_way_that_began_in_the_lap_before():
    """The robot starts in a, which is no visit; the visit of a lasts from one lap into the next, where the hurry is."""
    team = {"r0": hurried_start_of_a_lap()}
    plan = limited_plan(lap_world("a: {acceleration: 8.0}"), "ba", 0)
    assert_refused(judged(plan, team), Right("limits.legs.acceleration", "r0", "a", 1, (3.0, 3.3)))
    assert kept(limited_plan(lap_world("a: {acceleration: 40.0}"), "ba", 0), team)
    # before the first lap begins, and with it the stay that is no visit, nothing is on the way
    jolt = joined(
        out_and_back(0.05, 0.015, 0.15), legs([[1.15, 0, 1]], hold=3.0), legs([[1.15, 0, 1], [3, 0, 1], [1.15, 0, 1]]), cycle=2
    )
    assert kept(limited_plan(lap_world("a: {acceleration: 8.0}"), "ba", 0), {"r0": jolt})


def test_ways_of_a_lasso_whose_visits_do_not_match_are_those_of_its_first_lap():
    team = {"r0": hurried_start_of_a_lap()}
    plan = limited_plan(lap_world("b: {speed: 0.1}"), "abab", 1)
    failed = {(c.name, c.witness.visit, c.outcome) for c in judged(plan, team).claims if c.outcome != "holds"}
    assert ("visits", 3, "fails") in failed
    assert ("limits.legs.speed", 1, "fails") in failed
    assert ("limits.legs", 3, "undecided") in failed


def test_a_second_dip_that_is_not_deep_enough_to_be_sure_is_on_the_way():
    """In a for sure, out by 0.02 m, back in by 0.02 m, and away: the nominal path comes back, which no tube proves."""
    hurry = legs([[1.1, 0, 1], [1.22, 0, 1], [1.18, 0, 1]], speed=0.8)
    team = {"r0": joined(legs([[0, 0, 1], [1.1, 0, 1]], speed=0.1), hurry, legs([[1.18, 0, 1], [2, 0, 1]], speed=0.1))}
    assert_refused(
        judged(limited_plan(world(A, "a: {acceleration: 2.0}"), "a"), team), Right("limits.legs.acceleration", "r0", "a", 0)
    )
    straight = joined(legs([[0, 0, 1], [1.1, 0, 1]], speed=0.1), legs([[1.1, 0, 1], [2, 0, 1]], speed=0.8))
    assert judged(limited_plan(world(A, "a: {speed: 0.5}"), "a"), {"r0": straight}).holds
    slow = legs([[0, 0, 1], [1.1, 0, 1], [1.22, 0, 1], [1.195, 0, 1]], speed=0.03)
    within = legs([[1.195, 0, 1], [1.18, 0, 1]], speed=0.06)  # in a hurry where it is back already, but not for sure
    team = {"r0": joined(slow, within, legs([[1.18, 0, 1], [2, 0, 1]], speed=0.03))}
    assert [kept(limited_plan(world(A, f"a: {{speed: {most}}}"), "a"), team) for most in (0.1, 0.14)] == [False, True]


def test_who_starts_in_a_region_is_not_on_the_way_there():
    mission = world(AB, "a: {speed: 0.5}, b: {speed: 2.0}", start=(1.0, 0.0, 1.0))
    team = {"r0": legs([[1, 0, 1], [3, 0, 1]], speed=0.8)}
    certificate = judged(limited_plan(mission, "ab"), team)
    assert certificate.holds
    (said,) = (claim.sentence for claim in certificate.claims if claim.name == "limits.legs")
    assert "in 'a' from its start on" in said
    back = {"r0": joined(team["r0"], legs([[3, 0, 1], [1, 0, 1]], speed=0.8))}
    assert_refused(judged(limited_plan(mission, "aba"), back), Right("limits.legs.speed", "r0", "a", 2, says="1.75"))


def test_a_region_that_nobody_visits_is_said_to_bind_none():
    certificate = judged(limited_plan(world(AB, "b: {speed: 0.1}"), "a"), {"r0": legs([[0, 0, 1], [1, 0, 1]])})
    assert certificate.holds
    (said,) = (claim.sentence for claim in certificate.claims if claim.name == "limits.legs")
    assert said.startswith("No robot goes to 'b'")
    missed = judged(limited_plan(world(AB, "b: {speed: 0.1}"), "a"), {"r0": legs([[0, 0, 1], [0, 1, 1]])})
    assert {claim.name for claim in missed.claims if claim.outcome != "holds"} == {"visits", "limits.legs"}


# Against dense samples: random flights among regions that hold, overlap and touch each other.

STEP = 1e-3
"""s between samples."""


@dataclass
class Sampled:
    """One stay by samples: indices from and to, which of them are surely inside, and which are inside on the path itself."""

    region: str
    first: int
    last: int
    surely: np.ndarray
    inside: np.ndarray


def sampled_stays(path: Trajectory, mission: Mission, times: np.ndarray) -> list[Sampled]:
    """Read stays off the samples, by distances from balls."""
    points, margin, found = path.evaluate(times)[:, :3], mission.margin, []
    for name, region in mission.all_regions.items():
        distance = np.linalg.norm(points - np.array(region.center), axis=1)
        near = np.concatenate([[False], distance <= region.radii[0] + margin, [False]])
        for first, end in zip(np.flatnonzero(near[1:] & ~near[:-1]), np.flatnonzero(~near[1:] & near[:-1]), strict=True):
            row = slice(int(first), int(end))
            surely, inside = distance[row] <= region.radii[0] - margin, distance[row] <= region.radii[0]
            found.append(
                Sampled(name, int(first), int(end) - 1, np.flatnonzero(surely) + first, np.flatnonzero(inside) + first)
            )
    return sorted(found, key=lambda stay: (stay.first, stay.last))


def on_the_way(stays: list[Sampled], index: int) -> set[int]:
    """Return the samples on the way to a stay, straight from the words of docs/semantics.md."""
    stay = stays[index]
    arrival = int(stay.surely[0])
    over = [earlier for earlier in stays[:index] if earlier.last < stay.first]
    begin, resting = (int(over[-1].surely[0]), set(over[-1].surely.tolist())) if over else (0, set[int]())
    found = set(range(begin, arrival + 1)) - resting
    found |= set(range(arrival, int(stay.surely[-1]))) - set(stay.surely.tolist())
    later = stay.inside[stay.inside >= stay.surely[-1]]
    gaps = [i for i, (a, b) in enumerate(itertools.pairwise(later.tolist())) if b > a + 1]
    if gaps:  # the path itself leaves and comes back
        found |= set(range(int(later[gaps[0]]), int(later[-1]) + 1))
    return found


def random_flight(rng: np.random.Generator, pieces: int, cycle: int | None) -> Trajectory:
    """Return pieces between random points, each begun and ended with the same random velocities: laps close."""
    points = rng.uniform(-1.0, 1.0, (pieces + 1, 3)) + np.array([0.0, 0.0, 1.0])
    speeds = rng.uniform(-0.6, 0.6, (pieces + 1, 3))
    speeds[0] = speeds[-1] = 0.0
    if cycle is not None:
        points[-1], speeds[-1] = points[cycle], speeds[cycle]
    durations = rng.uniform(0.8, 2.0, pieces)
    values = np.zeros((pieces, 4, 8))
    for piece, length in enumerate(durations):
        rows, sides = [], []
        for at, node in ((0.0, piece), (length, piece + 1)):
            for order, value in enumerate((points[node], speeds[node], np.zeros(3), np.zeros(3))):
                powers = [np.polynomial.polynomial.polyval(at, np.polynomial.polynomial.polyder(e, order)) for e in np.eye(8)]
                rows.append(powers)
                sides.append(value)
        values[piece, :3] = np.linalg.solve(np.array(rows), np.array(sides)).T
    return quantised(Trajectory(durations, values, cycle=cycle))


def random_balls(rng: np.random.Generator) -> str:
    """Return three balls: one in another, or anywhere."""
    rows = []
    for name in "abc":
        centre, radius = rng.uniform(-0.7, 0.7, 3) + np.array([0.0, 0.0, 1.0]), float(rng.choice([0.15, 0.3, 0.6]))
        if rows and rng.random() < 0.4:
            centre = rows[-1][1] + rng.uniform(-0.2, 0.2, 3)
        rows.append((name, centre, radius))
    return "\n".join(f"{n}: {{center: {[float(x) for x in c]}, radii: [{r}, {r}, {r}]}}" for n, c, r in rows)


@pytest.mark.parametrize("lasso", [pytest.param(False, marks=pytest.mark.slow), True])
@pytest.mark.parametrize("count", [6, *(pytest.param(count, marks=pytest.mark.slow) for count in (14, 400))])
def test_limits_of_legs_against_dense_samples(lasso, count):
    rng = np.random.default_rng(count + lasso)
    judgements = 0
    for _ in range(count):
        cycle = int(rng.integers(0, 3)) if lasso else None
        path = random_flight(rng, int(rng.integers(3, 6)), cycle)
        start = tuple(float(x) for x in path.coefficients[0, :3, 0])
        trace = "infinite" if lasso else "finite"
        try:
            mission = small_mission(regions=random_balls(rng), starts=[start], margin=0.03, trace=trace)
        except MissionError:
            continue  # it starts at an edge
        knot = None if cycle is None else float(path.knots[cycle])
        end = path.duration + (0.0 if knot is None else path.duration - knot)
        times = np.arange(0.0, end, STEP)
        stays = sampled_stays(path, mission, times)
        made = [stay for stay in stays if times[stay.first] < path.duration - 2 * STEP]
        if not all(len(stay.surely) > 20 for stay in made) or not made:
            continue
        cycle_visit = None if knot is None else 2 * len(made) - len(stays)
        certificate = judged(limited_plan(mission, "".join(stay.region for stay in made), cycle_visit), {"r0": path})
        if any(c.outcome != "holds" for c in certificate.claims if c.name == "visits"):
            continue  # an edge that samples do not see
        speed = np.linalg.norm(path.evaluate(times, 1)[:, :3], axis=1)
        most = []
        for index in range(len(made)):
            samples = on_the_way(stays, index)
            if cycle_visit is not None and index >= cycle_visit:
                samples |= on_the_way(stays, index + len(made) - cycle_visit)
            most.append(max((float(speed[i]) for i in samples), default=0.0))
        pick = int(rng.integers(0, len(made)))
        if most[pick] < 0.1:
            continue
        for factor in (0.97, 1.03):
            own = {made[pick].region: {"speed": most[pick] * factor}}
            limits = mission.limits.model_validate({"legs": own})
            plan = limited_plan(mission.model_copy(update={"limits": limits}), "".join(s.region for s in made), cycle_visit)
            claims = [claim for claim in judged(plan, {"r0": path}).claims if claim.name.startswith("limits.legs")]
            for claim in claims:
                if claim.outcome != "holds":
                    assert most[claim.witness.visit] > claim.limit * 0.985, (claim.sentence, most)
                    assert claim.outcome == "fails"
            held = {claim.outcome for claim in claims}
            same = [m for stay, m in zip(made, most, strict=True) if stay.region == made[pick].region]
            if max(same) > own[made[pick].region]["speed"] * 1.015:
                assert "fails" in held, (most, pick, factor)
            judgements += 1
    assert judgements > count / 4
