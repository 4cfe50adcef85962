"""Tracking on streamed set-points and from starts off rest: what each costs the bound that is proved.

    OMP_NUM_THREADS=1 python -m tests.benchmarks.streamed_setpoints RUN ...

Flights are those of the runs' folders, under the disturbances of their missions, which `geometric` flies. Each row proves all robots of a run anew, and prints
the bound, and what set-points, the start and coupling make of it.
"""

from __future__ import annotations

import sys
from pathlib import Path

from tests.benchmarks.tracking import AIRFRAME, VEHICLE, hover, proved
from tests.helpers.benchmarks import is_smallest, run_benchmark
from verify.data import Trajectory
from verify.data.disturbance import Disturbance, StreamedSetpoints, Unrest
from verify.data.files.mission_file import load_mission_file
from verify.data.files.trajectory_csv import load_csv

STREAMS = {
    "the plan at each command": None,
    "0 to 4 ms old": StreamedSetpoints(age=(0.0, 0.004)),
    "0 to 20 ms old": StreamedSetpoints(age=(0.0, 0.02)),
    "20 ms old": StreamedSetpoints(age=(0.02, 0.02)),
    "half a millimetre, mm/s and mm/s^2 on each axis": StreamedSetpoints(
        position=0.00087, velocity=0.00087, acceleration=0.00087
    ),
    "32 bits, at 8 m": StreamedSetpoints(position=8.3e-7, velocity=1e-7, acceleration=1e-7, jerk=1e-6, snap=1e-5),
    "without snap": StreamedSetpoints(orders=3),
    "without jerk and snap": StreamedSetpoints(orders=2),
    "heading 10 mrad off": StreamedSetpoints(heading=0.01),
}
STARTS = {
    "speed 10 mm/s": Unrest(speed=0.01),
    "tilt 10 mrad": Unrest(tilt=0.01),
    "rates 50 mrad/s": Unrest(turn=0.05),
    "heading 30 mrad": Unrest(heading=0.03),
    "1 % of each rotor's thrust": Unrest(rotors=0.01),
    "summed errors 0.02 m/s^2": Unrest(summed=0.02),
}


def row(name: str, paths: list[Trajectory], told: Disturbance) -> None:
    """Print what is proved of flights."""
    found = proved(paths, told)
    if isinstance(found, str):
        print(f"{name:50} not proved: {found}")
        return
    costs = ", ".join(f"{cause} {1000.0 * found.costs.get(cause, 0.0):.1f}" for cause in ("set-points", "start", "coupling"))
    print(f"{name:50} {1000.0 * found.bound:5.1f} mm  {costs}")


def main() -> None:
    """Prove the flights of runs under all of them."""
    runs = {Path(run).name: Path(run) for run in sys.argv[1:]}
    if is_smallest() or not runs:
        row("hover", [hover(0.2)], Disturbance(airframe=AIRFRAME, setpoints=STREAMS["0 to 4 ms old"]))
        return
    for name, run in runs.items():
        told = load_mission_file(run / "mission.yaml").disturbance
        assert told is not None, "the mission states disturbances"
        paths = [load_csv(path) for path in sorted(run.glob("*.csv")) if path.name != "flight.csv"]
        print(f"{name}, {VEHICLE.name}")
        for stream, sent in STREAMS.items():
            row(stream, paths, told.changed(setpoints=sent, rest=None))
        for start, rest in STARTS.items():
            row(start, paths, told.changed(setpoints=None, rest=rest))


if __name__ == "__main__":
    run_benchmark(main, [])
