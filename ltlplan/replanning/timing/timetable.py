"""Times of a refined flight chosen anew, so that what the formula bounds in seconds holds: its pace, and hovers in the plan."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from ltlplan.replanning.timing.presence import laps_ahead, presence_of
from ltlplan.replanning.timing.requirements import Requirements, Times
from verify.data import Formula, Mission, Plan, Trajectory
from verify.data.sections import GENTLE
from verify.logic.explanation import show
from verify.model_checking.timing.timed_formula import bounds_of

if TYPE_CHECKING:
    from verify import Certificate

Judged = tuple[Plan, Mapping[str, Trajectory], "Certificate"]
"""A plan, its flights, and what the judge says of them."""


def timetable(flight: Judged, *, greatest: float, flown: float, late: bool = False) -> Times | None:
    """Return how much slower a flight may be flown, and where robots hover, so that its formula's bounds hold; None where none were found.

    Args:
        flight: As it was refined and judged.
        greatest: Share of the fastest flight at which the mission may be flown.
        flown: Share of the fastest flight that this one is.
        late: Whether deadlines may be missed, by as little as can be.
    """
    plan, team, certificate = flight
    parts = plan.mission.timed_parts
    bounds = sum(float(bound) for part in parts for bound in bounds_of(part))
    laps = laps_ahead(certificate.timelines, bounds)
    presence = {
        name: presence_of(plan, name, timeline, team[name].duration, laps) for name, timeline in certificate.timelines.items()
    }
    slowest = max(flown / min(GENTLE, greatest), 1.0)
    reach = 2.0 * certificate.duration * laps * slowest + bounds + 10.0
    asked = Requirements(presence, certificate.clock_error, slowest, reach)
    for part in parts:
        asked.ask(part, late=late)
    return asked.solve()


def deadlines_to_relax(flight: Judged) -> str:
    """Return which deadlines this flight's words miss at its pace, and by how much, as a sentence; empty where that does not tell.

    Args:
        flight: It was refused.
    """
    times = timetable(flight, greatest=1.0, flown=1.0, late=True)
    if times is None or not times.late:
        return ""
    missed = " and ".join(f"`{show(part)}` by {seconds:.2f} s" for part, seconds in times.late.items())
    return f"The least that these words miss at this pace: {missed}."


def least_times(mission: Mission) -> Iterator[tuple[Formula, float]]:
    """Yield conjuncts `F[a,b] p` of a mission that no flight can satisfy, with a lower bound on the time it takes to come to p, s.

    That is the straight way from the nearest start to the region's outer ball at the greatest speed.
    """
    for part in mission.timed_parts:
        where = part.arguments[0]
        region = mission.all_regions.get(where.name) if where.operator == "name" else None
        if part.operator != "F" or region is None or part.window is None or part.window[1] is None:
            continue
        names = [where.robot] if where.robot else list(mission.agents)
        least = min(
            max(math.dist(mission.agents[name].start, region.center) - region.outer_radius, 0.0) / mission.limits_of(name).speed
            for name in names
        )
        if least > part.window[1]:
            yield part, least
