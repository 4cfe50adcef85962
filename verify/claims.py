"""All claims of a certificate about paths: each a sentence, its exact bound, and where it is tight or broken.

`Evidence` holds what does not depend on the margin, computed once; the functions here hold it against a margin.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Literal

from verify.behaviour.timeline import Relations
from verify.data.language.sequence import Passage, Sequence
from verify.data.plan import Plan
from verify.data.trajectory import Trajectory
from verify.data.witness import Witness
from verify.motion import limits as limit_module
from verify.motion.continuity import Jump, jumps
from verify.motion.leg_windows import ways
from verify.motion.limits import Extreme, extremes, leg_extremes
from verify.motion.membership import MembershipPolynomials, Span, membership_polynomials, statuses
from verify.motion.passages import Clearance, Crossing, HoopFrames, clearances, hoop_frames
from verify.motion.paths import TeamPaths, read_team
from verify.motion.regions import relations
from verify.motion.separation import (
    MinimumDistance,
    PairwiseDistances,
    distance_exactly,
    minimum_distances,
    pairwise_distances,
    stretch_of,
    wall_exactly,
    walls,
)
from verify.motion.visits import ActionFault, Matching, Stay

Outcome = Literal["holds", "fails", "undecided"]


@dataclass(frozen=True, slots=True)
class Claim:
    """One part of a certificate.

    Attributes:
        name: "formula", "transitions", "visits", "passages", "rims", "workspace", "separation", "continuity" or
            "limits." and the limit's name.
        outcome: Only "holds" is proved; "fails" is refuted; "undecided" is neither.
        sentence: One sentence for a person.
        robot: The robot concerned; None for the team.
        other: The second robot, for claims about pairs.
        unit: Unit of bound, limit and margin.
        bound: What is proved for all times, rounded to the strict side.
        limit: What is asked.
        margin: How far the bound is from the limit; negative where the claim fails.
        time: Where it is tight or broken, in s.
        witness: For a claim that does not hold, what repair and reports work with.
    """

    name: str
    outcome: Outcome
    sentence: str
    robot: str | None = None
    other: str | None = None
    unit: str = ""
    bound: float | None = None
    limit: float | None = None
    margin: float | None = None
    time: float | None = None
    witness: Witness | None = None


@dataclass(frozen=True, eq=False)
class Evidence:
    """What is known of a team's paths at every margin; computed on first use.

    Attributes:
        plan: What was planned; carries the mission.
        paths: What is flown.
    """

    plan: Plan
    paths: TeamPaths

    @classmethod
    def of(cls, plan: Plan, team: Mapping[str, Trajectory]) -> Evidence:
        """Read a team's trajectories."""
        return cls(plan, read_team(plan.mission, team))

    @cached_property
    def membership(self) -> MembershipPolynomials:
        """Membership polynomials."""
        return membership_polynomials(self.paths)

    @cached_property
    def nominal(self) -> dict[str, dict[str, tuple[Span, ...]]]:
        """Spans of the nominal paths themselves, for each robot and region."""
        return statuses(self.membership, Fraction(0))

    @cached_property
    def relations(self) -> Relations:
        """What is proved of the regions."""
        return relations(self.plan.mission)

    @cached_property
    def frames(self) -> HoopFrames:
        """Paths as seen from the hoops."""
        return hoop_frames(self.paths)

    @cached_property
    def rims(self) -> list[Clearance]:
        """Nearest approach to each rim."""
        return clearances(self.frames)

    @cached_property
    def walls(self) -> list[MinimumDistance]:
        """Nearest approach to the walls."""
        return walls(self.paths)

    @cached_property
    def pairwise_distances(self) -> PairwiseDistances:
        """Squared distances of all pairs."""
        return pairwise_distances(self.paths)

    @cached_property
    def minimum_distances(self) -> list[MinimumDistance]:
        """Nearest approach of each pair."""
        return minimum_distances(self.pairwise_distances)

    @cached_property
    def extremes(self) -> list[Extreme]:
        """Extremes of all limited quantities."""
        return extremes(self.paths)

    @cached_property
    def jumps(self) -> list[Jump]:
        """Greatest jump of each robot."""
        return jumps(self.paths)


def limit_claims(evidence: Evidence) -> Iterable[Claim]:
    """Speed, acceleration, thrusts, tilt and rates of the nominal flight."""
    for extreme in evidence.extremes:
        yield _limit_claim(extreme)


