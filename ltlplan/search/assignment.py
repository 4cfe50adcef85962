"""What planning answers: what every robot does and how good that is, or that there are no words and why."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from ltlplan.allocation import Itinerary
from ltlplan.logic.budget import TooLarge
from ltlplan.search.relevant_places import FEW
from ltlplan.systems.robot_systems import unit_cost
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Formula, Infeasible, Mission, Unsatisfiable
from verify.data.language.formula import FALSE
from verify.data.plan import Meeting, Precedence

TIES = 1e-6  # m, more than the tiny amounts that break ties between equally dear plans add up to
MOST_NAMES = 400  # in a formula: decision diagrams of its letters are as deep as that


@dataclass(frozen=True, slots=True)
class Assignment:
    """What every robot does, and how good that is.

    Attributes:
        robots: An itinerary for each of the mission's agents, in the mission's order.
        cost: The objective: the sum of the robots' costs, or that of the one that costs most.
        lower_bound: No plan costs less than this.
        complete: Whether the search was exhausted, so that no plan is cheaper.
        tried: Complete plans that were checked in every order.
        notes: Sentences for a person.
        meetings: Arrivals that others wait for before they set out.
        precedences: Waits under which the words satisfy the formula, where they do not in every order of the robots.
    """

    robots: dict[str, Itinerary]
    cost: float
    lower_bound: float | None
    complete: bool
    tried: int
    notes: tuple[str, ...] = ()
    meetings: tuple[Meeting, ...] = ()
    precedences: tuple[Precedence, ...] = ()


Cheapest = Callable[[Mission], float | None]
"""What the cheapest plan of a mission costs; None where there is none."""


class NoWords(Unsatisfiable):
    """There is no plan; why is found out where it is asked.

    Args:
        why: Finds the error that says it.
    """

    def __init__(self, why: Callable[[], Unsatisfiable | Infeasible]) -> None:
        super().__init__("No plan satisfies the formula.")
        self.why = why


def in_units_of(mission: Mission, found: Assignment) -> Assignment:
    """Return what was searched by metres with the mission's own costs; the same where a metre costs 1.

    Args:
        mission: Gives weights and speeds.
        found: Counted as `Systems` does without a cost.
    """
    unit = unit_cost(mission)
    if unit == 1.0:
        return found
    robots = {name: replace(does, cost=does.cost * unit) for name, does in found.robots.items()}
    bound = None if found.lower_bound is None else found.lower_bound * unit
    return replace(found, robots=robots, cost=found.cost * unit, lower_bound=bound)


def asked_of(mission: Mission, systems: Sequence[TransitionSystem]) -> Formula:
    """Return the formula over what these systems can show: what nobody ever shows is false.

    With few regions that is the mission's own formula, whatever is shown.

    Raises:
        TooLarge: It speaks of more names than conditions on letters can be made of.
    """
    if len(mission.all_regions) <= FEW:
        return mission.formula
    shown = {name for system in systems for label in system.labels for name in label}
    asked = mission.formula.substitute(dict.fromkeys(mission.all_regions.keys() - shown, FALSE))
    if (used := len(asked.names())) > MOST_NAMES:
        hint = "`!free` speaks of all regions at once; name those that are meant instead."
        raise TooLarge("The formula speaks of", used, "regions and propositions", MOST_NAMES, hint)
    return asked
