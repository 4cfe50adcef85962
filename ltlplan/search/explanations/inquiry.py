"""Inquiry into a mission without a plan: which requirements hold together in which worlds, and how they were written.

Of requirements by themselves it is found whether any word satisfies them, whoever may show it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce

from ltlplan.logic.automaton import DEAD
from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.logic.conjunction import conjunct_automata, conjuncts
from ltlplan.logic.product_automaton import Task
from ltlplan.search.numbering import closure
from ltlplan.systems.robot_systems import Systems
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Formula, Infeasible, Letter, Mission
from verify.data.language.counting import written_out
from verify.data.language.formula import FREE, TRUE
from verify.data.language.free import in_no_region
from verify.data.sections import Robot

Worlds = Sequence[TransitionSystem]
"""What each robot can do."""

Feasible = Callable[[Sequence[Formula], Worlds], bool]
"""Whether some requirements can be met in some worlds."""

BUDGET = Budget(states=200_000)


def satisfiable(parts: Sequence[Formula], letters: Sequence[Letter]) -> bool:
    """Tell whether some finite word over these letters satisfies all parts, as far as the budget goes."""
    task = Task(conjunct_automata(all_of(parts), "finite"), letters)
    states = closure([task.initial], lambda state: (after for after in task.row(state) if after != DEAD))
    # where there are too many it is not known to be impossible
    return any(task.is_accepting(state) or seen > BUDGET.states for seen, state in enumerate(states))


def all_of(parts: Sequence[Formula]) -> Formula:
    """Return the conjunction of requirements."""
    return reduce(lambda left, right: Formula("&", (left, right)), parts) if parts else TRUE


def eventually(name: str) -> Formula:
    """Return the requirement that a name is shown at some time."""
    return Formula("F", (Formula("name", (), name),))


@dataclass(frozen=True, eq=False)
class Inquiry:
    """A mission without a plan, and how to find out what would be possible.

    Attributes:
        mission: Whose formula cannot be met.
        systems: What its robots can do.
        worlds: One system for each robot.
        possible: Whether some requirements can be met in some worlds; it may raise where it cannot tell.
    """

    mission: Mission
    systems: Systems
    worlds: Worlds
    possible: Feasible

    def feasible(self, parts: Sequence[Formula], worlds: Worlds) -> bool:
        """Tell whether some requirements may be met in some worlds; nothing is said of what is not known to be impossible."""
        try:
            return self.possible(parts, worlds)
        except (TooLarge, Infeasible):
            return True

    @cached_property
    def robots(self) -> list[Robot]:
        """The robots' internal transition systems, each once."""
        return list({id(robot): robot for robot in map(self.mission.robot_of, self.mission.agents)}.values())

    @cached_property
    def written(self) -> dict[Formula, Formula]:
        """Requirements as the user wrote them, with `free`, by what they were made into."""
        return as_written(self.mission)

    def shown(self, part: Formula) -> str:
        """Return a requirement as the user wrote it."""
        return str(self.written.get(part, part))

    def names(self, part: Formula) -> frozenset[str]:
        """Return the names that a requirement was written with, without `free`."""
        return self.written.get(part, part).names() - {FREE}


def as_written(mission: Mission) -> dict[Formula, Formula]:
    """Return requirements as the user wrote them, by what they were made into: those that speak of `free`, or were made into one."""
    free, found = {FREE: in_no_region(mission.all_regions)}, dict[Formula, Formula]()
    for asked in reversed(conjuncts(mission.written)):
        parts = conjuncts(written_out(asked.substitute(free), tuple(mission.agents)))
        found |= dict.fromkeys(parts, asked) if FREE in asked.names() or len(parts) == 1 else {}
    return found
