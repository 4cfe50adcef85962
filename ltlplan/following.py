"""A certified team that its vehicles' controllers can follow: flown in simulation, and slowed where it strays.

A flight may take as much of its limits as its pace allows; what is left is the controller's. Where that does not do, the team flies more
slowly there (`refine.slowing`), is proved and flown again; the plan's own times are taken where that does not do, or lasts longer.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ltlplan.logic.budget import DEFAULT_BUDGET, Budget
from ltlplan.paths.costs import with_expected_times, with_flown_times
from ltlplan.replanning.alternatives import candidates
from ltlplan.replanning.cuts import Candidate, Certified, Conflict, Cut, Flight
from verify.data.progress import Progress, part_of, silent

if TYPE_CHECKING:
    from flight import Conditions
    from flight.logs.log import FlightLog
    from refine.slowing import Dip

Attempt = Callable[[Candidate], Flight | Conflict]

RESERVE = 0.2
"""Share of the margin that a simulated flight leaves unused: other gusts and noise than its own take some of it."""
_ROUNDS = 3
"""How often a team is slowed where it strays."""
_MORE = 1.15
"""How much more than by its error's share of what is allowed it is slowed there."""
_GREATEST = 2.0
"""By how much at most, in one round."""
_EVERY = 15
"""Samples of the log between two times at which it is slowed."""


def followed(
    certified: Certified,
    attempt: Attempt,
    *,
    seed: int,
    conditions: Conditions,
    progress: Progress | None = None,
    budget: Budget = DEFAULT_BUDGET,
) -> tuple[Certified, FlightLog]:
    """Fly a certified team in simulation, more slowly where it strays too far from its plan, and return what was flown.

    Args:
        certified: The team.
        attempt: Refines and checks a candidate, as `pipeline.attempted` does.
        seed: Of the simulation.
        conditions: Of the simulation.
        progress: Receives a sentence and the share done, 0 to 1.
        budget: Bounds on the searches for other plans.

    Raises:
        BadInput: The team cannot be simulated.
    """
    import flight

    say = progress or silent

    def flown(team: Certified, number: int) -> FlightLog:
        part = part_of(say, number / (_ROUNDS + 2), (number + 1) / (_ROUNDS + 2))
        return flight.fly(team.plan, team.team, team.certificate, seed=seed, conditions=conditions, progress=part)

    first = certified, flown(certified, 0)
    mission = certified.plan.mission
    if all(mission.pace_of(name) == "nominal" for name in mission.agents) or not _strays(first[1], mission.margin):
        return first
    tried = [first]
    for number in range(1, _ROUNDS + 1):
        say(f"flying more slowly where robots stray, round {number}", number / (_ROUNDS + 2))
        slower = _slower(tried[-1], first[1])
        if slower is None:
            break
        tried.append((slower, flown(slower, number)))
        if not _strays(tried[-1][1], mission.margin):
            break
    last, log = tried[-1]
    if _strays(log, mission.margin) or last.certificate.duration > max(
        robot.hold + robot.times[-1] for robot in last.plan.robots.values()
    ):
        say("trying the plan's own times", (_ROUNDS + 1) / (_ROUNDS + 2))
        planned = _planned(certified, attempt, log, budget)
        if planned is not None:
            tried.append((planned, flown(planned, _ROUNDS + 1)))
            if all(log.worst_error() > mission.margin for _, log in tried):
                return tried[-1]  # nothing can be exported, so the times are those that were asked for
    return min(tried, key=_rank)


def _rank(tried: tuple[Certified, FlightLog]) -> tuple[bool, float]:
    """Rank flights: the shortest that keeps the reserve, else the one that strays least."""
    certified, log = tried
    strays = bool(_strays(log, certified.plan.mission.margin))
    return strays, log.worst_error() if strays else certified.certificate.duration


def _strays(log: FlightLog, margin: float) -> list[Dip]:
    """Return when a team is to fly more slowly, and how much: where a robot strays further than the reserve allows."""
    from refine.slowing import Dip

    allowed = (1.0 - RESERVE) * margin
    worst = log.error.max(axis=1, initial=0.0)
    found = [
        Dip(float(log.times[at]), float(np.clip(_MORE * worst[at] / allowed, _MORE, _GREATEST)))
        for at in np.flatnonzero(worst > allowed)[::_EVERY]
    ]
    if not found and log.worst_error() > allowed:  # between two rows of the log
        found = [Dip(float(log.times[int(np.argmax(worst))]), _MORE)]
    return found


def _slower(flown: tuple[Certified, FlightLog], first: FlightLog) -> Certified | None:
    """Return a team, slower where it strays; None where that is not certified."""
    import verify
    from refine.slowing import slowed_at

    certified, log = flown
    said = (
        f"Flown in simulation as fast as planned, a robot strays {1000 * first.worst_error():.1f} mm; {100 * (1 - RESERVE):.0f} % of the "
        "margin are allowed, so the team flies more slowly there."
    )
    team = slowed_at(certified.team, _strays(log, certified.plan.mission.margin))
    plan = with_flown_times(certified.plan, team, certified.team).noting(said)
    certificate = verify.judge(plan, team, margin=certified.certificate.margin)
    return replace(certified, plan=plan, team=team, certificate=certificate) if certificate.holds else None


def _planned(certified: Certified, attempt: Attempt, log: FlightLog, budget: Budget) -> Certified | None:
    """Return the team at the plan's own times; None where that is not certified."""
    still = (
        f"a robot still strays {1000 * log.worst_error():.1f} mm"
        if _strays(log, certified.plan.mission.margin)
        else "the flight is no shorter"
    )
    why = f"Slowed where it strays in simulation, {still}: the plan's own times are flown."
    plan = with_expected_times(certified.plan, certified.team).noting(why)
    refused: list[Flight | Conflict] = []
    for candidate in candidates(Candidate(plan, (Cut("tracking", why, 0),)), refused, budget):
        if candidate.plan.words != plan.words:
            return None
        found = attempt(candidate)
        if isinstance(found, Flight) and found.certificate.holds:
            rounds = certified.rounds + candidate.rounds + 1
            return replace(certified, plan=found.plan, team=found.team, certificate=found.certificate, rounds=rounds)
        refused.append(found)
    return None
