"""Flights at each pace: how long they last, and the processor time of their refinement, beside other ways to choose times.

    OMP_NUM_THREADS=1 python -m tests.benchmarks.pace [NAME ...]

Names are of shipped missions, `race`, `hoop6` and `split-s`; all of them by default, which takes a minute. Every flight of ours is
judged for all times. "Processor time" is that of the first `refine` at pace 1, with nothing remembered and modules loaded. Beside it:

* without the programme: the same refinement from durations and points by L-BFGS and the exact fit alone, as MINCO's users do;
* toppra (`pip install toppra`): the fastest retiming of the minimum-snap paths, each robot alone, with bounds on speed (of legs, too),
  acceleration, thrust and tilt by planes around them. Its acceleration jumps, so body rate and rotors are left out; so is keeping apart.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from unittest import mock

import numpy as np
from numpy.typing import NDArray

import ltlplan
import verify
from refine import refine, time_optimal
from refine.corridor.leg_limits import own_limits
from refine.corridor.planned import corridor_of
from refine.limits.limits import Limits
from refine.single_robot import time_optimised
from refine.single_robot.task import NOWHERE, Pace, RefinementOptions, Task
from refine.single_robot.visits_shown import showing_visits
from refine.solvers import ipopt_engine
from refine.spline.spline import Spline
from tests.benchmarks.refinement import split_s
from tests.helpers.benchmarks import installed, run_benchmark
from tests.helpers.missions.refinement_courses import HOOP6, HOOP6_LIMITS, flown, hoop6_vehicle, limit_verdicts
from verify.data import GRAVITY, Infeasible, Plan, Trajectory

Floats = NDArray[np.float64]

RACE = Path(__file__).parents[1] / "helpers" / "missions" / "race.yaml"
MISSIONS = ("firefighting", "hoops-sequence", "window-inspection", "wall-swap", "door-puzzle", "race")
COURSES = ("hoop6", "split-s")
_DIRECTIONS = 150
"""Planes around the balls of speeds and accelerations: they reach out of them by less than 2 %."""
_GRID = 12
"""Steps of toppra's grid a piece."""


@dataclass(frozen=True, slots=True)
class Row:
    """Flights of one mission.

    Attributes:
        nominal: s.
        usual: s, at pace 0.7.
        fastest: s, at pace 1.
        computing: Processor time of the first refinement at pace 1, s.
        pieces: Of the fastest flight, over all robots.
        programmeless: s, at pace 1 by durations, points and fit alone; None where that is not certified.
        programmeless_computing: Its processor time, s.
        retimed: s, toppra's; None where it is not installed or has no answer.
        notes: What the fastest flight's refinement said.
    """

    nominal: float
    usual: float
    fastest: float
    computing: float
    pieces: int
    programmeless: float | None
    programmeless_computing: float
    retimed: float | None
    notes: tuple[str, ...]


def mission_row(plan: Plan, toppra: bool) -> Row:
    """Refine a plan at each pace, and have each flight judged.

    Args:
        plan: What is flown.
        toppra: Whether it is installed.
    """
    notes: list[str] = []
    fastest, computing = _first(plan, notes.append)
    with mock.patch.object(time_optimised, "optimise", side_effect=Infeasible("left out")):
        fitted, fitted_computing = _first(plan)
    time_optimised.forget()
    others = [_refined(plan, pace) for pace in ("nominal", 0.7)]
    for team in (fastest, *others):
        assert verify.judge(plan, team, largest=False).holds
    return Row(
        nominal=_lasts(others[0]),
        usual=_lasts(others[1]),
        fastest=_lasts(fastest),
        computing=computing,
        pieces=sum(len(flight.durations) for flight in fastest.values()),
        programmeless=_lasts(fitted) if verify.judge(plan, fitted, largest=False).holds else None,
        programmeless_computing=fitted_computing,
        retimed=retimed(plan) if toppra else None,
        notes=tuple(notes),
    )


def _first(plan: Plan, note: Callable[[str], None] | None = None) -> tuple[dict[str, Trajectory], float]:
    """Return the fastest flight with nothing remembered, and its processor time in s."""
    time_optimised.forget()
    ipopt_engine.forget()
    begin = time.process_time()
    team = _refined(plan, 1.0, note)
    return team, time.process_time() - begin


def _refined(plan: Plan, pace: Pace, note: Callable[[str], None] | None = None) -> dict[str, Trajectory]:
    return refine(plan, pace=pace, too_long="rest", note=note)


def _lasts(team: Mapping[str, Trajectory]) -> float:
    return max(flight.duration for flight in team.values())


def retimed(plan: Plan) -> float | None:
    """Return the longest duration of toppra's retimings of a plan's minimum-snap paths, s; None where one has none.

    Args:
        plan: Each robot flies its part of it alone.
    """
    found = [_retimed(plan, name) for name, robot in plan.robots.items() if not robot.still]
    kept = [duration for duration in found if duration is not None]
    return max(kept) if len(kept) == len(found) else None


