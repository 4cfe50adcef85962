"""Plans for formulas that count robots, in stages: what is flown at once, and who waits for whom before the next stage begins.

`plan_stages` is the door. `waits_of` and `precedences_of`
say which robot must have arrived before which other one sets out, or acts.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator, Sequence
from itertools import accumulate, pairwise

from ltlplan.allocation import Allocation
from ltlplan.logic.budget import TooLarge
from ltlplan.search.counting.capacities import small_rooms
from ltlplan.search.counting.counted_plans import CountedPlan, Turn, may_crowd
from ltlplan.search.counting.counting_propositions import Marks
from ltlplan.search.counting.needed_waits import needed_waits
from ltlplan.search.counting.planning import plan_counts
from ltlplan.search.orders import planning as orders
from ltlplan.search.orders.event_names import Names
from ltlplan.search.orders.state_sets import all_or_none
from ltlplan.search.problem import TIES, NoWords, Problem
from ltlplan.systems.robot_systems import interchangeable
from ltlplan.systems.transition_systems import TransitionSystem
from ltlplan.systems.visit_log import VisitLog
from verify.data import BadInput, Infeasible
from verify.data.plan import Meeting, Precedence


def plan_stages(problem: Problem) -> Allocation:
    """Plan a formula that counts robots or names them: words, and who waits for whom.

    Raises:
        NoWords: There are none; it finds out why.
        HoversOutside: Robots would wait outside regions.
        Infeasible: None are within a vehicle's endurance.
        TooLarge: A budget was used up before an answer was found.
    """
    mission, each = problem.mission, problem.each
    kinds, rooms = list(interchangeable(mission).values()), small_rooms(mission, each, problem.capacities)
    asked = Marks(problem.automata, problem.known)
    found = plan_counts(each, kinds, asked, problem.budget, rooms=rooms, longest=problem.longest)
    if found is None:
        from ltlplan.search.counting.conflicting_conjuncts import no_counted_plan
        from ltlplan.search.explanations.relaxation import relaxed

        raise NoWords(lambda: relaxed(problem, no_counted_plan(problem, kinds, rooms)))
    try:
        crowded = may_crowd(each, found, rooms)
        marks = None if crowded or problem.asked.uses_next() else asked
        waits, precedences = waits_of(each, found, marks)
    except HoversOutside:  # but flights may be timed so that nobody has to, or it waits there
        for asked_first in (*problem.leaner, problem):
            with contextlib.suppress(TooLarge, Infeasible):
                ordered = orders.plan(asked_first)
                if ordered is not None:
                    return ordered
        events = precedences_of(each, found)
        if events is None:
            raise
        waits, precedences = [], events
    robots = problem.itineraries(found.paths)
    total = (max if problem.longest else sum)(robot.cost for robot in robots.values())
    complete = total <= found.bound + TIES
    notes = [f"The search reached {found.reached:,} states: how many robots rest where, and what is done."]
    if not complete:
        notes.append(
            "A cheaper plan was not ruled out, one in which robots end just outside regions or where they act included."
        )
    if waits or precedences:
        notes.append("Robots wait for each other where the formula asks for it.")
    said = (*notes, *problem.systems.unclear())
    return Allocation(
        robots=robots, cost=total, lower_bound=min(found.bound, total), complete=complete, notes=said, meetings=tuple(waits),
        precedences=tuple(precedences),
    )  # fmt: skip


class HoversOutside(BadInput):
    """A robot would have to hover outside all regions, or act where it stays, while others are still to set out."""


def waits_of(
    systems: Sequence[TransitionSystem], plan: CountedPlan, marks: Marks | None = None
) -> tuple[list[Meeting], list[Precedence]]:
    """Return the waits between stages: each robot of a stage sets out, or acts where it is, when all others of the one before have arrived.

    Args:
        systems: One for each robot.
        plan: Its paths, turns and stages.
        marks: What the formula sees; of waits between stages only those are kept then that it needs.

    Raises:
        HoversOutside: A robot would have to come to rest in no region, or act where it stays, while others are still to set out.
    """
    found = list(dict.fromkeys(_waits(systems, plan, _handovers(plan))))
    pairs = needed_waits(systems, marks, plan) if marks is not None and found else None
    if pairs is not None:
        with contextlib.suppress(HoversOutside):
            found = list(dict.fromkeys(_waits(systems, plan, _needed(plan, pairs))))
    return [wait for wait in found if isinstance(wait, Meeting)], [wait for wait in found if isinstance(wait, Precedence)]


def _waits(
    systems: Sequence[TransitionSystem], plan: CountedPlan, handovers: Iterable[tuple[Turn, list[Turn]]]
) -> Iterator[Meeting | Precedence]:
    def visits(robot: int, length: int) -> int:
        return len(VisitLog(systems[robot].nodes[node].regions for node in plan.paths[robot][:length]).visits)

    for (robot, before, after), others in handovers:
        setting_out, path = visits(robot, before), plan.paths[robot]
        acts, flies = _acts(systems[robot], path[before - 1 : before + 1]), visits(robot, after) > setting_out
        if not (acts or flies):
            raise HoversOutside(_OUTSIDE.format(name=systems[robot].robot))
        for other, began, arrived in others:
            if visits(other, arrived) == visits(other, began) or not systems[other].labels[plan.paths[other][arrived - 1]]:
                raise HoversOutside(_OUTSIDE.format(name=systems[other].robot))
            if arrived > 1 and _acts(systems[other], plan.paths[other][arrived - 2 : arrived]):
                raise HoversOutside(_ACTS.format(name=systems[other].robot))
            awaited = (systems[other].robot, visits(other, arrived) - 1)
            if acts:
                where = (systems[robot].robot, _acting_visit(systems[robot], path, before))
                yield Precedence(first=awaited, then=where, done="entered", due="acts")
            if flies:
                yield Meeting(first=awaited, then=(systems[robot].robot, setting_out))


def _handovers(plan: CountedPlan) -> Iterator[tuple[Turn, list[Turn]]]:
    """Yield the first turn of each robot in a stage, with the last ones of all others in the stage before it."""
    for earlier, later in pairwise(plan.stages):
        last = {plan.turns[turn][0]: plan.turns[turn] for turn in earlier}
        first = {plan.turns[turn][0]: plan.turns[turn] for turn in reversed(later)}
        for robot, turn in sorted(first.items()):
            yield turn, [other for who, other in sorted(last.items()) if who != robot]


def _needed(plan: CountedPlan, pairs: Iterable[tuple[int, int]]) -> Iterator[tuple[Turn, list[Turn]]]:
    """Yield each turn that waits, with those that it waits for."""
    awaited: dict[int, list[Turn]] = {}
    for first, then in pairs:
        awaited.setdefault(then, []).append(plan.turns[first])
    yield from ((plan.turns[then], others) for then, others in sorted(awaited.items()))


def _acting_visit(system: TransitionSystem, path: Sequence[int], step: int) -> int:
    """Return the visit in which a robot acts by a step of its path."""
    log = VisitLog(system.nodes[node].regions for node in path[:step])
    change = system.nodes[path[step - 1]].internal, system.nodes[path[step]].internal
    regions = system.nodes[path[step]].regions
    visit = log.current(next(a.at for a in system.actions if (a.source, a.target) == change and a.at in regions))
    for node in path[step:]:
        log.enter(system.nodes[node].regions)
    return log.numbers[visit]


def precedences_of(systems: Sequence[TransitionSystem], plan: CountedPlan) -> list[Precedence] | None:
    """Return the waits between stages as precedences between events; None where an event has no name that can be waited for.

    The last event of each robot's moves in a stage comes before the first ones of all others in the next.

    Args:
        systems: One for each robot.
        plan: Its paths, turns and stages; robots may wait outside regions that they have left.
    """
    names = Names(systems, plan.paths)
    letters = [
        list(accumulate((system.labels[a] != system.labels[b] for a, b in pairwise(path)), initial=0))
        for system, path in zip(systems, plan.paths, strict=True)
    ]
    found = all_or_none(
        names.precedence(((other, letters[other][arrived - 1]), (robot, letters[robot][before - 1] + 1)))
        for (robot, before, _), others in _handovers(plan)
        for other, _, arrived in others
    )
    return None if found is None else list(dict.fromkeys(found))


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
