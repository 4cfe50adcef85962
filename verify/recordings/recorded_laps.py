"""A formula of laps for ever, of which a recording shows the first ones.

* *Broken*: each word that the samples allow is a bad prefix, one that no continuation saves; from the first instant at which that is so.
* *Holds, if it goes on so*: each word that the samples allow, with the last lap repeated for ever, satisfies the formula. Every lap may show
  anew what the samples leave open of the last one. That later laps show what this one did is a premise, which no recording can prove,
  as it is of the certificate, and stands in the claim's sentence.
* Otherwise the samples cannot tell.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction

from verify.claims.claim import Claim
from verify.data.mission import Mission
from verify.data.witness import Witness
from verify.logic.explanation import show
from verify.model_checking.bad_prefixes import first_never_kept, never_kept
from verify.model_checking.timeline import Relations, Status, Timeline
from verify.model_checking.timing.timed_verdict import TimedJudge
from verify.model_checking.word_claims import judge_formula, judged_as_one
from verify.recordings.geometric_claims import recorded_claim

_ENDS = "A recorded flight ends, and what follows may keep the formula or break it"


# six parameters: what is asked, what is known of the flight, and what the search may take
def laps_claim(
    mission: Mission,
    timelines: Mapping[str, Timeline],
    related: Relations,
    lap: Fraction | None,
    begins: tuple[float, float],
    budget: int,
) -> Claim:
    """Claim that the formula holds of the recorded flight, assuming every later cycle repeats the last recorded one.

    Args:
        mission: Carries the formula and the reading; its trace is infinite.
        timelines: One for each robot, without cycles.
        related: What is proved of the regions at large.
        lap: Length of the last lap, with which the timelines end, s; None where it is not known.
        begins: Time of the timelines' 0, s of the recording, and by how much later the flight may have begun: bounds in seconds count from there.
        budget: Configurations that each part of the formula may take.
    """
    zero, late = begins[0], Fraction(begins[1]) if mission.timed_parts else Fraction(0)
    why = ": how long its laps last, or when exactly it began, is not known."
    if lap is not None:
        end = min(timeline.duration for timeline in timelines.values())
        repeated = {name: replace(timeline, cycle=end - lap) for name, timeline in timelines.items()}
        fault = next((name for name, timeline in repeated.items() if not _closes(timeline)), None)
        if fault is not None:
            why = f": {fault}'s internal state at the end of the last lap is not known to be that at its beginning."
        else:
            verdict = judged_as_one(judge_formula(mission, repeated, related, clock_error=late, budget=budget))
            if verdict.outcome == "holds":
                note = f" But {verdict.vacuous[0]}" if verdict.vacuous else ""
                span = f"from {zero + float(end - lap):.4f} to {zero + float(end):.4f} s"
                sentence = (
                    f"If it goes on for ever as in the last lap ({span}), `{mission.spec.formula}` holds of the flight.{note}"
                )
                return Claim("formula", "holds", sentence)
            why = f". Even if it went on as in its last lap: {verdict.sentence}"

    def broken(flown: Mapping[str, Timeline]) -> str:
        part = never_kept(mission.formula, flown, related, mission.spec.team, budget)
        return "" if part is None else show(part)

    if part := broken(timelines):
        at = first_never_kept(timelines, lambda flown: bool(broken(flown)))
        return _broken(timelines, part, at, zero)
    judge = TimedJudge(timelines, related, late)
    lost = [(at, show(part)) for part in mission.timed_parts if (at := judge.lost_from(part)) is not None]
    if lost:
        at, part = min(lost)
        return _broken(timelines, part, at, zero)
    return recorded_claim("formula", "undecided", f"{_ENDS}{why}")


def _broken(timelines: Mapping[str, Timeline], part: str, at: Fraction, zero: float) -> Claim:
    """Return the claim that nothing keeps a part of the formula from an instant on, with what robots then surely showed."""
    time = zero + float(at)
    shown = tuple((robot, _surely_in(timeline, at)) for robot, timeline in timelines.items())
    where = "; ".join(f"{robot} surely in {', '.join(sorted(letter))}" for robot, letter in shown if letter)
    sentence = (
        f"Violated, whatever happened between the samples and whatever comes: from {time:.3f} s on nothing can keep `{part}` any more"
        f"{f' ({where})' if where else ''}."
    )
    witness = Witness(claim="formula", sentence=sentence, time=time, word=shown, times=((time, time),) * len(shown))
    return Claim("formula", "fails", sentence, time=time, witness=witness)


def _surely_in(timeline: Timeline, at: Fraction) -> frozenset[str]:
    status: dict[str, Status] = dict(timeline.initial)
    for change in timeline.changes:
        if change.time.low <= at:
            status[change.region] = change.status
    return frozenset(region for region, known in status.items() if known == "must")


def _closes(timeline: Timeline) -> bool:
    """Return whether a lap is known to end with the internal state with which it began, no change being under way where it begins."""
    assert timeline.cycle is not None
    if any(action.until is not None and action.time <= timeline.cycle <= action.until for action in timeline.actions):
        return False
    states = [timeline.internal, *(action.propositions for action in timeline.actions)]
    return states[sum(action.time < timeline.cycle for action in timeline.actions)] == states[-1]
