"""Other plans for soft parts that a flight does not keep: waits, precedences, words without a leg, and at last fewer soft parts.

Words of one robot, or of laps, hold or do not: no waits mend them. But the flight of other words may keep what the first one's does not: at
the edge of a region a robot may come and go within its margin, and legs differ in the room that they leave. Two sets of words differ in
a leg at least, so each leg of the refused ones is shut in turn and the cheapest answer is taken (`ltlplan.search.lawler`). Where the
counterexample enters a region more often than was planned, robots keep out of it first.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Collection, Iterable, Iterator

from ltlplan.allocation import Itinerary, Leg
from ltlplan.planner import SEQUENCE
from ltlplan.precedences import with_planned_waits, with_waits
from ltlplan.replanning.checked_plan import plan
from ltlplan.replanning.cuts import Candidate, how_many_wish_less
from ltlplan.replanning.refusals import Refusal
from ltlplan.replanning.soft_parts import KEPT, is_timed, kept_by_plan, part_text
from ltlplan.replanning.soft_searches import asking
from ltlplan.search.lawler import Member, Partition
from ltlplan.search.method import under_precedences, without_legs
from verify.data import BadInput, Infeasible, Mission, NotCertified, Plan, Unsatisfiable, Witness
from verify.data.choices import PLANNING_METHODS

_SHUT = 12  # legs that are shut in turn, each for one search
_OTHERS = 3
"""Other words that are tried where no waits and precedences keep soft parts, each without a leg more."""
_NONE = (BadInput, Unsatisfiable, Infeasible, NotCertified)


def waits_for_soft_parts(refusal: Refusal) -> Candidate | None:
    """Return the same words with the waits that counterexamples to soft parts ask for; None where these go round in a circle, or there are none.

    Args:
        refusal: A certified flight that loses soft parts.
    """
    witnesses = _lost(refusal)
    try:
        waiting = with_waits(refusal.plan, witnesses)
    except NotCertified:
        return None
    return refusal.answered("waits", None if waiting.precedences == refusal.plan.precedences else waiting)


def same_words_under_precedences(refusal: Refusal) -> Candidate | None:
    """Return the plan with precedences under which its words keep the formula and the soft parts that they are meant to keep.

    Args:
        refusal: A certified flight that loses soft parts.

    Returns:
        None where there are no such precedences, the plan has them, or they were tried.
    """
    made = refusal.plan
    if not _lost(refusal) or refusal.tried.since("words", "legs", "precedences"):
        return None
    try:
        found = with_planned_waits(made.model_copy(update={"mission": asking(made.mission, _meant(made))}))
    except Unsatisfiable:
        return None
    return refusal.answered("precedences", found and found.model_copy(update={"mission": made.mission}))


def other_words(refusal: Refusal) -> Candidate | None:
    """Return words that keep the same soft parts under precedences; None where there are none, or they were tried.

    Args:
        refusal: A certified flight that loses soft parts, or a plan that no flight keeps.
    """
    certified = bool(refusal.soft)
    if refusal.tried.since("words", "legs") or not (_lost(refusal) if certified else _may_be_planned(refusal)):
        return None
    if not certified and any(cut.kind == "soft part" for cut in refusal.tried.cuts):
        return None
    why = refusal.why if certified else str(refusal.error)
    return refusal.answered("words", words_under_precedences(refusal.plan), why=why, anew=not certified)


def without_a_leg(refusal: Refusal) -> Candidate | None:
    """Return other words that may keep soft parts which the flight does not: they do without one of its legs, or keep out of a region.

    Args:
        refusal: A certified flight that loses soft parts, or a plan that no flight keeps.

    Returns:
        None where there are none, or enough of them were tried.
    """
    made, tried, judged = refusal.plan, refusal.tried, refusal.soft
    anew = refusal.reason not in ("soft parts", "no better")
    if anew and (not _may_be_planned(refusal) or any(cut.kind == "soft part" for cut in tried.cuts)):
        return None
    if tried.others >= _OTHERS or made.method == SEQUENCE or (judged and not laps(made) and not _lost(refusal)):
        return None
    held = {index for index, part in enumerate(judged) if part.outcome == "holds"}
    for parts in asked_again(made, held):
        witnesses = [part.witness for index, part in enumerate(judged) if index in parts - held and part.witness is not None]
        found = words_without(made, parts, tried.legs, witnesses)
        if found is not None:
            why = str(refusal.error) if anew else refusal.why
            return refusal.answered("legs", found.solution, why=why, anew=anew, legs=found.space)
    return None


def fewer_soft_parts(refusal: Refusal) -> Candidate | None:
    """Return a plan that is asked for one soft part less, the lightest first, or at last for none; None where that is so already.

    Args:
        refusal: A plan that no flight keeps.
    """
    if not _may_be_planned(refusal):
        return None
    made, why = refusal.plan, str(refusal.error)
    before = [cut for cut in refusal.tried.cuts if cut.kind == "soft part"]
    parts = before[0].parts if before else tuple(sorted(_meant(made)))
    fewer = list(_less_wished(made.mission, parts))[len(before) :]
    if not fewer:
        return None
    other = plan(fewer[0], method=made.method)
    lost = " and ".join(part_text(part) for part in made.mission.soft_parts if part not in fewer[0].soft_parts)
    notes = (
        *other.notes,
        f"Given up: {lost}; a plan that keeps more, at a cost of {made.cost:.3f} in all, has no flight that is certified.",
        f"A plan that keeps more of the soft parts was given up: {why}",
    )
    other = other.model_copy(update={"mission": made.mission, "notes": notes})
    return refusal.answered("soft part", other, why=why, anew=True, parts=parts)


def words_under_precedences(made: Plan) -> Plan | None:
    """Return a plan whose words hold under precedences, and keep what a plan's words keep.

    Args:
        made: A plan whose words hold in every order of whole words and in no flight, or lose a soft part.

    Returns:
        None where there are no such words, or no others.
    """
    mission, soft = made.mission, bool(made.mission.soft_parts)
    if made.method == SEQUENCE or (soft and (mission.spec.trace == "infinite" or len(made.robots) < 2)):
        return None
    try:
        other = plan(asking(mission, _meant(made)) if soft else mission, method=under_precedences)
    except _NONE:
        return None
    if not soft:
        why = "Words that hold in every order of the robots were given up: they hold under no precedences, as a flight asks."
        return other.model_copy(update={"method": made.method, "notes": (*other.notes, why)})
    if other.words == made.words and set(other.precedences) <= set(made.precedences):
        return None
    why = "Words that keep these soft parts in every order of the robots were given up for words that keep them under precedences, as a flight asks."
    return _reworded(made, other, why)


def _may_be_planned(refusal: Refusal) -> bool:
    """Tell whether other plans may be asked of the method of a plan with soft parts that no flight keeps."""
    made = refusal.plan
    return bool(made.mission.soft_parts) and made.method != SEQUENCE and PLANNING_METHODS.knows(made.method)


def _lost(refusal: Refusal) -> list[Witness]:
    """Return the counterexamples to soft parts that the words keep and the flight does not; none of laps, in which no waits are known that would help."""
    made = refusal.plan
    if made.method == SEQUENCE or laps(made):
        return []
    intended = range(len(refusal.soft)) if made.meetings else kept_by_plan(made.mission, made)
    lost = (part for index, part in enumerate(refusal.soft) if part.outcome != "holds" and index in intended)
    return [part.witness for part in lost if part.witness is not None]


def laps(made: Plan) -> bool:
    """Tell whether a plan's flight repeats for ever."""
    return made.mission.spec.trace == "infinite"


