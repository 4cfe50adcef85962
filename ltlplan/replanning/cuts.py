"""Values of the loop from a plan to a certificate: candidates, what became of their flights, and what these forbid of the plans to come.

    candidate - refine, judge - flight or conflict - cut - next candidate

The loop is counterexample-guided (Clarke et al. 2000). A candidate is a plan with the cuts that led to it. The cuts hold all that is known of
the way so far, so that a stored candidate goes on in any process. A `Refusal` is a candidate whose flight was
refused, or keeps fewer soft parts than planned, with what the counterexamples ask for.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

from ltlplan.allocation import Leg
from ltlplan.paths.costs import with_expected_times
from ltlplan.precedences import hold_under_precedences
from ltlplan.replanning.timing.timetable import deadlines_to_relax
from verify.data import Infeasible, LtlplanError, Mission, NotCertified, Plan, Trajectory, Witness
from verify.data.obstruction import Obstruction

if TYPE_CHECKING:
    from typing import Any

    from verify import Certificate, Claim
    from verify.claims.soft_claims import SoftClaim

MAX_ROUNDS = 6
"""How often refinement may try to keep one plan's words."""
_SEVERAL = 2
"""The same where the words are one choice of several."""
_RELIEFS = 3
"""Soft parts without which a plan is tried that no flight kept."""
CutKind = Literal[
    "waits", "pace", "times", "order", "precedences", "words", "legs", "capacity", "soft part", "tracking", "sharing"
]
_FORBIDS: dict[CutKind, str] = {
    "waits": "flights that come near the counterexamples",
    "pace": "flights at the mission's own pace",
    "times": "flights at these times",
    "order": "flights in every order of the robots",
    "precedences": "flights of these words without precedences",
    "words": "words that hold in every order of the robots",
    "legs": "words along these legs",
    "capacity": "more robots in one region",
    "soft part": "plans that keep all of these soft parts",
    "tracking": "flights faster than the plan's own times",
    "sharing": "words that outlast a vehicle's endurance at nominal times",
}
Reason = Literal["certified", "soft parts", "no better", "endurance", "times", "claims", "no flight"]
"""Certified as planned; soft parts are lost; nothing better than what is certified; a vehicle's endurance is too short; bounds in seconds ask for
other times, or allow gentler ones; a claim fails and waits may help; no flight of these words is certified."""


@dataclass(frozen=True)
class Cut:
    """Constraint that a refused flight puts on later plans.

    Attributes:
        kind: What is forbidden: flights near counterexamples, at the mission's pace, or in every order; the same words without precedences; words that need none; words along
            legs; more robots in a region; plans that keep all soft parts.
        why: What was said of the flight.
        rounds: How many times refinement had run by then.
        anew: Whether what follows may be refined as often as the first plan, as its words are others.
        proved: Whether no flight at all can have what is forbidden; else none was found, and an empty search proves nothing.
        witnesses: Counterexamples that the next refinement keeps clear of.
        legs: Legs that are forbidden.
        capacity: Region, and how many robots it may hold.
        parts: Soft parts, by index, that the first plan to lose one of them was meant to keep.
        pace: Share of the fastest flight at which the next one is flown, where its times are chosen.
        plan: Digest of the refused plan; empty where it may come again.
        obstruction: What stood in the way of its flight, where refinement says it.
    """

    kind: CutKind
    why: str
    rounds: int
    anew: bool = False
    proved: bool = False
    witnesses: tuple[Witness, ...] = ()
    legs: frozenset[Leg] = frozenset()
    capacity: tuple[str, int] | None = None
    parts: tuple[int, ...] = ()
    pace: float | None = None
    plan: str = ""
    obstruction: Obstruction | None = None

    @property
    def sentence(self) -> str:
        """Forbidden plans and the reason, as a sentence."""
        what = _FORBIDS[self.kind]
        if self.kind == "legs":
            what += ": " + ", ".join(f"{robot} to {region}" for robot, _, region in sorted(self.legs, key=str))
        if self.capacity is not None:
            what = f"more than {self.capacity[1]} robots in '{self.capacity[0]}'"
        return f"{'Proved impossible' if self.proved else 'Given up'}: {what}. {self.why}"


