"""Certification: trajectories compared with their plan and mission, claim by claim, and the largest margin at which all hold.

`judge` says of every claim whether it is proved; `certify` does the same and raises unless all of them are.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from verify.certificate import ActionInstant, Certificate, versions
from verify.claims.claim import Claim, claim_of_verdict
from verify.claims.distance_claims import Clocks, rim_claims, separation_claims, separation_holds, workspace_claims
from verify.claims.evidence import Evidence
from verify.claims.judged_plan import judged_plan
from verify.claims.limit_claims import continuity_claims, endurance_claims, leg_claims, limit_claims
from verify.claims.obstacle_claims import obstacle_claims
from verify.claims.order_claims import ordered_claims, precedence_claims
from verify.claims.part_claims import part_claims
from verify.claims.soft_claims import soft_claims
from verify.claims.tracking_claims import tracking_claims
from verify.claims.visit_claims import passage_claim, visit_claim
from verify.data.errors import BadInput, NotCertified
from verify.data.mission import Mission
from verify.data.plan import Plan, check_plan
from verify.data.trajectory import Trajectory, check_trajectories
from verify.data.validation.clocks import clock_error_of, since_common_start
from verify.logic.verdict import Verdict
from verify.model_checking.timeline import Timeline
from verify.model_checking.transitions import judge_transitions
from verify.model_checking.word_claims import judge_formula
from verify.motion.membership.statuses import changes, statuses
from verify.motion.passages import crossings
from verify.motion.planned_words import false_statement
from verify.motion.separation import stretch_of
from verify.motion.visits import Matching, internal_changes, match

RESOLUTION = 1e-4
"""m; the largest margin is found to this."""

_ANYWHERE = Fraction(10**30)
"""m that a robot may drift whose speed has no bound: more than any distance."""


def certify(
    plan: Plan, team: Mapping[str, Trajectory], *, margin: float | None = None, clock_error: float | None = None
) -> Certificate:
    """Prove every claim about a team's flight, for all times.

    Args:
        plan: What was planned; carries the mission.
        team: One trajectory for each of the mission's agents.
        margin: delta to prove, in m; None takes the mission's.
        clock_error: How far apart the robots' clocks may be, in s; None takes the mission's, or what a common start leaves.

    Raises:
        NotCertified: A claim is refuted or could not be proved; carries a witness for each.
        BadInput: Team, plan and mission do not belong together, or an argument is out of range.
    """
    certificate = judge(plan, team, margin=margin, clock_error=clock_error)
    if certificate.holds and (fault := false_statement(plan, certificate.timelines)):
        raise NotCertified(f"All claims hold, but the plan states what is not so: {fault}")
    if certificate.holds:
        return certificate
    refused = [claim for claim in certificate.claims if claim.outcome != "holds"]
    largest = certificate.largest_margin
    hint = "" if largest is None else f" The largest margin that holds is {largest:.4f} m."
    listed = " ".join(claim.sentence for claim in refused[:5])
    more = f" And {len(refused) - 5} more claims." if len(refused) > 5 else ""
    raise NotCertified(
        f"Not certified at margin {certificate.margin:g} m. {listed}{more}{hint}", [c.witness for c in refused if c.witness]
    )


@np.errstate(all="ignore")  # infinities and NaN arise from absurd numbers; they prove nothing, see `verify.arithmetic.balls`
def judge(
    plan: Plan,
    team: Mapping[str, Trajectory],
    *,
    margin: float | None = None,
    clock_error: float | None = None,
    largest: bool = True,
) -> Certificate:
    """Say of every claim about a team's flight whether it is proved, refuted or neither.

    Args:
        plan: What was planned; carries the mission.
        team: One trajectory for each of the mission's agents.
        margin: delta, in m; None takes the mission's.
        clock_error: How far apart the robots' clocks may be, in s; None takes the mission's, or what a common start leaves.
        largest: Whether to find the largest margin too.

    Raises:
        BadInput: Team, plan and mission do not belong together, or an argument is out of range.
    """
    plan, team = check_plan(plan), check_trajectories(team)
    mission = plan.mission
    asked = mission.margin if margin is None else margin
    apart = clock_error_of(mission, since_common_start(mission, team)) if clock_error is None else clock_error
    for name, value in (("margin", asked), ("clock_error", apart)):
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= 1e6:  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
            raise BadInput(f"{name} must be a number from 0 to a million, not {str(value)[:40]}.")
    if tuple(plan.robots) != tuple(mission.agents):
        raise BadInput(f"The plan has robots {', '.join(plan.robots)}; the mission has {', '.join(mission.agents)}.")
    _check_plan(plan)
    evidence = Evidence.of(judged_plan(plan), team)
    error = Fraction(apart)
    still = (*_margin_free_claims(evidence), *tracking_claims(evidence, float(asked)))
    tube = _at_margin(evidence, Fraction(asked), error)
    best = None
    if largest and all(claim.outcome == "holds" for claim in still):
        best = _largest_margin(evidence, float(asked), error, tube)
    claims = (*tube.claims, *still)

    def formula_of(part: Mission) -> Verdict:
        (verdict,) = judge_formula(part, tube.timelines, evidence.relations, clock_error=error)
        return verdict

    return Certificate(
        mission=mission,
        mission_digest=mission.digest(),
        plan_digest=plan.digest(),
        trajectories={name: team[name].digest() for name in evidence.paths.robots},
        cycles={name: team[name].cycle for name in evidence.paths.robots},
        cuts={name: team[name].cuts for name in evidence.paths.robots if team[name].cuts},
        margin=float(asked),
        largest_margin=best,
        clock_error=float(apart),
        duration=float(evidence.paths.end),
        claims=claims,
        actions=tuple(
            ActionInstant(name, change.visit, float(change.time), change.source, change.target)
            for name, timeline in tube.timelines.items()
            for change in timeline.actions
        ),
        versions=versions(),
        timelines=tube.timelines,
        soft=soft_claims(mission, formula_of),
    )


def _check_plan(plan: Plan) -> None:
    """Reject a plan that names unknown regions, or whose cycles are not the mission's."""
    mission = plan.mission
    for name, robot in plan.robots.items():
        for index, visit in enumerate(robot.visits):
            if visit.region not in mission.all_regions:
                raise BadInput(f"{name}, visit {index}: '{visit.region}' is not a region of the mission.")
        if mission.spec.trace == "infinite" and not (
            robot.cycle_visit is not None and 0 <= robot.cycle_visit <= len(robot.visits)
        ):
            raise BadInput(f"{name}: the mission's trace is infinite, so its plan must say at which visit the cycle begins.")
        if mission.spec.trace == "finite" and robot.cycle_visit is not None:
            raise BadInput(f"{name}: the mission's trace is finite, so its plan cannot have a cycle.")
        if mission.spec.trace == "infinite" and mission.agents[name].end is not None:
            raise BadInput(
                f"{name}: the mission's trace is infinite, so its flight never ends; it cannot have to finish at its `end`."
            )