def leg_claims(evidence: Evidence, matchings: Mapping[str, Matching]) -> Iterable[Claim]:
    """Limits that hold on the way to one region, at all times at which a robot may be on its way there."""
    legs = evidence.plan.mission.limits.legs
    for index, (robot, plan) in enumerate(evidence.plan.robots.items()):
        matching, cycle = matchings[robot], evidence.paths.trajectories[index].cycle
        knot = None if cycle is None else evidence.paths.knots[index][cycle]
        for visit, region in enumerate(visit.region for visit in plan.visits):
            if region not in legs:
                continue
            if visit >= len(matching.stays):
                sentence = f"{robot}: the leg to visit {visit} of '{region}' cannot be told, so its limits are not proved."
                yield _claim("limits.legs", "undecided", sentence, robot=robot, region=region, visit=visit)
                continue
            windows = ways(matching, visit, evidence.nominal[robot][region], knot)
            if not windows:
                sentence = f"{robot} is in '{region}' from its start on and not on the way there before it has left for good."
                yield _claim("limits.legs", "holds", sentence, robot=robot, region=region, visit=visit)
            for extreme in leg_extremes(evidence.paths, index, windows, legs[region]) if windows else ():
                yield _limit_claim(extreme, region, visit)
    visited = {visit.region for plan in evidence.plan.robots.values() for visit in plan.visits}
    sure = all(not matching.fault for matching in matchings.values())
    for region in legs:
        if region not in visited:
            sentence = f"No robot goes to '{region}', so the limits on the way there bind none."
            yield _claim("limits.legs", "holds" if sure else "undecided", sentence, region=region)


def braking_claims(evidence: Evidence, towards: Mapping[str, tuple[Fraction, *tuple[str, ...]]]) -> Iterable[Claim]:
    """Limits of legs that are not flown to their ends: from when a robot slows down, on its way to regions, until it rests.

    Args:
        evidence: Of trajectories that end at rest.
        towards: For each robot that slows down: when it begins to, exact, in s, and the regions that it was on its way to.
    """
    legs = evidence.plan.mission.limits.legs
    for robot, (begin, *regions) in towards.items():
        index = evidence.paths.robots.index(robot)
        for region in regions:
            if region in legs:
                for extreme in leg_extremes(evidence.paths, index, [(begin, evidence.paths.end)], legs[region]):
                    yield _limit_claim(extreme, region)


def _limit_claim(extreme: Extreme, region: str | None = None, visit: int | None = None) -> Claim:
    """Word one limit; a region makes it the limit of the leg there."""
    least = extreme.name.endswith("_min")
    unit = limit_module.UNITS[extreme.name]
    quantity = extreme.name.replace("_", " ").removesuffix(" min").removesuffix(" max")
    quantity += "" if region is None else f" on the way to '{region}'"
    verdict: Outcome = "holds" if extreme.holds else "fails" if extreme.fails else "undecided"
    time = float(extreme.time)
    if extreme.holds:
        word = "at least" if least else "at most"
        sentence = f"{extreme.robot}'s {quantity} is {word} {extreme.bound:.5g} {unit} (limit {extreme.limit:.5g})."
    elif extreme.fails:
        word = "falls to" if least else "reaches"
        sentence = (
            f"{extreme.robot}'s {quantity} {word} {_beyond(extreme)} {unit} at {time:.4f} s; "
            f"the limit is {extreme.limit:.5g} {unit}."
        )
    else:
        sentence = f"{extreme.robot}'s {quantity} near {time:.4f} s cannot be told from its limit {extreme.limit:.5g} {unit}."
    name = f"limits.{extreme.name}" if region is None else f"limits.legs.{extreme.name}"
    return _claim(
        name, verdict, sentence, robot=extreme.robot, unit=unit, bound=extreme.bound,
        limit=extreme.limit, margin=extreme.bound - extreme.limit if least else extreme.limit - extreme.bound, time=time,
        region=region, visit=visit,
    )  # fmt: skip


def continuity_claims(evidence: Evidence) -> Iterable[Claim]:
    """Jumps between pieces, at the start and at the end."""
    for jump in evidence.jumps:
        verdict: Outcome = "holds" if jump.share <= 1 else "fails" if jump.sure > 1 else "undecided"
        sentence = f"{jump.robot}: the {jump.what} jumps by at most {jump.size:.3g}; {jump.allowed:g} is allowed."
        yield _claim(
            "continuity", verdict, sentence, robot=jump.robot, bound=jump.size, limit=jump.allowed,
            margin=jump.allowed - jump.size, time=float(jump.time), what=jump.what,
        )  # fmt: skip


