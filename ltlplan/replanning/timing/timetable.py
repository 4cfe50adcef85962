"""Times of a refined flight chosen anew, so that what the formula bounds in seconds holds: its pace, and hovers in the plan."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from ltlplan.replanning.timing.presence import laps_ahead, presence_of
from ltlplan.replanning.timing.requirements import Requirements, Times
from ltlplan.replanning.timing.visit_orders import soonest
from verify.data import Formula, Plan, Trajectory
from verify.logic.explanation import show
from verify.model_checking.timing.timed_formula import bounds_of

if TYPE_CHECKING:
    from verify import Certificate

Judged = tuple[Plan, Mapping[str, Trajectory], "Certificate"]
"""A plan, its flights, and what the judge says of them."""


def timetable(
    flight: Judged, *, paces: tuple[float, float], flown: float, late: bool = False, without: Formula | None = None
) -> Times | None:
    """Return how much slower, or faster, a flight may be flown, and where robots hover, so that its formula's bounds hold; None where none were found.

    Args:
        flight: As it was refined and judged.
        paces: Shares of the fastest flight at which it may be flown: the least and the greatest.
        flown: Share of the fastest flight that this one is.
        late: Whether deadlines may be missed, by as little as can be.
        without: A conjunct that is not asked.
    """
    plan, team, certificate = flight
    parts = plan.mission.timed_parts
    bounds = sum(float(bound) for part in parts for bound in bounds_of(part))
    laps = laps_ahead(certificate.timelines, bounds)
    presence = {
        name: presence_of(plan, name, timeline, team[name].duration, laps) for name, timeline in certificate.timelines.items()
    }
    fastest, slowest = flown / paces[1], flown / paces[0]
    reach = 2.0 * certificate.duration * laps * max(slowest, 1.0) + bounds + 10.0
    resting = {(hover.robot, hover.visit) for hover in plan.hovers}
    asked = Requirements(presence, certificate.clock_error, (fastest, slowest), reach, resting)
    for part in parts:
        if part != without:
            asked.ask(part, late=late)
    return asked.solve()


@dataclass(frozen=True, slots=True)
class Relaxation:
    """Least change of what is bounded in seconds under which a flight's words are in time.

    Attributes:
        late: By how much deadlines are missed, s; empty where that does not tell.
        soonest: When what is late comes at the soonest in any flight of these words, by straight ways, s.
        without: Conjuncts without any one of which all others can be kept.
    """

    late: Mapping[Formula, float] = field(default_factory=dict[Formula, float])
    soonest: Mapping[Formula, float] = field(default_factory=dict[Formula, float])
    without: tuple[Formula, ...] = ()

    @property
    def total(self) -> float:
        """By how much deadlines are missed in all, s; infinite where that is not known."""
        return sum(self.late.values()) if self.late else math.inf

    @property
    def sentence(self) -> str:
        """Sentences on what would have to be given up; empty where nothing is known."""
        said = [f"The least that these words miss at this pace: {listed_delays(self.late)}."] if self.late else []
        said += [
            f"By straight ways they come to `{show(part)}` at {self.soonest[part]:.3g} s at the soonest."
            for part in self.late
            if self.soonest.get(part) and part.operator != "G"  # which is late when it comes again
        ]
        return " ".join([*said, *without_one(self.without)])


def listed_delays(late: Mapping[Formula, float]) -> str:
    """Return by how much deadlines are missed, for a person.

    Args:
        late: By conjunct, s.
    """
    return " and ".join(f"`{show(part)}` by {seconds:.2f} s" for part, seconds in late.items())


def without_one(parts: Collection[Formula]) -> list[str]:
    """Return without which conjuncts the others may be kept, as a sentence where there are such.

    Args:
        parts: The conjuncts.
    """
    return [f"Without {' or '.join(f'`{show(part)}`' for part in parts)} the others may be kept."] if parts else []


def relaxation_of(flight: Judged) -> Relaxation:
    """Return what would have to be given up for a flight's words to be in time at its pace.

    Args:
        flight: It was refused.
    """
    parts = flight[0].mission.timed_parts
    times = timetable(flight, paces=(1.0, 1.0), flown=1.0, late=True)
    others = [
        part for part in parts if len(parts) > 1 and timetable(flight, paces=(1.0, 1.0), flown=1.0, without=part) is not None
    ]
    return Relaxation({} if times is None else times.late, soonest(flight[0]), tuple(others))
