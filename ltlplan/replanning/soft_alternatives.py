"""Other plans for soft parts that a flight does not keep: precedences, words without a leg, and at last fewer soft parts.

Words of one robot, or of laps, hold or do not: no precedences mend them. But the flight of other words may keep what the first one's does not: at
the edge of a region a robot may come and go within its margin, and legs differ in the room that they leave. Two sets of words differ in
a leg at least, so each leg of the refused ones is shut in turn and the cheapest answer is taken (`ltlplan.search.lawler`). Where the
counterexample enters a region more often than was planned, robots keep out of it first.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Collection, Iterable, Iterator

from ltlplan.allocation import Known, Leg
from ltlplan.planner import SEQUENCE
from ltlplan.replanning.checked_plan import legs_of, plan, plan_or_none, plans_without
from ltlplan.replanning.cuts import Candidate, less_wished
from ltlplan.replanning.refusal import Refusal
from ltlplan.replanning.soft_parts import KEPT, asking, is_timed, kept_by_plan, part_text
from ltlplan.search.exact import under_precedences
from ltlplan.search.lawler import Member
from ltlplan.search.orders.planned_words import with_planned_waits
from verify.data import Mission, Plan, Unsatisfiable, Witness
from verify.data.names.choices import PLANNING_METHODS

_SHUT = 12  # legs that are shut in turn, each for one search
_OTHERS = 3
"""Other words that are tried where no precedences keep soft parts, each without a leg more."""


def same_words_under_precedences(refusal: Refusal) -> Candidate | None:
    """Return the plan with precedences under which its words keep the formula and the soft parts that they are meant to keep.

    Args:
        refusal: A certified flight that loses soft parts.

    Returns:
        None where there are no such precedences, the plan has them, or they were tried.
    """
    made = refusal.plan
    if not _loses_some(refusal) or refusal.tried.since("words", "legs", "precedences"):
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
    certified, tried = bool(refusal.soft), refusal.tried
    asks = _loses_some(refusal) if certified else _may_be_planned(refusal) and not tried.given_up
    if not asks or tried.since("words", "legs"):
        return None
    return refusal.answered("words", words_under_precedences(refusal), anew=not certified)


def without_a_leg(refusal: Refusal) -> Candidate | None:
    """Return other words that may keep soft parts which the flight does not: they do without one of its legs, or keep out of a region.

    Args:
        refusal: A certified flight that loses soft parts, or a plan that no flight keeps.

    Returns:
        None where there are none, or enough of them were tried.
    """
    made, tried, judged = refusal.plan, refusal.tried, refusal.soft
    anew = refusal.reason not in ("soft parts", "no better")
    if anew and (not _may_be_planned(refusal) or tried.given_up):
        return None
    if tried.others >= _OTHERS or made.method == SEQUENCE or (judged and not laps(made) and not _loses_some(refusal)):
        return None
    held = {index for index, part in enumerate(judged) if part.outcome == "holds"}
    for parts in asked_again(made, held):
        witnesses = [part.witness for index, part in enumerate(judged) if index in parts - held and part.witness is not None]
        found = words_without(made, parts, tried.legs, witnesses, known=refusal.known)
        if found is not None:
            return refusal.answered("legs", found.solution, anew=anew, legs=found.space)
    return None


def fewer_soft_parts(refusal: Refusal) -> Candidate | None:
    """Return a plan that is asked for one soft part less, the lightest first, or at last for none; None where that is so already.

    Args:
        refusal: A plan that no flight keeps.
    """
    if not _may_be_planned(refusal):
        return None
    made, before = refusal.plan, refusal.tried.given_up
    parts = before[0].parts if before else tuple(sorted(_meant(made)))
    fewer = next(iter(less_wished(made.mission, parts)[len(before) :]), None)
    if fewer is None:
        return None
    other = plan(fewer, method=made.method, known=refusal.known)
    lost = " and ".join(part_text(part) for part in made.mission.soft_parts if part not in fewer.soft_parts)
    notes = (
        *other.notes,
        f"Given up: {lost}; a plan that keeps more, at a cost of {made.cost:.3f} in all, has no flight that is certified.",
        f"A plan that keeps more of the soft parts was given up: {refusal.error}",
    )
    other = other.model_copy(update={"mission": made.mission, "notes": notes})
    return refusal.answered("soft part", other, anew=True, parts=parts)


def words_under_precedences(refusal: Refusal) -> Plan | None:
    """Return a plan whose words hold under precedences, and keep what a plan's words keep.

    Args:
        refusal: Of a plan whose words hold in every order of whole words and in no flight, or lose a soft part.

    Returns:
        None where there are no such words, or no others.
    """
    made, mission, soft = refusal.plan, refusal.plan.mission, bool(refusal.plan.mission.soft_parts)
    if made.method == SEQUENCE or (soft and (mission.spec.trace == "infinite" or len(made.robots) < 2)):
        return None
    asked = asking(mission, _meant(made)) if soft else mission
    other = plan_or_none(asked, method=under_precedences, known=refusal.known)
    if other is None:
        return None
    if not soft:
        why = "Words that hold in every order of the robots were given up: they hold under no precedences, as a flight asks."
        return other.noting(why).model_copy(update={"method": made.method})
    if other.words == made.words and set(other.precedences) <= set(made.precedences):
        return None
    why = "Words that keep these soft parts in every order of the robots were given up for words that keep them under precedences, as a flight asks."
    return _reworded(made, other, why)


def _may_be_planned(refusal: Refusal) -> bool:
    """Tell whether other plans may be asked of the method of a plan with soft parts that no flight keeps."""
    made = refusal.plan
    return bool(made.mission.soft_parts) and PLANNING_METHODS.knows(made.method)


def _loses_some(refusal: Refusal) -> bool:
    """Tell whether a flight shows how soft parts break that its words keep; not of laps, in which no precedences are known that would help."""
    made = refusal.plan
    if made.method == SEQUENCE or laps(made):
        return False
    intended = range(len(refusal.soft)) if made.meetings else kept_by_plan(made.mission, made)
    lost = (part for index, part in enumerate(refusal.soft) if part.outcome != "holds" and index in intended)
    return any(part.witness is not None for part in lost)


def laps(made: Plan) -> bool:
    """Tell whether a plan's flight repeats for ever."""
    return made.mission.spec.trace == "infinite"


