"""What the live loop takes for ten robots: a look at all of them under the monitor, and how evenly set-points leave.

    python tests/benchmarks/live.py [ROBOTS]

The first flies a certified team over a link that has nothing to wait for; the second streams for some seconds to vehicles that keep PX4's
rules, in another process, over local sockets, and says by how much the time between two set-points differs from 20 ms.
"""

from __future__ import annotations

import multiprocessing
import sys
import time
from collections.abc import Mapping
from multiprocessing.synchronize import Event
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import ltlplan
from flight.exports.scripts.flying.checks import NAMES
from flight.link.link import Health, Pose
from flight.link.live_executive import Operator, fly_live
from flight.link.mavlink import RATE, MavlinkLink
from flight.link.phases import Stage
from ltlplan.pipeline import certified_team
from tests.helpers.benchmarks import run_benchmark
from tests.helpers.vehicles.px4_peer import Manner, Px4Peer, free_port
from verify.data import Mission, Trajectory


def mission_of(count: int) -> Mission:
    """Robots in a row, each with a goal of its own ahead."""
    goals = "".join(f"  g{i}: {{center: [{i}.0, 3.0, 1.0], radii: [0.3, 0.3, 0.3]}}\n" for i in range(count))
    agents = "".join(f"  q{i}: {{start: [{i}.0, 0.0, 1.0]}}\n" for i in range(count))
    formula = " & ".join(f"F g{i}" for i in range(count))
    return ltlplan.parse_mission(
        f"format: 1\nname: row\nspec: {{formula: {formula!r}}}\nregions:\n{goals}agents:\n{agents}vehicle: crazyflie-2.1\n"
        f"workspace: {{min: [-2, -2, 0.2], max: [{count + 2}, 5, 3]}}\nplanner: {{objective: longest}}\n"
    )


class OnPlan:
    """A link to robots that are always where they should be."""

    failsafe, accuracy, streams = "nothing", 0.0, True

    def __init__(self, stage: Stage) -> None:
        self._paths, self._time, self._begin = stage.paths, 0.0, np.inf
        self.robots = tuple(stage.paths)

    def now(self) -> float:
        """Return the clock."""
        return self._time

    def sleep(self, seconds: float) -> None:
        """Move the clock."""
        self._time += seconds

    def pose(self, robot: str) -> Pose:
        """Return the planned place."""
        x, y, z = self._paths[robot].evaluate(max(self._time - self._begin, 0.0))[:3].tolist()
        return Pose(self._time, (x, y, z), None)

    def health(self, robot: str) -> Health:
        """Return nothing."""
        del robot
        return Health()

    def parameters(self, robot: str) -> Mapping[str, float]:
        """Return nothing."""
        del robot
        return {}

    def upload(self, robot: str, number: int, path: Trajectory) -> None:
        """Take a flight."""

    def start(self, number: int, at: float | None = None) -> float:
        """Begin."""
        del number, at
        self._begin = self._time
        return self._time

    def hold(self, robot: str) -> bool:
        """Hold."""
        del robot
        return True

    def land(self, robot: str, height: float, seconds: float) -> bool:
        """Land."""
        del robot, height, seconds
        return True

    def stop(self, robot: str) -> bool:
        """Stop."""
        del robot
        return True

    def close(self) -> None:
        """Close."""


def fly_vehicles(places: list[tuple[float, ...]], ports: list[int], done: Event) -> None:
    """Be all vehicles, until somebody is done with them."""
    peers = [
        Px4Peer(i + 1, port, (y, x, -z), Manner(armed=False))
        for i, (port, (x, y, z)) in enumerate(zip(ports, places, strict=True))
    ]
    for peer in peers:
        peer.start()
    done.wait()
    for peer in peers:
        peer.ended.set()


def main() -> None:
    """Print both figures."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    mission = mission_of(count)
    made = certified_team(ltlplan.plan(mission))
    stage = Stage("flight", made.plan, made.team, made.certificate)
    looks: list[float] = []
    begin = time.perf_counter()
    flown = fly_live(
        OnPlan(stage),
        (stage,),
        grounds=dict.fromkeys(mission.agents, 0.0),
        operator=Operator(lambda _: looks.append(time.perf_counter())),
        unchecked=NAMES,
    )
    assert flown.flown, flown.reason
    steps = np.diff(looks) * 1000
    print(f"{count} robots: a look takes {np.median(steps):.2f} ms, 99th percentile {np.percentile(steps, 99):.2f} ms "
          f"({len(looks)} looks, {time.perf_counter() - begin:.2f} s in all)")  # fmt: skip

    ports = [free_port() for _ in range(count)]
    done = multiprocessing.get_context("spawn").Event()
    places = [tuple(path.evaluate(0.0)[:3].tolist()) for path in stage.paths.values()]
    vehicles = multiprocessing.get_context("spawn").Process(target=fly_vehicles, args=(places, ports, done))
    vehicles.start()
    link = MavlinkLink(mission, {name: f"udpin:127.0.0.1:{port}" for name, port in zip(mission.agents, ports, strict=True)})
    for name, path in stage.paths.items():
        link.upload(name, 0, path)
    link.start(0)
    sent: list[float] = []
    first = link._vehicles["q0"].link.mav  # the one whose set-points are timed
    send = first.set_position_target_local_ned_send
    first.set_position_target_local_ned_send = lambda *values: (sent.append(time.perf_counter()), send(*values))
    link.sleep(5.0)
    done.set()
    vehicles.join()
    link.close()
    off = np.abs(np.diff(sent) - 1 / RATE) * 1000
    print(f"{count} robots: set-points leave {len(sent) / 5:.1f} times a second, off by {np.median(off):.2f} ms, "
          f"99th percentile {np.percentile(off, 99):.2f} ms, at most {off.max():.2f} ms")  # fmt: skip


if __name__ == "__main__":
    run_benchmark(main, ["2"])
