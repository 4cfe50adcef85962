"""Assertions about flights that hold for all times, not at samples. A failure prints sentence, counterexample and timeline."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import ValidationError

from verify.claims.evidence import Evidence
from verify.claims.limit_claims import limit_claims
from verify.data.errors import BadInput
from verify.data.language.word import Word
from verify.data.mission import Mission, check_mission
from verify.data.plan import Plan, RobotPlan, Waypoint
from verify.data.sections import Agent, Box, Limits, Spec
from verify.data.shapes.region import Region
from verify.data.trajectory import Trajectory
from verify.data.validation.faults import MissionError
from verify.logic.verdict import Verdict, show_readings
from verify.model_checking.timeline import Timeline
from verify.model_checking.word_claims import judge_formula, judged_as_one
from verify.motion.continuity import jumps
from verify.motion.membership.polynomials import membership_polynomials
from verify.motion.membership.statuses import changes, statuses
from verify.motion.paths import read_team
from verify.motion.regions import relations
from verify.recordings.sampled_timelines import sampled_timeline
from verify.recordings.samples import check_samples

Samples = tuple[ArrayLike, ArrayLike]
"""Times in s, shape (n,), and positions in m, shape (n, 3)."""

Regions = Mission | Mapping[str, Region | tuple[ArrayLike, ArrayLike]]
"""A mission, or regions by name: a `Region`, (centre, radius) or (centre, (a, b, c)), in m."""

ROBOT = "robot"
_FAR = 1e6


def assert_satisfies(
    flight: Trajectory | Samples,
    formula: str,
    regions: Regions,
    *,
    margin: float = 0.0,
    max_speed: float | None = None,
    error: float = 0.0,
) -> None:
    """Fail unless a flight satisfies a formula at all times.

    Args:
        flight: A trajectory (one with a cycle is checked as the infinite path), or (times, positions) of samples.
        formula: LTL without X over the regions' names and `free`.
        regions: Regions by name, or a mission that has them.
        margin: The formula must hold for every path within this many metres of the flight.
        max_speed: For samples: bound on the speed, m/s. Needed: a sampled path proves nothing without it.
        error: For samples: bound on the measurement error, m.

    Raises:
        AssertionError: It does not, or that could not be proved; the message has the counterexample and the timeline.
        BadInput: Formula, regions or numbers are wrong.
    """
    __tracebackhide__ = True
    if isinstance(margin, bool) or not isinstance(margin, int | float) or not 0 <= margin <= 1e6:  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
        raise BadInput(f"margin must be a number of metres from 0 to a million, not {str(margin)[:40]}.")
    if isinstance(flight, Trajectory):
        mission = _mission(regions, flight.evaluate(0.0)[:3], Spec(formula=formula, trace=_trace(flight)))
        timeline = _timeline(mission, flight, margin)
        verdict = judged_as_one(judge_formula(mission, {ROBOT: timeline}, relations(mission)))
    else:
        if max_speed is None:
            raise AssertionError("a sampled path proves nothing without a speed bound: give max_speed in m/s")
        times, positions = _samples(flight)
        mission = _mission(regions, positions[0], Spec(formula=formula))
        verdict = check_samples(times, positions, mission, max_speed=max_speed, error=error)
        if verdict and margin:  # every path that near the flight: what is within `wide` of the samples, and not only `error`
            wide = math.nextafter(error + margin, math.inf)
            verdict = check_samples(times, positions, mission, max_speed=max_speed, error=wide)
            error = wide
        timeline = sampled_timeline(
            ROBOT, times - times[0], positions, mission.all_regions, speed=float(max_speed), error=error
        )
    if not verdict:
        raise AssertionError(_report(verdict, timeline))


def assert_within_limits(
    trajectory: Trajectory,
    *,
    vehicle: str = "crazyflie-2.1",
    rest: bool = False,
    **limits: float,
) -> None:
    """Fail unless a trajectory keeps a vehicle's limits at all times, on its pieces and where they meet.

    At a joint, and where a cycle begins again, position, velocity, acceleration, jerk and heading may jump by no more
    than rounding to float32 makes them: a greater jump keeps no limit.

    Args:
        trajectory: The flight.
        vehicle: Name of a shipped profile.
        rest: Whether it must begin and end at rest too, as a whole flight does and a part of one need not.
        **limits: Tighter ones, as in a mission file: speed, acceleration, thrust_min, thrust_max, tilt_deg,
            body_rate_deg, yaw_rate_deg.

    Raises:
        AssertionError: A limit is broken, or its keeping could not be proved; the message has each such limit.
        BadInput: There is no such vehicle or limit, or a value that is no limit.
    """
    __tracebackhide__ = True
    if not isinstance(trajectory, Trajectory):  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
        raise BadInput(f"Give a Trajectory, not {type(trajectory).__name__}.")
    if "legs" in limits:
        raise BadInput(
            "legs: limits on the way to a region need a plan, which says when that way begins and ends; "
            "`verify.certify(plan, team)` checks them."
        )
    try:
        spec = Spec(formula="true", trace=_trace(trajectory))
        mission = check_mission(_mission({}, trajectory.evaluate(0.0), spec, vehicle, Limits(**limits)), to_plan=False)  # type: ignore[arg-type]  # checked by the schema
    except ValidationError as problem:
        first = problem.errors()[0]
        raise BadInput(f"{'.'.join(map(str, first['loc'])) or 'limits'}: {first['msg']}.") from None
    except MissionError as problem:
        raise BadInput(" ".join(f"{'.'.join(map(str, fault.keys))}: {fault.reason}" for fault in problem.faults)) from None
    plan = RobotPlan(
        word=Word((frozenset(),)),
        waypoints=(Waypoint(position=mission.agents[ROBOT].start, role="start"),),
        times=(0.0,),
    )
    evidence = Evidence.of(Plan(mission=mission, robots={ROBOT: plan}), {ROBOT: trajectory})
    refused = [claim.sentence for claim in limit_claims(evidence) if claim.outcome != "holds"]
    refused += [
        f"{jump.robot}'s {jump.what} {'jumps' if jump.sure > 1 else 'may jump'} by up to {jump.size:.4g} at "
        f"{float(jump.time):.4f} s; {jump.allowed:g} is allowed."
        for jump in jumps(evidence.paths, ends=rest)
        if not jump.share <= 1
    ]
    if refused:
        raise AssertionError("\n".join(refused))


def _trace(trajectory: Trajectory) -> Any:
    return "finite" if trajectory.cycle is None else "infinite"


def _mission(
    regions: Regions, start: ArrayLike, spec: Spec, vehicle: str = "crazyflie-2.1", limits: Limits | None = None
) -> Mission:
    """Wrap what is asked into a mission of one robot in a wide world; `start` is x, y, z in m and perhaps a heading in rad."""
    if not isinstance(regions, Mapping | Mission):  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
        raise BadInput(f"Regions are a mission, or a table of regions by name, not {type(regions).__name__}.")
    if isinstance(regions, Mission):
        regions = check_mission(regions, to_plan=False)
    found = regions.all_regions if isinstance(regions, Mission) else {n: _region(n, r) for n, r in regions.items()}
    x, y, z, *heading = (float(value) for value in np.asarray(start))
    yaw = math.degrees(heading[0]) if heading else 0.0
    return Mission.model_validate(
        {
            "name": "assertion",
            "spec": spec,
            "regions": {name: Region.model_validate(_plain(region)) for name, region in found.items()},
            "agents": {ROBOT: Agent(start=(x, y, z), yaw_deg=yaw)},
            "vehicle": vehicle,
            "limits": limits or Limits(),
            "workspace": Box(min=(-_FAR, -_FAR, -_FAR), max=(_FAR, _FAR, _FAR)),
        }
    )


def _samples(flight: object) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return times, shape (n,), and positions, shape (n, 3), as finite arrays."""
    if not isinstance(flight, Sequence) or len(flight) != 2:
        raise BadInput("Give a Trajectory, or the samples as (times, positions).")
    try:
        times, positions = (np.asarray(part, dtype=np.float64) for part in flight)
    except (TypeError, ValueError, OverflowError) as problem:
        raise BadInput(f"Samples are times (n,) and positions (n, 3), as numbers: {problem}.") from None
    if positions.ndim != 2 or positions.shape[1:] != (3,) or times.shape != positions.shape[:1] or not len(times):
        raise BadInput(f"Samples are times (n,) and positions (n, 3), not {times.shape} and {positions.shape}.")
    for name, values in (("times", times), ("positions", positions)):
        if not np.all(np.isfinite(values)):
            where = tuple(int(i) for i in np.argwhere(~np.isfinite(values))[0])
            raise BadInput(f"{name}[{', '.join(map(str, where))}] is {values[where]}; a sample is a finite number.")
    return times, positions


