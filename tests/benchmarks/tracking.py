"""Tracking: the largest share of a set of disturbances that is proved, what it costs, and what stands in the way of more.

    OMP_NUM_THREADS=1 python -m tests.benchmarks.tracking [RUN ...] [--gains GAINS] [--each] [--hunt] [--steps] [--seconds]

Flights are a hover of 4 s and those of the runs' folders; all of their robots are proved. The set is the whole one of docs/tracking.md, for a Crazyflie 2.1:
wind 0.8 m/s, cameras 1 mm and 0 to 15 ms, gyroscope 0.04 rad/s, mass 2 %, thrust 5 %. `GAINS` changes gains of its airframe, as in
`'position: [6, 12], velocity: [4.5, 9]'`. `--each` hovers without each of the disturbances, too. `--hunt` flies hovers at 20 and
37 % of the set in winds and gyroscope errors aimed by the loop's response, in 64 directions, at corners of mass, thrust and latency. `--steps` hovers at 20 % of the set under the gains of `GAINS`, and prints beside each bound
how the linear loop, as it is sampled, answers a step of the set-point along a horizontal axis and upwards. "time" is the processor's, of one proof of all
robots. `--seconds` prints that alone: at 15 % of the set, of three robots that hover for 3.4, 10 and 40 s, and of the runs, with nothing remembered.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from itertools import product
from pathlib import Path

import numpy as np
import yaml
from numpy.typing import NDArray

from tests.helpers.benchmarks import is_smallest, run_benchmark
from tests.helpers.vehicles.disturbed_flights import Disturbed
from verify.data import Trajectory
from verify.data.airframe import AirframeTable, load_airframe
from verify.data.disturbance import Disturbance
from verify.data.files.trajectory_csv import load_csv
from verify.data.vehicle import Vehicle, load_vehicle
from verify.tracking.error_model import NotProved
from verify.tracking.loops import LoopChoice, lateral_loop, vertical_loop
from verify.tracking.on_board.onboard_proof import BoardBound
from verify.tracking.proof import TrackingBound, cells_of, loops_of, model_of, prove, steps_late
from verify.tracking.sampled_loop import SUBSTEPS, SampledLoop

AIRFRAME, VEHICLE = load_airframe("crazyflie-2.1"), load_vehicle("crazyflie-2.1")
WHOLE = Disturbance(
    airframe=AIRFRAME, wind=0.8, position=0.001, latency=(0.0, 0.015), gyroscope=0.04, mass=0.02, thrust=0.05, sag=0.002
)


QUICK = {"attitude": (300.0, 40.0), "rate": (28.0, 8.0)}
STIFF = {"attitude": (400.0, 60.0), "rate": (34.0, 12.0), "position": (26.0, 36.0), "velocity": (9.0, 12.0)}
OTHERS = {
    "as shipped": {},
    "quicker attitude": QUICK,
    "softer": {**QUICK, "position": (8.0, 16.0), "velocity": (5.0, 9.0), "integral": (6.0, 12.0)},
    "softest": {**QUICK, "position": (6.5, 14.0), "velocity": (4.4, 9.0), "integral": (4.0, 12.0)},
    "less damped": {"velocity": (5.0, 8.0)},
    "more damped": {"velocity": (7.5, 10.0)},
    "stiffer": {"position": (18.0, 24.0), "velocity": (7.0, 10.0)},
    "stiffest": STIFF,
}
"""Gains that `--steps` compares, by what is changed."""


def hover(duration: float) -> Trajectory:
    """Return a hover at 1 m.

    Args:
        duration: s.
    """
    coefficients = np.zeros((1, 4, 8))
    coefficients[0, 2, 0] = 1.0
    return Trajectory([duration], coefficients)


def robots_of(run: Path) -> list[Trajectory]:
    """Return the flights of a run's robots.

    Args:
        run: Its folder.
    """
    return [load_csv(name) for name in sorted(run.glob("*.csv")) if name.name != "flight.csv"]


def proved(paths: Sequence[Trajectory], told: Disturbance) -> TrackingBound | str:
    """Return the worst bound of all robots, or why there is none.

    Args:
        paths: Of the robots.
        told: What disturbs them.
    """
    duration = max(path.duration for path in paths)
    found: list[TrackingBound] = []
    try:
        for path in paths:
            x, y, z = (float(number) for number in path.coefficients[0, :3, 0])
            found.append(prove(model_of(path, duration, (x, y, z), VEHICLE, told)))
    except NotProved as reason:
        return str(reason)
    return max(found, key=lambda one: one.bound)


def measure(name: str, paths: Sequence[Trajectory], told: Disturbance, halvings: int) -> None:
    """Print one row.

    Args:
        name: Of the flight.
        paths: Of its robots.
        told: The whole set.
        halvings: Steps of the search.
    """
    low, high, kept, spent = 0.0, 1.0, proved(paths, told.scaled(0.0)), 0.0
    reason = kept if isinstance(kept, str) else ""
    for _ in range(0 if reason else halvings):
        share, begun = 0.5 * (low + high), time.process_time()
        found = proved(paths, told.scaled(share))
        if isinstance(found, str):
            high, reason = share, found
        else:
            low, kept, spent = share, found, time.process_time() - begun
    if isinstance(kept, str):
        print(f"{name:24} none: {reason}", flush=True)
        return
    row = f"{name:24} {100.0 * low:5.1f} %  {1000.0 * kept.bound:6.1f} mm  {spent:6.1f} s  {costs_of(kept)}; more: {reason}"
    print(row, flush=True)


def measure_seconds(name: str, paths: Sequence[Trajectory], told: Disturbance) -> None:
    """Print how long one proof of all robots takes, with nothing remembered.

    Args:
        name: Of the flight.
        paths: Of its robots.
        told: The set.
    """
    loops_of.cache_clear()
    begun = time.process_time()
    found = proved(paths, told)
    spent, duration = time.process_time() - begun, max(path.duration for path in paths)
    cells = len(cells_of(model_of(paths[0], duration, (0.0, 0.0, 0.0), VEHICLE, told)))
    bound = found if isinstance(found, str) else f"{1000.0 * found.bound:6.1f} mm"
    print(f"{name:24} {duration:6.1f} s {len(paths):7} {cells:6} {spent:7.2f} s  {bound}", flush=True)


def step_of(make: Callable[[Vehicle, AirframeTable, LoopChoice], SampledLoop], told: Disturbance) -> tuple[float, float, float]:
    """Return how a loop answers a step: overshoot in %, times from 10 to 90 % and until it stays within 5 %, in s.

    Args:
        make: Makes the loop.
        told: Its gains, and how late cameras are.
    """
    loop = make(VEHICLE, told.airframe, LoopChoice(1.0, 1.0, steps_late(told), 1.0))
    taken, seen = [t for _, t in loop.recorded], [s for s, _ in loop.recorded]
    state, left = np.zeros(len(loop.states)), np.ones(3001)
    state[0] = state[loop.states.index("xi_seen")] = 1.0  # off by the step: the set-point has moved
    for k in range(3000):
        state = loop.jump.mid @ state if k % SUBSTEPS == 0 else state
        state = loop.step.mid @ state
        if k % SUBSTEPS + 1 == loop.seen:
            state[taken] = state[seen]
        left[k + 1] = state[0]
    return answer(left)


def answer(left: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return overshoot in %, times from 10 to 90 % and until it stays within 5 %, in s.

    Args:
        left: What is left of a step, each 2 ms. Shape (n,).
    """
    rise = 0.002 * (np.argmax(left < 0.1) - np.argmax(left < 0.9))
    settled = 0.002 * (len(left) - np.argmax(np.abs(left[::-1]) > 0.05))
    return -100.0 * float(left.min()), float(rise), float(settled)


