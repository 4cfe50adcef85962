"""Each claim of a certificate broken alone, by the least that can be told, and kept by as little: finite flights and laps."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from tests.helpers.few import few_of
from tests.helpers.kernel.witnesses import judged
from tests.helpers.motion.flights import changed, legs, plan_of, quantised, small_mission
from tests.helpers.motion.limited_quantities import sampled
from verify.data.mission import Mission
from verify.data.plan import Plan, Visit
from verify.data.trajectory import Trajectory
from verify.data.vehicle import GRAVITY, load_vehicle
from verify.motion.continuity import JUMPS

RADIUS = load_vehicle("crazyflie-2.1").radius
Team = dict[str, Trajectory]
Flown = tuple[Plan, Team]

BOTH = pytest.mark.parametrize("lasso", [False, True], ids=["finite", "lasso"])


def flown(mission: Mission, points: list[list[float]], visits: list[Visit], *, lasso: bool) -> Flown:
    """Fly through points, and for a lap back to the first of them."""
    plan = plan_of(mission, {"r0": visits})
    if not lasso:
        return plan, {"r0": legs(points)}
    robot = plan.robots["r0"].model_copy(update={"cycle_visit": 0, "cycle_waypoint": 0})
    return plan.model_copy(update={"robots": {"r0": robot}}), {"r0": legs([*points, points[0]], cycle=0)}


def world(
    *, lasso: bool, formula: str = "true", regions: str = "", hoops: str = "", margin: float = 0.0, extra: str = ""
) -> Mission:
    trace = "infinite" if lasso else "finite"
    return small_mission(formula, regions=regions, hoops=hoops, margin=margin, extra=extra, trace=trace)


def assert_alone(claim: str, kept: Flown, broken: Flown) -> None:
    """Fail unless everything holds of one flight, and everything but one claim of the other."""
    certificate = judged(*kept)
    assert [c.sentence for c in certificate.claims if c.outcome != "holds"] == []
    assert claim in {c.name for c in certificate.claims}
    refused = [c for c in judged(*broken).claims if c.outcome != "holds"]
    assert {c.name for c in refused} == {claim}, [c.sentence for c in refused]
    assert all(c.witness is not None for c in refused)


# Words, visits, passages, rims and walls: `by` is how far the claim is broken, in m; below 0 it is kept by as much.

AROUND = [[0, 0, 1], [2, 0, 1], [2, -1, 1], [0, -1, 1]]


def grazing(by: float) -> str:
    """Return a ball that the line from (0, 0, 1) to (2, 0, 1) dips into by so much."""
    return f"c: {{center: [1.0, {0.2 - by!r}, 1.0], radii: [0.2, 0.2, 0.2]}}"


def never(by: float, lasso: bool) -> Flown:
    mission = world(formula="G !c", regions=grazing(by), lasso=lasso)
    return flown(mission, AROUND, [Visit(region="c")] if by > 0 else [], lasso=lasso)


def sometimes(by: float, lasso: bool) -> Flown:
    mission = world(formula="F c", regions=grazing(-by), lasso=lasso)
    return flown(mission, AROUND, [] if by > 0 else [Visit(region="c")], lasso=lasso)


def unplanned(by: float, lasso: bool) -> Flown:
    return flown(world(regions=grazing(by), lasso=lasso), AROUND, [], lasso=lasso)


def unjoined(by: float, lasso: bool) -> Flown:
    """b is reached only by way of m, which the way there dips into; back it leads through the middle of m."""
    regions = f"""a: {{center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}}
