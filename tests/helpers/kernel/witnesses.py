"""What a refusal must say: the right claim, robot, region, visit, time and amount; held against every witness of a certificate.

For the tests that break flights in every way (`test_refused_*.py` in `tests/verify/motion` and `behaviour`): each names the witness that it wants as a
`Right`, and `assert_refused` fails unless the certificate has it. Times and amounts are computed there from the broken path itself, read
by `Trajectory.evaluate`, which the judge never calls.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from tests.helpers.motion.flights import firefighting
from verify import judge
from verify.certificate import Certificate
from verify.claims.claim import Claim
from verify.data.plan import Plan
from verify.data.trajectory import Trajectory

PLAN, TEAM = firefighting()
"""The fire-fighting mission flown by hand, which is certified."""

ANY: Any = object()


@dataclass(frozen=True)
class Right:
    """What the right witness says; `ANY` where the break leaves it open.

    Attributes:
        claim: Name of the refused claim.
        robot: Whose.
        region: Region or hoop.
        visit: Index of the planned visit.
        time: (from, to) in s, or None for "no time".
        off: (least, most) by which the bound passes the limit, in the limit's unit.
        other: The second robot.
        what: Part of what the bound is of.
        says: Part of the sentence.
    """

    claim: str
    robot: str | None = ANY
    region: str | None = ANY
    visit: int | None = ANY
    time: tuple[float, float] | None = ANY
    off: tuple[float, float] = ANY
    other: str | None = ANY
    what: str = ""
    says: str = ""


def refused(certificate: Certificate) -> list[Claim]:
    """Return the claims that do not hold, each of which must carry a witness that tells the same as the claim."""
    found = [claim for claim in certificate.claims if claim.outcome != "holds"]
    for claim in found:
        assert claim.witness is not None
        same = ("sentence", "robot", "other", "time", "bound", "limit")
        assert claim.witness.claim == claim.name
        if claim.name not in ("formula", "transitions"):
            assert all(getattr(claim, key) == getattr(claim.witness, key) for key in same)
    assert not certificate.holds
    return found


def assert_refused(certificate: Certificate, *wanted: Right) -> list[Claim]:
    """Fail unless each wanted witness is there; return the claims that they belong to."""
    found = refused(certificate)
    return [_matching(found, right) for right in wanted]


def _matching(found: list[Claim], right: Right) -> Claim:
    named = [c for c in found if c.name == right.claim and right.robot in (ANY, c.robot) and right.other in (ANY, c.other)]
    assert named, f"{right.claim} of {right.robot} is not refused; refused: {[(c.name, c.robot) for c in found]}"
    faults = [_faults(claim, right) for claim in named]
    assert [] in faults, faults
    return named[faults.index([])]


def _faults(claim: Claim, right: Right) -> list[str]:
    witness = claim.witness
    assert witness is not None
    faults = [
        f"{key}: {getattr(witness, key)} instead of {getattr(right, key)}"
        for key in ("region", "visit")
        if getattr(right, key) is not ANY and getattr(witness, key) != getattr(right, key)
    ]
    if right.time is None and witness.time is not None:
        faults.append(f"time: {witness.time} instead of none")
    if isinstance(right.time, tuple) and not (witness.time is not None and right.time[0] <= witness.time <= right.time[1]):
        faults.append(f"time: {witness.time} instead of {right.time}")
    if right.off is not ANY:
        assert witness.bound is not None
        assert witness.limit is not None
        off = abs(witness.bound - witness.limit)
        if not right.off[0] <= off <= right.off[1]:
            faults.append(f"off by {off} instead of {right.off}")
    if right.what not in witness.what:
        faults.append(f"what: {witness.what}")
    if right.says not in witness.sentence:
        faults.append(f"sentence: {witness.sentence}")
    return faults


def judged(plan: Plan, team: Mapping[str, Trajectory], **options: Any) -> Certificate:
    """Judge without looking for the largest margin."""
    return judge(plan, team, largest=False, **options)


def around(time: float, within: float = 1e-3) -> tuple[float, float]:
    """Return a window."""
    return time - within, time + within