def _meant(made: Plan) -> frozenset[int]:
    """Return the soft parts that a plan's words keep; all of them where that depends on the times of laps."""
    if is_timed(made.mission, ()):
        return frozenset(range(len(made.mission.soft_parts)))
    return kept_by_plan(made.mission, made)


def _less_wished(mission: Mission, kept: Collection[int]) -> Iterator[Mission]:
    """Yield the mission with fewer soft parts than were kept: without one, lightest first, at last without any."""
    parts = mission.soft_parts
    lightest = sorted(kept, key=lambda index: (parts[index].weight, index))
    for index in lightest[: how_many_wish_less(kept) - 1]:
        fewer = tuple(part for i, part in enumerate(parts) if i != index)
        yield mission.model_copy(update={"spec": mission.spec.model_copy(update={"soft": fewer})})
    if kept:
        yield mission.asking(mission.spec.formula)


def _reworded(made: Plan, other: Plan, why: str) -> Plan:
    """Return a plan of other words that keep the same soft parts, with what was said of these."""
    said = itertools.dropwhile(lambda note: not note.startswith(KEPT), made.notes)
    return made.model_copy(
        update={
            **{name: getattr(other, name) for name in ("robots", "precedences", "meetings", "cost", "lower_bound", "complete")},
            "notes": (*other.notes, *(note for note in said if note != why), why),
        }
    )