def workspace_claims(evidence: Evidence, margin: Fraction) -> Iterable[Claim]:
    """The whole tube lies in the workspace."""
    for robot, near in enumerate(evidence.walls):
        verdict = _at_least(near.low, near.high, margin, lambda robot=robot: wall_exactly(evidence.paths, robot, margin))
        time = float(near.time)
        stays = "stays" if verdict == "holds" else "comes within"
        sentence = (
            f"{near.robot} {stays} {max(near.low, 0.0) if verdict == 'holds' else near.high:.4f} m from the wall {near.other}"
        )
        sentence += "." if verdict == "holds" else f" at {time:.4f} s; the margin is {float(margin):g} m."
        bound = _proved(near.low, margin, verdict)
        yield _claim(
            "workspace", verdict, sentence, robot=near.robot, unit="m", time=time, what=f"wall {near.other}",
            bound=bound, limit=float(margin), margin=bound - float(margin),
        )  # fmt: skip


def separation_limit(evidence: Evidence, margin: Fraction) -> Fraction:
    """Return how far apart nominal paths must be, in m."""
    return Fraction(evidence.plan.mission.separation) + 2 * margin * stretch_of(evidence.paths)


def separation_claims(evidence: Evidence, margin: Fraction, drifts: Mapping[str, Fraction]) -> Iterable[Claim]:
    """Robots keep their separation in the tube, whatever their clocks' errors make them drift.

    Args:
        evidence: What is known of the team's paths.
        margin: delta, m, exact.
        drifts: For each robot, how far at most its clock's error moves it, m, exact.
    """
    stretch = stretch_of(evidence.paths)
    for pair, near in enumerate(evidence.minimum_distances):
        in_tube = separation_limit(evidence, margin)
        limit = in_tube + stretch * min(drifts[near.robot], drifts[near.other])
        steps = [evidence.pairwise_distances.jumps[i] for i in evidence.pairwise_distances.pairs[pair]]

        def exactly(pair: int = pair, limit: Fraction = limit, steps: list[float] = steps) -> bool:
            if not all(map(math.isfinite, steps)):
                return False
            return distance_exactly(evidence.pairwise_distances, pair, limit + stretch * sum(map(Fraction, steps)))

        verdict = _at_least(near.low, near.high, limit, exactly)
        if verdict == "fails" and not near.high < float(in_tube) and (limit > in_tube or any(steps)):
            verdict = "undecided"  # what drift and steps can do is bounded from above only
        time = float(near.time)
        asked = (
            f"{float(limit):.4f} m are asked (separation {evidence.plan.mission.separation:g} m, margin {float(margin):g} m)"
        )
        if verdict == "holds":
            sentence = f"{near.robot} and {near.other} stay {near.low:.4f} m apart; {asked}."
        elif verdict == "undecided":
            sentence = (
                f"{near.robot} and {near.other} cannot be shown to keep apart: they come within {near.high:.4f} m at {time:.4f} s, "
                f"not counting what their paths jump between pieces (up to {sum(steps):.4g} m); {asked}."
            )
        else:
            sentence = f"{near.robot} and {near.other} come within {near.high:.4f} m at {time:.4f} s; {asked}."
        bound = _proved(near.low, limit, verdict)
        yield _claim(
            "separation", verdict, sentence, robot=near.robot, other=near.other, unit="m", time=time,
            bound=bound, limit=float(limit), margin=bound - float(limit),
        )  # fmt: skip


