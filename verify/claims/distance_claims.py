"""Claims about distances: the whole tube lies in the workspace, clear of rims, and robots keep apart."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction

from verify.claims.claim import Claim, Outcome, at_least, at_least_asked, claim_of
from verify.claims.evidence import Evidence
from verify.motion.passages import clearances
from verify.motion.separation import distance_exactly, stretch_of, wall_exactly, z_weight


def workspace_claims(evidence: Evidence, margin: Fraction) -> Iterable[Claim]:
    """Claim that the whole tube lies in the workspace."""
    for robot, near in enumerate(evidence.walls):
        verdict = _at_least(near.low, near.high, margin, lambda robot=robot: wall_exactly(evidence.paths, robot, margin))
        time = float(near.time)
        stays = "stays" if verdict == "holds" else "comes within"
        distance = at_least(max(near.low, 0.0)) if verdict == "holds" else f"{near.high:.4f}"
        sentence = f"{near.robot} {stays} {distance} m from the wall {near.other}"
        sentence += "." if verdict == "holds" else f" at {time:.4f} s; the margin is {float(margin):g} m."
        bound = _proved(near.low, margin, verdict)
        yield claim_of(
            "workspace", verdict, sentence, robot=near.robot, unit="m", time=time, what=f"wall {near.other}",
            bound=bound, limit=float(margin), margin=bound - float(margin),
        )  # fmt: skip


def separation_limit(evidence: Evidence, pair: tuple[str, str], margin: Fraction) -> Fraction:
    """Return how far apart the nominal paths of two robots must be, in m.

    Args:
        evidence: What is known of the team's paths.
        pair: Their names.
        margin: delta, m, exact.
    """
    return Fraction(evidence.plan.mission.least_distance(*pair)) + 2 * margin * stretch_of(evidence.paths)


@dataclass(frozen=True, slots=True)
class Clocks:
    """Greatest difference between clocks, and the distance that it is worth.

    Attributes:
        error: s between two clocks at any moment, exact.
        drifts: For each robot, how far at most it flies within that time, m, exact.
    """

    error: Fraction
    drifts: Mapping[str, Fraction]


def separation_claims(evidence: Evidence, margin: Fraction, clocks: Clocks) -> Iterable[Claim]:
    """Robots keep their separation in the tube, however their clocks differ.

    Args:
        evidence: What is known of the team's paths.
        margin: delta, m, exact.
        clocks: How far they may be apart.
    """
    for pair in range(len(evidence.minimum_distances)):
        yield _separation_claim(evidence, pair, margin, clocks)


def separation_holds(evidence: Evidence, margin: Fraction, clocks: Clocks) -> bool:
    """Return whether all separation claims hold: those of pairs that stay further apart than is asked of any pair do.

    Args:
        evidence: What is known of the team's paths.
        margin: delta, m, exact.
        clocks: How far they may be apart.
    """
    mission = evidence.plan.mission
    asked = {mission.least_distance(near.robot, near.other) for near in evidence.minimum_distances}
    if not asked:
        return True
    most = Fraction(max(asked)) + stretch_of(evidence.paths) * (2 * margin + max(clocks.drifts.values()))
    clear = math.nextafter(float(most), math.inf)
    near = [pair for pair, found in enumerate(evidence.minimum_distances) if not math.inf > found.low >= clear]
    return all(_separation_claim(evidence, pair, margin, clocks).outcome == "holds" for pair in near)


def _separation_claim(evidence: Evidence, pair: int, margin: Fraction, clocks: Clocks) -> Claim:
    """Return the claim of one pair: what the slower robot flies in the clocks' error is added first, and looked at closer if that is too much."""
    stretch, near = stretch_of(evidence.paths), evidence.minimum_distances[pair]
    robots = near.robot, near.other
    in_tube = separation_limit(evidence, robots, margin)
    limit = in_tube + stretch * min(clocks.drifts[near.robot], clocks.drifts[near.other])
    steps = [evidence.pairwise_distances.jumps[i] for i in evidence.pairwise_distances.pairs[pair]]

    def exactly() -> bool:
        if not all(map(math.isfinite, steps)):
            return False
        return distance_exactly(evidence.pairwise_distances, pair, limit + stretch * sum(map(Fraction, steps)))

    verdict = _at_least(near.low, near.high, limit, exactly)
    if verdict == "fails" and not near.high < float(in_tube):
        if limit > in_tube:
            return _claim_of_shifts(evidence, pair, in_tube, margin, clocks)
        if any(steps):
            verdict = "undecided"  # what steps can do is bounded from above only
    time, bound = float(near.time), _proved(near.low, limit, verdict)
    proved, least = at_least_asked(bound, float(limit))
    asked = _asked(evidence, robots, least if verdict == "holds" else f"{float(limit):.4f}", margin)
    if verdict == "holds":
        sentence = f"{near.robot} and {near.other} stay {proved} m apart; {asked}."
    elif verdict == "undecided":
        sentence = (
            f"{near.robot} and {near.other} cannot be shown to keep apart: they come within {near.high:.4f} m at {time:.4f} s, "
            f"not counting what their paths jump between pieces (up to {sum(steps):.4g} m); {asked}."
        )
    else:
        sentence = f"{near.robot} and {near.other} come within {near.high:.4f} m at {time:.4f} s; {asked}."
    return claim_of(
        "separation", verdict, sentence, robot=near.robot, other=near.other, unit="m", time=time,
        bound=bound, limit=float(limit), margin=bound - float(limit),
    )  # fmt: skip