@dataclass(frozen=True, slots=True)
class _Tube:
    """Claims and timelines at one margin."""

    claims: tuple[Claim, ...]
    timelines: dict[str, Timeline]

    @property
    def holds(self) -> bool:
        return all(claim.outcome == "holds" for claim in self.claims)


def _margin_free_claims(evidence: Evidence) -> tuple[Claim, ...]:
    return (
        *continuity_claims(evidence.jumps),
        *part_claims(evidence),
        *limit_claims(evidence),
        *endurance_claims(evidence),
        *ordered_claims(evidence.plan),
    )


@dataclass(frozen=True, slots=True)
class _Readings:
    """Timelines of all paths within one margin, robot by robot, and the claims about those alone."""

    timelines: dict[str, Timeline]
    matchings: dict[str, Matching]
    visits: tuple[Claim, ...]
    passages: tuple[Claim, ...]


def _read(evidence: Evidence, margin: Fraction) -> _Readings:
    plan, paths = evidence.plan, evidence.paths
    spans = statuses(evidence.membership, margin)
    passed = crossings(evidence.frames, margin)
    timelines: dict[str, Timeline] = {}
    matchings: dict[str, Matching] = {}
    visits: list[Claim] = []
    passages: list[Claim] = []
    for index, robot in enumerate(paths.robots):
        cycle = paths.trajectories[index].cycle
        knot = None if cycle is None else paths.knots[index][cycle]
        matching = matchings[robot] = match(plan.robots[robot], spans[robot], knot)
        began = plan.mission.initial_internal(robot)
        actions, fault = internal_changes(plan.mission.robot_of(robot), plan.robots[robot], matching, knot, initial=began)
        initial, found = changes(spans[robot])
        timelines[robot] = Timeline(
            robot=robot,
            initial=initial,
            changes=found,
            duration=paths.end,
            internal=plan.mission.initial_letter(robot),
            actions=actions,
            cycle=knot,
            unplanned=matching.extra is not None,
        )
        visits.append(visit_claim(robot, matching, fault))
        passages.append(passage_claim(evidence, robot, matching, spans[robot], passed[robot], margin))
    return _Readings(timelines, matchings, tuple(visits), tuple(passages))


