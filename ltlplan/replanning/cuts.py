"""Values of the loop from a plan to a certificate: candidates, what became of their flights, and what these forbid of the plans to come.

    candidate - refine, judge - flight or conflict - cut - next candidate

The loop is counterexample-guided (Clarke et al. 2000). A candidate is a plan with the cuts that led to it. The cuts hold all that is known of
the way so far, so that a stored candidate goes on in any process. What became of a candidate is its `Refusal`.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

from ltlplan.allocation import Leg
from verify.data import LtlplanError, Mission, Plan, Trajectory, Witness
from verify.data.obstruction import Obstruction

if TYPE_CHECKING:
    from verify import Certificate, Claim

MAX_ROUNDS = 6
"""How often refinement may try to keep one plan's words."""
_SEVERAL = 2
"""The same where the words are one choice of several."""
_RELIEFS = 3
"""Soft parts without which a plan is tried that no flight kept."""
STEPS_ASIDE = "out of the way of"
"""Words of a plan's notes on robots that step aside."""
CutKind = Literal[
    "waits",
    "pace",
    "times",
    "visits",
    "order",
    "precedences",
    "words",
    "legs",
    "aside",
    "capacity",
    "soft part",
    "tracking",
    "sharing",
]
_FORBIDS: dict[CutKind, str] = {
    "waits": "flights that come near the counterexamples",
    "pace": "flights at the mission's own pace",
    "times": "flights at these times",
    "visits": "visits by these robots in this order",
    "order": "flights in every order of the robots",
    "precedences": "flights of these words without precedences",
    "words": "words that hold in every order of the robots",
    "legs": "words along these legs",
    "aside": "flights in which no robot steps aside",
    "capacity": "more robots in one region",
    "soft part": "plans that keep all of these soft parts",
    "tracking": "flights faster than the plan's own times",
    "sharing": "words that outlast a vehicle's endurance at nominal times",
}


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
        order: Order of visits in which the next plan makes them, as a formula; empty where they are not chosen.
        late: By how much the refused words miss deadlines in all, s; infinite where that is not known.
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
    order: str = ""
    late: float = math.inf
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
    def pace(self) -> float | Literal["time", "nominal"] | None:
        """Its pace instead of the mission's: as fast as limits allow, one that was chosen, or the plan's own times; None for the mission's."""
        if any(cut.kind == "tracking" for cut in self.since("tracking", "visits")[-1:]):
            return "nominal"
        chosen = self.timed[-1:] or self.since("pace")[-1:]
        hurried = any(cut.kind == "pace" for cut in self.since("pace", "sharing")[-1:])
        return chosen[0].pace if chosen and chosen[0].pace is not None else "time" if hurried else None

    @property
    def timed(self) -> tuple[Cut, ...]:
        """Return the cuts after which the times of these words were chosen."""
        anew = max((index for index, cut in enumerate(self.cuts) if cut.anew), default=-1)
        return tuple(cut for cut in self.cuts[anew + 1 :] if cut.kind == "times")

    @property
    def pace_flown(self) -> float:
        """The share of the fastest flight at which its slowest robot flies; 1 at the plan's own times."""
        if self.pace is None:
            return greatest_pace(self.plan.mission)
        return 1.0 if isinstance(self.pace, str) else self.pace

    @property
    def others(self) -> int:
        """Number of times that other words were taken for the sake of room."""
        return len(self.since("legs", "aside", "capacity"))

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
    """Return what tells plans apart: words, visits, who flies at all, and who waits for whom."""
    does = {
        name: (str(robot.word), robot.still, [visit.model_dump() for visit in robot.visits])
        for name, robot in made.robots.items()
    }
    waits: list[Any] = [wait.model_dump() for wait in (*made.precedences, *made.meetings)]
    waits += [note for note in made.notes if STEPS_ASIDE in note]
    return hashlib.sha256(json.dumps([does, waits], sort_keys=True).encode()).hexdigest()
