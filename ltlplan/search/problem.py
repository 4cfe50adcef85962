"""The problem that every reading plans: a mission, its robots' systems, the formula that is asked of them, and the budget."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

from ltlplan.allocation import Itinerary
from ltlplan.logic.automaton import Automaton
from ltlplan.logic.budget import DEFAULT_BUDGET, Budget, TooLarge
from ltlplan.logic.conjunction import conjunct_automata
from ltlplan.search.itineraries import itinerary
from ltlplan.search.relevant_places import FEW, places_that_matter
from ltlplan.systems.region_labels import Layout
from ltlplan.systems.robot_systems import Systems
from ltlplan.systems.transition_systems import Cost, TransitionSystem
from verify.data import Formula, Infeasible, Mission, Unsatisfiable, Word
from verify.data.language.counting import Atom, atoms
from verify.data.language.formula import FALSE

TIES = 1e-6  # m, more than the tiny amounts that break ties between equally dear plans add up to
MOST_NAMES = 400  # in a formula: decision diagrams of its letters are as deep as that


class NoWords(Unsatisfiable):
    """There is no plan; why is found out where it is asked.

    Args:
        why: Finds the error that says it.
    """

    def __init__(self, why: Callable[[], Unsatisfiable | Infeasible]) -> None:
        super().__init__("No plan satisfies the formula.")
        self.why = why


@dataclass(frozen=True)
class Problem:
    """A mission as it is searched; what follows from its fields is made when it is first asked for.

    Attributes:
        mission: With its formula, regions, environment, internal states and agents.
        budget: Bounds on the search.
        cost: Cost of a leg; None for straight lines by the mission's weights.
        metre: What a metre costs each robot on the way to its end, where `cost` counts more than metres.
        capacities: Robots that regions hold, where refinement found no places for more.
        cheapest: Prices missions that ask for less, where there is no plan; None where these have none either.
        explain: Says why there is no plan; gets the order of the robots, with words, that breaks the cheapest plan of a fixed order.
        few: Regions up to which robots may stop at all of them; beyond, at those that matter.
    """

    mission: Mission
    budget: Budget = DEFAULT_BUDGET
    cost: Cost | None = None
    metre: Mapping[str, float] | None = None
    capacities: Mapping[str, int] = field(default_factory=dict[str, int])
    cheapest: Callable[[Mission], float | None] = lambda _: None
    explain: Callable[[Problem, Sequence[tuple[str, Word]]], Unsatisfiable] = lambda *_: Unsatisfiable(
        "No plan satisfies the formula."
    )
    few: int = FEW

    @cached_property
    def systems(self) -> Systems:
        """The robots' abilities."""
        layout = Layout(self.mission)
        places = places_that_matter(self.mission, layout, self.few)
        return Systems(self.mission, self.cost, places=places, layout=layout, metre=self.metre)

    @cached_property
    def each(self) -> list[TransitionSystem]:
        """Every robot's system, in the mission's order."""
        return [self.systems.of(name) for name in self.mission.agents]

    @property
    def leaner(self) -> tuple[Problem, ...]:
        """The same problem where robots stop at regions that matter alone, if there are others; else none."""
        matter = places_that_matter(self.mission, self.systems.layout, 0)
        return () if matter is None or len(matter) == len(self.mission.all_regions) else (replace(self, few=0),)

    @property
    def several(self) -> bool:
        """Return whether there are several robots."""
        return len(self.mission.agents) > 1

    @property
    def longest(self) -> bool:
        """Return whether the highest cost of several robots counts, not the sum."""
        return self.several and self.mission.planner.objective == "longest"

    @cached_property
    def asked(self) -> Formula:
        """The formula over what these systems can show: what nobody ever shows is false. With few regions it is the mission's own.

        Raises:
            TooLarge: It speaks of more names than conditions on letters can be made of.
        """
        mission = self.mission
        if len(mission.all_regions) <= self.few:
            return mission.formula
        shown = {name for system in self.each for label in system.labels for name in label}
        asked = mission.formula.substitute(dict.fromkeys(mission.all_regions.keys() - shown, FALSE))
        if (used := len(asked.names())) > MOST_NAMES:
            hint = "`!free` speaks of all regions at once; name those that are meant instead."
            raise TooLarge("The formula speaks of", used, "regions and propositions", MOST_NAMES, hint)
        return asked

    @cached_property
    def known(self) -> dict[str, Atom]:
        """The formula's propositions of the whole team, where it counts."""
        return atoms(self.asked)

    @cached_property
    def automata(self) -> Sequence[Automaton]:
        """One automaton for each conjunct of the formula.

        Raises:
            TooLarge: One is larger than the budget.
        """
        return conjunct_automata(self.asked, self.mission.spec.trace, budget=self.budget)

    def itineraries(self, paths: Sequence[tuple[int, ...]]) -> dict[str, Itinerary]:
        """Return what each robot does along a path of its system."""
        robots = zip(self.mission.agents, self.each, paths, strict=True)
        return {name: itinerary(system, path) for name, system, path in robots}