def _meant(made: Plan) -> frozenset[int]:
    """Return the soft parts that a plan's words keep; all of them where that depends on the times of laps."""
    if is_timed(made.mission, ()):
        return frozenset(range(len(made.mission.soft_parts)))
    return kept_by_plan(made.mission, made)


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
    *,
    known: Known | None = None,
) -> Member[frozenset[Leg], Plan] | None:
    """Return the cheapest plan that keeps the formula and some soft parts by words that do without one of a plan's legs.

    Args:
        made: The plan whose flight does not keep them.
        parts: The soft parts, by index.
        shut: Legs that have to be done without anyway.
        witnesses: What breaks the soft parts in that flight.
        known: Bounds on the searches.

    Returns:
        The plan, and the legs that it does without; None where there are no such words.
    """
    asked = asking(made.mission, frozenset(parts))

    regions = [frozenset(_legs_into(made.mission, entered)) for entered in _doubtful(made, witnesses)]
    legs = [frozenset({leg}) for leg in sorted({leg for name in made.robots for leg in legs_of(made, name)}, key=str)]
    for several in (regions, legs):
        spaces = (shut | those for those in several if those)
        found = plans_without(asked, spaces, searches=_SHUT, known=known)
        if (other := next((each for each in found if each.solution.words != made.words), None)) is not None:
            return other._replace(solution=_reworded(made, other.solution, _WHY))
    return None


_WHY = "Cheaper words that keep these soft parts were given up for others, as no flight of theirs that was tried keeps them."


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
    for word in (witness.word for witness in witnesses):
        team = sum(planned.values(), Counter[str]())
        read = [(planned, team, [letter for robot, letter in word if robot not in planned])]  # a letter of the whole team
        read += [([name], own, [letter for robot, letter in word if robot == name]) for name, own in planned.items()]
        for names, expected, letters in read:
            often = _entries(letters)
            too_often = [region for region in often if repeated or often[region] > expected[region] > 0]
            found |= set(itertools.product(names, too_often))
    if not repeated:
        return [found]
    return [set(itertools.product(planned, [region])) for region in sorted({region for _, region in found})]


def _entries(letters: Iterable[frozenset[str]]) -> Counter[str]:
    """Count how often each region is entered."""
    entered = (after - before for before, after in itertools.pairwise([frozenset[str](), *letters]))
    return Counter(itertools.chain.from_iterable(entered))


def _legs_into(mission: Mission, entered: Iterable[tuple[str, str]]) -> Iterator[Leg]:
    for name, region in entered:
        if region in mission.all_regions:
            yield (name, mission.agents[name].start, region)
            yield from ((name, other, region) for other in mission.all_regions if other != region)
