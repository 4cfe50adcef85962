"""Other words that keep the same soft parts, for words whose flight does not keep them: the next cheapest ones that do without a leg.

Words of one robot, or of laps, hold or do not: no waits mend them. But the flight of other words may keep what the first one's does not: at
the edge of a region a robot may come and go within its margin, and legs differ in the room that they leave. Two sets of words differ in
a leg at least, so each leg of the refused ones is shut in turn and the cheapest answer is taken (as `ltlplan.paths.nominal` does;
Lawler 1972). Where the counterexample enters a region more often than was planned, robots keep out of it first.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass

from ltlplan.allocation import Itinerary, Leg
from ltlplan.replanning.soft_parts import kept_by_plan, reworded
from ltlplan.replanning.soft_searches import asking
from verify.data import BadInput, Infeasible, Mission, NotCertified, Plan, Unsatisfiable, Witness

_SHUT = 12  # legs that are shut in turn, each for one search


@dataclass(frozen=True, slots=True)
class OtherWords:
    """A plan whose words do without some legs.

    Attributes:
        plan: The plan.
        shut: The legs that it does without.
    """

    plan: Plan
    shut: frozenset[Leg]


def words_without(
    made: Plan,
    parts: Collection[int],
    shut: frozenset[Leg],
    planned: Callable[[Mission, frozenset[Leg]], Plan],
    witnesses: Iterable[Witness] = (),
) -> OtherWords | None:
    """Return the cheapest plan that keeps the formula and some soft parts by words that do without one of a plan's legs.

    Args:
        made: The plan whose flight does not keep them.
        parts: The soft parts, by index.
        shut: Legs that have to be done without anyway.
        planned: Plans a mission without soft parts by words that do without legs, where there are such words.
        witnesses: What breaks the soft parts in that flight.

    Returns:
        None where there are no such words.
    """
    asked = asking(made.mission, frozenset(parts))

    def without(legs: frozenset[Leg]) -> OtherWords | None:
        try:
            other = planned(asked, shut | legs)
        except (BadInput, Unsatisfiable, Infeasible, NotCertified):
            return None
        if other.words == made.words or legs_of(other) & (shut | legs):
            return None
        return OtherWords(reworded(made, other, _WHY), shut | legs)

    regions = [frozenset(_legs_into(made.mission, entered)) for entered in _doubtful(made, witnesses)]
    legs = [frozenset({leg}) for leg in sorted(legs_of(made), key=str)[:_SHUT]]
    for several in (regions, legs):
        others = [other for those in several if those and (other := without(those)) is not None]
        if others:
            return min(others, key=lambda other: other.plan.cost)
    return None


_WHY = "Cheaper words that keep these soft parts were given up for others, as no flight of theirs that was tried keeps them."


def legs_of(made: Plan) -> frozenset[Leg]:
    """Return the legs that a plan's robots fly from visit to visit."""
    legs = (Itinerary(does.visits, does.word, does.cycle_visit).legs(made.mission, name) for name, does in made.robots.items())
    return frozenset(itertools.chain.from_iterable(legs))


def asked_again(made: Plan, held: Collection[int]) -> Iterator[frozenset[int]]:
    """Yield the sets of soft parts that other words may keep: all that a plan's words keep; of laps of a team, what holds and one more, heaviest first.

    Args:
        made: The plan.
        held: The parts that its flight keeps, by index.
    """
    weights = [part.weight for part in made.mission.soft_parts]
    if made.mission.spec.trace == "infinite" and len(made.robots) > 1:
        for index in sorted(set(range(len(weights))) - set(held), key=lambda index: (-weights[index], index)):
            yield frozenset({*held, index})
        return
    meant = frozenset(kept_by_plan(made.mission, made))
    if meant - set(held):
        yield meant


def _doubtful(made: Plan, witnesses: Iterable[Witness]) -> list[set[tuple[str, str]]]:
    """Return robots with regions to keep out of: those that a counterexample enters more often than planned; of laps, all robots with each one that it enters."""
    planned = {name: _entries(does.word.prefix) for name, does in made.robots.items()}
    laps = made.mission.spec.trace == "infinite"
    found: set[tuple[str, str]] = set()
    for witness in witnesses:
        team = _entries(letter for robot, letter in witness.word if robot not in planned)  # a letter of the whole team
        found |= {
            (name, region)
            for region, often in team.items()
            for name in planned
            if laps or often > sum(own[region] for own in planned.values()) > 0
        }
        for name, own in planned.items():
            seen = _entries(letter for robot, letter in witness.word if robot == name)
            found |= {(name, region) for region, often in seen.items() if laps or often > own[region] > 0}
    if not laps:
        return [found]
    return [{(name, region) for name in planned} for region in sorted({region for _, region in found})][:_SHUT]


def _entries(letters: Iterable[frozenset[str]]) -> Counter[str]:
    before: frozenset[str] = frozenset()
    counts: Counter[str] = Counter()
    for letter in letters:
        counts.update(letter - before)
        before = letter
    return counts


def _legs_into(mission: Mission, entered: Iterable[tuple[str, str]]) -> Iterator[Leg]:
    for name, region in entered:
        if region in mission.all_regions:
            yield (name, mission.agents[name].start, region)
            yield from ((name, other, region) for other in mission.all_regions if other != region)