def rim_claims(evidence: Evidence, margin: Fraction) -> Iterable[Claim]:
    """No rim is met by the vehicle's sphere."""
    if not evidence.rims:
        return
    limit = margin + Fraction(evidence.plan.mission.vehicle.radius)
    for robot in evidence.paths.robots:
        near = min((c for c in evidence.rims if c.robot == robot), key=lambda c: c.low)
        clear = math.isfinite(near.low) and Fraction(near.low) > limit
        if not clear and math.isfinite(near.high) and limit < Fraction(near.high):  # too near to call: look closer
            near = min((c for c in clearances(evidence.frames, 1e-9) if c.robot == robot), key=lambda c: c.low)
        verdict: Outcome = "undecided"
        if math.isfinite(near.low) and Fraction(near.low) > limit:
            verdict = "holds"
        elif math.isfinite(near.high) and Fraction(near.high) <= limit:
            verdict = "fails"
        time = float(near.time)
        if verdict == "holds":
            sentence = f"{robot} stays {near.low:.4f} m from the rim of '{near.hoop}' and of every other hoop."
        else:
            sentence = (
                f"{robot} comes within {near.high:.4f} m of the rim of '{near.hoop}' at {time:.4f} s; "
                f"radius and margin need {float(limit):.4f} m."
            )
        yield _claim(
            "rims", verdict, sentence, robot=robot, unit="m", bound=near.low, limit=float(limit),
            margin=near.low - float(limit), time=time, region=near.hoop,
        )  # fmt: skip


def visit_claim(robot: str, matching: Matching, actions: ActionFault | None) -> Claim:
    """The k-th planned visit is the k-th stay, and its actions are permitted there.

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
        return _claim("visits", "holds", f"{robot} makes its {count} planned visits, in order, and no other.", robot=robot)
    when = None if time is None else float(time)
    at = "" if when is None else f" (from {when:.4f} s)"
    return _claim("visits", "fails", f"{robot}: {fault}{at}.", robot=robot, time=when, region=region, visit=visit)


def passage_claim(
    evidence: Evidence,
    robot: str,
    matching: Matching,
    spans: Mapping[str, tuple[Span, ...]],
    found: tuple[Crossing, ...],
    margin: Fraction,
) -> Claim:
    """The robot passes exactly the planned openings, in order, each within its visit.

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

    limit = float(margin + Fraction(evidence.plan.mission.vehicle.radius))

    def refused(sentence: str, crossing: Crossing | None = None, visit: int | None = None, region: str | None = None) -> Claim:
        if crossing is None:
            stay = None if visit is None or visit >= len(matching.stays) else matching.stays[visit]
            time = None if stay is None else float((stay.start + stay.stop) / 2)
            at = "" if time is None else f" (its visit is around {time:.4f} s)"
            return _claim("passages", "fails", f"{robot}: {sentence}{at}.", robot=robot, time=time, region=region, visit=visit)
        time, room = float((crossing.start + crossing.stop) / 2), _inside_rim(evidence, crossing)
        visit = next((i for i, stay in enumerate(matching.stays) if _holds(stay, crossing)), visit)
        near = crossing.way is not None and bool(crossing.reason)
        return _claim(
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
        return _claim("passages", "holds", f"{robot} passes no opening, as planned.", robot=robot)
    room, crossing = tightest
    return _claim(
        "passages", "holds", f"{robot} passes exactly its planned openings: {flown}; at least {room:.4f} m inside the rims.",
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


def _proved(low: float, limit: Fraction, verdict: Outcome) -> float:
    """Return the proved lower bound: what was decided without rounding is at least the limit."""
    return max(low, float(limit)) if verdict == "holds" else low


def _at_least(low: float, high: float, limit: Fraction, exactly: Callable[[], bool]) -> Outcome:
    if math.isfinite(low) and Fraction(low) >= limit:
        return "holds"
    if math.isfinite(high) and Fraction(high) < limit:
        return "fails"
    return "holds" if exactly() else "fails"


def _beyond(extreme: Extreme) -> str:
    """Write a broken limit's value with enough digits to differ from the limit."""
    for digits in range(5, 17):
        text = f"{extreme.reached:.{digits}g}"
        if text != f"{extreme.limit:.{digits}g}":
            return text
    return repr(extreme.reached)


def _claim(
    name: str,
    verdict: Outcome,
    sentence: str,
    *,
    robot: str | None = None,
    other: str | None = None,
    unit: str = "",
    bound: float | None = None,
    limit: float | None = None,
    margin: float | None = None,
    time: float | None = None,
    region: str | None = None,
    visit: int | None = None,
    what: str = "",
) -> Claim:
    witness = None
    if verdict != "holds":
        witness = Witness(
            claim=name, sentence=sentence, robot=robot, other=other, time=time, region=region, visit=visit,
            bound=bound, limit=limit, what=what,
        )  # fmt: skip
    return Claim(name, verdict, sentence, robot, other, unit, bound, limit, margin, time, witness)
