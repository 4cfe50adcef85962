"""Flights of random teams in rooms, held against bounds of their own: cost, duration at the plan's own times, duration at a pace."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import ltlplan
from ltlplan.pipeline import certified_team
from tests.helpers.missions.counted_halls import longest_alone
from tests.helpers.missions.room_bounds import RoomBounds
from tests.helpers.missions.room_teams import RoomTeam
from verify.data import Infeasible, NotCertified, Plan

PACE = "0.7"


@dataclass(frozen=True)
class Figure:
    """What a team's plan and its two certified flights come to, as shares of bounds.

    Attributes:
        cost: Over the least length that was found without the planner.
        nominal: Duration at the plan's own times, over that of the robots' least ways at the nominal speed, one after another through narrow doors.
        paced: Duration at pace 0.7, over the longest flight of one of the robots alone at that pace.
        seconds: Processor time of it all.
        refusal: Why there is no flight; empty where there is.
    """

    cost: float = np.nan
    nominal: float = np.nan
    paced: float = np.nan
    seconds: float = 0.0
    refusal: str = ""


def measured(team: RoomTeam) -> Figure:
    """Plan, refine and certify a team twice, and hold it against its bounds.

    Args:
        team: The mission.
    """
    begin = time.process_time()
    try:
        plan = ltlplan.plan(team.mission())
        bounds = RoomBounds(team, plan.mission.planner.speed)
        nominal, _ = flown(plan)
        paced, made = flown(plan.model_copy(update={"mission": team.mission(PACE)}))
    except (Infeasible, NotCertified) as error:
        return Figure(refusal=str(error), seconds=time.process_time() - begin)
    visited = {name: [visit.region for visit in robot.visits] for name, robot in plan.robots.items()}
    assert plan.cost is not None
    return Figure(
        cost=plan.cost / bounds.cost,
        nominal=nominal / bounds.duration(visited),
        paced=paced / longest_alone(made),
        seconds=time.process_time() - begin,
    )


def flown(plan: Plan) -> tuple[float, Plan]:
    """Return how long a plan's certified flight lasts, s, and the plan that is flown.

    Args:
        plan: At the pace of its mission.
    """
    done = certified_team(plan)
    return max(flight.duration for flight in done.team.values()), done.plan


def distribution(values: Sequence[float]) -> str:
    """Return quantiles of some shares as cells of a table: median, 75 %, 90 %, most."""
    found = [value for value in values if not np.isnan(value)]
    return " | ".join(f"{value:.2f}" for value in np.quantile(found, [0.5, 0.75, 0.9, 1.0])) if found else " | | | "
