"""Claims that hold whatever the margin: the vehicle's limits, those of the mission's legs, and how pieces join."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from fractions import Fraction

from verify.claims.claim import Claim, Outcome, claim_of, figures, told_apart
from verify.claims.evidence import Evidence
from verify.claims.part_claims import pauses
from verify.data.trajectory import PAUSE
from verify.data.vehicle import CLIMB_AND_LANDING
from verify.motion.continuity import Jump
from verify.motion.leg_windows import ways
from verify.motion.limits import UNITS, Extreme, leg_extremes
from verify.motion.visits import Matching


def limit_claims(evidence: Evidence) -> Iterable[Claim]:
    """Speed, acceleration, thrusts, tilt and rates of the nominal flight."""
    for extreme in evidence.extremes:
        yield _limit_claim(extreme)


def endurance_claims(evidence: Evidence) -> Iterable[Claim]:
    """Each robot is back on the ground before its endurance ends, all laps and waits counted; none where there is no such limit."""
    mission, paths = evidence.plan.mission, evidence.paths
    for index, robot in enumerate(paths.robots):
        limit = mission.limits_of(robot).endurance
        if limit is None:
            continue
        cycle, flown = paths.trajectories[index].cycle, paths.end
        if cycle is not None:
            flown += (mission.spec.repeat - 1) * (paths.end - paths.knots[index][cycle])
        paused = max(pauses(trajectory, mission.spec.repeat) for trajectory in paths.trajectories)
        flown += paused * Fraction(PAUSE)
        total = flown + Fraction(CLIMB_AND_LANDING)
        verdict: Outcome = "holds" if total <= Fraction(limit) else "fails"
        bound = float(total)
        if Fraction(bound) < total:
            bound = math.nextafter(bound, math.inf)
        sentence = (
            f"{robot} is in the air for {figures(bound, 5, up=True)} s, {CLIMB_AND_LANDING:g} s of them for climb, the way to the start and landing; "
            f"its endurance is {limit:.5g} s.{_paused(paused)}"
        )
        yield claim_of(
            "limits.endurance", verdict, sentence, robot=robot, unit="s", bound=bound, limit=limit, margin=limit - bound,
            time=float(flown),
        )  # fmt: skip


def _paused(count: int) -> str:
    return f" {count} pauses between parts count {PAUSE:g} s each: whoever pauses for longer lands." if count else ""


def leg_claims(evidence: Evidence, matchings: Mapping[str, Matching]) -> Iterable[Claim]:
    """Limits that hold on the way to one region, at all times at which a robot may be on its way there."""
    mission, named = evidence.plan.mission, dict[str, None]()
    for index, (robot, plan) in enumerate(evidence.plan.robots.items()):
        legs = mission.leg_limits_of(robot)
        named |= dict.fromkeys(legs)
        matching, cycle = matchings[robot], evidence.paths.trajectories[index].cycle
        knot = None if cycle is None else evidence.paths.knots[index][cycle]
        for visit, region in enumerate(visit.region for visit in plan.visits):
            if region not in legs:
                continue
            if visit >= len(matching.stays):
                sentence = f"{robot}: the leg to visit {visit} of '{region}' cannot be told, so its limits are not proved."
                yield claim_of("limits.legs", "undecided", sentence, robot=robot, region=region, visit=visit)
                continue
            windows = ways(matching, visit, evidence.nominal[robot][region], knot)
            if not windows:
                sentence = f"{robot} is in '{region}' from its start on and not on the way there before it has left for good."
                yield claim_of("limits.legs", "holds", sentence, robot=robot, region=region, visit=visit)
            for extreme in leg_extremes(evidence.paths, index, windows, legs[region]) if windows else ():
                yield _limit_claim(extreme, region, visit)
    visited = {visit.region for plan in evidence.plan.robots.values() for visit in plan.visits}
    sure = all(not matching.fault for matching in matchings.values())
    for region in named:
        if region not in visited:
            sentence = f"No robot goes to '{region}', so the limits on the way there bind none."
            yield claim_of("limits.legs", "holds" if sure else "undecided", sentence, region=region)


def braking_claims(evidence: Evidence, towards: Mapping[str, tuple[Fraction, *tuple[str, ...]]]) -> Iterable[Claim]:
    """Limits of legs that are not flown to their ends: from when a robot slows down, on its way to regions, until it rests.

    Args:
        evidence: Of trajectories that end at rest.
        towards: For each robot that slows down: when it begins to, exact, in s, and the regions that it was on its way to.
    """
    for robot, (begin, *regions) in towards.items():
        legs = evidence.plan.mission.leg_limits_of(robot)
        index = evidence.paths.robots.index(robot)
        for region in regions:
            if region in legs:
                for extreme in leg_extremes(evidence.paths, index, [(begin, evidence.paths.end)], legs[region]):
                    yield _limit_claim(extreme, region)


def _limit_claim(extreme: Extreme, region: str | None = None, visit: int | None = None) -> Claim:
    """Word one limit; a region makes it the limit of the leg there."""
    least = extreme.name.endswith("_min")
    unit = UNITS[extreme.name]
    quantity = extreme.name.replace("_", " ").removesuffix(" min").removesuffix(" max")
    quantity += " (roll and pitch)" if extreme.name == "body_rate" else ""
    quantity += "" if region is None else f" on the way to '{region}'"
    verdict: Outcome = "holds" if extreme.holds else "fails" if extreme.fails else "undecided"
    time = float(extreme.time)
    if extreme.holds:
        word, bound = "at least" if least else "at most", figures(extreme.bound, 5, up=not least)
        sentence = f"{extreme.robot}'s {quantity} is {word} {bound} {unit} (limit {extreme.limit:.5g})."
    elif extreme.fails:
        word = "falls to" if least else "reaches"
        sentence = (
            f"{extreme.robot}'s {quantity} {word} {told_apart(extreme.reached, extreme.limit)} {unit} at {time:.4f} s; "
            f"the limit is {extreme.limit:.5g} {unit}."
        )
    else:
        sentence = f"{extreme.robot}'s {quantity} near {time:.4f} s cannot be told from its limit {extreme.limit:.5g} {unit}."
    name = f"limits.{extreme.name}" if region is None else f"limits.legs.{extreme.name}"
    return claim_of(
        name, verdict, sentence, robot=extreme.robot, unit=unit, bound=extreme.bound,
        limit=extreme.limit, margin=extreme.bound - extreme.limit if least else extreme.limit - extreme.bound, time=time,
        region=region, visit=visit,
    )  # fmt: skip


def continuity_claims(jumps: Iterable[Jump]) -> Iterable[Claim]:
    """Jumps between pieces, at the start and at the end."""
    for jump in jumps:
        verdict: Outcome = "holds" if jump.share <= 1 else "fails" if jump.sure > 1 else "undecided"
        sentence = (
            f"{jump.robot}: the {jump.what} jumps by at most {figures(jump.size, 3, up=True)}; {jump.allowed:g} is allowed."
        )
        yield claim_of(
            "continuity", verdict, sentence, robot=jump.robot, bound=jump.size, limit=jump.allowed,
            margin=jump.allowed - jump.size, time=float(jump.time), what=jump.what,
        )  # fmt: skip