@dataclass(frozen=True)
class Candidate:
    """A plan to be refined and judged.

    Attributes:
        plan: With the precedences that the cuts ask for.
        cuts: What earlier flights forbid, in the order in which they were refused.
        rounds: How many flights were judged.
        certified: What is certified already, while refinement tries to keep more of the planned soft parts.
    """

    plan: Plan
    cuts: tuple[Cut, ...] = ()
    rounds: int = 0
    certified: Certified | None = None

    def since(self, *kinds: CutKind) -> tuple[Cut, ...]:
        """Return the cuts of some kinds since a soft part was given up for the last time."""
        last = max((i + 1 for i, cut in enumerate(self.cuts) if cut.kind == "soft part"), default=0)
        return tuple(cut for cut in self.cuts[last:] if cut.kind in kinds)

    @property
    def witnesses(self) -> tuple[Witness, ...]:
        """Counterexamples to these words that refinement keeps clear of."""
        found: tuple[Witness, ...] = ()
        for cut in self.cuts:
            if cut.kind == "waits":
                found += cut.witnesses
            elif cut.kind not in (
                "pace",
                "times",
            ):  # other words, or an order of all events, which answers what was said of the formula
                found = tuple(each for each in found if each.claim != "formula") if cut.kind == "order" else ()
        return found

    @property
    def legs(self) -> frozenset[Leg]:
        """Legs that these words do without."""
        return frozenset[Any]().union(*(cut.legs for cut in self.since("legs")))

    @property
    def capacities(self) -> Mapping[str, int]:
        """Robots that regions hold, where refinement found no places for more."""
        return dict(cut.capacity for cut in self.since("capacity") if cut.capacity is not None)

    @property
    def hurried(self) -> bool:
        """Return whether it flies as fast as limits allow, as flights of its words at the mission's pace outlast a vehicle's endurance."""
        return any(cut.kind == "pace" for cut in self.since("pace", "sharing")[-1:])

    @property
    def pace(self) -> float | Literal["time", "nominal"] | None:
        """Its pace instead of the mission's: as fast as limits allow, one that was chosen, or the plan's own times; None for the mission's."""
        chosen = self.since("times", "pace")[-1:]
        if self.since("tracking"):
            return "nominal"
        return chosen[0].pace if chosen and chosen[0].pace is not None else "time" if self.hurried else None

    @property
    def pace_flown(self) -> float:
        """The share of the fastest flight at which its slowest robot flies; 1 at the plan's own times."""
        if self.pace is None:
            return greatest_pace(self.plan.mission)
        return 1.0 if isinstance(self.pace, str) else self.pace

    @property
    def others(self) -> int:
        """Number of times that other words were taken for the sake of room."""
        return len(self.since("legs", "capacity"))

    @property
    def last_round(self) -> int:
        """After how many rounds this plan is given up."""
        begun = max((cut.rounds for cut in self.cuts if cut.anew), default=0)
        parts = self.given_up[0].parts if self.given_up else ()
        wishes_less = 0 < len(self.given_up) < len(less_wished(self.plan.mission, parts))
        several = wishes_less or (self.others > 0 and self.certified is None)
        return begun + (_SEVERAL if several else MAX_ROUNDS)

    @property
    def given_up(self) -> tuple[Cut, ...]:
        """The cuts by which soft parts were given up."""
        return tuple(cut for cut in self.cuts if cut.kind == "soft part")

    def better_of(self, found: Flight | Conflict) -> Certified | None:
        """Return the better one of what is certified now and before, once this candidate was judged; None where nothing is.

        Args:
            found: What became of it.
        """
        best = self.certified
        if isinstance(found, Flight) and found.certificate.holds:
            certificate = found.certificate
            if best is None or best.certificate.soft_weight < certificate.soft_weight or found.plan.mission.timed_parts:
                best = Certified(found.plan, found.team, certificate, self.rounds + 1)
        return best and replace(best, rounds=self.rounds + 1)


@dataclass(frozen=True)
class Flight:
    """Refined candidate, with the checker's certificate.

    Attributes:
        plan: The candidate's, with notes on its flight.
        team: One trajectory a robot.
        certificate: The judge's answer.
    """

    plan: Plan
    team: dict[str, Trajectory]
    certificate: Certificate

    @property
    def refused(self) -> tuple[Claim, ...]:
        """The claims that do not hold."""
        return tuple(claim for claim in self.certificate.claims if claim.outcome != "holds")


@dataclass(frozen=True)
class Conflict:
    """Failure of refinement to find a flight.

    Attributes:
        error: With the witness that says where.
    """

    error: LtlplanError


@dataclass(frozen=True)
class Certified(Flight):
    """A flight that is certified; its plan has the precedences that the proof asked for.

    Attributes:
        rounds: How many flights were judged.
    """

    rounds: int


