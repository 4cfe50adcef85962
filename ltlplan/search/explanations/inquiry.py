"""What is asked about a mission without a plan: which requirements hold together in which worlds, and how they were written."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

from ltlplan.logic.budget import TooLarge
from ltlplan.logic.conjunction import conjuncts
from ltlplan.search.explanations.remedies import Worlds
from ltlplan.systems.robot_systems import Systems
from verify.data import Formula, Infeasible, Mission
from verify.data.language.counting import written_out
from verify.data.language.formula import FREE
from verify.data.language.free import in_no_region
from verify.data.sections import Robot

Feasible = Callable[[Sequence[Formula], Worlds], bool]
"""Whether some requirements can be met in some worlds."""


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
        free = {FREE: in_no_region(self.mission.all_regions)}
        robots = tuple(self.mission.agents)
        found: dict[Formula, Formula] = {}
        for asked in reversed(conjuncts(self.mission.written)):
            for part in conjuncts(written_out(asked.substitute(free), robots)):
                found[part] = asked if FREE in asked.names() else part
        return found

    def shown(self, part: Formula) -> str:
        """Return a requirement as the user wrote it."""
        return str(self.written.get(part, part))

    def names(self, part: Formula) -> frozenset[str]:
        """Return the names that a requirement was written with, without `free`."""
        return self.written.get(part, part).names() - {FREE}


def listed(items: Sequence[str]) -> str:
    """Return items in a row, as one says them; there is at least one."""
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} and {items[-1]}"
