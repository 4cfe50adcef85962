"""From an event in flight to the next certified piece, in real time: fire fighting over the simulated link, with a process that computes beside it.

    OMP_NUM_THREADS=1 python tests/benchmarks/online.py [FLIGHTS]

Each flight has four events two seconds apart: regions that move by decimetres, formulas that ask for more, and one robot that fails. Printed are the
seconds from the instant at which an event is known until a way to come to rest is proved, until the next piece is certified and proved with all that was
flown before, and until it begins; where nothing could be proved of what was left, that is counted, and why is said.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import ltlplan
from flight import Conditions
from flight.link.live_executive import fly_live
from flight.link.simulated import SimulatedLink
from ltlplan.online.event_queue import Happenings, no_news
from ltlplan.online.live.live_online_flight import Answered, OnlineCourse
from ltlplan.online.segments.certified_team import CertifiedTeam
from ltlplan.service.execution.background_executor import Beside
from ltlplan.transfers import to_starts
from tests.helpers.benchmarks import run_benchmark
from verify.data.events import HoopMoves, NewFormula, RobotLeaves, WorldEvent

_PLACES = {"loc2": (-1.15, 0.45, 1.0), "loc1": (0.2, 0.75, 1.0), "smoke": (-0.45, -0.15, 0.9)}
_FORMULAS = ("F loc1 & F loc2 & F water & G(smoke -> carrying)", "F loc2 & F loc1 & F smoke & G(smoke -> carrying)")


def events_of(rng: np.random.Generator) -> tuple[WorldEvent, ...]:
    """Return the events of one flight."""
    drawn: list[WorldEvent] = []
    falls = int(rng.integers(4))
    for number in range(4):
        time = 1.0 + 2.0 * number + float(rng.uniform(0.0, 0.5))
        if number == falls:
            drawn.append(RobotLeaves(time=time, robot=f"quad{rng.integers(3)}"))
        elif rng.random() < 0.5:
            region = list(_PLACES)[int(rng.integers(3))]
            x, y, z = (np.array(_PLACES[region]) + rng.uniform(-0.15, 0.15, 3)).tolist()
            drawn.append(HoopMoves(time=time, region=region, center=(x, y, z)))
        else:
            drawn.append(NewFormula(time=time, formula=_FORMULAS[int(rng.integers(2))]))
    return tuple(drawn)


def fly(computer: Beside, seed: int) -> tuple[Sequence[Answered], str]:
    """Fly once, and return how events were answered, and how it ended."""
    mission = ltlplan.load_mission("firefighting")
    team = CertifiedTeam(mission, seed=1)
    assert team.present is not None
    places = {name: (*agent.start[:2], 0.0) for name, agent in mission.agents.items()}
    before = [transfer.stage for transfer in to_starts(mission, team.present.team, places)]
    link = SimulatedLink(mission, places, conditions=Conditions(noise=0.001), seed=seed, real_time=True)
    course = OnlineCourse(team, computer, places, Happenings(events_of(np.random.default_rng(seed)), no_news))
    done = fly_live(link, before, grounds=dict.fromkeys(places, 0.0), onwards=course)
    return course.answered, done.reason or team.holding or "all was done"


def main() -> None:
    """Fly so often, and print quantiles."""
    flights = int(sys.argv[1]) if len(sys.argv) > 1 else 12
    computer, answered = Beside(), list[Answered]()
    for seed in range(flights):
        entries, ended = fly(computer, seed)
        answered += entries
        for entry in entries:
            said = ", ".join("-" if one is None else f"{one:.2f}" for one in (entry.stop, entry.proved, entry.begun))
            print(f"flight {seed}, {entry.event.time:5.2f} s {entry.event}: {said}", flush=True)
        print(f"flight {seed}: {ended}", flush=True)
    print(f"{len(answered)} events; median, 95th percentile and most, s:")
    for what in ("stop", "proved", "begun"):
        found = [value for entry in answered if (value := getattr(entry, what)) is not None]
        if found:
            middle, most = np.quantile(found, 0.5), np.quantile(found, 0.95)
            print(f"  {what}: {len(found)} answers, {middle:.2f}, {most:.2f}, {max(found):.2f}")


if __name__ == "__main__":
    run_benchmark(main, ["1"])
