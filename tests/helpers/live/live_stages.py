"""Stages of live flights, made by hand and certified: a patrol that brakes behind its last lap, and flights in parts."""

from __future__ import annotations

import numpy as np

from flight.exports.braking import AtMost, braked
from flight.link.phases import Stage
from tests.helpers.motion.flights import legs, plan_of, small_mission
from tests.helpers.motion.patrols import patrol
from tests.helpers.vehicles.crazyflie_stages import stage
from verify import certify
from verify.data import Trajectory
from verify.data.plan import Visit

BALLS = "a: {center: [1.0, 0.0, 0.6], radii: [0.2, 0.2, 0.2]}\nb: {center: [0.0, 1.0, 0.6], radii: [0.2, 0.2, 0.2]}"
POINTS = [[0, 0, 0.6], [1, 0, 0.6], [1, 1, 0.6], [0, 1, 0.6]]


def patrol_stages() -> tuple[Stage, ...]:
    """Return climb, two laps with a braking behind them, and landing, of one robot."""
    plan, path = patrol()
    found = braked(plan.mission, "r0", path, AtMost())
    assert found is not None
    flown = Stage("flight", plan, {"r0": path}, certify(plan, {"r0": path}), {"r0": found.flown})
    return _with_climb_and_landing(flown)


def parts_stages(*, extra: str = "", speed: float = 0.45) -> tuple[Stage, ...]:
    """Return climb, a flight in three parts, and landing, of two robots."""
    starts = ((0.0, 0.0, 0.6), (0.0, -2.0, 0.6))
    mission = small_mission("F a & F b", regions=BALLS, margin=0.05, starts=starts, extra=extra)
    plan = plan_of(mission, {"r0": [Visit(region="a"), Visit(region="b")]})
    beside = [np.add(point, (0, -2.0, 0)) for point in POINTS]
    team = {"r0": _cut(legs(POINTS, speed=speed), 1, 2), "r1": _cut(legs(beside, speed=speed), 1, 2)}
    return _with_climb_and_landing(Stage("flight", plan, team, certify(plan, team)))


def laps_stages(repeat: int = 3) -> tuple[Stage, ...]:
    """Return climb, a prefix and laps that are begun one after another, and landing, of one robot."""
    mission = small_mission("G F a & G F b", regions=BALLS, margin=0.05, trace="infinite", starts=((0.0, 0.0, 0.6),))
    mission = mission.model_copy(update={"spec": mission.spec.model_copy(update={"repeat": repeat})})
    plan = plan_of(mission, {"r0": [Visit(region="a"), Visit(region="b"), Visit(region="a")]})
    robot = plan.robots["r0"].model_copy(update={"cycle_visit": 1, "cycle_waypoint": 0})
    plan = plan.model_copy(update={"robots": {"r0": robot}})
    team = {"r0": _cut(legs([POINTS[0], POINTS[1], POINTS[3], POINTS[1]], cycle=1), 1)}
    return _with_climb_and_landing(Stage("flight", plan, team, certify(plan, team)))


def places_of(stages: tuple[Stage, ...]) -> dict[str, tuple[float, float, float]]:
    """Return where robots stand at first."""
    return {name: tuple(path.evaluate(0.0)[:3].tolist()) for name, path in stages[0].paths.items()}


def _cut(path: Trajectory, *cuts: int) -> Trajectory:
    return Trajectory(path.durations, path.coefficients, cycle=path.cycle, cuts=cuts)


def _with_climb_and_landing(flown: Stage) -> tuple[Stage, ...]:
    begins = {name: path.evaluate(0.0)[:3].tolist() for name, path in flown.paths.items()}
    ends = {name: path.evaluate(path.duration)[:3].tolist() for name, path in flown.paths.items()}
    return (
        stage("climb", {name: [[x, y, 0.0], [x, y, z]] for name, (x, y, z) in begins.items()}),
        flown,
        stage("landing", {name: [[x, y, z], [x, y, 0.05]] for name, (x, y, z) in ends.items()}),
    )
