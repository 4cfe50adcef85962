"""From stages to waits: who must have arrived before who sets out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

from ltlplan.search.counts.planning import CountedPlan
from ltlplan.systems.transition_systems import TransitionSystem
from ltlplan.systems.visit_log import VisitLog
from verify.data import BadInput
from verify.data.plan import Meeting


class HoversOutside(BadInput):
    """A robot would have to hover outside all regions, or act where it stays, while others are still to set out."""


def meetings_of(systems: Sequence[TransitionSystem], plan: CountedPlan) -> list[Meeting]:
    """Return the waits between stages: each robot of a stage sets out when all others of the one before have arrived.

    Args:
        systems: One for each robot.
        plan: Its paths, turns and stages.

    Raises:
        HoversOutside: A robot would have to come to rest in no region, or act where it stays, while others are still to set out.
    """
    return list(dict.fromkeys(_meetings(systems, plan)))


def _meetings(systems: Sequence[TransitionSystem], plan: CountedPlan) -> Iterator[Meeting]:
    def visits(robot: int, length: int) -> int:
        log = VisitLog()
        for node in plan.paths[robot][:length]:
            log.enter(systems[robot].nodes[node].regions)
        return len(log.visits)

    for earlier, later in pairwise(plan.stages):
        last = {plan.turns[turn][0]: turn for turn in earlier}
        first = {plan.turns[turn][0]: turn for turn in reversed(later)}
        for robot, turn in sorted(first.items()):
            _, before, after = plan.turns[turn]
            setting_out = visits(robot, before)
            if visits(robot, after) == setting_out:
                raise HoversOutside(_OUTSIDE.format(name=systems[robot].robot))
            for other, other_turn in sorted(last.items()):
                _, began, arrived = plan.turns[other_turn]
                if other == robot:
                    continue
                if visits(other, arrived) == visits(other, began) or not systems[other].labels[plan.paths[other][arrived - 1]]:
                    raise HoversOutside(_OUTSIDE.format(name=systems[other].robot))
                if arrived > 1 and _acts(systems[other], plan.paths[other][arrived - 2 : arrived]):
                    raise HoversOutside(_ACTS.format(name=systems[other].robot))
                yield Meeting(
                    first=(systems[other].robot, visits(other, arrived) - 1), then=(systems[robot].robot, setting_out)
                )


def _acts(system: TransitionSystem, step: Sequence[int]) -> bool:
    before, after = (system.nodes[node] for node in step)
    return before.internal != after.internal


_ACTS = (
    "The formula asks that another robot sets out after {name} has acted where it stays, and an action ends at some time of a stay: such "
    "waits are not planned. Let {name} come to a further region."
)
_OUTSIDE = (
    "The formula asks that {name} hovers outside all regions before or after another robot sets out: such waits are not planned yet. "
    "Give the place where it should hover a region of its own."
)