def _at_margin(evidence: Evidence, margin: Fraction, clock_error: Fraction) -> _Tube:
    """Check all claims that depend on the margin."""
    plan = evidence.plan
    found = _read(evidence, margin)
    words = [
        *_unless_in_parts(evidence, judge_formula(plan.mission, found.timelines, evidence.relations, clock_error=clock_error)),
        *judge_transitions(plan.mission, found.timelines, evidence.relations),
    ]
    claims = (
        *(_word_claim(verdict, plan, found.matchings) for verdict in words),
        *found.visits,
        *found.passages,
        *precedence_claims(evidence, found.matchings, found.timelines, clock_error),
        *_claims_of_paths(evidence, found, margin, separation_claims(evidence, margin, _clocks(evidence, clock_error))),
    )
    return _Tube(claims, found.timelines)


def _unless_in_parts(evidence: Evidence, verdicts: Iterable[Verdict]) -> Iterator[Verdict]:
    """Yield verdicts; of a flight in parts, between which the team hovers for any time, none on times holds."""
    parts = any(path.cuts for path in evidence.paths.trajectories)
    for verdict in verdicts:
        if parts and verdict.claim == "timing" and verdict.outcome == "holds":
            sentence = (
                "The flight is in parts, between which the team hovers for any time, so that no bound in seconds is proved."
            )
            verdict = replace(verdict, outcome="undecided", sentence=sentence, slack=None)
        yield verdict


def _claims_of_paths(evidence: Evidence, found: _Readings, margin: Fraction, separation: Iterable[Claim]) -> Iterator[Claim]:
    yield from rim_claims(evidence, margin)
    yield from obstacle_claims(evidence, margin)
    yield from workspace_claims(evidence, margin)
    yield from separation
    yield from leg_claims(evidence, found.matchings)


def _holds_at(evidence: Evidence, margin: Fraction, clock_error: Fraction) -> bool:
    """Return whether all claims that depend on the margin hold; those about words, which take longest, are asked last."""
    mission = evidence.plan.mission
    found = _read(evidence, margin)
    claims = itertools.chain(
        found.visits,
        found.passages,
        precedence_claims(evidence, found.matchings, found.timelines, clock_error),
        _claims_of_paths(evidence, found, margin, ()),
    )
    return (
        all(claim.outcome == "holds" for claim in claims)
        and separation_holds(evidence, margin, _clocks(evidence, clock_error))
        and all(judge_transitions(mission, found.timelines, evidence.relations))
        and all(
            _unless_in_parts(
                evidence, judge_formula(mission, found.timelines, evidence.relations, clock_error=clock_error, detail="answer")
            )
        )
    )


