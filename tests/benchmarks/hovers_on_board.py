"""Hovers of `mellinger` on its filter: what each disturbance makes of the linear loop, and the largest share of a set that is proved.

    OMP_NUM_THREADS=1 python -m tests.benchmarks.hovers_on_board [SECONDS [DEAD_ZONE ...]]

The set is the whole one of docs/tracking.md, for a Crazyflie 2.1: wind 0.8 m/s, cameras 1 mm and 0 to 15 ms, gyroscope 0.04 rad/s, mass 2 %, thrust 5 %. What the
linear loop makes is no proof. The dead zone is the least correction of the attitude that the filter takes, 1e-4 rad in the firmware.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from tests.benchmarks.tracking import AIRFRAME, VEHICLE, WHOLE
from tests.helpers.benchmarks import is_smallest, run_benchmark
from verify.data.autopilot import load_autopilot
from verify.tracking.error_model import NotProved
from verify.tracking.onboard_proof import HoverBound, loop_of, prove_hover

STOCK = load_autopilot("crazyflie-2")


def alone(seconds: float) -> dict[str, float]:
    """Return m by which each disturbance of the whole set can move the linear loop.

    Args:
        seconds: Of the hover.
    """
    responses = loop_of(VEHICLE, AIRFRAME, STOCK, 4, round(100 * seconds)).responses
    sizes = {"position": WHOLE.position, "gyroscope": WHOLE.gyroscope, "dropped": STOCK.ekf.least_turn}
    found = {"wind": responses.places["wind"] * WHOLE.wind}
    found |= {name: float(responses.lengths[name].sum()) * size for name, size in sizes.items()}
    found["mass"] = float(np.linalg.norm(responses.steady["mass"][:3])) * WHOLE.mass / (1.0 - WHOLE.mass)
    found["thrust"] = float(np.linalg.norm(responses.steady["thrust"][:3])) * WHOLE.thrust
    return found


def proved(seconds: float, least_turn: float, share: float) -> HoverBound | str:
    """Return the bound of a hover at a share of the whole set, or why there is none.

    Args:
        seconds: Of the hover.
        least_turn: rad, below which the filter drops corrections.
        share: Of the set.
    """
    autopilot = STOCK.changed(ekf=STOCK.ekf.changed(least_turn=least_turn))
    try:
        return prove_hover(VEHICLE, autopilot, WHOLE.scaled(share), seconds)
    except NotProved as reason:
        return str(reason)


def main() -> None:
    """Print what the linear loop makes, and a line for each dead zone."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 4.0
    print(
        "linear loop, no proof: " + ", ".join(f"{name} {1000 * made:.1f} mm" for name, made in alone(seconds).items()),
        flush=True,
    )
    zones = [0.0] if is_smallest() else [float(zone) for zone in sys.argv[2:]] or [STOCK.ekf.least_turn, 5e-5, 2e-5, 0.0]
    for least_turn in zones:
        begun, low, high = time.process_time(), 0.0, 0.16
        best = proved(seconds, least_turn, low)
        for _ in range(1 if is_smallest() else 6):
            middle = 0.5 * (low + high)
            found = proved(seconds, least_turn, middle)
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
    run_benchmark(main, ("0.2",))
