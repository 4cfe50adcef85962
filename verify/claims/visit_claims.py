"""Claims about a plan's visits: each is made, in order, with its actions and its passage through an opening, and no other."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from fractions import Fraction

from verify.claims.claim import Claim, at_least, claim_of
from verify.claims.evidence import Evidence
from verify.data.language.sequence import Passage, Sequence
from verify.motion.membership.bodies import Span
from verify.motion.passages import Crossing
from verify.motion.visits import ActionFault, Matching, Stay


def visit_claim(robot: str, matching: Matching, actions: ActionFault | None) -> Claim:
    """Claim that the k-th planned visit is the k-th stay, and its actions are permitted there.

    Args:
        robot: Name.
        matching: The robot's planned visits and their stays, or why they do not match.
        actions: Why one of its actions cannot be placed; None where all can.
    """
    if matching.fault:
        fault, visit, region, time = matching.fault, matching.visit, matching.region, matching.time
    elif actions is not None:
        fault, visit, region, time = actions.sentence, actions.visit, actions.region, actions.time
    else:
        count = len(matching.stays)
        return claim_of("visits", "holds", f"{robot} makes its {count} planned visits, in order, and no other.", robot=robot)
    when = None if time is None else float(time)
    at = "" if when is None else f" (from {when:.4f} s)"
    return claim_of("visits", "fails", f"{robot}: {fault}{at}.", robot=robot, time=when, region=region, visit=visit)


def passage_claim(
    evidence: Evidence,
    robot: str,
    matching: Matching,
    spans: Mapping[str, tuple[Span, ...]],
    found: tuple[Crossing, ...],
    margin: Fraction,
) -> Claim:
    """Claim that the robot passes exactly the planned openings, in order, each within its visit.

    Args:
        evidence: What is known of the team's paths.
        robot: Name.
        matching: The robot's planned visits and their stays.
        spans: For each region, when the path is in it for sure, perhaps or not.
        found: When the robot may be near an opening, in order of time.
        margin: delta, m, exact.
    """
    plan = evidence.plan.robots[robot]
    wanted = [(i, Passage(v.region, v.direction)) for i, v in enumerate(plan.visits) if v.direction is not None]
    cycle = evidence.paths.trajectories[evidence.paths.robots.index(robot)].cycle
    knot = None if cycle is None else evidence.paths.knots[evidence.paths.robots.index(robot)][cycle]

    limit = float(margin + Fraction(evidence.plan.mission.vehicle_of(robot).radius))

    def refused(sentence: str, crossing: Crossing | None = None, visit: int | None = None, region: str | None = None) -> Claim:
        if crossing is None:
            stay = None if visit is None or visit >= len(matching.stays) else matching.stays[visit]
            time = None if stay is None else float((stay.start + stay.stop) / 2)
            at = "" if time is None else f" (its visit is around {time:.4f} s)"
            return claim_of(
                "passages", "fails", f"{robot}: {sentence}{at}.", robot=robot, time=time, region=region, visit=visit
            )
        time, room = float((crossing.start + crossing.stop) / 2), _inside_rim(evidence, crossing)
        visit = next((i for i, stay in enumerate(matching.stays) if _holds(stay, crossing)), visit)
        near = crossing.way is not None and bool(crossing.reason)
        return claim_of(
            "passages", "fails", f"{robot}: {sentence} at {time:.4f} s.", robot=robot, time=time, region=crossing.hoop,
            visit=visit, unit="m" if near else "", bound=room if near else None, limit=limit if near else None,
            margin=room - limit if near else None, what="distance inside the rim" if near else "",
        )  # fmt: skip

    lap = plan.cycle_visit if matching.lap is None else matching.lap
    tightest: tuple[float, Crossing] | None = None
    for position, crossing in enumerate(found):
        if crossing.way is None:
            return refused(f"hoop '{crossing.hoop}': {crossing.reason}", crossing, _visit_of(wanted, position))
        if position >= len(wanted):
            return refused(f"the path passes '{crossing.hoop}' ({crossing.way}), which is not planned", crossing)
        visit, passage = wanted[position]
        if (crossing.hoop, crossing.way) != (passage.hoop, passage.direction):
            return refused(f"passage {position} is {crossing.hoop}{crossing.way}, planned is {passage}", crossing, visit)
        if crossing.reason:
            return refused(f"hoop '{crossing.hoop}': {crossing.reason}", crossing, visit)
        if position and found[position - 1].stop >= crossing.start:
            return refused(f"passages {position - 1} and {position} cannot be told apart in time", crossing, visit)
        must = matching.stays[visit].must if visit < len(matching.stays) else _must(spans[crossing.hoop])
        if not any(start <= crossing.start and crossing.stop <= stop for start, stop in must):
            return refused(f"the visit of '{crossing.hoop}' may not contain its passage", crossing, visit)
        if knot is not None:
            in_lap = lap is not None and visit >= lap
            if not (crossing.start > knot if in_lap else crossing.stop < knot):
                return refused(f"passage {position} is on the wrong side of the start of the cycle", crossing, visit)
        room = _inside_rim(evidence, crossing)
        tightest = (room, crossing) if tightest is None or room < tightest[0] else tightest
    if len(found) < len(wanted):
        visit, passage = wanted[len(found)]
        return refused(f"the planned passage {passage} does not happen", None, visit, passage.hoop)
    flown, sequence = _flown(found, knot), evidence.plan.mission.passages
    if sequence is not None and not flown.same_passages(sequence):
        return refused(f"the passages flown are {_shown(flown)}, not the mission's sequence `{sequence}`")
    if tightest is None:
        return claim_of("passages", "holds", f"{robot} passes no opening, as planned.", robot=robot)
    room, crossing = tightest
    return claim_of(
        "passages", "holds", f"{robot} passes exactly its planned openings: {flown}; at least {at_least(room)} m inside the rims.",
        robot=robot, unit="m", bound=room, limit=limit, margin=room - limit,
        time=float((crossing.start + crossing.stop) / 2), region=crossing.hoop,
    )  # fmt: skip


def _flown(found: tuple[Crossing, ...], knot: Fraction | None) -> Sequence:
    """Return the passages of a flight, those of the lap as a cycle."""
    passages = [(crossing.start, Passage(crossing.hoop, crossing.way)) for crossing in found if crossing.way is not None]
    if knot is None:
        return Sequence(tuple(passage for _, passage in passages))
    prefix, cycle = ([p for start, p in passages if (start > knot) == later] for later in (False, True))
    return Sequence(tuple(prefix), tuple(cycle) or None)


def _shown(flown: Sequence) -> str:
    return f"`{flown}`" + ("" if flown.cycle else " and no more") if str(flown) else "none"


def _must(row: tuple[Span, ...]) -> tuple[tuple[Fraction, Fraction], ...]:
    return tuple((span.start, span.stop) for span in row if span.mark == "must")


def _holds(stay: Stay, crossing: Crossing) -> bool:
    return stay.region == crossing.hoop and stay.start <= crossing.stop and crossing.start <= stay.stop


def _inside_rim(evidence: Evidence, crossing: Crossing) -> float:
    """Return a lower bound on how far inside the opening's edge a path stays, in m."""
    return math.nextafter(evidence.plan.mission.hoops[crossing.hoop].opening - crossing.off_axis, -math.inf)


def _visit_of(wanted: list[tuple[int, Passage]], position: int) -> int | None:
    return wanted[position][0] if position < len(wanted) else None


def closed_region_claims(evidence: Evidence, robot: str, spans: Mapping[str, tuple[Span, ...]]) -> Iterator[Claim]:
    """Yield a refusal for each region that a robot may enter though it is closed to its kind; nothing where there is none.

    Args:
        evidence: What is known of the team's paths.
        robot: Name.
        spans: Where the robot is, in each region.
    """
    mission = evidence.plan.mission
    for region, row in spans.items():
        if not mission.may_enter(robot, region) and (inside := [span for span in row if span.mark != "no"]):
            only = " and ".join(mission.all_regions[region].only or ())
            sentence = f"{robot} can enter {region}, which is open to {only} only."
            yield Claim("transitions", "fails", sentence, robot=robot, time=float(inside[0].start))