def compare(told: Disturbance) -> None:
    """Print a row of a hover for each of the gains.

    Args:
        told: The set.
    """
    print(f"{'gains':24} {'bound':>9}  {'horizontal step':>22}  {'vertical step':>22}  what makes the bound, mm")
    for name, changes in OTHERS.items():
        flown = told.changed(airframe=AIRFRAME.changed(gains=AIRFRAME.gains.changed(**changes)))
        found = proved([hover(0.2 if is_smallest() else 4.0)], flown)
        steps = "  ".join(
            "{:5.1f} % {:5.2f} s {:5.2f} s".format(*step_of(make, flown)) for make in (lateral_loop, vertical_loop)
        )
        print(
            f"{name:24} {found if isinstance(found, str) else f'{1000.0 * found.bound:6.1f} mm':>9}  {steps}  {costs_of(found)}",
            flush=True,
        )


def costs_of(found: TrackingBound | BoardBound | str) -> str:
    """Return what makes a bound, the dearest first, in mm.

    Args:
        found: What is proved, or why nothing is.
    """
    if isinstance(found, str):
        return ""
    dearest = sorted(found.costs.items(), key=lambda item: -item[1])[:5]
    return ", ".join(f"{cause} {1000.0 * cost:.1f}" for cause, cost in dearest if cost > 5e-5)


