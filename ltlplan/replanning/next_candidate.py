"""The next candidate, where a flight is refused: the same words with waits, under other precedences, other words, or fewer soft parts."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from ltlplan.planner import SEQUENCE
from ltlplan.precedences import with_planned_waits, with_waits
from ltlplan.replanning.candidates import Candidate, Certified, Conflict, Cut, CutKind, Flight
from ltlplan.replanning.checked_plan import plan
from ltlplan.replanning.conflict_alternatives import NO_WAITS, flown_otherwise, hold_under_precedences, no_other_words
from verify.data import BadInput, Infeasible, LtlplanError, NotCertified, Plan, Unsatisfiable
from verify.data.choices import PLANNING_METHODS

if TYPE_CHECKING:
    from verify.claims.soft_claims import SoftClaim

_WAYS: tuple[CutKind, CutKind] = ("precedences", "words")
"""Beyond waits, to keep soft parts: the same words under precedences, and other words; one leads to the next."""
_OTHERS = 3
"""Other words that are tried where no waits and precedences keep soft parts, each without a leg more."""


def following(candidate: Candidate, found: Flight | Conflict) -> Candidate | Certified:
    """Return what to refine next, or what is certified.

    Args:
        candidate: What was refined.
        found: What became of it.

    Raises:
        NotCertified: No flight of these words and of no others that were tried is certified; carries the witnesses.
        Infeasible: Refinement found no flight, and there are no other words.
        DoesNotFit: So, for a vehicle's memory.
    """
    if isinstance(found, Flight):
        candidate = replace(candidate, plan=found.plan)
        if found.certificate.holds:
            return _certified(candidate, found)
    number = candidate.rounds + 1
    judged = number if isinstance(found, Flight) else candidate.rounds
    if candidate.certified is not None:
        other = None if number >= candidate.last_round else without_a_leg(candidate, (), _why(found))
        return replace(candidate.certified, rounds=number) if other is None else replace(other, rounds=judged)
    error = found.error if isinstance(found, Conflict) else None
    if isinstance(found, Flight):
        try:
            return _waiting(candidate, found)
        except NotCertified as refusal:
            error = refusal
    assert error is not None
    other = _other_words(replace(candidate, rounds=number), error)
    if other is None:
        raise no_other_words(candidate, error) from error
    return replace(other, rounds=judged)


def _why(found: Flight | Conflict) -> str:
    return str(found.error) if isinstance(found, Conflict) else " ".join(claim.sentence for claim in found.refused)


def _certified(candidate: Candidate, flight: Flight) -> Candidate | Certified:
    """Return the better one of what is certified now and before; or a candidate that may keep soft parts which the flight does not."""
    number, before = candidate.rounds + 1, candidate.certified
    done = Certified(flight.plan, flight.team, flight.certificate, number)
    if before is not None and before.certificate.soft_weight >= flight.certificate.soft_weight:
        done = replace(before, rounds=number)
    if number >= candidate.last_round:
        return done
    tried = replace(candidate, rounds=number, certified=done)
    return _keeping_soft_parts(tried, flight.certificate.soft) or done


def _waiting(candidate: Candidate, flight: Flight) -> Candidate:
    """Return the same words with the waits, the order or the pace that the counterexamples ask for.

    Raises:
        NotCertified: This was the last of a handful of rounds, the fastest flight outlasts a vehicle's endurance, or the waits go round in a circle.
    """
    number, why = candidate.rounds + 1, _why(flight)
    latest = tuple(claim.witness for claim in flight.refused if claim.witness is not None)
    if long := [claim.sentence for claim in flight.refused if claim.name == "limits.endurance"]:
        if not candidate.hurried:
            note = "Flown as fast as the limits allow: at the planned speeds the flight would outlast a vehicle's endurance."
            made = candidate.plan.model_copy(update={"notes": (*candidate.plan.notes, note)})
            return candidate.cut(Cut("pace", why, number), made, rounds=number)
        lasts = max(path.duration for path in flight.team.values())
        hint = (
            f"Flown as fast as all limits allow, which took {lasts:.4g} s; plan more robots, or vehicles of longer endurance."
        )
        raise NotCertified(f"Not certified. {' '.join(long)} {hint}", latest)
    if number >= candidate.last_round:
        raise NotCertified(f"Not certified after {number} rounds of refinement. {why}", latest)
    if any(witness.claim == "formula" for witness in latest) and not hold_under_precedences(candidate.plan):
        planned = _words_under_precedences(candidate.plan)
        if planned is None:
            raise NotCertified(f"Not certified. {why} {NO_WAITS}", latest)
        return candidate.cut(Cut("order", why, number, proved=True), planned, rounds=number)
    try:
        waiting = with_waits(candidate.plan, latest)
        mends = waiting is not candidate.plan or all(witness.claim != "formula" for witness in latest)
    except NotCertified:
        planned = _ordered(candidate.plan)
        if planned is None:
            raise
        return candidate.cut(Cut("order", why, number), planned, rounds=number)
    planned = None if mends else _ordered(candidate.plan)
    if planned is not None:
        return candidate.cut(Cut("order", why, number), planned, rounds=number)
    return candidate.cut(Cut("waits", why, number, witnesses=latest), waiting, rounds=number)


def _ordered(made: Plan) -> Plan | None:
    """Return the plan with precedences that planning finds for its words, or with other words that have some; None where it finds none."""
    try:
        return with_planned_waits(made)
    except Unsatisfiable:
        return _words_under_precedences(made)


def _words_under_precedences(made: Plan) -> Plan | None:
    """Return a plan whose words hold under precedences, in the place of one that holds in every order of whole words and in no flight."""
    from ltlplan.search.method import under_precedences

    if made.method == SEQUENCE:
        return None
    if made.mission.soft_parts:
        return _words_for_soft_parts(made)
    try:
        other = plan(made.mission, method=under_precedences)
    except (BadInput, Unsatisfiable, Infeasible, NotCertified):
        return None
    why = "Words that hold in every order of the robots were given up: they hold under no precedences, as a flight asks."
    return other.model_copy(update={"method": made.method, "notes": (*other.notes, why)})


def _words_for_soft_parts(made: Plan) -> Plan | None:
    from ltlplan.replanning.soft_parts import other_words_under_precedences
    from ltlplan.search.method import under_precedences

    return other_words_under_precedences(made, lambda asked: plan(asked, method=under_precedences))


def _other_words(candidate: Candidate, error: LtlplanError) -> Candidate | None:
    """Return other words for the same soft parts, or for fewer of them; None where there are none."""
    made = candidate.plan
    if not made.mission.soft_parts:
        return flown_otherwise(candidate, error)
    if made.method == SEQUENCE or not PLANNING_METHODS.knows(made.method):
        return None
    fewer = any(cut.kind == "soft part" for cut in candidate.cuts)
    if not fewer and not candidate.since("words", "legs"):
        other = _words_for_soft_parts(made)
        if other is not None:
            return candidate.cut(Cut("words", str(error), candidate.rounds, anew=True), other)
    elsewhere = None if fewer else without_a_leg(candidate, (), str(error), anew=True)
    return elsewhere or _with_fewer_soft_parts(candidate, str(error))


def _with_fewer_soft_parts(candidate: Candidate, why: str) -> Candidate | None:
    """Return a plan that is asked for one soft part less, or for none; None where that is so already."""
    from ltlplan.replanning.soft_parts import less_wished, meant, part_text

    made, before = candidate.plan, [cut for cut in candidate.cuts if cut.kind == "soft part"]
    parts = before[0].parts if before else tuple(sorted(meant(made)))
    fewer = list(less_wished(made.mission, parts))[len(before) :]
    if not fewer:
        return None
    other = plan(fewer[0], method=made.method)
    lost = " and ".join(part_text(part) for part in made.mission.soft_parts if part not in fewer[0].soft_parts)
    notes = (
        *other.notes,
        f"Given up: {lost}; a plan that keeps more, at a cost of {made.cost:.3f} in all, has no flight that is certified.",
        f"A plan that keeps more of the soft parts was given up: {why}",
    )
    cut = Cut("soft part", why, candidate.rounds, anew=True, parts=parts)
    return candidate.cut(cut, other.model_copy(update={"mission": made.mission, "notes": notes}))


def _keeping_soft_parts(candidate: Candidate, judged: Sequence[SoftClaim]) -> Candidate | None:
    """Return what may keep soft parts that the words keep and the flight may not: waits, precedences, other words; None where nothing may."""
    from ltlplan.replanning.soft_parts import kept_by_plan, same_words_under_precedences

    made, why = candidate.plan, " ".join(part.sentence for part in judged if part.outcome != "holds")
    lost = [part.outcome != "holds" for part in judged]
    if not any(lost) or made.method == SEQUENCE:
        return None
    if made.mission.spec.trace == "infinite":  # in laps no waits are known that would help
        return without_a_leg(candidate, judged, why)
    intended = range(len(lost)) if made.meetings else kept_by_plan(made.mission, made)
    witnesses = [p.witness for i, p in enumerate(judged) if lost[i] and i in intended and p.witness is not None]
    if not witnesses:
        return None  # these parts were not meant to be kept
    with contextlib.suppress(NotCertified):  # the waits go round in a circle
        waiting = with_waits(made, witnesses)
        if waiting.precedences != made.precedences:
            return candidate.cut(Cut("waits", why, candidate.rounds), waiting)
    for kind in _WAYS:
        if candidate.since("words", "legs", kind):
            continue
        other = same_words_under_precedences(made) if kind == "precedences" else _words_for_soft_parts(made)
        if other is not None:
            return candidate.cut(Cut(kind, why, candidate.rounds), other)
    return without_a_leg(candidate, judged, why)


def without_a_leg(candidate: Candidate, judged: Sequence[SoftClaim], why: str, *, anew: bool = False) -> Candidate | None:
    """Return other words that may keep soft parts which the flight of a plan does not: they do without one of its legs, or keep out of a region.

    Args:
        candidate: The plan, and what was forbidden before.
        judged: What the judge said of each soft part; empty where the flight was refused.
        why: What was said of the flight.
        anew: Whether they may be refined as often as the first plan.

    Returns:
        None where there are none, or enough of them were tried.
    """
    from ltlplan.replanning.k_best_alternatives import asked_again, words_without
    from ltlplan.search.method import without_legs

    made = candidate.plan
    if candidate.others >= _OTHERS or made.method == SEQUENCE:
        return None
    held = {index for index, part in enumerate(judged) if part.outcome == "holds"}
    for parts in asked_again(made, held):
        witnesses = [part.witness for index, part in enumerate(judged) if index in parts - held and part.witness is not None]
        found = words_without(
            made, parts, candidate.legs, lambda asked, shut: plan(asked, method=without_legs(shut)), witnesses
        )
        if found is not None:
            return candidate.cut(Cut("legs", why, candidate.rounds, anew=anew, legs=found.shut), found.plan)
    return None
