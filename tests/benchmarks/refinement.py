"""Refinement beside other tools: fixed times, shortest times with limits, the Split-S race course, time-optimised missions.

    python tests/benchmarks/refinement.py            # a minute of processor time
    python tests/benchmarks/refinement.py --all      # and the missions and limits that take several

Peers run where they are installed (`pip install minsnap-trajectories rotorpy toppra`); each row names its own. Times are
the least of several runs, in one thread (OMP_NUM_THREADS=1); those above 10 ms are processor time, so that other work on the
machine does not count.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from contextlib import redirect_stdout
from importlib.util import find_spec
from io import StringIO
from typing import Any

import numpy as np
import pytest
from scipy.linalg import solveh_banded

import ltlplan
import verify
from refine import Limits, minimum_snap, refine, time_optimal
from refine.heading.spin import with_least_spin
from refine.limits.limits import rotors_of
from refine.planes import Plane
from refine.single_robot.task import Pace
from refine.single_robot.time_optimised import forget as forget_answers
from refine.solvers.ipopt_engine import forget
from refine.spline.least_snap import banded_problem
from tests.helpers.benchmarks import installed, is_smallest, require_time, run_benchmark
from tests.helpers.missions.refinement_courses import (
    HOOP6,
    HOOP6_BLEND,
    HOOP6_LIMITS,
    HOOP6_SNAP,
    SPLIT_S,
    SPLIT_S_FAST_PEER,
    SPLIT_S_FLOOR,
    SPLIT_S_OPTIMUM,
    SPLIT_S_TOLERANCE,
    flown,
    hoop6_vehicle,
    limit_verdicts,
    passes_points,
    racer,
)
from verify.data import GRAVITY, Trajectory

SIZES = (6, 30, 100, 300, 1000)
PEERS = {"minsnap_trajectories": "minsnap-trajectories", "rotorpy": "rotorpy", "cvxopt": "cvxopt", "toppra": "toppra"}
"""By what is imported."""
HURRIED = ("hoops-sequence",)
"""Missions whose time-optimised flights are measured."""


def least(run: Callable[[], Any], seconds: float = 0.4) -> float:
    """Return the least time of one call, in s."""
    best, until = np.inf, time.perf_counter() + (0.01 if is_smallest() else seconds)
    while time.perf_counter() < until:
        begin, busy = time.perf_counter(), time.process_time()
        run()
        spent = time.perf_counter() - begin
        best = min(best, spent if spent < 1e-2 else time.process_time() - busy)
    return float(best)


def course(points: int) -> tuple[np.ndarray, np.ndarray]:
    """Return hoop6, or a random walk through the air with as many points, and times at 1 m/s."""
    if points == len(HOOP6):
        waypoints = HOOP6
    else:
        steps = np.random.default_rng(points).normal(size=(points, 3))
        waypoints = np.cumsum(steps / np.linalg.norm(steps, axis=1, keepdims=True), axis=0)
    lengths = np.linalg.norm(np.diff(waypoints, axis=0), axis=1)
    return waypoints, np.concatenate([[0.0], np.cumsum(lengths)])


def fixed_times() -> list[dict[str, Any]]:
    """Time fixed-time minimum snap and its peers on growing courses."""
    rows = []
    for size in SIZES[:2] if is_smallest() else SIZES:
        points, times = course(size)
        durations = np.diff(times)

        def bare(points: np.ndarray = points, durations: np.ndarray = durations) -> np.ndarray:
            problem = banded_problem(points, durations)
            return solveh_banded(problem.band, problem.right, lower=True)

        row: dict[str, Any] = {
            "points": size,
            "ours": 1e3 * least(lambda points=points, times=times: minimum_snap(points, times)),
            "ours_coefficients": 1e3 * least(lambda points=points, times=times: minimum_snap(points, times).coefficients),
            "band_and_solveh": 1e3 * least(bare),
            "snap": minimum_snap(points, times).snap_cost(),
        }
        if find_spec("minsnap_trajectories") and size <= 300:
            row["minsnap-trajectories"] = 1e3 * _minsnap_trajectories(points, times)
        if find_spec("rotorpy") and find_spec("cvxopt") and size <= 100:
            row["rotorpy"] = 1e3 * _rotorpy(points)
        rows.append(row)
    return rows


def _minsnap_trajectories(points: np.ndarray, times: np.ndarray) -> float:
    import minsnap_trajectories as ms

    rest = {"velocity": np.zeros(3), "acceleration": np.zeros(3), "jerk": np.zeros(3)}
    ends = (0, len(points) - 1)
    references = [
        ms.Waypoint(time=float(t), position=p, **(rest if i in ends else {}))
        for i, (t, p) in enumerate(zip(times, points, strict=True))
    ]
    return least(
        lambda: ms.generate_trajectory(
            references, degree=7, idx_minimized_orders=(4,), num_continuous_orders=4, algorithm="closed-form"
        ),
        0.1,
    )


def _rotorpy(points: np.ndarray) -> float:
    from rotorpy.trajectories.minsnap import MinSnap

    def run() -> None:
        with redirect_stdout(StringIO()):
            MinSnap(points, v_avg=1.0, verbose=False)

    return least(run, 0.1)


def _toppra() -> float | None:
    """Return the duration of toppra's fastest retiming of the minimum-snap path, speed and acceleration by axis circles."""
    if not find_spec("toppra"):
        return None
    import toppra as ta
    from toppra import algorithm, constraint

    ta.setup_logging("ERROR")
    points, times = course(len(HOOP6))
    knots = np.linspace(0.0, times[-1], 200)
    path = ta.SplineInterpolator(knots, _at(minimum_snap(points, times), knots))
    # Boxes inside the balls: its constraints are by axis.
    speed, acceleration = 2.0 / np.sqrt(3), 8.0 / np.sqrt(3)
    limits = [constraint.JointVelocityConstraint([speed] * 3), constraint.JointAccelerationConstraint([acceleration] * 3)]
    answer = algorithm.TOPPRA(limits, path, gridpoints=np.linspace(0, times[-1], 200)).compute_trajectory(0, 0)
    return None if answer is None else float(answer.duration)