def _clocks(evidence: Evidence, clock_error: Fraction) -> Clocks:
    """Bound how far each robot flies within the clocks' error, in m, steps between pieces included."""
    if clock_error == 0:
        return Clocks(clock_error, dict.fromkeys(evidence.paths.robots, Fraction(0)))
    speeds = {e.robot: e.bound for e in evidence.extremes if e.name == "speed"}
    steps = Counter(segment.robot for segment in evidence.paths.segments if segment.kind == "step")
    drifts: dict[str, Fraction] = {}
    for index, robot in enumerate(evidence.paths.robots):
        jump = evidence.pairwise_distances.jumps[index]
        if not evidence.paths.trajectories[index].coefficients[:, :3, 1:].any() and jump == 0:
            drifts[robot] = Fraction(0)  # it never moves
        elif math.isfinite(speeds[robot]) and math.isfinite(jump):
            drifts[robot] = Fraction(speeds[robot]) * clock_error + steps[index] * Fraction(jump)
        else:
            drifts[robot] = _ANYWHERE
    return Clocks(clock_error, drifts)


def _word_claim(verdict: Verdict, plan: Plan, matchings: Mapping[str, Matching]) -> Claim:
    if verdict.outcome != "holds" and verdict.claim == "formula" and verdict.region is not None:
        verdict = _with_visit(verdict, plan, matchings)
    return claim_of_verdict(verdict)


def _with_visit(verdict: Verdict, plan: Plan, matchings: Mapping[str, Matching]) -> Verdict:
    """Name the planned visit of a broken formula's region: the one at that time, or the only one that was to be made."""
    if verdict.time is None:
        planned = [(r, i) for r, robot in plan.robots.items() for i, v in enumerate(robot.visits) if v.region == verdict.region]
        return replace(verdict, robot=planned[0][0], visit=planned[0][1]) if len(planned) == 1 else verdict
    found, time = () if verdict.robot is None else matchings[verdict.robot].stays, verdict.time
    near = (i for i, s in enumerate(found) if s.region == verdict.region and float(s.start) <= time <= float(s.stop))
    return replace(verdict, visit=next(near, None))


def _largest_margin(evidence: Evidence, asked: float, clock_error: Fraction, tube: _Tube) -> float | None:
    """Find the largest margin at which all claims hold, by bisection to RESOLUTION; a larger one is rejected.

    A tube holds every smaller one, so what is proved at one margin holds at all smaller ones.
    """

    def holds(margin: float) -> bool:
        return _holds_at(evidence, Fraction(margin), clock_error)

    low, high = asked, _margin_bound(evidence)
    if not tube.holds:
        low, high = 0.0, min(asked, high)
        if asked == 0.0 or not holds(0.0):
            return None
    elif high <= low or holds(high):
        return max(low, high)
    while high - low > RESOLUTION:
        middle = (low + high) / 2
        if holds(middle):
            low = middle
        else:
            high = middle
    return low


def _margin_bound(evidence: Evidence) -> float:
    """Return a margin above which some claim about distances fails, as a place to begin."""
    mission = evidence.plan.mission
    bounds = [near.high for near in evidence.walls]
    bounds += [near.high - mission.vehicle_of(near.robot).radius for near in evidence.rims]
    if mission.obstacles:
        bounds += [near.high - mission.vehicle_of(robot).radius for robot, (near, *_) in evidence.approaches.items()]
    stretch = float(stretch_of(evidence.paths))
    for near in evidence.minimum_distances:
        bounds.append((near.high - mission.least_distance(near.robot, near.other)) / (2 * stretch))
    visits = {(robot, visit.region) for robot, plan in evidence.plan.robots.items() for visit in plan.visits}
    bounds += [mission.all_regions[name].inner_radius for _, name in visits]
    bounds += [
        mission.hoops[name].opening - mission.vehicle_of(robot).radius for robot, name in visits if name in mission.hoops
    ]
    return max(min(bounds), 0.0)
