"""What a plan becomes on its way to a certificate: a draft, a team that was refused, a team that is certified."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from verify.data import Mission, Plan, Trajectory, Witness

if TYPE_CHECKING:
    from ltlplan.allocation import Leg
    from verify import Certificate, Claim

MAX_ROUNDS = 6
"""How often refinement may try to mend what the checker refused."""


@dataclass(frozen=True)
class Draft:
    """A plan that is not certified yet, with what the judge refused of it so far.

    Attributes:
        plan: With the precedences that the refusals asked for.
        rounds: How many times refinement ran.
        witnesses: Of all claims that were refused, in all rounds.
        certified: What is certified already, while refinement tries to keep more of the planned soft parts.
        begun: Rounds that were spent on plans that keep more soft parts, and that no flight kept.
        fewer: Missions with fewer soft parts, to be planned next where this plan is not certified; None before that was asked.
        reworded: How many other ways to keep the soft parts were tried, of those in `mending`.
        others: How many times other words were tried that do without legs.
        shut: The legs that these do without.
        rooms: How many robots regions hold, where refinement found no places for more: (region, robots).
        tried: What the plans before did that no flight kept, as digests.
        given_up: Why the first plan was given up for other words; None before that.
        hurried: Whether it is flown as fast as limits allow, for flights at the plan's own times outlast a vehicle's endurance.
    """

    plan: Plan
    rounds: int = 0
    witnesses: tuple[Witness, ...] = ()
    certified: Certified | None = None
    begun: int = 0
    fewer: tuple[Mission, ...] | None = None
    reworded: int = 0
    others: int = 0
    shut: frozenset[Leg] = frozenset()
    rooms: tuple[tuple[str, int], ...] = ()
    tried: tuple[str, ...] = ()
    given_up: str | None = None
    hurried: bool = False

    @property
    def last_round(self) -> int:
        """After how many rounds this plan is given up: a handful, two where it is one of several that are tried."""
        several = bool(self.fewer) or (self.others > 0 and self.certified is None)
        return self.begun + (2 if several else MAX_ROUNDS)


@dataclass(frozen=True)
class Refused:
    """A team that was refined and not certified.

    Attributes:
        draft: What was refined.
        team: One trajectory a robot.
        certificate: What the judge said of them.
        instead: What may keep more of the soft parts, where only these are missed.
    """

    draft: Draft
    team: dict[str, Trajectory]
    certificate: Certificate
    instead: Draft | None = None

    @property
    def rounds(self) -> int:
        """How many times refinement ran."""
        return self.draft.rounds + 1

    @property
    def claims(self) -> tuple[Claim, ...]:
        """The claims that were refused."""
        return tuple(claim for claim in self.certificate.claims if claim.outcome != "holds")


@dataclass(frozen=True)
class Certified:
    """A team that is certified.

    Attributes:
        plan: With the precedences that the proof asked for.
        team: One trajectory a robot.
        certificate: The proof.
        rounds: How many times refinement ran.
    """

    plan: Plan
    team: dict[str, Trajectory]
    certificate: Certificate
    rounds: int