def _at(path: Any, times: np.ndarray) -> np.ndarray:
    return flown(path).evaluate(np.minimum(times, flown(path).duration))[:, :3]


def shortest_times() -> list[dict[str, Any]]:
    """Time hoop6 under its limits, each answer judged for all times, cold (compiled anew) and warm."""
    asks = (
        ("shortest, one piece a leg", {"pieces": 1}),
        ("shortest, two pieces a leg", {"pieces": 2}),
        ("snap + 1000 T", {"objective": "blend", "weight": 1000.0, "instants": 8}),
    )
    rows = []
    for name, options in asks:
        forget()
        begin = time.process_time()
        path = time_optimal(HOOP6, HOOP6_LIMITS, **options)
        cold = time.process_time() - begin
        warm = least(lambda options=options: time_optimal(HOOP6, HOOP6_LIMITS, **options), 2.0)
        flight = flown(path)
        claims = limit_verdicts(flight, hoop6_vehicle())
        rows.append(
            {
                "what": name,
                "duration": flight.duration,
                "snap_and_time": path.snap_cost() + 1000 * path.duration,
                "cold": cold,
                "warm": warm,
                "certified": all(claim.outcome == "holds" for claim in claims.values()),
                "refused": [claim.sentence for claim in claims.values() if claim.outcome != "holds"],
            }
        )
    return rows


def split_s(yaw_rate: float) -> dict[str, Any]:
    """Fly the Split-S course with rotor, collective and rate limits, and have it judged for all times."""
    vehicle = racer()
    limits = Limits(
        thrust_min=vehicle.thrust_min / vehicle.mass,
        thrust_max=vehicle.thrust_max / vehicle.mass,
        body_rate=15.0,
        yaw_rate=yaw_rate,
        rotors=rotors_of(vehicle),
    )
    floor = Plane(np.array([0.0, 0.0, 1.0]), SPLIT_S_FLOOR)
    forget()
    begin = time.process_time()
    path = time_optimal(SPLIT_S, limits, tolerance=SPLIT_S_TOLERANCE - 1e-4, end="free", walls=[floor], instants=12)
    path, yaw = with_least_spin(path, limits)
    seconds = time.process_time() - begin
    flight = flown(path, yaw)
    vehicle = vehicle.model_copy(update={"yaw_rate_deg": float(np.degrees(yaw_rate))})
    claims = limit_verdicts(flight, vehicle)
    asked = ("thrust_max", "thrust_min", "rotor_thrust_max", "rotor_thrust_min", "body_rate", "yaw_rate")
    return {
        "yaw_rate": yaw_rate,
        "duration": flight.duration,
        "seconds": seconds,
        "certified": all(claims[name].outcome == "holds" for name in asked),
        "refused": [claims[name].sentence for name in asked if claims[name].outcome != "holds"],
        "passes": passes_points(flight, SPLIT_S, SPLIT_S_TOLERANCE),
        "lowest": float(path.sample(np.linspace(0, 1, 400))[..., 2].min()),
    }