def _retimed(plan: Plan, name: str) -> float | None:
    import toppra as ta
    from toppra import algorithm, constraint

    ta.setup_logging("ERROR")
    robot, mission = plan.robots[name], plan.mission.seen_by(name)
    corridor, limits = corridor_of(mission, name, robot), Limits.of_mission(plan.mission, name)
    task = Task(mission, name, robot, corridor, limits, 0.0, RefinementOptions("nominal", 1.0, None))
    path = showing_visits(task, NOWHERE).motion.path
    grid = np.append((path.knots[:-1, None] + path.durations[:, None] * np.arange(_GRID) / _GRID).ravel(), path.duration)
    normals, low, high = _bounds(limits)
    speeds = np.minimum(own_limits(mission, robot, corridor)[0], limits.speed)

    def speed_at(at: float) -> Floats:
        # a grid point between two legs keeps the limits of both
        piece = np.searchsorted(path.knots, [at - 1e-9, at + 1e-9], side="right") - 1
        most = speeds[np.clip(piece, 0, len(speeds) - 1)].min()
        return np.linalg.norm(normals, axis=1)[:, None] * [-most, most]

    along = ta.SplineInterpolator(grid, _sampled(path) @ normals.T)
    kept = [
        constraint.JointVelocityConstraintVarying(speed_at),
        constraint.JointAccelerationConstraint(np.stack([low, high], axis=1)),
    ]
    answer = algorithm.TOPPRA(kept, along, gridpoints=grid).compute_trajectory(0, 0)
    return None if answer is None else float(np.ptp(answer.path_interval))


def _sampled(path: Spline) -> Floats:
    """Return positions on toppra's grid. Shape (points, 3)."""
    inner = path.sample(np.arange(_GRID) / _GRID).reshape(-1, 3)
    return np.concatenate([inner, path.nodes[-1:]])


def _bounds(limits: Limits) -> tuple[Floats, Floats, Floats]:
    """Return normals, shape (planes, 3), and the least and greatest acceleration along each that limits allow, m/s^2."""
    number = np.arange(_DIRECTIONS) + 0.5
    height, turn = 1.0 - number / _DIRECTIONS, np.pi * (1.0 + np.sqrt(5.0)) * number  # even on half of a sphere
    across = np.sqrt(1.0 - height**2)
    ball = np.stack([across * np.cos(turn), across * np.sin(turn), height], axis=1)
    high = np.minimum(limits.acceleration, limits.thrust_max - GRAVITY * height)
    low = -np.minimum(limits.acceleration, limits.thrust_max + GRAVITY * height)
    if limits.tilt >= np.pi / 2:
        return ball, low, high
    angle, slope = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False), np.tan(limits.tilt)
    cone = np.stack([np.cos(angle), np.sin(angle), np.full(32, -slope)], axis=1)
    return (
        np.concatenate([ball, cone]),
        np.append(low, np.full(32, -1e3)),
        np.append(high, np.full(32, slope * GRAVITY)),
    )


def hoop6_rows() -> None:
    """Print hoop6's least times, with one and two pieces a leg."""
    for pieces in (1, 2):
        ipopt_engine.forget()
        begin = time.process_time()
        flight = flown(time_optimal(HOOP6, HOOP6_LIMITS, pieces=pieces))
        spent = time.process_time() - begin
        assert all(claim.outcome == "holds" for claim in limit_verdicts(flight, hoop6_vehicle()).values())
        print(f"| hoop6, {pieces} a leg | | | {flight.duration:.3f} | {spent:.2f} | {len(flight.durations)} | | |", flush=True)


def split_s_row() -> None:
    """Print the Split-S course's least time."""
    row = split_s(3.0)
    assert row["certified"]
    assert row["passes"]
    print(f"| Split-S | | | {row['duration']:.3f} | {row['seconds']:.2f} | | | |", flush=True)


def main() -> None:
    """Print one row for each mission and course."""
    import_module("casadi")  # so that loading it counts nowhere
    wanted = sys.argv[1:] or [*MISSIONS, *COURSES]
    toppra = installed("toppra", "toppra")
    print(
        "| mission | nominal, s | pace 0.7, s | pace 1, s | processor time, s | pieces | without the programme, s / s | toppra, s |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for name in wanted:
        if name == "hoop6":
            hoop6_rows()
        elif name == "split-s":
            split_s_row()
        else:
            _print(name, mission_row(ltlplan.plan(RACE if name == "race" else name), toppra))


def _print(name: str, row: Row) -> None:
    fitted = "-" if row.programmeless is None else f"{row.programmeless:.2f}"
    peer = "" if row.retimed is None else f"{row.retimed:.2f}"
    print(
        f"| {name} | {row.nominal:.2f} | {row.usual:.2f} | {row.fastest:.2f} | {row.computing:.1f} | {row.pieces} "
        f"| {fitted} / {row.programmeless_computing:.1f} | {peer} |",
        flush=True,
    )
    for sentence in row.notes:
        print(f"  {name}: {sentence}", flush=True)


if __name__ == "__main__":
    run_benchmark(main, ["firefighting", "hoop6"])
