"""Hovers and ways of `mellinger` on its filter: what each disturbance makes of the linear loop, and the largest share of a set that is proved.

    OMP_NUM_THREADS=1 python -m tests.benchmarks.hovers_on_board [SECONDS [DEAD_ZONE ...]] [--attitude NOISE] [--line METRES | --run RUN]

The set is the whole one of docs/tracking.md, for a Crazyflie 2.1: wind 0.8 m/s, cameras 1 mm and 0 to 15 ms, gyroscope 0.04 rad/s, mass 2 %, thrust 5 %. What the
linear loop makes is no proof. The dead zone is the least correction of the attitude that the filter takes, 1e-4 rad in the firmware. `NOISE` is what the filter
assumes of the cameras' attitude, rad, 0.05 in the profile. Flights are a hover, a line from rest to rest in so many seconds, or those of a run's folder.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tests.benchmarks.tracking import AIRFRAME, VEHICLE, WHOLE, hover
from tests.helpers.benchmarks import is_smallest, run_benchmark
from verify.data import Trajectory
from verify.data.autopilot import Autopilot, load_autopilot
from verify.data.files.trajectory_csv import load_csv
from verify.tracking.error_model import NotProved
from verify.tracking.onboard_proof import BoardBound, loop_of, prove_on_board

STOCK = load_autopilot("crazyflie-2")


def alone(seconds: float, autopilot: Autopilot) -> dict[str, float]:
    """Return m by which each disturbance of the whole set can move the linear loop.

    Args:
        seconds: Of the hover.
        autopilot: What flies.
    """
    responses = loop_of(VEHICLE, AIRFRAME, autopilot, 4, round(100 * seconds)).responses
    sizes = {"position": WHOLE.position, "gyroscope": WHOLE.gyroscope, "dropped": autopilot.ekf.least_turn}
    found = {"wind": responses.places["wind"] * WHOLE.wind}
    found |= {name: float(responses.lengths[name].sum()) * size for name, size in sizes.items()}
    found["mass"] = float(np.linalg.norm(responses.steady["mass"][:3])) * WHOLE.mass / (1.0 - WHOLE.mass)
    found["thrust"] = float(np.linalg.norm(responses.steady["thrust"][:3])) * WHOLE.thrust
    return found


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
    noise, metres, run = (taken(arguments, name) for name in ("--attitude", "--line", "--run"))
    seconds = float(arguments[0]) if arguments else 4.0
    stock = STOCK.changed(ekf=STOCK.ekf.changed(attitude_noise=float(noise))) if noise else STOCK
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
        costs = ", ".join(f"{name} {1000 * cost:.1f}" for name, cost in sorted(best.costs.items(), key=lambda one: -one[1])[:5])
        print(
            f"dead zone {least_turn:g} rad: {100 * low:.2g} %, {1000 * best.bound:.1f} mm ({costs}); {spent:.0f} s", flush=True
        )


if __name__ == "__main__":
    run_benchmark(main, ("0.2",), ("0.2", "--line", "0.001"))