def greatest_pace(mission: Mission) -> float:
    """Return the share of the fastest flight at which a mission's slowest robot flies, where nothing else is chosen; 1 at the plan's own times.

    Args:
        mission: What is asked.
    """
    return min(1.0 if isinstance(pace := mission.pace_of(name), str) else pace for name in mission.agents)


def less_wished(mission: Mission, kept: Collection[int]) -> list[Mission]:
    """Return the mission with fewer soft parts than were kept: without one of the lightest, in turn, and at last without any.

    Args:
        mission: With all of them.
        kept: The soft parts, by index, that the first plan was meant to keep.
    """
    parts = mission.soft_parts
    lightest = sorted(kept, key=lambda index: (parts[index].weight, index)) if len(kept) > 1 else []
    fewer = [tuple(part for i, part in enumerate(parts) if i != index) for index in lightest[:_RELIEFS]]
    specs = [mission.spec.model_copy(update={"soft": soft}) for soft in fewer]
    return [
        *(mission.model_copy(update={"spec": spec}) for spec in specs),
        *([mission.asking(mission.spec.formula)] if kept else []),
    ]


def digest(made: Plan) -> str:
    """Return what tells plans apart: words, visits, and who waits for whom."""
    does = {name: (str(robot.word), [visit.model_dump() for visit in robot.visits]) for name, robot in made.robots.items()}
    waits = [wait.model_dump() for wait in (*made.precedences, *made.meetings)]
    return hashlib.sha256(json.dumps([does, waits], sort_keys=True).encode()).hexdigest()


@dataclass(eq=False)
class Refusal:
    """A candidate, and what became of it.

    Attributes:
        tried: The candidate, with the notes on its flight; `rounds` counts this one.
        found: Its flight, or the conflict that left none.
    """

    tried: Candidate
    found: Flight | Conflict

    @classmethod
    def of(cls, candidate: Candidate, found: Flight | Conflict) -> Refusal:
        """Return what became of a candidate.

        Args:
            candidate: What was refined.
            found: Its flight, or the conflict that left none.
        """
        plan = with_expected_times(found.plan, found.team) if isinstance(found, Flight) else candidate.plan
        return cls(replace(candidate, plan=plan, rounds=candidate.rounds + 1), found)

    @property
    def plan(self) -> Plan:
        """The plan that was refined."""
        return self.tried.plan

    @property
    def soft(self) -> Sequence[SoftClaim]:
        """Claims of the checker about each soft part; empty where the flight itself was refused."""
        return self.found.certificate.soft if isinstance(self.found, Flight) and self.found.certificate.holds else ()

    @cached_property
    def reason(self) -> Reason:
        """Outcome of the attempt, which decides the next candidate."""
        spent = self.tried.rounds >= self.tried.last_round
        timed = bool(self.plan.mission.timed_parts)
        if isinstance(self.found, Flight) and self.found.certificate.holds:
            if not spent and any(part.outcome != "holds" for part in self.soft):
                return "soft parts"
            return "times" if timed and not spent and not self.tried.since("times") else "certified"
        if self.tried.certified is not None:
            return "certified" if spent or timed else "no better"
        if isinstance(self.found, Conflict):
            return "no flight"
        if self._too_long:
            return "endurance"
        if {claim.name for claim in self.found.refused} == {"timing"} and not spent:
            return "times"
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
        return " ".join(claim.sentence for claim in self.found.refused) or " ".join(
            part.sentence for part in self.soft if part.outcome != "holds"
        )

    @cached_property
    def error(self) -> LtlplanError:
        """Error that tells why these words are given up."""
        if isinstance(self.found, Conflict):
            return self.found.error
        if self._too_long:
            lasts = max(path.duration for path in self.found.team.values())
            hint = f"Flown as fast as all limits allow, which took {lasts:.4g} s; plan more robots, or vehicles of longer endurance."
            return NotCertified(f"Not certified. {' '.join(self._too_long)} {hint}", self.witnesses)
        if self.reason == "no flight":
            return NotCertified(f"Not certified after {self.tried.rounds} rounds of refinement. {self.why}", self.witnesses)
        if self.reason == "times":
            said = f"Not certified: no times of these words keep what is bounded in seconds. {self.why} {deadlines_to_relax((self.found.plan, self.found.team, self.found.certificate))}"
            return NotCertified(said.rstrip(), self.witnesses)
        no_waits = "Whatever robots wait for, these words do not satisfy the formula."
        return NotCertified(f"Not certified. {self.why} {no_waits}", self.witnesses)

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
