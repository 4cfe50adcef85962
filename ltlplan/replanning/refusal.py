"""Refusals: what became of a candidate's flight, the reason, and what the counterexamples ask for."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

from ltlplan.allocation import Known
from ltlplan.logic.budget import DEFAULT_BUDGET, Budget
from ltlplan.paths.costs import with_expected_times
from ltlplan.replanning.cuts import Candidate, Conflict, Cut, CutKind, Flight
from ltlplan.replanning.narrow_rooms import narrow_room
from ltlplan.replanning.timing.timetable import Relaxation, relaxation_of
from ltlplan.search.orders.planned_words import hold_under_precedences
from verify.data import Infeasible, LtlplanError, NotCertified, Plan, Witness

if TYPE_CHECKING:
    from verify import Claim
    from verify.claims.soft_claims import SoftClaim

Reason = Literal["certified", "soft parts", "no better", "endurance", "times", "claims", "tracking", "no flight"]
"""Certified as planned; soft parts are lost; nothing better than what is certified; a vehicle's endurance is too short; bounds in seconds ask for
other times, or allow gentler ones; a claim fails and waits may help; only tracking is not proved, which no other plan mends; no flight of these
words is certified."""


@dataclass(eq=False)
class Refusal:
    """A candidate, and what became of it.

    Attributes:
        tried: The candidate, with the notes on its flight; `rounds` counts this one.
        found: Its flight, or the conflict that left none.
        budget: Bounds on the searches for other plans.
    """

    tried: Candidate
    found: Flight | Conflict
    budget: Budget = DEFAULT_BUDGET

    @classmethod
    def of(cls, candidate: Candidate, found: Flight | Conflict, budget: Budget = DEFAULT_BUDGET) -> Refusal:
        """Return what became of a candidate.

        Args:
            candidate: What was refined.
            found: Its flight, or the conflict that left none.
            budget: Bounds on the searches for other plans.
        """
        plan = with_expected_times(found.plan, found.team) if isinstance(found, Flight) else candidate.plan
        return cls(replace(candidate, plan=plan, rounds=candidate.rounds + 1), found, budget)

    @property
    def plan(self) -> Plan:
        """The plan that was refined."""
        return self.tried.plan

    @property
    def known(self) -> Known:
        """Bounds on the searches for other plans, as planning takes them."""
        return Known(budget=self.budget)

    @property
    def soft(self) -> Sequence[SoftClaim]:
        """Claims of the checker about each soft part; empty where the flight itself was refused."""
        return self.found.certificate.soft if isinstance(self.found, Flight) and self.found.certificate.holds else ()

    @property
    def holds(self) -> bool:
        """Return whether the flight was certified."""
        return isinstance(self.found, Flight) and self.found.certificate.holds

    @cached_property
    def reason(self) -> Reason:
        """Outcome of the attempt, which decides the next candidate."""
        spent = self.tried.rounds >= self.tried.last_round
        timed = bool(self.plan.mission.timed_parts)
        if self.holds:
            if not spent and any(part.outcome != "holds" for part in self.soft):
                return "soft parts"
            return "times" if timed and not spent and not self.tried.timed else "certified"
        if self.tried.certified is not None:
            return "certified" if spent or timed else "no better"
        if isinstance(self.found, Conflict):
            return "no flight"
        if self._too_long:
            return "endurance"
        if {claim.name for claim in self.found.refused} == {"timing"} and not spent:
            return "times"
        if {claim.name for claim in self.found.refused} == {"tracking"}:
            return "tracking"
        return "no flight" if spent else "claims"

    @property
    def witnesses(self) -> tuple[Witness, ...]:
        """Counterexamples to the claims that were refused."""
        refused = self.found.refused if isinstance(self.found, Flight) else ()
        return tuple(claim.witness for claim in refused if claim.witness is not None)

    @property
    def breaks_formula(self) -> bool:
        """Return whether the flight may violate the formula."""
        return any(witness.claim == "formula" for witness in self.witnesses)

    @cached_property
    def impossible(self) -> bool:
        """Return whether the formula is violated, and the words satisfy it under no precedences."""
        return self.breaks_formula and not hold_under_precedences(self.plan)

    @property
    def why(self) -> str:
        """Sentences about the flight."""
        if isinstance(self.found, Conflict):
            return str(self.found.error)
        return " ".join(_said_once(self.found.refused)) or " ".join(
            part.sentence for part in self.soft if part.outcome != "holds"
        )

    @cached_property
    def error(self) -> LtlplanError:
        """Error that tells why these words are given up."""
        if isinstance(self.found, Conflict):
            return _with_narrow_room(self.plan, self.found.error)
        if self._too_long:
            lasts = max(path.duration for path in self.found.team.values())
            hint = f"Flown as fast as all limits allow, which took {lasts:.4g} s; plan more robots, or vehicles of longer endurance."
            return NotCertified(f"Not certified. {' '.join(self._too_long)} {hint}", self.witnesses)
        if self.reason == "no flight":
            said = f"Not certified after {self.tried.rounds} rounds of refinement. {self.why} {self._relief}"
            return NotCertified(" ".join([said.rstrip(), *self._narrow]), self.witnesses)
        if self.reason == "times":
            said = f"Not certified: no times of these words keep what is bounded in seconds. {self.why} {self._relief}"
            return NotCertified(said.rstrip(), self.witnesses)
        if self.reason == "tracking":
            return NotCertified(f"Not certified. {self.why}", self.witnesses)
        no_waits = "Whatever robots wait for, these words do not satisfy the formula."
        return NotCertified(f"Not certified. {self.why} {no_waits}", self.witnesses)

    @property
    def _relief(self) -> str:
        """Sentences on what would have to be given up for these words to be in time; empty where bounds in seconds are not all that was refused."""
        paces = {pace for name in self.plan.mission.agents if (pace := self.plan.mission.pace_of(name)) != 1.0}
        slow = " and ".join(sorted(str(pace) for pace in paces))
        faster = f"`planner.pace` is {slow}; a greater one, up to 1, flies faster." if slow and self.relaxation.late else ""
        return f"{self.relaxation.sentence} {faster}".strip()

    @property
    def _narrow(self) -> list[str]:
        """Sentences on narrow places of rooms that robots were not shown to stay in."""
        left = sorted({each.robot for each in self.witnesses if each.claim == "formula" and each.robot is not None})
        return [place.sentence for robot in left if (place := narrow_room(self.plan, robot)) is not None]

    @cached_property
    def relaxation(self) -> Relaxation:
        """Return what would have to be given up for these words to be in time, where bounds in seconds alone were refused."""
        if not isinstance(self.found, Flight) or {claim.name for claim in self.found.refused} != {"timing"}:
            return Relaxation()
        return relaxation_of((self.found.plan, self.found.team, self.found.certificate))

    @property
    def _too_long(self) -> list[str]:
        refused = self.found.refused if isinstance(self.found, Flight) else ()
        return [claim.sentence for claim in refused if claim.name == "limits.endurance"]

    @property
    def conflict(self) -> Witness | None:
        """Witness of a conflict that other words may avoid: robots come too near each other, or wait in a circle."""
        witnesses = (self.error.witness,) if isinstance(self.error, Infeasible) else getattr(self.error, "witnesses", ())
        return next((each for each in witnesses if each is not None and each.claim in ("separation", "formula")), None)

    def answered(self, kind: CutKind, plan: Plan | None, /, *, anew: bool = False, **forbidden: Any) -> Candidate | None:
        """Return the candidate that comes next; None where there is no plan for it.

        Other words are never said to be the cheapest, unless these are proved to be impossible.

        Args:
            kind: What is forbidden.
            plan: The plan that does without it.
            anew: Whether these words are given up, so that the plan may be refined as often as the first one.
            forbidden: Further fields of the cut.
        """
        if plan is None:
            return None
        if plan.words != self.plan.words and not forbidden.get("proved"):  # cheaper words may have flights that were not found
            plan = plan.model_copy(update={"complete": False})
        obstruction = getattr(self.error, "obstruction", None) if anew else None
        why = str(self.error) if anew else self.why
        cut = Cut(kind, why, self.tried.rounds, anew=anew, obstruction=obstruction, **forbidden)
        judged = self.tried.rounds - isinstance(self.found, Conflict)
        return replace(self.tried, plan=plan, cuts=(*self.tried.cuts, cut), rounds=judged)


def _said_once(claims: Iterable[Claim]) -> Iterator[str]:
    """Yield the sentences of claims; of those that differ in the robot alone the first, and of whom else it is said."""
    kinds: dict[str, list[str]] = {}
    for claim in claims:
        alike = kinds.setdefault(claim.sentence.replace(claim.robot, "") if claim.robot else claim.sentence, [])
        if not alike:
            alike.append(claim.sentence)
        elif claim.robot:
            alike.append(claim.robot)
    for first, *others in kinds.values():
        yield f"{first} So it is of {', '.join(others)}." if others else first


def _with_narrow_room(plan: Plan, error: LtlplanError) -> LtlplanError:
    """Return an error, with the narrow place of a room that a robot's path leaves between its visits, where there is one."""
    if not isinstance(error, Infeasible) or error.witness is None or error.obstruction is None:
        return error
    robot = error.witness.robot if error.witness.claim == "visits" else None
    narrow = None if robot is None else narrow_room(plan, robot)
    return error if narrow is None else error.because(replace(error.obstruction, place=narrow.place, helps=narrow.helps))