def words_without(
    made: Plan,
    parts: Collection[int],
    shut: frozenset[Leg],
    witnesses: Iterable[Witness] = (),
) -> Member[frozenset[Leg], Plan] | None:
    """Return the cheapest plan that keeps the formula and some soft parts by words that do without one of a plan's legs.

    Args:
        made: The plan whose flight does not keep them.
        parts: The soft parts, by index.
        shut: Legs that have to be done without anyway.
        witnesses: What breaks the soft parts in that flight.

    Returns:
        The plan, and the legs that it does without; None where there are no such words.
    """
    asked = asking(made.mission, frozenset(parts))

    def solve(legs: frozenset[Leg]) -> Iterator[tuple[float, Plan]]:
        try:
            other = plan(asked, method=without_legs(legs))
        except _NONE:
            return
        if other.words != made.words and not legs_of(other) & legs:
            yield other.cost, _reworded(made, other, _WHY)

    regions = [frozenset(_legs_into(made.mission, entered)) for entered in _doubtful(made, witnesses)]
    legs = [frozenset({leg}) for leg in sorted(legs_of(made), key=str)]
    for several in (regions, legs):
        spaces = (shut | those for those in several if those)
        if (other := next(iter(Partition(spaces, solve, searches=_SHUT)), None)) is not None:
            return other
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
    if laps(made) and len(made.robots) > 1:
        for index in sorted(set(range(len(weights))) - set(held), key=lambda index: (-weights[index], index)):
            yield frozenset({*held, index})
        return
    meant = frozenset(kept_by_plan(made.mission, made))
    if meant - set(held):
        yield meant


def _doubtful(made: Plan, witnesses: Iterable[Witness]) -> list[set[tuple[str, str]]]:
    """Return robots with regions to keep out of: those that a counterexample enters more often than planned; of laps, all robots with each one that it enters."""
    planned = {name: _entries(does.word.prefix) for name, does in made.robots.items()}
    repeated = laps(made)
    found: set[tuple[str, str]] = set()
    for witness in witnesses:
        team = _entries(letter for robot, letter in witness.word if robot not in planned)  # a letter of the whole team
        found |= {
            (name, region)
            for region, often in team.items()
            for name in planned
            if repeated or often > sum(own[region] for own in planned.values()) > 0
        }
        for name, own in planned.items():
            seen = _entries(letter for robot, letter in witness.word if robot == name)
            found |= {(name, region) for region, often in seen.items() if repeated or often > own[region] > 0}
    if not repeated:
        return [found]
    return [{(name, region) for name in planned} for region in sorted({region for _, region in found})]


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