def _claim_of_shifts(evidence: Evidence, pair: int, limit: Fraction, margin: Fraction, clocks: Clocks) -> Claim:
    """Return the claim of a pair that comes so near that all differences of their clocks are looked at."""
    near = evidence.shifted_distances.least(pair, clocks.error, evidence.minimum_distances[pair].high)
    verdict: Outcome = "holds" if Fraction(near.low) >= limit else "fails" if Fraction(near.high) < limit else "undecided"
    time, apart = float(near.time), f"with clocks up to {float(clocks.error):g} s apart"
    proved, least = at_least_asked(near.low, float(limit))
    asked = _asked(evidence, (near.robot, near.other), least if verdict == "holds" else f"{float(limit):.4f}", margin)
    if verdict == "holds":
        sentence = f"{near.robot} and {near.other} stay {proved} m apart {apart}; {asked}."
    elif verdict == "undecided":
        sentence = (
            f"{near.robot} and {near.other} cannot be shown to keep apart {apart}: no more than {near.low:.4f} m is proved, and they "
            f"come within {near.high:.4f} m at {time:.4f} s; {asked}."
        )
    else:
        sentence = f"{near.robot} and {near.other} come within {near.high:.4f} m at {time:.4f} s {apart}; {asked}."
    return claim_of(
        "separation", verdict, sentence, robot=near.robot, other=near.other, unit="m", time=time,
        bound=near.low, limit=float(limit), margin=near.low - float(limit),
    )  # fmt: skip


def _asked(evidence: Evidence, pair: tuple[str, str], limit: str, margin: Fraction) -> str:
    """Word what is asked of a pair, and how distances are counted where that is not the same in all directions."""
    mission, weight = evidence.plan.mission, z_weight(evidence.paths)
    counted = "" if weight == 1 else f", distances in z counted {float(weight):g} times"
    return f"{limit} m are asked (separation {mission.least_distance(*pair):g} m, margin {float(margin):g} m{counted})"


def rim_claims(evidence: Evidence, margin: Fraction) -> Iterable[Claim]:
    """No rim is met by the vehicle's sphere."""
    if not evidence.rims:
        return
    for robot in evidence.paths.robots:
        limit = margin + Fraction(evidence.plan.mission.vehicle_of(robot).radius)
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
            sentence = f"{robot} stays {at_least(near.low)} m from the rim of '{near.hoop}' and of every other hoop."
        else:
            sentence = (
                f"{robot} comes within {near.high:.4f} m of the rim of '{near.hoop}' at {time:.4f} s; "
                f"radius and margin need {float(limit):.4f} m."
            )
        yield claim_of(
            "rims", verdict, sentence, robot=robot, unit="m", bound=near.low, limit=float(limit),
            margin=near.low - float(limit), time=time, region=near.hoop,
        )  # fmt: skip


def _proved(low: float, limit: Fraction, verdict: Outcome) -> float:
    """Return the proved lower bound: what was decided without rounding is at least the limit."""
    return max(low, float(limit)) if verdict == "holds" else low


def _at_least(low: float, high: float, limit: Fraction, exactly: Callable[[], bool]) -> Outcome:
    if math.isfinite(low) and Fraction(low) >= limit:
        return "holds"
    if math.isfinite(high) and Fraction(high) < limit:
        return "fails"
    return "holds" if exactly() else "fails"
