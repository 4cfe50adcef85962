"""Section 6.6 of the 2022 paper: online MTAC-E against offline, 1 to 5 robots (Figs. 14 and 15)."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from ltlplan.mtac.offline import share_tasks
from ltlplan.online_mtac.online_team import OnlineTeam
from ltlplan.online_mtac.team_in_flight import PERIOD
from ltlplan.reproduction.charts import bars
from ltlplan.reproduction.element import Chart, Element, Findings, Quantity, holds
from ltlplan.reproduction.team_flights import LENGTH, PAPER, PRINTED, UNIT, firefighting
from verify.data import Mission
from verify.data.sections import Agent

ROBOTS = (1, 2, 3, 4, 5)
"""Numbers of robots of Figs. 14 and 15."""
SEEDS = 3
"""Runs of each, of which medians are taken."""
LONGEST = 30.0
"""s of simulated time that an online team may fly."""


@dataclass(frozen=True, slots=True)
class Race:
    """One run offline and one online, or the medians of several.

    Attributes:
        offline: Summed cost of the paths found offline.
        online: Summed cost at the end of the online flight.
        seconds: Offline's processor time, s.
        reached: Online's until it has complete paths that are no dearer than offline's, s.
        factor: Offline's time over that.
        flight: Online's over its whole flight, s.
    """

    offline: float
    online: float
    seconds: float
    reached: float
    factor: float
    flight: float


def with_robots(mission: Mission, count: int) -> Mission:
    """Return the mission with its first robots, or with more of them behind and beside the paper's three.

    Args:
        mission: Fire-fighting.
        count: How many robots, up to five.
    """
    places = [(1.0, -0.5, 0.8), (1.0, 0.0, 0.8), (1.0, 0.5, 0.8), (1.4, -0.25, 0.8), (1.4, 0.25, 0.8)]
    agents = {f"quad{i}": Agent(start=place) for i, place in enumerate(places[:count])}
    return mission.model_copy(update={"agents": agents})


@cache
def raced(weights: tuple[tuple[str, float], ...], count: int, seed: int, longest: float = LONGEST) -> Race:
    """Return one run.

    Args:
        weights: Of the cost's terms.
        count: How many robots.
        seed: Of all draws.
        longest: Simulated time of the online flight, s.
    """
    mission = with_robots(firefighting(dict(weights)), count)
    begun = time.process_time()
    found = share_tasks(mission, rng=np.random.default_rng(seed), options=PAPER)
    took = time.process_time() - begun
    assert found is not None
    cost = sum(path.plan.cost for path in found.paths.values())
    begun = time.process_time()
    team = OnlineTeam(mission, rng=np.random.default_rng(seed))
    total, reached = time.process_time() - begun, np.nan
    positions = {name: agent.start for name, agent in mission.agents.items()}
    for step in range(round(longest / PERIOD)):
        begun = time.process_time()
        desired = team.step(step * PERIOD, positions)
        total += time.process_time() - begun
        if np.isnan(reached) and team.cost <= cost and team.complete:
            reached = total
        positions = {name: tuple(desired.flat[0, :3, j].tolist()) for j, name in enumerate(team.pilots)}
        if desired.finished:
            break
    return Race(cost, team.cost, took, reached, took / reached, total)


@cache
def medians(weights: tuple[tuple[str, float], ...], count: int, seeds: int = SEEDS, longest: float = LONGEST) -> Race:
    """Return the medians of several runs.

    Args:
        weights: Of the cost's terms.
        count: How many robots.
        seeds: How many runs.
        longest: Simulated time of each online flight, s.
    """
    runs = [raced(weights, count, seed, longest) for seed in range(seeds)]
    fields = ("offline", "online", "seconds", "reached", "factor", "flight")
    return Race(**{name: float(np.median([getattr(run, name) for run in runs])) for name in fields})


def table(weights: Mapping[str, float]) -> dict[int, Race]:
    """Return the medians for each number of robots.

    Args:
        weights: Of the cost's terms.
    """
    return {count: medians(tuple(weights.items()), count) for count in ROBOTS}


def summed_costs() -> Findings:
    """Compare the summed costs online and offline."""
    rows: list[Quantity] = []
    for title, weights, unit in (("printed cost", PRINTED, UNIT), ("length", LENGTH, "m")):
        for count, race in table(weights).items():
            rows.append(Quantity(f"N = {count}, {title}, online", race.online, unit))
            rows.append(Quantity(f"N = {count}, {title}, offline", race.offline, unit))
    found = [*table(PRINTED).values(), *table(LENGTH).values()]
    lower = holds(
        "online is lower for every number of robots",
        all(race.online < race.offline for race in found),
        "total costs are reduced in the online case",
    )
    return Findings(
        (*rows, lower),
        (_bars("Summed cost by the printed cost, online and offline.", f"summed cost ({UNIT})", "online", "offline"),),
    )


def run_times() -> Findings:
    """Compare the times to complete paths that are no dearer than offline's."""
    rows = [
        Quantity(f"N = {count}, {title}: offline's time over online's", race.factor, paper="3 to 5", digits=1)
        for title, weights in (("printed cost", PRINTED), ("length", LENGTH))
        for count, race in table(weights).items()
    ]
    whole = [
        Quantity(f"N = {count}, printed cost: computing of the online flight", race.flight, "s")
        for count, race in table(PRINTED).items()
    ]
    chart = _bars(
        "Time to complete paths that are no dearer than offline's, by the printed cost.",
        "processor time (s)",
        "reached",
        "seconds",
    )
    return Findings((*rows, *whole), (chart,))


def _bars(label: str, axis: str, online: str, offline: str) -> Chart:
    """Return bars for each number of robots."""
    found = table(PRINTED)
    rows = {
        name: [getattr(race, which) for race in found.values()] for name, which in (("online", online), ("offline", offline))
    }
    return bars(label, [str(count) for count in found], rows, ("robots", axis))


RACE: tuple[Element, ...] = (
    Element(
        id="2022-fig-14", publication="2022", kind="figure", title="Section 6.6 and Fig. 14: summed cost, 1 to 5 robots", shares="2022-fig-14",
        says="Online MTAC-E finds lower summed costs than offline for 1 to 5 robots.",
        differs="Beyond three robots nothing changes here: two do the work. Medians of three seeds.",
        by=("ltlplan.mtac.offline.share_tasks", "ltlplan.online_mtac.online_team.OnlineTeam"), compute=summed_costs,
    ),
    Element(
        id="2022-fig-15", publication="2022", kind="figure", title="Section 6.6 and Fig. 15: run time, 1 to 5 robots", shares="2022-fig-14",
        says="Online is 3 to 5 times faster.",
        differs="Compared is the time to complete paths no dearer than offline's; the computing of a whole online flight is more, and stands beside it.",
        by=("ltlplan.mtac.offline.share_tasks", "ltlplan.online_mtac.online_team.OnlineTeam"), compute=run_times,
    ),
)  # fmt: skip
