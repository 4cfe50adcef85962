"""The claim that no vehicle meets an obstacle."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction

from verify.claims.claim import Claim, claim_of
from verify.claims.evidence import Evidence


def obstacle_claims(evidence: Evidence, margin: Fraction) -> Iterable[Claim]:  # noqa: ARG001  # until it is judged
    """No obstacle is met by the vehicle's sphere; nothing is said where there are none."""
    if evidence.plan.mission.obstacles:
        for robot in evidence.paths.robots:
            sentence = f"{robot} cannot be shown to stay clear of obstacles: this version does not judge them yet."
            yield claim_of("obstacles", "undecided", sentence, robot=robot)