def time_optimised(missions: Sequence[str] = HURRIED) -> list[dict[str, Any]]:
    """Refine missions at each pace, first (compiled anew) and again, and have each answer judged for all times."""
    rows = []
    for mission in missions:
        plan = ltlplan.plan(ltlplan.load_mission(mission), seed=0)
        paces: tuple[tuple[Pace, float], ...] = (("nominal", 100.0), ("time", 100.0), ("blend", 100.0))
        for pace, weight in paces:
            seconds = []
            forget()
            team: dict[str, Trajectory] = {}
            for _ in range(2):
                forget_answers()
                begin = time.process_time()
                team = refine(plan, pace=pace, weight=weight)
                seconds.append(time.process_time() - begin)
            row: dict[str, Any] = {"mission": mission, "pace": pace, "weight": weight if pace == "blend" else None}
            row |= {"flight": max(flight.duration for flight in team.values()), "first": seconds[0], "again": seconds[1]}
            rows.append(row | {"certified": verify.judge(plan, team, largest=False).holds})
    return rows


@pytest.mark.parametrize("mission", [*HURRIED, pytest.param("hoops-ltl", marks=pytest.mark.slow)])
def test_time_optimised(mission: str) -> None:
    """A mission at the plan's pace, time-optimised, and so with regard for snap."""
    rows = time_optimised([mission])
    for row in rows:
        print(row)
    assert all(row["certified"] for row in rows)
    for nominal, fast, blend in zip(rows[::3], rows[1::3], rows[2::3], strict=True):
        assert fast["flight"] <= blend["flight"]
        assert fast["flight"] <= nominal["flight"]


def test_fixed_times() -> None:
    """Snap to nine digits; at most 1.5 times the bare band; 300 points in a millisecond; linear growth."""
    rows = fixed_times()
    for row in rows:
        print("  ".join(f"{key} {value:.6g}" for key, value in row.items()))
    by_size = {row["points"]: row for row in rows}
    assert round(by_size[6]["snap"], 6) == round(HOOP6_SNAP, 6) or abs(by_size[6]["snap"] / HOOP6_SNAP - 1) < 1e-9
    require_time(by_size[6]["ours"], 1.5 * by_size[6]["band_and_solveh"])
    if not is_smallest():
        require_time(by_size[300]["ours"], 1.0)
        require_time(by_size[1000]["ours"], 15 * by_size[100]["ours"])


def test_shortest_times() -> None:
    """hoop6 under its limits, certified for all times."""
    rows = shortest_times()
    for row in rows:
        print(row)
    print({"toppra on the minimum-snap path, s": _toppra(), "straight lines, s": 4.358, "best smooth peer, s": 7.082})
    one, two, blend = rows
    assert all(row["certified"] for row in rows)
    assert one["duration"] <= 5.45
    assert two["duration"] <= 5.0
    assert blend["snap_and_time"] <= 1.001 * HOOP6_BLEND
    require_time(one["warm"], 0.5)
    require_time(two["warm"], 3.0)
    require_time(blend["warm"], 0.3)


def test_split_s() -> None:
    """The race course, certified for all times."""
    row = split_s(3.0)
    print(row, {"optimum, s": SPLIT_S_OPTIMUM, "best fast peer, s": SPLIT_S_FAST_PEER})
    assert row["certified"]
    assert row["passes"]
    assert row["lowest"] >= SPLIT_S_FLOOR
    assert row["duration"] <= 17.9
    require_time(row["seconds"], 10.0)


@pytest.mark.slow
def test_split_s_turning_slowly() -> None:
    """The same at 0.3 rad/s about z, which is reported beside it."""
    row = split_s(0.3)
    print(row)
    assert row["certified"]
    assert row["passes"]
    assert row["lowest"] >= SPLIT_S_FLOOR


def main() -> int:
    """Print all rows, and judge them."""
    print(f"g = {GRAVITY} m/s^2; times in ms for fixed times, in s elsewhere")
    for module, package in PEERS.items():
        installed(module, package)
    chosen = "slow or not slow" if "--all" in sys.argv[1:] else "not slow"
    return pytest.main(["-s", "-q", "-n", "0", "-m", chosen, __file__])


if __name__ == "__main__":
    run_benchmark(main)
