"""Claims about the order of events: the planned words satisfy the formula under the plan's precedences, and the flight keeps each of them.

The times of an event are enclosed: a region is entered from when the path may be in it until it is for sure, and left from when the
path may be out of it again until it is for sure. A precedence is kept where the second event comes later than the first by more than
the clocks may be off, wherever in their enclosures both are.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction

from verify.behaviour.timeline import Enclosure, Timeline
from verify.claims.claim import Claim, claim_of
from verify.data.plan import Meeting, Plan, Precedence
from verify.motion.visits import Matching, Stay
from verify.words.planned_order import check_planned_order
from verify.words.team_verdict import check_team

Wait = Precedence | Meeting


def ordered_claims(plan: Plan) -> tuple[Claim, ...]:
    """Every team word that keeps the plan's precedences and meetings satisfies the formula.

    None where the plan has none, where the budget does not suffice, and where they are not what the words rest on: words that satisfy
    the formula in every order of the robots may have waits for their flight's sake alone.

    Args:
        plan: What was planned; carries the mission.
    """
    if plan.mission.spec.trace == "infinite" or not (plan.precedences or plan.meetings):
        return ()
    verdict = check_planned_order(plan)
    if verdict.outcome == "undecided":
        return ()
    if verdict.outcome == "fails" and check_team(plan.mission.formula, plan.words, plan.mission.spec.team).sequential:
        return ()
    witness = None if verdict.outcome == "holds" else verdict.witness()
    return (Claim("ordered", verdict.outcome, verdict.sentence, robot=verdict.robot, witness=witness),)


def precedence_claims(
    plan: Plan, matchings: Mapping[str, Matching], timelines: Mapping[str, Timeline], clock_error: Fraction
) -> Iterator[Claim]:
    """Yield for each precedence and meeting of a plan that the flight keeps it by more than the clocks may be off.

    Args:
        plan: What was planned.
        matchings: Each robot's planned visits and their stays.
        timelines: Each robot's actions, and when the flight ends.
        clock_error: How far apart the robots' clocks may be, s.
    """
    if plan.mission.spec.trace == "infinite":
        return
    for wait in (*plan.precedences, *plan.meetings):
        (first, i), (then, j) = wait.first, wait.then
        if i < len(matchings[first].stays) and j < len(matchings[then].stays):
            done = _Flown(matchings[first], timelines[first]).done(i, wait)
            due = _Flown(matchings[then], timelines[then]).due(j, wait)
            yield _kept(wait, wait.sentence(plan.robots), done, due, clock_error)
        else:
            sentence = f"That {wait.sentence(plan.robots)} is not proved: not all of these visits are made."
            yield claim_of("precedences", "undecided", sentence, robot=then, other=first, visit=j)


@dataclass(frozen=True, slots=True)
class _Flown:
    """One robot's visits as they are flown."""

    matching: Matching
    timeline: Timeline

    def done(self, visit: int, wait: Wait) -> Enclosure | None:
        """Return when what is waited for happens; None where it never does."""
        stay = self.matching.stays[visit]
        if isinstance(wait, Meeting) or wait.done == "entered":
            return self._entered(stay)
        return self._left(stay) if wait.done == "left" else self._acted(visit, -1)

    def due(self, visit: int, wait: Wait) -> Enclosure | None:
        """Return when what has to wait happens; None where it never does."""
        stay = self.matching.stays[visit]
        if isinstance(wait, Meeting):  # whichever comes first: it leaves where it is, or comes to where it goes
            here, there = self._left(self.matching.stays[visit - 1]) if visit else None, self._entered(stay)
            return there if here is None else Enclosure(min(here.low, there.low), min(here.high, there.high))
        if wait.due == "enters":
            return self._entered(stay)
        return self._left(stay) if wait.due == "leaves" else self._acted(visit, 0)

    def _entered(self, stay: Stay) -> Enclosure:
        return Enclosure(stay.start, stay.must[0][0] if stay.must else self.timeline.duration)

    def _left(self, stay: Stay) -> Enclosure | None:
        """Return when a region is left: after the first time in it for sure, for the path may go to and fro at its boundary."""
        begins = stay.must[0][1] if stay.must else stay.start
        return None if begins >= self.timeline.duration else Enclosure(begins, stay.stop)

    def _acted(self, visit: int, which: int) -> Enclosure | None:
        times = [action.time for action in self.timeline.actions if action.visit == visit]
        return Enclosure(times[which], times[which]) if times else None


def _kept(wait: Wait, text: str, done: Enclosure | None, due: Enclosure | None, clock_error: Fraction) -> Claim:
    (first, _), (then, visit) = wait.first, wait.then
    if done is None:
        sentence = f"It is not so that {text}: {first} never does what is waited for."
        return claim_of("precedences", "fails", sentence, robot=then, other=first, visit=visit)
    if due is None:
        return claim_of("precedences", "holds", f"{then} never does what would have to wait: {text}.", robot=then, other=first)
    gap = due.low - done.high
    if gap > clock_error:
        outcome, what, where = "holds", f"In flight {text}, by {float(gap):.4f} s.", None
    else:
        outcome = "fails" if due.high - done.low <= clock_error else "undecided"
        late = f"that may come at {float(due.low):.4f} s, and what it waits for as late as {float(done.high):.4f} s"
        what, where = f"It is not {_NOT[outcome]} that {text}, by more than {float(clock_error):g} s: {late}.", visit
    return claim_of(
        "precedences", outcome, what, robot=then, other=first, unit="s", bound=_rounded_down(gap), limit=float(clock_error),
        margin=_rounded_down(gap - clock_error), time=float(due.low), visit=where, what="wait" if where is not None else "",
    )  # fmt: skip


def _rounded_down(value: Fraction) -> float:
    near = float(value)
    return near if near <= value else math.nextafter(near, -math.inf)


_NOT = {"fails": "so", "undecided": "proved"}