def aimed(name: str, steps: int) -> NDArray[np.float64]:
    """Return the signs of the lateral loop's response to an input, read backwards. Shape (steps,).

    Args:
        name: Of the input.
        steps: On board.
    """
    loop = lateral_loop(VEHICLE, AIRFRAME, LoopChoice(1.0, 1.0, 2, 1.0))
    taken, seen = [t for _, t in loop.recorded], [s for s, _ in loop.recorded]
    state, found = np.zeros(len(loop.states)), np.zeros(steps)
    for k in range(steps):
        state = loop.jump.mid @ state if k % SUBSTEPS == 0 else state
        state = loop.step.mid @ state + (loop.stepped[name].mid[:, 0] if k == 0 else 0.0)
        if k % SUBSTEPS + 1 == loop.seen:
            state[taken] = state[seen]
        found[k] = state[0]
    return np.sign(found[::-1])


def hunt(told: Disturbance, steps: int) -> None:
    """Print a hover's bound over the worst that aimed disturbances make of it.

    Args:
        told: The set.
        steps: On board.
    """
    turns, rises = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False), (0.0, 0.4, -0.4, 0.8))
    ways = np.stack([np.cos(turns) * np.cos(rises), np.sin(turns) * np.cos(rises), np.sin(rises)]).reshape(3, -1)
    rolls = np.stack([-np.sin(turns), np.cos(turns), 0.0 * turns]).reshape(3, -1)
    winds, errors, bound, worst = aimed("acc", steps), aimed("u", steps), proved([hover(4.0)], told), 0.0
    for late, heavy, strong, way in product((0, int(told.latency[1] / 0.002)), (-1, 1), (-1, 1), (-1, 1)):
        flight = Disturbed(
            64, late=late, mass=np.full(64, 1.0 + heavy * told.mass), thrust=np.full(64, 1.0 + strong * told.thrust),
            wind=lambda t: told.wind * winds[min(round(t / 0.002), steps - 1)] * ways,
            gyroscope=lambda t, way=way: way * told.gyroscope * errors[min(round(t / 0.002), steps - 1)] * rolls,
        )  # fmt: skip
        worst = max(worst, float(np.linalg.norm(flight.fly(VEHICLE, hover(4.0), 0.002 * steps), axis=1).max()))
    if not isinstance(bound, str):
        print(
            f"hover, wind {told.wind:g} m/s: bound {1000 * bound.bound:.1f} mm, worst {1000 * worst:.1f} mm, {bound.bound / worst:.1f} times",
            flush=True,
        )


def without_each(told: Disturbance, halvings: int) -> None:
    """Print a row of a hover without each of the disturbances.

    Args:
        told: The whole set.
        halvings: Steps of the search.
    """
    still = {
        "wind": {"wind": 0.0}, "latency": {"latency": (0.0, 0.0)}, "latency's changes": {"latency": (0.0075, 0.0075)}, "position": {"position": 0.0},
        "gyroscope": {"gyroscope": 0.0}, "mass and thrust": {"mass": 0.0, "thrust": 0.0},
    }  # fmt: skip
    for name, changes in still.items():
        measure(f"without {name}", [hover(0.2 if is_smallest() else 4.0)], told.changed(**changes), halvings)


def main() -> None:
    """Measure a hover and the flights of runs."""
    arguments = sys.argv[1:]
    airframe = AIRFRAME
    if "--gains" in arguments:
        at = arguments.index("--gains")
        changes = {
            key: tuple(value) if isinstance(value, list) else value
            for key, value in yaml.safe_load(f"{{{arguments[at + 1]}}}").items()
        }
        airframe = AIRFRAME.changed(gains=AIRFRAME.gains.changed(**changes))
        del arguments[at : at + 2]
    each = "--each" in arguments
    if each:
        arguments.remove("--each")
    if "--hunt" in arguments:
        for share in (0.2, 0.37):
            hunt(WHOLE.scaled(share), 20 if is_smallest() else 1900)
        return
    if "--steps" in arguments:
        compare(WHOLE.scaled(0.2))
        return
    told, halvings = WHOLE.changed(airframe=airframe), 1 if is_smallest() else 6
    if "--seconds" in arguments:
        arguments.remove("--seconds")
        print(f"{'flight':24} {'length':>8} {'robots':>7} {'cells':>6} {'time':>9}  bound")
        for duration in (0.2,) if is_smallest() else (3.4, 10.0, 40.0):
            measure_seconds("hover", [hover(duration)] * 3, told.scaled(0.15))
        for run in map(Path, arguments):
            measure_seconds(run.name, robots_of(run), told.scaled(0.15))
        return
    print(f"{'flight':24} {'share':>7}  {'bound':>9}  {'time':>8}  what makes the bound, mm")
    measure("hover", [hover(0.2 if is_smallest() else 4.0)], told, halvings)
    if each:
        without_each(told, halvings)
    for run in map(Path, arguments):
        measure(run.name, robots_of(run), told, halvings)


if __name__ == "__main__":
    run_benchmark(main, [], ["--each"], ["--hunt"], ["--steps"], ["--seconds"])
