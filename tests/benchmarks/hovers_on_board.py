"""Hovers and ways of `mellinger` on its filter: what each disturbance makes of the linear loop, and the largest share of a set that is proved.

    OMP_NUM_THREADS=1 python -m tests.benchmarks.hovers_on_board [SECONDS [DEAD_ZONE ...]] [--attitude NOISE] [--line METRES | --run RUN | --steps]
        [--shares SHARE,...]

The set is the whole one of docs/tracking.md, for a Crazyflie 2.1: wind 0.8 m/s, cameras 1 mm and 0 to 15 ms, gyroscope 0.04 rad/s, mass 2 %, thrust 5 %. What the
linear loop makes is no proof. The dead zone is the least correction of the attitude that the filter takes, 1e-4 rad in the firmware. `NOISE` is what the filter
assumes of the cameras' attitude, rad, 0.05 in the profile. Flights are a hover, a line from rest to rest in so many seconds, or those of a run's folder.
`--shares` proves those shares alone, in place of looking for the largest.
`--steps` hovers at none, 2 and 4 % of the set under the gains of `GAINS`, and prints beside the bounds how the linear loop answers a step of the set-point along x
and upwards.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tests.benchmarks.tracking import AIRFRAME, VEHICLE, WHOLE, answer, costs_of, hover
from tests.helpers.benchmarks import is_smallest, run_benchmark
from verify.data import Trajectory
from verify.data.autopilot import Autopilot, load_autopilot
from verify.data.files.trajectory_csv import load_csv
from verify.tracking.error_model import NotProved
from verify.tracking.on_board.onboard_course import maps_of
from verify.tracking.on_board.onboard_loop import LINKED, PLACE, SUBSTEPS
from verify.tracking.on_board.onboard_proof import BoardBound, prove_on_board, summed_of
from verify.tracking.on_board.onboard_sums import COUNT, INPUT, LENGTH, STEPPED

STOCK = load_autopilot("crazyflie-2")
QUICK = {"attitude": (105000.0, 105000.0, 60000.0), "rate": (24000.0, 24000.0, 12000.0)}
QUICKER = {"attitude": (140000.0, 140000.0, 60000.0), "rate": (32000.0, 32000.0, 12000.0)}
STIFF = {"position": (0.8, 0.8, 1.25), "velocity": (0.3, 0.3, 0.4)}
STIFFER = {"position": (1.0, 1.0, 1.25), "velocity": (0.35, 0.35, 0.4)}
GAINS = {
    "as the firmware": {},
    "quicker attitude": QUICK,
    "stiff": STIFF,
    "stiff and quicker": {**STIFF, **QUICK},
    "stiffer and quicker": {**STIFFER, **QUICK},
    "stiffer and quickest": {**STIFFER, **QUICKER},
    "stiffest and quickest": {"position": (1.6, 1.6, 1.25), "velocity": (0.4, 0.4, 0.4), **QUICKER},
    "soft": {"position": (0.2, 0.2, 0.8), "velocity": (0.15, 0.15, 0.3)},
    "more damped": {"velocity": (0.4, 0.4, 0.6)},
}
"""Gains that `--steps` compares, by what is changed."""


def alone(seconds: float, autopilot: Autopilot) -> dict[str, float]:
    """Return m by which each disturbance of the whole set can move the linear loop.

    Args:
        seconds: Of the hover.
        autopilot: What flies.
    """
    course, sums = summed_of(VEHICLE, AIRFRAME, autopilot, 4, line(0.0, seconds), round(100 * seconds))
    sizes = {"wind": WHOLE.wind, "position": WHOLE.position, "gyroscope": WHOLE.gyroscope, "dropped": autopilot.ekf.least_turn}
    found = dict[str, float]()
    for name, size in sizes.items():
        inputs = np.zeros((course.frames, SUBSTEPS, COUNT))
        inputs[..., INPUT[name]] = size
        found[name] = float(sums.driven(inputs[..., :STEPPED], inputs[:, 0, STEPPED:])[:, LENGTH].max())
    steady = sums.steady[:, :, LENGTH].max(0)
    return found | {"mass": float(steady[0]) * WHOLE.mass / (1.0 - WHOLE.mass), "thrust": float(steady[1]) * WHOLE.thrust}


def proved(paths: Sequence[Trajectory], autopilot: Autopilot, share: float) -> BoardBound | str:
    """Return the worst bound of flights at a share of the whole set, or why there is none.

    Args:
        paths: Of the robots.
        autopilot: What flies.
        share: Of the set.
    """
    duration = max(path.duration for path in paths)
    try:
        found = [prove_on_board(VEHICLE, autopilot, WHOLE.scaled(share), (path, duration)) for path in paths]
    except NotProved as reason:
        return str(reason)
    return max(found, key=lambda one: one.bound)


def line(metres: float, seconds: float) -> Trajectory:
    """Return a line along x from rest to rest.

    Args:
        metres: Of its length.
        seconds: Of its duration.
    """
    coefficients = hover(seconds).coefficients.copy()
    coefficients[0, 0, 4:] = metres * np.array([35.0, -84.0, 70.0, -20.0]) / seconds ** np.arange(4, 8)
    return Trajectory([seconds], coefficients)


def step_of(autopilot: Autopilot, axis: int, frames: int) -> tuple[float, float, float]:
    """Return how the linear loop answers a step, as `tests.benchmarks.tracking.answer` does.

    Args:
        autopilot: What flies.
        axis: Of the step.
        frames: Of the flight.
    """
    course, _ = summed_of(VEHICLE, AIRFRAME, autopilot, 4, line(0.0, 0.01 * frames), frames)
    maps, state, left = maps_of(course, slice(0, 1)), np.zeros(LINKED), [1.0]
    state[[rows + axis for rows in (PLACE.start, 23, 36, 42)]] = (
        1.0  # the vehicle, its estimate and poses on their way: the set-point has moved
    )
    for _ in range(1200):
        for step in range(SUBSTEPS):
            state = maps.steps[0, step] @ state
            left.append(float(state[PLACE.start + axis]))
        state = maps.jumps[0] @ state
    return answer(np.array(left))


def compare(stock: Autopilot, seconds: float) -> None:
    """Print rows of hovers for each of the gains.

    Args:
        stock: With the filter.
        seconds: Of the hovers.
    """
    assert stock.mellinger is not None
    for name, changes in list(GAINS.items())[: 2 if is_smallest() else None]:
        autopilot = stock.changed(mellinger=stock.mellinger.changed(**changes))
        steps = "; ".join(
            "{:.0f} %, {:.2f} s, {:.2f} s".format(*step_of(autopilot, axis, round(100 * seconds))) for axis in (0, 2)
        )
        print(f"{name}: steps {steps}", flush=True)
        for share in (0.0, 0.02, 0.04):
            found = proved([line(0.0, seconds)], autopilot, share)
            told = found if isinstance(found, str) else f"{1000.0 * found.bound:.1f} mm ({costs_of(found)})"
            print(f"    {100.0 * share:.0f} %: {told}", flush=True)


def taken(arguments: list[str], name: str) -> str:
    """Take an option and its value out of arguments; return the value, empty where it is not there."""
    if name not in arguments:
        return ""
    at = arguments.index(name)
    value = arguments[at + 1]
    del arguments[at : at + 2]
    return value


def main() -> None:
    """Print what the linear loop makes, and a line for each dead zone."""
    arguments = sys.argv[1:]
    noise, metres, run, shares = (taken(arguments, name) for name in ("--attitude", "--line", "--run", "--shares"))
    steps = "--steps" in arguments and not arguments.remove("--steps")
    seconds = float(arguments[0]) if arguments else 4.0
    stock = STOCK.changed(ekf=STOCK.ekf.changed(attitude_noise=float(noise))) if noise else STOCK
    if steps:
        compare(stock, seconds)
        return
    paths = [line(float(metres or 0.0), seconds)]
    if run:
        paths = [load_csv(name) for name in sorted(Path(run).glob("*.csv")) if name.name != "flight.csv"]
    else:
        made = ", ".join(f"{name} {1000 * size:.1f} mm" for name, size in alone(seconds, stock).items())
        print(f"linear loop, no proof: {made}", flush=True)
    zones = [0.0] if is_smallest() else [float(zone) for zone in arguments[1:]] or [stock.ekf.least_turn, 5e-5, 2e-5, 0.0]
    for least_turn in zones:
        begun, low, high = time.process_time(), 0.0, 0.16
        autopilot = stock.changed(ekf=stock.ekf.changed(least_turn=least_turn))
        for share in (float(each) for each in shares.split(",") if each):
            found = proved(paths, autopilot, share)
            told = found if isinstance(found, str) else f"{1000.0 * found.bound:.1f} mm ({costs_of(found)})"
            print(
                f"dead zone {least_turn:g} rad, {100.0 * share:.2g} %: {told}; {time.process_time() - begun:.0f} s", flush=True
            )
        if shares:
            continue
        best = proved(paths, autopilot, low)
        for _ in range(0 if isinstance(best, str) else 1 if is_smallest() else 6):
            middle = 0.5 * (low + high)
            found = proved(paths, autopilot, middle)
            if isinstance(found, str):
                high = middle
            else:
                low, best = middle, found
        spent = time.process_time() - begun
        if isinstance(best, str):
            print(f"dead zone {least_turn:g} rad: none, {best}; {spent:.0f} s", flush=True)
            continue
        print(
            f"dead zone {least_turn:g} rad: {100 * low:.2g} %, {1000 * best.bound:.1f} mm ({costs_of(best)}); {spent:.0f} s",
            flush=True,
        )


if __name__ == "__main__":
    run_benchmark(main, ("0.2",), ("0.2", "--line", "0.001"), ("0.2", "--steps"))
