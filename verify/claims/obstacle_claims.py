"""The claim that no vehicle meets an obstacle, wherever in the tube it is."""

from __future__ import annotations

import math
from collections.abc import Iterable
from fractions import Fraction

from verify.claims.claim import Claim, Outcome, at_least, claim_of
from verify.claims.evidence import Evidence
from verify.motion.obstacles.approaches import Approach
from verify.motion.obstacles.points import meets


def obstacle_claims(evidence: Evidence, margin: Fraction) -> Iterable[Claim]:
    """No obstacle is met by the vehicle's sphere: one claim for each robot where that holds, and one for each obstacle where not.

    Args:
        evidence: What is known of the team's paths; nothing is said where the mission has no obstacles.
        margin: delta, m, exact.
    """
    if not evidence.plan.mission.obstacles:
        return
    for index, robot in enumerate(evidence.paths.robots):
        limit = margin + Fraction(evidence.plan.mission.vehicle_of(robot).radius)
        found = evidence.approaches[robot]
        open_ = [one for one in found if not _is_beyond(one, limit)]
        known = {one.obstacle: one for one in open_ if one.high < float(limit)}
        if len(known) < len(open_):  # too near to call: look closer
            closer = evidence.solids.nearer_than(index, limit)
            open_ = [known.get(one.obstacle, one) for one in closer if not _is_beyond(one, limit)]
        if open_:
            yield from (_refused(evidence, one, limit) for one in open_)
        else:
            yield _kept(found[0], limit)


def _is_beyond(one: Approach, limit: Fraction) -> bool:
    """Return whether a robot is proved to stay farther away than a limit; NaN and infinities prove nothing."""
    return 0 < one.low < math.inf and Fraction(one.low) > limit


def _kept(nearest: Approach, limit: Fraction) -> Claim:
    low = max(nearest.low, float(limit))
    sentence = f"{nearest.robot} stays {at_least(low)} m from obstacle '{nearest.obstacle}' and from every other."
    return claim_of(
        "obstacles", "holds", sentence, robot=nearest.robot, unit="m", bound=low, limit=float(limit),
        margin=low - float(limit), time=float(nearest.time), region=nearest.obstacle,
    )  # fmt: skip


def _refused(evidence: Evidence, one: Approach, limit: Fraction) -> Claim:
    """Word an obstacle that a robot comes too near to, or may."""
    part = evidence.solids.parts[one.part]
    verdict: Outcome = "fails" if meets(evidence.paths, part, one.segment, one.place, limit) else "undecided"
    time, radius = float(one.time), evidence.plan.mission.vehicle_of(one.robot).radius
    need = f"radius {radius:g} m and margin {float(limit) - radius:g} m need {float(limit):.4f} m"
    if verdict == "undecided":
        sentence = f"{one.robot} cannot be shown to stay clear of obstacle '{one.obstacle}' near {time:.4f} s; {need}."
    elif one.high <= 0:
        sentence = f"{one.robot} is {-one.high:.4f} m inside obstacle '{one.obstacle}' at {time:.4f} s; {need} outside."
    else:
        sentence = f"{one.robot} comes within {one.high:.4f} m of obstacle '{one.obstacle}' at {time:.4f} s; {need}."
    bound = one.high if verdict == "fails" else min(one.low, float(limit))
    return claim_of(
        "obstacles", verdict, sentence, robot=one.robot, unit="m", bound=bound, limit=float(limit),
        margin=bound - float(limit), time=time, region=one.obstacle, what="distance from what is solid", way=one.way,
    )  # fmt: skip
