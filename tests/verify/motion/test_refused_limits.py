"""Limits, walls and distances passed by a millionth, or for a millisecond: refused with the time and the amount."""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest

from tests.helpers.few import few_of
from tests.helpers.kernel.witnesses import PLAN, TEAM, Right, around, assert_refused, judged, refused
from tests.helpers.motion.flights import changed, legs, plan_of, small_mission
from tests.helpers.motion.limited_quantities import LIMITS
from verify.certificate import Certificate
from verify.data.mission import Mission
from verify.data.plan import Visit
from verify.data.trajectory import Trajectory
from verify.data.vehicle import GRAVITY

# Limits, walls and distances: passed by a little, and kept by a little.


def limited(name: str, value: float) -> Mission:
    """Return the mission with one limit set to a value; rotor limits are the vehicle's."""
    mission = PLAN.mission
    if name.startswith("rotor"):
        return mission.model_copy(update={"vehicle": mission.vehicle.model_copy(update={name: value})})
    key = f"{name}_deg" if name in ("tilt", "body_rate", "yaw_rate") else name
    value = math.degrees(value) if key.endswith("_deg") else value
    return mission.model_copy(update={"limits": mission.limits.model_copy(update={key: value})})


def quantity(name: str, path: Trajectory, time: float) -> float:
    """Return a limited quantity at a time, in the limit's unit, from the path's derivatives (rotor thrusts: of a hover)."""
    v, a, j = (path.evaluate(time, order)[:3] for order in (1, 2, 3))
    f, mass = a + np.array([0, 0, GRAVITY]), PLAN.mission.vehicle.mass
    size = float(np.linalg.norm(f))
    turning = np.cross(f, j) / size**2
    values = {"speed": np.linalg.norm(v), "acceleration": np.linalg.norm(a), "tilt": math.acos(f[2] / size)}
    return float({**values, "body_rate": np.linalg.norm(turning)}.get(name, mass * size))


@functools.cache
def judged_as_it_turns() -> tuple[dict[str, Trajectory], Certificate]:
    """Return the team, one of whose robots turns as it flies, and its certificate."""
    team = {**TEAM, "quad0": changed(TEAM["quad0"], coefficients=_turning(TEAM["quad0"]))}
    return team, judged(PLAN, team)


@few_of(2, "name", LIMITS)
@few_of(1, "share", [1e-5, 1e-2])
def test_every_limit_passed_by_a_little(name, share):
    team, certificate = judged_as_it_turns()
    claims = [c for c in certificate.claims if c.name == f"limits.{name}"]
    least = name.endswith("_min")
    worst = (min if least else max)(claims, key=lambda c: c.bound)
    kept = PLAN.model_copy(update={"mission": limited(name, worst.bound * (1 - 2e-3 if least else 1 + 2e-3))})
    claims = [c for c in judged(kept, team).claims if c.name == worst.name]  # with the limit near by the bound is tighter
    assert all(c.outcome == "holds" for c in claims)
    worst = (min if least else max)(claims, key=lambda c: c.bound)
    if name in ("yaw_rate", "rotor_thrust_max", "rotor_thrust_min"):
        share = max(share, 3e-3)  # these are bounded to a thousandth
    broken = PLAN.model_copy(update={"mission": limited(name, worst.bound * (1 + share if least else 1 - share))})
    (claim,) = assert_refused(judged(broken, team), Right(worst.name, worst.robot, None, None))
    off = abs(claim.bound - claim.limit) / worst.bound
    assert off == pytest.approx(share, rel=0.6, abs=2e-5)
    if name in ("speed", "acceleration", "thrust_max", "thrust_min", "tilt", "body_rate"):
        assert quantity(name, team[claim.robot], claim.time) == pytest.approx(claim.bound, rel=1e-3)


def _turning(path: Trajectory) -> np.ndarray:
    """Turn the heading by 0.4 rad and back in the first two pieces, smoothly."""
    values = path.coefficients.copy()
    for piece, sign in ((0, 1), (1, -1)):
        values[piece, 3, 0] = 0.0 if sign > 0 else 0.4
        for power, factor in ((4, 35.0), (5, -84.0), (6, 70.0), (7, -20.0)):
            values[piece, 3, power] = np.float32(sign * 0.4 * factor / float(path.durations[piece]) ** power)
    values[1, 3, 0] = np.float32(0.4)
    return values.astype(np.float32).astype(np.float64)


