"""Claims on others' flights: one of each kind for all drones where it holds, or one for each drone or pair that violates it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from verify.claims.claim import Claim, claim_of
from verify.logic.verdict import Outcome
from verify.third_party.audit_requirements import Asked
from verify.third_party.distances import Breach, Nearest, Separation
from verify.third_party.extremes import Extreme
from verify.third_party.fleet import Fleet
from verify.third_party.instants import TIGHTEST, Instant, all_of
from verify.third_party.joints import Joints, home_jumps, jumps

_NOTHING = 1e-12
"""Bounds below this are told as 0: what keeps them above it is rounding."""

POSITION_JUMP = 1e-3
"""m by which positions may jump between pieces; shows are written in millimetres."""


# five parameters: the claim's name and what it speaks of
def extreme_claims(
    fleet: Fleet, name: str, unit: str, found: Sequence[Extreme], what: str = ""
) -> tuple[list[Claim], list[Instant]]:
    """Word what one kind of extreme comes to: one claim where all drones keep the limit, else one for each that does not.

    Args:
        fleet: The drones.
        name: The claim's.
        unit: Of the limit.
        found: Extremes of this kind, at least one.
        what: What is limited; empty for places, of which it is told how near drones come to the limit.

    Returns:
        The claims, and the instants nearest to the limit.
    """
    least = not what
    what = what or {"workspace": "position"}.get(name, name)

    def room(extreme: Extreme) -> float:
        return abs(extreme.bound - extreme.limit) * (1 if extreme.outcome == "holds" else -1)

    order = sorted(found, key=room)
    figure = f"{order[0].bound:.5g}" if abs(order[0].bound) > _NOTHING else "0"
    claims = [_broken(fleet, name, unit, extreme, room(extreme)) for extreme in order if extreme.outcome != "holds"]
    if not claims:
        near, robot = order[0], fleet.names[order[0].drone]
        quantity = {"workspace": f"{room(near):.4g} m from the wall {near.what}", "limits": f"{figure} {unit}"}
        reached = quantity.get(name.split(".")[0], f"z = {figure} m")
        verb = "comes nearest to it" if least else "is nearest to it"
        sentence = f"{all_of(fleet)} keep the limit of {what} at all times; {robot} {verb}, with {reached} at {near.time:.3f} s"
        sentence += "." if name == "workspace" else f" (limit {near.limit:.5g} {unit})."
        claims = [
            claim_of(
                name,
                "holds",
                sentence,
                robot=robot,
                unit=unit,
                bound=near.bound,
                limit=near.limit,
                margin=room(near),
                time=near.time,
            )
        ]
    return claims, [Instant(fleet.names[e.drone], None, e.reached, e.limit, e.time) for e in order[:TIGHTEST]]


def _broken(fleet: Fleet, name: str, unit: str, extreme: Extreme, room: float) -> Claim:
    robot = fleet.names[extreme.drone]
    over = f"at {extreme.time:.4f} s; the limit is {extreme.limit:.6g} {unit}."
    if name == "workspace":
        sentence = f"{robot} passes the wall {extreme.what} at {extreme.limit:.6g} m: it is at {extreme.reached:.6g} m at {extreme.time:.4f} s."
    elif name == "height":
        sentence = (
            f"{robot} comes down to z = {extreme.reached:.6g} m at {extreme.time:.4f} s; {extreme.limit:.6g} m are asked."
        )
    elif name == "altitude":
        sentence = f"{robot} rises to z = {extreme.reached:.6g} m {over}"
    else:
        sentence = f"{robot}'s {extreme.what} reaches {extreme.reached:.6g} {unit} {over}"
    return claim_of(
        name, "fails", sentence, robot=robot, unit=unit, bound=extreme.bound, limit=extreme.limit, margin=room, time=extreme.time,
        what=extreme.what,
    )  # fmt: skip


def yaw_claims(fleet: Fleet, found: Sequence[Extreme]) -> tuple[list[Claim], list[Instant]]:
    """Word how fast drones turn whose file says it.

    Args:
        fleet: The drones.
        found: Of those that have headings, at least one.

    Returns:
        The claims, and the instants nearest to the limit.
    """
    claims, instants = extreme_claims(fleet, "limits.yaw_rate", "deg/s", found, "yaw rate")
    if len(found) == len(fleet):
        return claims, instants
    some = f"{len(found)} of {len(fleet)} drones, those whose file says how they turn,"
    return [replace(claim, sentence=claim.sentence.replace(all_of(fleet), some, 1)) for claim in claims], instants


def joint_claims(fleet: Fleet, steps: Joints, asked: Asked) -> Iterator[Claim]:
    """Yield what is claimed of joints: positions join, velocities too where acceleration is asked, and drones stand where the file says.

    Args:
        fleet: The drones.
        steps: How positions jump.
        asked: What is asked of them.
    """
    yield from _jump_claims(fleet, steps, "position", "m", POSITION_JUMP)
    if any(rate.order == 2 for rate in asked.rates):
        yield from _jump_claims(fleet, jumps(fleet, 1), "velocity", "m/s", asked.velocity_jump)
    for drone, what, end, gap in home_jumps(fleet):
        if gap > POSITION_JUMP:
            name, time = fleet.names[drone], float(fleet.end) if end else 0.0
            sentence = f"{name}: its {what} is {gap:.4g} m from where its path {'ends' if end else 'begins'}; {POSITION_JUMP:g} m are allowed."
            yield claim_of(
                "continuity", "fails", sentence, robot=name, unit="m", bound=gap, limit=POSITION_JUMP, margin=POSITION_JUMP - gap,
                time=time, what=what,
            )  # fmt: skip


def _jump_claims(fleet: Fleet, found: Joints, what: str, unit: str, limit: float) -> Iterator[Claim]:
    def of(drone: int, outcome: Outcome, sentence: str) -> Claim:
        size = float(found.jumps[drone])
        return claim_of(
            "continuity", outcome, sentence, robot=fleet.names[drone], unit=unit, bound=size, limit=limit, margin=limit - size,
            time=float(found.times[drone]), what=what,
        )  # fmt: skip

    most = int(np.argmax(found.jumps))
    if found.jumps[most] <= limit:
        allowed = f"more than {found.jumps[most]:.3g} {unit} between pieces; {limit:g} {unit} are allowed."
        yield of(most, "holds", f"{all_of(fleet)}: no {what} jumps by {allowed}")
        return
    for drone in np.flatnonzero(~(found.jumps <= limit)).tolist():
        when = f"by {found.jumps[drone]:.4g} {unit} at {found.times[drone]:.4f} s; {limit:g} {unit} are allowed."
        outcome = "fails" if found.sure[drone] > limit else "undecided"
        yield of(drone, outcome, f"{fleet.names[drone]}: its {what} jumps {when}")


def separation_claims(
    fleet: Fleet, pairs: Separation, nearest: Nearest, breaches: Sequence[Breach]
) -> tuple[list[Claim], list[Instant]]:
    """Word how near drones come to each other: one claim where all keep apart, else one for each pair that does not.

    Args:
        fleet: The drones.
        pairs: How far apart they must be.
        nearest: The pair that comes nearest.
        breaches: Pairs that are too near.

    Returns:
        The claims, and the instants nearest to the limit.
    """
    if breaches:
        instants = [Instant(fleet.names[b.one], fleet.names[b.other], b.distance, b.limit, b.time) for b in breaches[:TIGHTEST]]
        return [_breach(fleet, breach, pairs.above) for breach in breaches], instants
    where = "" if pairs.above is None else f" while both are above z = {pairs.above:g} m"
    if nearest.one < 0:
        sentence = f"{all_of(fleet)} stay {pairs.fewest:.4f} m apart at all times{where}; none comes near another there."
        return [claim_of("separation", "holds", sentence, unit="m", bound=pairs.fewest, limit=pairs.fewest, margin=0.0)], []
    one, other = fleet.names[nearest.one], fleet.names[nearest.other]
    limit = float(pairs.limits(np.array([nearest.one]), np.array([nearest.other]))[0])
    bound, asked = nearest.low, f"{limit:.4f} m are asked"
    if bound < limit:  # another pair's, of which less is asked
        asked, limit = f"{asked} of them, {pairs.fewest:.4f} m of others", pairs.fewest
    sentence = (
        f"{all_of(fleet)} stay {bound:.4f} m apart at all times{where}, in all {len(fleet) * (len(fleet) - 1) // 2} pairs; {one} and {other} are nearest, "
        f"with {nearest.high:.4f} m at {nearest.time:.3f} s ({asked})."
    )
    claim = claim_of(
        "separation",
        "holds",
        sentence,
        robot=one,
        other=other,
        unit="m",
        bound=bound,
        limit=limit,
        margin=bound - limit,
        time=nearest.time,
    )
    return [claim], [Instant(one, other, nearest.high, limit, nearest.time)]


def _breach(fleet: Fleet, breach: Breach, above: float | None) -> Claim:
    where = "" if above is None else f" above z = {above:g} m"
    one, other = fleet.names[breach.one], fleet.names[breach.other]
    sentence = (
        f"{one} and {other} are nearer than {breach.limit:.4f} m{where} from {breach.start:.4f} s to {breach.stop:.4f} s: "
        f"{breach.distance:.4f} m at {breach.time:.4f} s."
    )
    if not breach.sure:
        sentence = (
            f"{one} and {other} cannot be shown to keep {breach.limit:.4f} m{where}: they come within {breach.distance:.4f} m at {breach.time:.4f} s, "
            "not counting what their paths jump between pieces."
        )
    return claim_of(
        "separation", "fails" if breach.sure else "undecided", sentence, robot=one, other=other, unit="m", bound=breach.distance,
        limit=breach.limit, margin=breach.distance - breach.limit, time=breach.time,
    )  # fmt: skip
