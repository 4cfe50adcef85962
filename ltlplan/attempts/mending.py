"""What to refine next where a plan's flight is refused: the same words with waits, under other precedences, other words, or fewer soft parts."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from ltlplan.attempts.checked_plan import plan
from ltlplan.attempts.drafts import Draft, Refused
from ltlplan.attempts.flyable_words import NO_WAITS, flown_otherwise, hold_under_precedences, no_other_words
from ltlplan.planner import SEQUENCE
from ltlplan.precedences import with_planned_waits, with_waits
from verify.data import BadInput, Infeasible, LtlplanError, NotCertified, Plan, Unsatisfiable
from verify.data.choices import PLANNING_METHODS

if TYPE_CHECKING:
    from verify.claims.soft_claims import SoftClaim

_WAYS = 2
"""Ways beyond waits to keep soft parts: the same words under precedences, and other words."""
_OTHERS = 3
"""Other words that are tried where no waits and precedences keep soft parts, each without a leg more."""


def mended(refused: Refused) -> Draft:
    """Return what to refine next after a refusal: the plan with the waits that it asks for, and all witnesses so far.

    Raises:
        NotCertified: This was the last of a handful of rounds, the flight outlasts a vehicle's endurance, or the waits go round in a circle; carries the witnesses.
    """
    try:
        return _mended(refused)
    except NotCertified as error:
        draft = replace(refused.draft, rounds=refused.rounds)
        other = without_this_flight(draft, error)
        if other is None:
            raise no_other_words(draft, error) from error
        return other


def _mended(refused: Refused) -> Draft:
    if refused.draft.certified is not None:
        return refused.instead or replace(refused.draft, rounds=refused.rounds)
    latest = tuple(claim.witness for claim in refused.claims if claim.witness is not None)
    if long := [claim.sentence for claim in refused.claims if claim.name == "limits.endurance"]:
        if not refused.draft.hurried:
            return _hurried(refused.draft, refused.rounds)
        lasts = max(flight.duration for flight in refused.team.values())
        hint = (
            f"Flown as fast as all limits allow, which took {lasts:.4g} s; plan more robots, or vehicles of longer endurance."
        )
        raise NotCertified(f"Not certified. {' '.join(long)} {hint}", latest)
    if refused.rounds >= refused.draft.last_round:
        sentences = " ".join(claim.sentence for claim in refused.claims)
        raise NotCertified(f"Not certified after {refused.rounds} rounds of refinement. {sentences}", latest)
    draft, witnesses = refused.draft, (*refused.draft.witnesses, *latest)
    if any(witness.claim == "formula" for witness in latest) and not hold_under_precedences(draft.plan):
        replanned = _replanned(refused)
        if replanned is None:
            sentences = " ".join(claim.sentence for claim in refused.claims)
            raise NotCertified(f"Not certified. {sentences} {NO_WAITS}", latest)
        return replanned
    try:
        waiting = with_waits(draft.plan, latest)
        mends = waiting is not draft.plan or all(witness.claim != "formula" for witness in latest)
    except NotCertified:
        replanned = _replanned(refused)
        if replanned is None:
            raise
        return replanned
    replanned = None if mends else _replanned(refused)
    return replanned or replace(draft, plan=waiting, rounds=refused.rounds, witnesses=witnesses)


def _hurried(draft: Draft, rounds: int) -> Draft:
    """Return the draft as it is flown as fast as limits allow."""
    note = "Flown as fast as the limits allow: at the planned speeds the flight would outlast a vehicle's endurance."
    made = draft.plan.model_copy(update={"notes": (*draft.plan.notes, note)})
    return replace(draft, plan=made, rounds=rounds, hurried=True)


def _replanned(refused: Refused) -> Draft | None:
    """Return the draft with precedences that planning finds for its words, or with other words that have some; None where it finds none."""
    draft = refused.draft
    others = tuple(witness for witness in draft.witnesses if witness.claim != "formula")  # planning orders all events
    try:
        planned = with_planned_waits(draft.plan)
    except Unsatisfiable:
        planned = _with_other_words(draft.plan)
    return None if planned is None else replace(draft, plan=planned, rounds=refused.rounds, witnesses=others)


def _with_other_words(made: Plan) -> Plan | None:
    """Return a plan whose words hold under precedences, in the place of one that holds in every order of whole words and in no flight."""
    from ltlplan.search.method import under_precedences

    if made.method == SEQUENCE:
        return None
    if made.mission.soft_parts:
        return _other_words_for_soft_parts(made)
    try:
        other = plan(made.mission, method=under_precedences)
    except (BadInput, Unsatisfiable, Infeasible, NotCertified):
        return None
    why = "Words that hold in every order of the robots were given up: they hold under no precedences, as a flight asks."
    return other.model_copy(update={"method": made.method, "notes": (*other.notes, why)})


def without_this_flight(draft: Draft, error: LtlplanError) -> Draft | None:
    """Return other words for the same soft parts, or for fewer of them, in the place of a plan that no flight keeps; None where there are none.

    Args:
        draft: The plan, and what was refused of it.
        error: What refinement or the judge said of it.

    Raises:
        LtlplanError: What wishes less cannot be planned either.
    """
    made = draft.plan
    if not made.mission.soft_parts:
        return flown_otherwise(draft, error)
    if made.method == SEQUENCE or not PLANNING_METHODS.knows(made.method):
        return None
    other = None if draft.reworded == _WAYS or draft.fewer is not None else _other_words_for_soft_parts(made)
    if other is not None:
        return Draft(other, draft.rounds, begun=draft.rounds, reworded=_WAYS)
    elsewhere = None if draft.fewer is not None else elsewhere_for_soft_parts(draft, ())
    if elsewhere is not None:
        return replace(elsewhere, begun=draft.rounds)
    return _with_fewer_soft_parts(draft, str(error))


def _with_fewer_soft_parts(draft: Draft, why: str) -> Draft | None:
    from ltlplan.attempts.soft_parts import less_wished, part_text

    made = draft.plan
    fewer = tuple(less_wished(made)) if draft.fewer is None else draft.fewer
    if not fewer:
        return None
    other = plan(fewer[0], method=made.method)
    lost = " and ".join(part_text(part) for part in made.mission.soft_parts if part not in fewer[0].soft_parts)
    notes = (
        *other.notes,
        f"Given up: {lost}; a plan that keeps more, at a cost of {made.cost:.3f} in all, has no flight that is certified.",
        f"A plan that keeps more of the soft parts was given up: {why}",
    )
    return Draft(
        other.model_copy(update={"mission": made.mission, "notes": notes}), draft.rounds, begun=draft.rounds, fewer=fewer[1:]
    )


def keeping_soft_parts(refused: Refused) -> Draft | None:
    """Return what may keep soft parts which the words keep and the flight may not: waits, precedences, other words; None where nothing may.

    Args:
        refused: A team whose certificate lacks some of the soft parts.
    """
    from ltlplan.attempts.soft_parts import kept_by_plan, same_words_under_precedences

    draft, made = refused.draft, refused.draft.plan
    lost = [part.outcome != "holds" for part in refused.certificate.soft]
    if not any(lost) or made.method == SEQUENCE:
        return None
    if made.mission.spec.trace == "infinite":  # in laps no waits are known that would help
        return elsewhere_for_soft_parts(replace(draft, rounds=refused.rounds), refused.certificate.soft)
    meant = range(len(lost)) if made.meetings else kept_by_plan(made.mission, made)
    witnesses = [p.witness for i, p in enumerate(refused.certificate.soft) if lost[i] and i in meant and p.witness is not None]
    if not witnesses:
        return None  # these parts were not meant to be kept
    with contextlib.suppress(NotCertified):  # the waits go round in a circle
        waiting = with_waits(made, witnesses)
        if waiting.precedences != made.precedences:
            return replace(draft, plan=waiting, rounds=refused.rounds)
    for way in range(draft.reworded, _WAYS):
        other = same_words_under_precedences(made) if way == 0 else _other_words_for_soft_parts(made)
        if other is not None:
            return replace(draft, plan=other, rounds=refused.rounds, witnesses=(), reworded=way + 1)
    return elsewhere_for_soft_parts(replace(draft, rounds=refused.rounds), refused.certificate.soft)


def elsewhere_for_soft_parts(draft: Draft, judged: Sequence[SoftClaim]) -> Draft | None:
    """Return other words that may keep soft parts which the flight of a plan does not: they do without one of its legs, or keep out of a region.

    Args:
        draft: The plan.
        judged: What the judge said of each soft part; empty where the flight was refused.

    Returns:
        None where there are none, or enough of them were tried.
    """
    from ltlplan.attempts.other_words import asked_again, words_without
    from ltlplan.search.method import without_legs

    made = draft.plan
    if draft.others >= _OTHERS or made.method == SEQUENCE:
        return None
    held = {index for index, part in enumerate(judged) if part.outcome == "holds"}
    for parts in asked_again(made, held):
        witnesses = [part.witness for index, part in enumerate(judged) if index in parts - held and part.witness is not None]
        found = words_without(made, parts, draft.shut, lambda asked, shut: plan(asked, method=without_legs(shut)), witnesses)
        if found is not None:
            return replace(draft, plan=found.plan, shut=found.shut, others=draft.others + 1, witnesses=(), reworded=_WAYS)
    return None


def _other_words_for_soft_parts(made: Plan) -> Plan | None:
    from ltlplan.attempts.soft_parts import other_words_under_precedences
    from ltlplan.search.method import under_precedences

    return other_words_under_precedences(made, lambda asked: plan(asked, method=under_precedences))