m: {{center: [2.0, {0.2 + by!r}, 1.0], radii: [0.2, 0.2, 0.2]}}
b: {{center: [3.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}}"""
    edges = "environment: {start: robot, edges: [[robot, a], [a, m], [m, b]]}"
    points = [[0, 0, 1], [3, 0, 1], [2, 0.2, 1], [2, 1, 1], [0, 1, 1]]
    names = "abm" if by > 0 else "ambm"
    return flown(world(regions=regions, extra=edges, lasso=lasso), points, [Visit(region=n) for n in names], lasso=lasso)


def hoop(radius: float = 0.2) -> str:
    return f"h: {{center: [1.0, 0.0, 1.0], radii: [{radius!r}, 0.2, 0.2], opening: 0.3, rim: 0.05}}"


def uncontained(by: float, lasso: bool) -> Flown:
    """The robot is in the region for sure up to 0.05 m - by off the hoop's plane, and passes it within the margin 0.05 m."""
    mission = world(hoops=hoop(0.1 - by), margin=0.05, lasso=lasso)
    return flown(mission, AROUND, [Visit(region="h", direction="F")], lasso=lasso)


def touching(by: float, lasso: bool) -> Flown:
    """Past the ring on the outside, the sphere and the margin clear of it or not."""
    center = 0.3 + 0.05 + RADIUS + 0.05 - by
    mission = world(hoops=hoop().replace("1.0, 0.0, 1.0", f"1.0, {center!r}, 1.0"), margin=0.05, lasso=lasso)
    return flown(mission, AROUND, [], lasso=lasso)


def walled(by: float, lasso: bool) -> Flown:
    mission = world(margin=0.05, lasso=lasso)
    team = flown(mission, AROUND, [], lasso=lasso)[1]
    furthest = float(team["r0"].evaluate(np.linspace(0.0, team["r0"].duration, 100_001))[:, 0].max())
    box = mission.workspace.model_copy(update={"max": (furthest + 0.05 - by, 5.0, 5.0)})
    return flown(mission.model_copy(update={"workspace": box}), AROUND, [], lasso=lasso)


@BOTH
@few_of(
    6,
    ("claim", "case", "least"),
    [
        ("formula", never, 1e-9),
        ("formula", sometimes, 1e-9),
        ("transitions", unjoined, 1e-9),
        ("visits", unplanned, 1e-9),
        ("passages", uncontained, 2e-5),
        ("rims", touching, 1e-6),
        ("workspace", walled, 1e-8),
    ],
    ids=lambda value: getattr(value, "__name__", str(value)),
)
def test_a_place_missed_or_met_by_the_least(
    claim: str, case: Callable[[float, bool], Flown], least: float, lasso: bool
) -> None:
    assert_alone(claim, case(-least, lasso), case(least, lasso))


def test_robots_too_near_by_a_millionth() -> None:
    def meeting(by: float) -> Flown:
        away = 0.3 + 2 * 0.02 - by
        mission = small_mission(regions="", starts=[[-1.0, 0.0, 1.0], [0.0, away, 1.0]], margin=0.02)
        still = legs([[0.0, 0.0, 1.0]])
        values = still.coefficients.copy()
        values[0, 1, 0] = away
        return plan_of(mission, {}), {"r0": legs([[-1, 0, 1], [1, 0, 1]]), "r1": changed(still, coefficients=values)}

    assert_alone("separation", meeting(-1e-6), meeting(1e-6))


# Jumps: a piece bent so that one derivative jumps at one of its ends, and nothing else changes there or at the other.

DERIVATIVES = [*((0, order) for order in range(4)), *((3, order) for order in range(3))]


def bent(path: Trajectory, piece: int, axis: int, order: int, size: float, *, at_end: bool) -> Trajectory:
    """Add size t^k (1 - t / T)^4 / k! to one coordinate of a piece, or the same from its end."""
    values, length = path.coefficients.copy(), float(path.durations[piece])
    fade = np.polynomial.Polynomial([1.0, -1.0 / length]) ** 4
    if at_end:
        fade = np.polynomial.Polynomial([0.0, 1.0 / length]) ** 4
    bump = np.polynomial.Polynomial([-length if at_end else 0.0, 1.0]) ** order * fade * (size / math.factorial(order))
    values[piece, axis, : len(bump.coef)] += bump.coef
    return changed(path, coefficients=values)


@few_of(
    10,
    ("place", "axis", "order", "lasso"),
    [
        (place, axis, order, lasso)
        for place in ("start", "joint", "end")
        for axis, order in DERIVATIVES
        for lasso in (False, True)
        if (place, axis, order, lasso) != ("end", 3, 0, False)  # where a finite flight looks at its end is free
    ],
)
def test_a_jump_a_little_above_what_is_allowed(place: str, axis: int, order: int, lasso: bool) -> None:
    mission = world(lasso=lasso)
    agents = {"r0": mission.agents["r0"].model_copy(update={"end": None if lasso else tuple(map(float, AROUND[-1]))})}
    plan, team = flown(mission.model_copy(update={"agents": agents}), AROUND, [], lasso=lasso)
    piece = {"start": 0, "joint": 1, "end": len(team["r0"]) - 1}[place]

    ends = [_side(team["r0"], p, axis, order, at_end=at_end) for p, at_end in ((piece, place == "end"), (piece - 1, True))]
    beyond = 0.0 if order or axis == 3 else (AROUND[-1] if place == "end" else AROUND[0])[axis]  # the start, or the end
    if place == "joint":
        beyond = ends[1]
    elif place == "end" and lasso:
        beyond = _side(team["r0"], 0, axis, order, at_end=False)

    def jumping(share: float) -> Flown:
        size = share * JUMPS[order] + beyond - ends[0]  # rounding to float32 left a little already
        return plan, {"r0": bent(team["r0"], piece, axis, order, size, at_end=place == "end")}

    assert_alone("continuity", jumping(0.9999), jumping(1.0001))


def _side(path: Trajectory, piece: int, axis: int, order: int, *, at_end: bool) -> float:
    """Return a derivative at an end of a piece."""
    polynomial = np.polynomial.Polynomial(path.coefficients[piece, axis])
    return float((polynomial.deriv(order) if order else polynomial)(float(path.durations[piece]) if at_end else 0.0))


# Limits.


def turning(path: Trajectory) -> Trajectory:
    """Turn the heading by 0.4 rad in the first piece and back in the second."""
    values = path.coefficients.copy()
    for piece, (sign, start) in enumerate(((1, 0.0), (-1, 0.4))):
        values[piece, 3, 0] = start
        for power, factor in ((4, 35.0), (5, -84.0), (6, 70.0), (7, -20.0)):
            values[piece, 3, power] = sign * 0.4 * factor / float(path.durations[piece]) ** power
    return quantised(changed(path, coefficients=values))


def seamed(path: Trajectory) -> Trajectory:
    """Move the seam of a lap to the middle of its first piece, where it is fastest."""
    half = float(np.float32(path.durations[0] / 2))
    ahead, later = path.coefficients[:1], path.coefficients[:1].copy()
    for axis in range(4):
        shifted = np.polynomial.Polynomial(path.coefficients[0, axis])(np.polynomial.Polynomial([half, 1.0]))
        later[0, axis] = 0.0
        later[0, axis, : len(shifted.coef)] = shifted.coef
    rest = float(path.durations[0]) - half
    durations = np.concatenate([[half, rest], path.durations[1:], [half]])
    return quantised(Trajectory(durations, np.concatenate([ahead, later, path.coefficients[1:], ahead]), cycle=1))


@dataclass(frozen=True)
class Peak:
    """Extreme of a quantity over a path, by dense samples and a closer look: no part of the judge."""

    path: Trajectory

    def of(self, name: str) -> float:
        least = name.endswith("_min")
        times = np.linspace(0.0, self.path.duration, 20_001)
        for _ in range(4):
            values = self._values(name, times)
            at = int(np.argmin(values) if least else np.argmax(values))
            low, high = times[max(at - 1, 0)], times[min(at + 1, len(times) - 1)]
            times = np.linspace(low, high, 2001)
        return float(values[at])

    def _values(self, name: str, times: np.ndarray) -> np.ndarray:
        v, a, j = (self.path.evaluate(times, order)[:, :3] for order in (1, 2, 3))
        force = a + np.array([0.0, 0.0, GRAVITY])
        size = np.linalg.norm(force, axis=1)
        if name == "speed":
            return np.linalg.norm(v, axis=1)
        if name == "acceleration":
            return np.linalg.norm(a, axis=1)
        if name == "tilt":
            return np.arctan2(np.linalg.norm(force[:, :2], axis=1), force[:, 2])
        if name == "body_rate":
            return np.linalg.norm(np.cross(force, j), axis=1) / size**2
        return load_vehicle("crazyflie-2.1").mass * size


def limited(plan: Plan, name: str, value: float) -> Plan:
    mission = plan.mission
    if name.startswith("rotor"):
        return plan.model_copy(
            update={"mission": mission.model_copy(update={"vehicle": mission.vehicle.model_copy(update={name: value})})}
        )
    key = f"{name}_deg" if name in ("tilt", "body_rate", "yaw_rate") else name
    value = math.degrees(value) if key.endswith("_deg") else value
    limits = mission.limits.model_copy(update={key: value})
    return plan.model_copy(update={"mission": mission.model_copy(update={"limits": limits})})


SLANTED = [[0, 0, 1], [1, 0.5, 1.6], [2, -0.5, 1.2], [1, -1, 1]]


def slanted(kind: str) -> Flown:
    plan, team = flown(world(lasso=kind != "finite"), SLANTED, [], lasso=kind != "finite")
    path = turning(team["r0"])
    return plan, {"r0": seamed(path) if kind == "seam" else path}


@few_of(1, "kind", ["finite", "lasso", "seam"])
@pytest.mark.parametrize("name", ["speed", "acceleration", "thrust_max", "thrust_min", "tilt", "body_rate"])
def test_a_limit_passed_by_a_millionth(name: str, kind: str) -> None:
    plan, team = slanted(kind)
    peak, outwards = Peak(team["r0"]).of(name), -1 if name.endswith("_min") else 1
    kept, broken = (limited(plan, name, peak * (1 + outwards * by)) for by in (1e-6, -1e-6))
    assert_alone(f"limits.{name}", (kept, team), (broken, team))


@few_of(1, "kind", ["finite", "lasso", "seam"])
@pytest.mark.parametrize("name", ["yaw_rate", "rotor_thrust_max", "rotor_thrust_min"])
def test_a_limit_passed_by_a_ten_thousandth(name: str, kind: str) -> None:
    """These hold the attitude; differences of it tell their peaks to about 1e-5."""
    plan, team = slanted(kind)
    values = sampled(team["r0"], plan.mission.vehicle, count=2000)[name]
    peak, outwards = float(values.min() if name.endswith("_min") else values.max()), -1 if name.endswith("_min") else 1
    kept, broken = (limited(plan, name, peak * (1 + outwards * by)) for by in (1e-4, -1e-4))
    assert_alone(f"limits.{name}", (kept, team), (broken, team))


@BOTH
@pytest.mark.parametrize("name", ["speed", "acceleration"])
def test_the_limit_of_a_leg_passed_by_a_millionth(name: str, lasso: bool) -> None:
    """The legs to c peak on their way; for a lap the longest is the one back over the seam."""
    regions = "c: {center: [0.3, 0.0, 1.0], radii: [0.1, 0.1, 0.1]}"
    points = [[0, 0, 1], [0.3, 0, 1], [2, -2, 1]] if lasso else [[0, 0, 1], [0, 2, 1], [0.3, 0, 1], [2, -2, 1]]
    plan, team = flown(world(regions=regions, margin=0.02, lasso=lasso), points, [Visit(region="c")], lasso=lasso)
    path = team["r0"]
    way = path if lasso else Trajectory(path.durations[:2], path.coefficients[:2])
    peak = Peak(way).of(name)

    def bound(by: float) -> Flown:
        limits = plan.mission.limits.model_validate({"legs": {"c": {name: peak * (1 + by)}}})
        return plan.model_copy(update={"mission": plan.mission.model_copy(update={"limits": limits})}), team

    assert_alone(f"limits.legs.{name}", bound(1e-6), bound(-1e-6))


# The certificate as a whole.


@pytest.mark.parametrize("kind", ["plain", "hoops", "legs", "team", "lasso"])
def test_no_part_of_a_mission_goes_without_its_claim(kind: str) -> None:
    mission = {
        "plain": lambda: world(lasso=False),
        "hoops": lambda: world(hoops=hoop().replace("1.0, 0.0", "1.0, 3.0"), lasso=False),
        "legs": lambda: world(regions=grazing(-1.0), extra="limits: {legs: {c: {speed: 1.0, acceleration: 2.0}}}", lasso=False),
        "team": lambda: small_mission(regions="", starts=[[0, 0, 1], [0, 3, 1], [0, -3, 1]]),
        "lasso": lambda: world(lasso=True),
    }[kind]()
    starts = {name: list(agent.start) for name, agent in mission.agents.items()}
    plan, team = flown(mission, AROUND, [], lasso=kind == "lasso")
    team |= {name: legs([starts[name]]) for name in starts if name != "r0"}
    found = [(c.name, c.robot, c.other) for c in judged(plan, team).claims]
    every = ["transitions", "visits", "passages", "workspace", "continuity"]
    every += [f"limits.{n}" for n in ("speed", "acceleration", "tilt", "body_rate", "yaw_rate")]
    every += [f"limits.{kind}_{end}" for kind in ("thrust", "rotor_thrust") for end in ("min", "max")]
    every += ["rims"] if kind == "hoops" else []
    wanted = [("formula", None, None), *((name, robot, None) for name in every for robot in starts)]
    wanted += [("separation", a, b) for a in starts for b in starts if a < b]
    wanted += [("limits.legs", None, None)] if kind == "legs" else []
    assert sorted(found, key=str) == sorted(wanted, key=str)
    assert judged(plan, team).holds