def _plain(region: Region) -> dict[str, Any]:
    """Return a hoop's ellipsoid without its ring."""
    return {name: getattr(region, name) for name in Region.model_fields}


def _region(name: str, value: Any) -> Region:
    if isinstance(value, Region):
        return value
    try:
        centre, radii = value
        radii = (radii, radii, radii) if isinstance(radii, int | float) else radii
        return Region(
            center=tuple(float(x) for x in centre),  # type: ignore[arg-type]  # its length is checked by the schema
            radii=tuple(float(x) for x in radii),  # type: ignore[arg-type]
        )
    except (TypeError, ValueError, OverflowError):
        wanted = "a Region, (centre, radius) or (centre, (a, b, c)), in finite numbers of metres"
        raise BadInput(f"Region '{name}' must be {wanted}, not {value!r:.80}.") from None


def _timeline(mission: Mission, trajectory: Trajectory, margin: float) -> Timeline:
    paths = read_team(mission, {ROBOT: trajectory})
    initial, found = changes(statuses(membership_polynomials(paths), Fraction(margin))[ROBOT])
    cycle = None if trajectory.cycle is None else paths.knots[0][trajectory.cycle]
    return Timeline(ROBOT, initial, found, paths.end, cycle=cycle)


def _report(verdict: Verdict, timeline: Timeline) -> str:
    lines = [verdict.sentence]
    if verdict.counterexample is not None:
        lines.append(f"counterexample: {show_readings(verdict.readings())}")
    lines.append("timeline:")
    for region, status in timeline.initial.items():
        row = [f"{status} from 0 s"]
        row += [f"{c.status} from {float(c.time.high):.4g} s" for c in timeline.changes if c.region == region]
        shown = row if len(row) <= 12 else [*row[:6], f"({len(row) - 12} more)", *row[-6:]]
        lines.append(f"  {region}: {', '.join(shown)}")
    return "\n".join(lines)
