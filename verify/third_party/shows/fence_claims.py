"""Claims on a geofence: one for each polygon that all drones satisfy, one for each drone that violates it."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from verify.claims.claim import Claim, claim_of
from verify.third_party.fleet import Fleet
from verify.third_party.instants import TIGHTEST, Instant, all_of
from verify.third_party.shows.fences import Outside, judge_fence
from verify.third_party.shows.own_limits import Fence


def fence_claims(fleet: Fleet, fences: Sequence[Fence], margin: Fraction) -> tuple[list[Claim], list[Instant]]:
    """Check every polygon of a geofence.

    Args:
        fleet: The drones.
        fences: The polygons; all must be kept.
        margin: How far drones may be from their paths, in m.
    """
    claims: list[Claim] = []
    instants: list[Instant] = []
    for fence in fences:
        kept, broken = judge_fence(fleet, fence, margin)
        where = f"{'inside' if fence.inside else 'outside'} {fence.name} of the geofence"
        for found in broken:
            claims.append(_broken(fleet, fence, found, where, float(margin)))
            instants.append(Instant(fleet.names[found.drone], None, -found.depth, float(margin), found.time))
        if broken:
            continue
        near, bound = fleet.names[kept.drone], max(kept.low, 0.0)
        reached = f"{near} comes nearest to its border, with {kept.high:.4g} m at {kept.time:.3f} s"
        claims.append(
            claim_of(
                "geofence", "holds", f"{all_of(fleet)} stay {where} at all times; {reached}.", robot=near, unit="m", bound=bound,
                limit=float(margin), margin=bound - float(margin), time=kept.time,
            )
        )  # fmt: skip
        instants.append(Instant(near, None, kept.high, float(margin), kept.time))
    return claims, sorted(instants, key=lambda i: i.value)[:TIGHTEST]


def _broken(fleet: Fleet, fence: Fence, found: Outside, where: str, margin: float) -> Claim:
    robot = fleet.names[found.drone]
    if found.outcome != "holds" and found.depth > 0:
        sentence = f"{robot} does not stay {where}: it is {found.depth:.4g} m beyond its border at {found.time:.4f} s."
    else:
        sentence = f"{robot} cannot be shown to stay {where}: it is {-found.depth:.4g} m from its border at {found.time:.4f} s."
    if margin:
        sentence = sentence[:-1] + f" ({margin:g} m are asked)."
    return claim_of(
        "geofence", found.outcome, sentence, robot=robot, unit="m", bound=-found.depth, limit=margin, margin=-found.depth - margin,
        time=found.time, what=fence.name,
    )  # fmt: skip
