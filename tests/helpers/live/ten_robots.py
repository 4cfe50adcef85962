"""A simulated team of ten that flies up and down beside each other in real time, seen at a service: for tests and benchmarks of what that costs the flight.

python -m tests.helpers.live.ten_robots SECONDS ADDRESS flies it in a process of its own, says when the monitor first looks, and at the end what was measured.
"""

from __future__ import annotations

import itertools
import json
import sys
import threading
import time
from contextlib import closing
from dataclasses import dataclass, field

from flight.conditions import Conditions
from flight.link.live_executive import LiveFlight, Operator, fly_live
from flight.link.observed_link import Observation, ObservedLink
from flight.link.record import Record
from flight.link.simulated import SimulatedLink
from flight.link.stop_orders import StopOrders
from flight.link.tracking_monitor import Look
from flight.model.airframe import airframe_of
from ltlplan.service.client_parts.flight_feed import FlightFeed
from ltlplan.service.client_parts.long_polling import FollowedService
from tests.helpers.vehicles.crazyflie_stages import FAR, stage

_LEG = 1.0 / 0.45
"""s of a leg."""


@dataclass
class TenRobots:
    """The flight, in a thread of its own.

    Attributes:
        looks: When the monitor looked, s, and at which stage.
        shown: How long showing each observation took, s.
        computed: How long the flight's thread computed for it, s.
        done: How it ended.
        feed: Shows it, where it is seen.
    """

    seconds: float
    address: str | None = None
    robots: int = 10
    looks: list[tuple[float, str]] = field(default_factory=list[tuple[float, str]])
    shown: list[float] = field(default_factory=list[float])
    computed: list[float] = field(default_factory=list[float])
    done: LiveFlight | None = None
    feed: FlightFeed | None = None

    def begin(self) -> threading.Thread:
        """Begin to fly, and return the thread, which ends with the flight."""
        laps = max(round(self.seconds / (2 * _LEG)), 1)
        high = {f"r{i}": [-4.0 + 0.85 * i, -1.0, 0.6] for i in range(self.robots)}
        ways = {name: [at, *([[at[0], 0.0, 0.6], at] * laps)] for name, at in high.items()}
        stages = (
            stage("climb", {name: [[*at[:2], 0.0], at] for name, at in high.items()}, regions=FAR),
            stage("flight", ways, regions=FAR),
            stage("landing", {name: [at, [*at[:2], 0.05]] for name, at in high.items()}, regions=FAR),
        )
        flying = threading.Thread(target=self._fly, args=(stages,), name="ten robots")
        flying.start()
        return flying

    def _fly(self, stages: tuple) -> None:  # of stages
        mission = stages[1].plan.mission
        places = {name: tuple(path.evaluate(0.0)[:3].tolist()) for name, path in stages[0].paths.items()}
        lasts = 2.0 * self.seconds + 120.0  # a Crazyflie's battery is empty after five minutes
        vehicle = mission.vehicle.model_copy(update={"endurance": lasts})
        airframe = airframe_of(mission.vehicle)
        battery = airframe.battery.model_copy(update={"charge": lasts / 60.0 * airframe.battery.charge})
        link, orders, record = (
            SimulatedLink(
                mission.model_copy(update={"vehicle": vehicle}), places, real_time=True,
                conditions=Conditions(airframe=airframe.changed(battery=battery)),
            ),
            StopOrders(),
            Record(),
        )  # fmt: skip
        grounds = dict.fromkeys(places, 0.0)
        if self.address is None:
            self.done = fly_live(link, stages, grounds=grounds, operator=Operator(self._look))
            return
        with closing(FollowedService(self.address, mission.name)) as listener:
            self.feed = feed = FlightFeed(listener, lambda: mission, orders)

            def show(seen: Observation) -> None:
                began, computing = time.perf_counter(), time.thread_time()
                feed.show(seen)
                self.shown.append(time.perf_counter() - began)
                self.computed.append(time.thread_time() - computing)

            observed = ObservedLink(link, orders, record, show)

            def look(seen: Look) -> None:
                observed.see(seen)
                self._look(seen)

            try:
                self.done = fly_live(observed, stages, grounds=grounds, operator=Operator(look, orders, record))
                observed.observe()
            finally:
                feed.end()

    def _look(self, look: Look) -> None:
        self.looks.append((time.monotonic(), look.stage))

    @property
    def gaps(self) -> list[float]:
        """S between two looks at one stage, sorted: between stages a team hovers for a second."""
        return sorted(now - before for (before, stage), (now, same) in itertools.pairwise(self.looks) if stage == same)


def main() -> None:
    """Fly, and say what was measured."""
    team = TenRobots(float(sys.argv[1]), sys.argv[2])
    flying = team.begin()
    while flying.is_alive() and not team.looks:
        time.sleep(0.05)
    print("flying" if team.looks else "not flying", flush=True)
    flying.join()
    assert team.done is not None
    gaps = team.gaps
    found = {
        "reason": team.done.reason, "unsafe": team.done.unsafe, "median": gaps[len(gaps) // 2], "99 %": gaps[int(0.99 * len(gaps))],
        "late": sum(gap > 0.22 for gap in gaps) / len(gaps), "gap": gaps[-1], "shown": max(team.shown), "computed": max(team.computed),
        "computed in all": sum(team.computed) / len(team.computed),
    }  # fmt: skip
    print(json.dumps(found), flush=True)


if __name__ == "__main__":
    main()
