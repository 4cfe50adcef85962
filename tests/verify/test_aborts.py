"""Braking to a hover from any instant: the judge against dense sampling, and against what vehicles do when they are told to hold."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from flight.link.simulated_commander import Commander
from flight.monitoring.alarm_response import braking_length
from tests.helpers.few import few_of
from tests.helpers.motion.braking import brakes, closest
from tests.helpers.motion.dense_motion import SampledFlight, body_rates, rotor_thrusts
from tests.helpers.motion.stand_ins import hover, minimum_snap, rest_to_rest
from verify.aborts import judge_aborts
from verify.claims.claim import told_apart
from verify.data import BadInput, Mission, Trajectory, parse_mission

MISSION = """
format: 1
name: pair
spec: {formula: "true"}
regions: {left: {center: [-1.0, 0.4, 1.0], radii: [0.25, 0.25, 0.25]}}
obstacles: {pillar: {center: [0.0, 1.2, 1.0], size: [0.3, 0.3, 2.0]}}
agents:
  one: {start: [-1.0, 0.0, 1.0]}
  two: {start: [1.0, 0.0, 1.0]}
vehicle: crazyflie-2.1
workspace: {min: [-3.0, -3.0, 0.0], max: [3.0, 3.0, 3.0]}
separation: 0.3
margin: 0.03
"""
LENGTH = 1.0


def mission(**changes: object) -> Mission:
    return parse_mission(MISSION).model_copy(update=changes)


def swerving(gap: float) -> dict[str, Trajectory]:
    """Two robots that fly at one another and turn off in time, each to its own side."""
    one = minimum_snap([(-1, 0, 1), (-0.5 - gap / 2, 0.0, 1), (-0.5 - gap / 2, -1.0, 1)], [0.9, 1.6])
    two = minimum_snap([(1, 0, 1), (-0.5 + gap / 2 + 0.4, 0.0, 1), (0.5, 1.0, 1)], [1.6, 1.6])
    return {"one": one, "two": two}


def test_braking_of_robots_far_apart_is_certified() -> None:
    team = {"one": rest_to_rest([(-1, 0, 1), (-1, -2, 1)], [4.0]), "two": rest_to_rest([(1, 0, 1), (1, -2, 1)], [3.0])}
    verdict = judge_aborts(mission(), team, length=LENGTH)
    assert verdict, verdict.sentence
    assert verdict.sentence.startswith("Abort certified: from every instant all robots brake to a hover within 1 s")
    assert closest(team, LENGTH) > 0.36


def test_robots_that_turn_off_before_they_meet_may_not_brake() -> None:
    team = {
        "one": minimum_snap([(-1, 0, 1), (-0.25, 0.0, 1), (-0.25, -0.8, 1)], [1.2, 1.2]),
        "two": minimum_snap([(1, 0, 1), (0.25, 0.0, 1), (0.25, 0.8, 1)], [1.2, 1.2]),
    }
    times = np.linspace(0.0, 2.4, 2000)
    apart = np.linalg.norm(team["one"].evaluate(times)[:, :3] - team["two"].evaluate(times)[:, :3], axis=1).min()
    assert apart > 0.36 > closest(team, LENGTH)
    verdict = judge_aborts(mission(), team, length=LENGTH)
    assert not verdict
    assert verdict.refused[0].name == "separation"
    assert verdict.refused[0].outcome == "fails"
    assert verdict.sentence.startswith("Abort not certified: ")


def test_braking_that_leads_into_an_obstacle_or_a_wall_is_refused() -> None:
    still = hover(place=(1.0, 0.0, 1.0), duration=2.0)
    course = minimum_snap([(-1, 0, 1), (0, -0.6, 1), (0, 0.9, 1), (1.0, 0.2, 1)], [1.6, 1.2, 1.3])
    nearest = course.evaluate(np.linspace(0.0, course.duration, 999))[:, :2] - np.array([0.0, 1.05])
    assert np.linalg.norm(nearest, axis=1).min() > 0.14
    verdict = judge_aborts(mission(), {"one": course, "two": hover(place=(-2.0, 0.0, 1.0))}, length=LENGTH)
    assert {claim.name for claim in verdict.refused} == {"obstacles"}, verdict.sentence
    low = mission(workspace=mission().workspace.model_copy(update={"min": (-3.0, -0.1, 0.0)}))
    turning = minimum_snap([(-1, 0, 1), (-1, 0.8, 1), (-1.0, 0.0, 1.0), (-1.5, 0.6, 1.0)], [1.5, 1.5, 1.5])
    assert float(turning.evaluate(np.linspace(0, 4.5, 999))[:, 1].min()) > -0.07
    verdict = judge_aborts(low, {"one": turning, "two": still}, length=LENGTH)
    assert verdict.refused[0].name == "workspace"


def test_what_the_vehicle_cannot_do_is_refused() -> None:
    fast = {"one": rest_to_rest([(-1, 0, 1), (-1, -1.2, 1)], [2.5]), "two": hover(place=(1.0, 0.0, 1.0))}
    assert judge_aborts(mission(), fast, length=LENGTH)
    verdict = judge_aborts(mission(), fast, length=0.15)
    assert not verdict
    assert all(claim.name.startswith("limits.") for claim in verdict.refused)


@pytest.mark.slow
def test_laps_and_clocks_that_differ_are_judged() -> None:
    spec = mission().spec.model_copy(update={"trace": "infinite"})
    there_and_back = [(-1, 0, 1), (-1, -1, 1), (-1, 0, 1)]
    again = rest_to_rest(there_and_back, [3.0, 3.0])
    lap = Trajectory(again.durations, again.coefficients, cycle=0)
    other = rest_to_rest([(-1, -0.45, 1), (-1, -1.45, 1), (-1, -0.45, 1)], [3.0, 3.0])
    team = {"one": lap, "two": Trajectory(other.durations, other.coefficients, cycle=0)}
    flown = mission(spec=spec)
    assert judge_aborts(flown, team, length=LENGTH)
    assert judge_aborts(flown, team, length=LENGTH, clock_error=0.05)
    assert not judge_aborts(flown, team, length=LENGTH, clock_error=1.5)


def circling(radius: float, period: float, pieces: int = 16) -> Trajectory:
    """A lap around (-1, 0, 1) that is never at rest, by Taylor polynomials of sine and cosine."""
    coefficients, rate = np.zeros((pieces, 4, 8)), 2 * np.pi / period
    for piece, angle in enumerate(2 * np.pi * np.arange(pieces) / pieces):
        for power in range(8):
            size = radius * rate**power / math.factorial(power)
            coefficients[piece, :2, power] = size * np.array(
                [np.cos(angle + power * np.pi / 2), np.sin(angle + power * np.pi / 2)]
            )
    coefficients[:, :3, 0] += (-1.0, 0.0, 1.0)
    return Trajectory(np.full(pieces, period / pieces), coefficients, cycle=0)


@pytest.mark.parametrize(("clear", "certified"), [(0.005, True), (-0.005, False)])
def test_laps_that_are_never_at_rest_brake_as_far_as_sampled(clear: float, certified: bool) -> None:
    lap = circling(0.5, 8.0)
    farthest = float(brakes(lap, np.linspace(0.0, 7.999, 400), np.linspace(0.0, 1.0, 40), LENGTH)[..., 1].max())
    assert farthest > 0.506, "further out than the circle"
    wall = farthest + clear + mission().margin
    agent = mission().agents["one"].model_copy(update={"start": (-0.5, 0.0, 1.0)})
    flown = mission(
        spec=mission().spec.model_copy(update={"trace": "infinite"}),
        workspace=mission().workspace.model_copy(update={"max": (3.0, wall, 3.0)}),
        obstacles={},
        agents={"one": agent},
    )
    verdict = judge_aborts(flown, {"one": lap}, length=LENGTH)
    assert bool(verdict) == certified, verdict.sentence
    assert certified or {claim.name for claim in verdict.refused} == {"workspace"}


def test_bad_input_is_refused() -> None:
    team = {"one": hover(place=(-1.0, 0.0, 1.0)), "two": hover(place=(1.0, 0.0, 1.0))}
    with pytest.raises(BadInput, match=r"length must be a number from 0\.001"):
        judge_aborts(mission(), team, length=0.0)
    with pytest.raises(BadInput, match="margin must be"):
        judge_aborts(mission(), team, length=LENGTH, margin=-1.0)
    with pytest.raises(BadInput, match="The team has robots one; the mission has one, two"):
        judge_aborts(mission(), {"one": team["one"]}, length=LENGTH)


def test_vehicles_that_are_told_to_hold_brake_as_it_is_judged() -> None:
    path, shares = swerving(0.6)["one"], np.linspace(0.0, 1.0, 9)
    assert braking_length(mission()) == LENGTH
    for now in np.random.default_rng(0).uniform(0.0, path.duration, 12):
        commander = Commander(np.array([-1.0, 0.0, 1.0, 0.0]), LENGTH)
        commander.store(0, path)
        commander.start(0, 0.0)
        commander.hold(float(now))
        wanted = np.array([commander.wanted(float(now) + LENGTH * s)[0, :3] for s in shares])
        assert np.allclose(wanted, brakes(path, np.array([now]), shares, LENGTH)[:, 0], atol=1e-9)


def test_vehicles_that_hold_slow_their_turning_down_as_it_is_judged() -> None:
    path, begin = swerving(0.6)["one"], 0.4
    coefficients = path.coefficients.copy()
    coefficients[:, 3] = coefficients[:, 1]  # it turns as it flies along y
    turning = Trajectory(path.durations, coefficients)
    commander = Commander(np.array([-1.0, 0.0, 1.0, 0.0]), LENGTH)
    commander.store(0, turning)
    commander.start(0, 0.0)
    commander.hold(begin)
    for share in np.linspace(0.0, 0.999, 7):
        wanted = commander.wanted(begin + LENGTH * float(share))
        assert np.allclose(wanted[:, 3], wanted[:, 1], atol=1e-12)
    assert np.allclose(commander.wanted(begin)[1:4, 3], [turning.evaluate(begin, order)[3] for order in (1, 2, 3)])
    assert np.allclose(commander.wanted(begin + LENGTH)[1:4, 3], 0.0)


@pytest.mark.slow
def test_the_verdict_agrees_with_dense_sampling_on_random_flights() -> None:
    rng, certified, refused = np.random.default_rng(4), 0, 0
    for _ in range(30):
        team: dict[str, Trajectory] = {}
        for name, x in (("one", -0.8), ("two", 0.8)):
            points = np.vstack([[x, 0.0, 1.0], rng.uniform((-1.0, -0.8, 0.7), (1.0, 0.8, 1.4), (2, 3))])
            team[name] = minimum_snap(points, rng.uniform(2.0, 3.0, 2))
        flown = mission(obstacles={})
        verdict, sampled = judge_aborts(flown, team, length=LENGTH), closest(team, LENGTH, instants=500, shares=40)
        asked = flown.separation + 2 * flown.margin
        if verdict:
            certified += 1
            assert sampled >= asked
        elif {claim.name for claim in verdict.refused} == {"separation"}:
            refused += 1
            assert sampled < asked + 0.03, "it refuses nothing that is clear by more than its intervals are wide"
    assert certified > 5
    assert refused > 5


def turning_brake(path: Trajectory, length: float) -> tuple[float, float, float]:
    """Return the greatest yaw rate, and the least and greatest rotor thrust, of braking from a grid of instants, by dense samples."""
    flown, shares = SampledFlight(path.durations, path.coefficients), np.linspace(0.0, 1.0, 41)
    times = np.repeat(flown.inner_times(0.02), len(shares))
    late = np.tile(shares, len(times) // len(shares)) * length
    motion, before = [flown.at(times, order) for order in (1, 2, 3)], flown.at(times)
    ends = [
        [length**3, length**4, length**5],
        [3 * length**2, 4 * length**3, 5 * length**4],
        [6 * length, 12 * length**2, 20 * length**3],
    ]
    v, a, j = motion
    left = -np.stack([v + length * a + 0.5 * length**2 * j, a + length * j, j]).reshape(3, -1)
    powers = [v, a, 0.5 * j, *np.linalg.solve(ends, left).reshape(3, *v.shape)]

    def flat(after: float) -> tuple[np.ndarray, np.ndarray]:
        t = (late + after)[:, None]
        acceleration = sum(k * c * t ** (k - 1) for k, c in enumerate(powers) if k)
        place = before + sum(c * t ** (k + 1) / (k + 1) for k, c in enumerate(powers))
        return acceleration[:, :3], place[:, 3]

    vehicle = mission().vehicle
    thrusts = rotor_thrusts(flat, vehicle.mass, vehicle.arm, vehicle.inertia, vehicle.torque_to_thrust)
    return float(np.abs(body_rates(flat)[:, 2]).max()), float(thrusts.min()), float(thrusts.max())


@few_of(1, "limit", ["yaw_rate_deg", "rotor_thrust_min", "rotor_thrust_max"])
@pytest.mark.slow
def test_yaw_rate_and_rotor_thrust_are_judged_as_sampled(limit: str) -> None:
    path = minimum_snap([(-1, 0, 1), (0.2, 0.9, 1.3), (0.9, -0.4, 0.8)], [1.9, 2.0])
    coefficients = path.coefficients.copy()
    coefficients[0, 3, 4:6] = np.float32([0.8, -0.3])
    coefficients[1, 3, 0] = np.float32(np.polynomial.polynomial.polyval(path.durations[0], coefficients[0, 3]))
    path = Trajectory(path.durations, coefficients)
    rate, least, greatest = turning_brake(path, LENGTH)
    reached, sign = {
        "yaw_rate_deg": (math.degrees(rate), 1.0),
        "rotor_thrust_min": (least, -1.0),
        "rotor_thrust_max": (greatest, 1.0),
    }[limit]
    agents = {"one": mission().agents["one"]}
    for share, certified in ((0.03, True), (-0.005, False)):
        vehicle = mission().vehicle.model_copy(update={limit: reached * (1 + sign * share)})
        verdict = judge_aborts(mission(vehicle=vehicle, agents=agents, obstacles={}), {"one": path}, length=LENGTH)
        assert bool(verdict) == certified, verdict.sentence
        assert certified or {claim.name for claim in verdict.refused} == {f"limits.{limit.removesuffix('_deg')}"}


def test_the_sentence_says_which_limits_are_covered() -> None:
    team = {"one": hover(place=(-1.0, 0.0, 1.0)), "two": hover(place=(1.0, 0.0, 1.0))}
    sentence = judge_aborts(mission(), team, length=LENGTH).sentence
    for limit in ("speed", "acceleration", "thrust", "tilt", "body rate", "yaw rate", "rotor thrust"):
        assert limit in sentence.split("within their limits of ")[1].split(";")[0]
    assert sentence.endswith("limits of single legs and endurance are not covered.")


def test_teams_of_any_size_are_judged() -> None:
    names = [f"q{k}" for k in range(12)]
    places = {name: (0.5 * (k % 4) - 2.0, 0.5 * (k // 4) - 2.0, 1.0) for k, name in enumerate(names)}
    agents = {name: mission().agents["one"].model_copy(update={"start": place}) for name, place in places.items()}
    many = mission(agents=agents, obstacles={})
    team = {name: rest_to_rest([place, (*place[:2], 1.5)], [3.0]) for name, place in places.items()}
    assert judge_aborts(many, team, length=LENGTH)
    near = {**team, "q9": rest_to_rest([places["q9"], places["q10"]], [1.8])}
    verdict = judge_aborts(many, near, length=LENGTH)
    assert {verdict.refused[0].robot, verdict.refused[0].other} == {"q9", "q10"}
    assert verdict.refused[0].outcome == "fails"


def test_a_refusal_says_who_when_and_how_near() -> None:
    team = {
        "one": minimum_snap([(-1, 0, 1), (-0.25, 0.0, 1), (-0.25, -0.8, 1)], [1.2, 1.2]),
        "two": minimum_snap([(1, 0, 1), (0.25, 0.0, 1), (0.25, 0.8, 1)], [1.2, 1.2]),
    }
    found = re.fullmatch(
        r"Abort not certified: one and two come within (\S+) m of one another (\S+) s into braking that begins at (\S+) s; "
        r"0\.3600 m are asked \(separation 0\.3 m, margin 0\.03 m\)\.",
        judge_aborts(mission(), team, length=LENGTH).sentence,
    )
    assert found is not None
    near, share, time = (float(number) for number in found.groups())
    one, two = (brakes(path, np.array([time]), np.array([share / LENGTH]), LENGTH)[0, 0] for path in team.values())
    assert float(np.linalg.norm(one - two)) == pytest.approx(near, abs=2e-3), "to the digits that are printed"


def test_a_tie_is_said_to_be_unproved() -> None:
    team = {"one": hover(place=(-1.0, 0.0, 1.0)), "two": hover(place=(-0.5, 0.0, 1.0))}
    agents = {
        name: mission().agents["one"].model_copy(update={"start": (x, 0.0, 1.0)}) for name, x in (("one", -1.0), ("two", -0.5))
    }
    verdict = judge_aborts(mission(agents=agents, separation=0.5), team, length=LENGTH, margin=0.0)
    assert not verdict
    assert verdict.sentence.startswith(
        "Abort not certified: it could not be proved that one and two keep apart 0.000 to 1.000 s into braking"
    )
    assert "0.5000 m is proved, and 0.5000 m is reached; 0.5000 m are asked" in verdict.sentence


@pytest.mark.parametrize(
    ("value", "limit", "text"),
    [(1.2345678, 1.0, "1.2346"), (1.0000000001, 1.0, "1.0000000001"), (0.99999999, 1.0, "0.99999999"), (1.0 + 1e-12, 1.0, "1.000000000001")],
)  # fmt: skip
def test_a_value_that_breaks_its_limit_is_written_so_that_one_sees_it(value, limit, text) -> None:
    assert told_apart(value, limit) == text