@few_of(1, "factor", [0.2, 0.3, 0.4, 0.45])
@pytest.mark.parametrize("robot", ["quad0", "quad1"])
def test_flown_faster_than_the_limits(robot, factor):
    path = TEAM[robot]
    fast = Trajectory(path.durations * factor, path.coefficients / factor ** np.arange(8))
    broken = [c for c in refused(judged(PLAN, {**TEAM, robot: fast})) if c.name.startswith("limits.")]
    assert broken
    for claim in broken:
        assert claim.robot == robot
        name = claim.name.removeprefix("limits.")
        if name in ("speed", "acceleration", "thrust_max", "thrust_min", "body_rate") and claim.outcome == "fails":
            assert quantity(name, fast, claim.time) == pytest.approx(claim.bound, rel=1e-2)


def test_thrust_through_zero():
    """In free fall the attitude means nothing: at g / 20 s the thrust is zero, and all that rests on it is refused."""
    values = np.zeros((1, 4, 8))
    values[0, :3, 0] = [0, 0, 1]
    values[0, 2, 3] = -20 / 6
    path, zero = Trajectory([1.0], values), GRAVITY / 20
    found = assert_refused(
        judged(plan_of(small_mission(regions=""), {}), {"r0": path}),
        Right("limits.thrust_min", "r0", None, None, around(zero, 0.02), says="falls to"),
        Right("limits.tilt", "r0"),
        Right("limits.body_rate", "r0"),
        Right("limits.yaw_rate", "r0"),
        Right("limits.rotor_thrust_min", "r0"),
    )
    assert 0 <= found[0].bound < 1e-3 < found[0].limit


@few_of(1, "gap", [1e-6, 1e-3, 0.3])
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("side", [-1, 1])
def test_a_wall_passed_by_a_millionth(axis, side, gap):
    target = np.array([0.0, 0.0, 1.0])
    target[axis] = side * np.float64(np.float32(2.0))
    corner = [5.0, 5.0, 5.0]
    corner[axis] = 2.0 + 0.05 - gap
    mission = small_mission(regions="", margin=0.05)
    box = mission.workspace.model_copy(update={"min": tuple(-c for c in corner), "max": tuple(corner)})
    mission = mission.model_copy(update={"workspace": box})
    path = legs([[0, 0, 1], target, [0, 0, 1]], speed=0.3)
    assert_refused(
        judged(plan_of(mission, {}), {"r0": path}),
        Right("workspace", "r0", None, None, around(path.knots[1], 0.4), off=around(gap, 3e-7),
              what=f"wall {'xyz'[axis]} {'max' if side > 0 else 'min'}"),
    )  # fmt: skip
    wide = mission.model_copy(update={"workspace": box.model_copy(update={"max": (6.0,) * 3, "min": (-6.0,) * 3})})
    assert judged(plan_of(wide, {}), {"r0": path}).holds


@pytest.mark.parametrize("gap", [1e-6, 1e-3, 0.1])
@pytest.mark.parametrize("third", [(0.0, 3.0, 1.0), (0.0, -3.0, 1.0)])
def test_robots_too_near_by_a_millionth(gap, third):
    near = 0.3 + 2 * 0.02 - gap
    starts = [[-1.0, 0.0, 1.0], [0.0, near, 1.0], list(third)]
    mission = small_mission(regions="", starts=starts, margin=0.02)
    team = {"r0": legs([starts[0], [1, 0, 1]]), "r1": legs([starts[1]]), "r2": legs([starts[2]])}
    values = team["r1"].coefficients.copy()
    values[0, 1, 0] = near
    team["r1"] = changed(team["r1"], coefficients=values)
    (claim,) = assert_refused(
        judged(plan_of(mission, {}), team),
        Right("separation", "r0", time=around(team["r0"].duration / 2, 0.4), off=around(gap, 5e-7), other="r1"),
    )
    distance = np.linalg.norm(team["r0"].evaluate(claim.time)[:3] - np.array(starts[1]))
    assert distance == pytest.approx(claim.bound, abs=1e-5)


@pytest.mark.parametrize("limit", [0.9, 0.98])
def test_the_limit_of_a_leg(limit):
    mission = small_mission("F a", extra=f"limits: {{legs: {{a: {{speed: {limit}}}}}}}")
    path = {"r0": legs([[0, 0, 1], [1, 0, 1]])}  # peaks at 2.1875 x 0.45 m/s in the middle
    plan = plan_of(mission, {"r0": [Visit(region="a")]})
    off = around(2.1875 * 0.45 - limit, 1e-5)
    assert_refused(judged(plan, path), Right("limits.legs.speed", "r0", "a", 0, around(path["r0"].duration / 2, 1e-2), off=off))
    away = {"r0": legs([[0, 0, 1], [0, 1, 1]])}
    assert_refused(judged(plan, away), Right("limits.legs", "r0", "a", 0, says="cannot be told"))
