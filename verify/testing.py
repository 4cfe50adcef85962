"""For other people's tests: assertions about flights that hold for all times, not at samples.

Import the assertions from here, or load the module as a pytest plugin (`-p verify.testing`, or
`pytest_plugins = ["verify.testing"]`), which says in the header of a run what they rest on. A failure prints the
sentence, the counterexample and the label timeline.

    from verify.testing import assert_satisfies, assert_within_limits

    def test_course():
        trajectory = plan_my_course()
        assert_satisfies(trajectory, "F a & G !b", {"a": ((1, 0, 1), 0.2), "b": ((0, 0, 1), 0.3)})
        assert_within_limits(trajectory, vehicle="crazyflie-2.1", speed=1.0)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pydantic import ValidationError

from verify.behaviour import judge_formula
from verify.claims import Evidence, limit_claims
from verify.data.errors import BadInput
from verify.data.mission import Agent, Box, Limits, Mission, Region, Spec
from verify.data.plan import Plan, RobotPlan, Waypoint
from verify.data.trajectory import Trajectory
from verify.data.word import Word
from verify.labels import changes, levels, statuses
from verify.paths import read_team
from verify.regions import relations
from verify.samples import check_samples, sampled_timeline
from verify.timeline import Timeline
from verify.verdict import Verdict, show_readings

Samples = tuple[ArrayLike, ArrayLike]
"""Times in s, shape (n,), and positions in m, shape (n, 3)."""

Regions = Mission | Mapping[str, Any]
"""A mission, or regions by name: a `Region`, (centre, radius) or (centre, (a, b, c)), in m."""

ROBOT = "robot"
_FAR = 1e6


def pytest_report_header() -> str:
    """Say in the header of a test run what the assertions rest on."""
    return "verify: flights are judged for all times; sampled paths need a speed bound"


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
        flight: A trajectory (one with a cycle is judged as the infinite path), or (times, positions) of samples.
        formula: LTL without X over the regions' names and `free`.
        regions: Regions by name, or a mission that has them.
        margin: For a trajectory: the formula must hold for every path within this many metres.
        max_speed: For samples: bound on the speed, m/s. Needed: a sampled path proves nothing without it.
        error: For samples: bound on the measurement error, m.

    Raises:
        AssertionError: It does not, or that could not be proved; the message has the counterexample and the timeline.
        BadInput: Formula, regions or numbers are wrong.
    """
    __tracebackhide__ = True
    if isinstance(margin, bool) or not isinstance(margin, int | float) or not 0 <= margin <= 1e6:
        raise BadInput(f"margin must be a number of metres from 0 to a million, not {str(margin)[:40]}.")
    if isinstance(flight, Trajectory):
        mission = _mission(regions, flight.evaluate(0.0)[:3], Spec(formula=formula, trace=_trace(flight)))
        timeline = _timeline(mission, flight, margin)
        verdict = judge_formula(mission, {ROBOT: timeline}, relations(mission))[0]
    else:
        if max_speed is None:
            raise AssertionError("a sampled path proves nothing without a speed bound: give max_speed in m/s")
        if not isinstance(flight, Sequence) or len(flight) != 2:
            raise BadInput("Give a Trajectory, or the samples as (times, positions).")
        times = np.asarray(flight[0], dtype=np.float64)
        positions = np.asarray(flight[1], dtype=np.float64)
        if positions.ndim != 2 or positions.shape[1:] != (3,) or times.shape != positions.shape[:1] or not len(times):
            raise BadInput(f"Samples are times (n,) and positions (n, 3), not {times.shape} and {positions.shape}.")
        mission = _mission(regions, positions[0], Spec(formula=formula))
        verdict = check_samples(times, positions, mission, max_speed=max_speed, error=error)
        timeline = sampled_timeline(
            ROBOT, times - times[0], positions, mission.all_regions, speed=float(max_speed), error=error
        )
    if not verdict:
        raise AssertionError(_report(verdict, timeline))


def assert_within_limits(
    trajectory: Trajectory,
    *,
    vehicle: str = "crazyflie-2.1",
    **limits: float,
) -> None:
    """Fail unless a trajectory keeps a vehicle's limits at all times.

    Args:
        trajectory: The flight.
        vehicle: Name of a shipped profile.
        **limits: Tighter ones, as in a mission file: speed, acceleration, thrust_min, thrust_max, tilt_deg,
            body_rate_deg, yaw_rate_deg.

    Raises:
        AssertionError: A limit is broken, or its keeping could not be proved; the message has each such limit.
        BadInput: There is no such vehicle or limit.
    """
    __tracebackhide__ = True
    start = trajectory.evaluate(0.0)
    try:
        mission = _mission({}, start[:3], Spec(formula="true", trace=_trace(trajectory)), vehicle, Limits(**limits))  # type: ignore[arg-type]  # checked by the schema
    except ValidationError as problem:
        first = problem.errors()[0]
        raise BadInput(f"{'.'.join(map(str, first['loc'])) or 'limits'}: {first['msg']}.") from None
    plan = RobotPlan(
        word=Word((frozenset(),)),
        waypoints=(Waypoint(position=mission.agents[ROBOT].start, role="start"),),
        times=(0.0,),
    )
    evidence = Evidence.of(Plan(mission=mission, robots={ROBOT: plan}), {ROBOT: trajectory})
    refused = [claim.sentence for claim in limit_claims(evidence) if claim.verdict != "holds"]
    if refused:
        raise AssertionError("\n".join(refused))


def _trace(trajectory: Trajectory) -> Any:
    return "finite" if trajectory.cycle is None else "infinite"


def _mission(
    regions: Regions, start: ArrayLike, spec: Spec, vehicle: str = "crazyflie-2.1", limits: Limits | None = None
) -> Mission:
    """Wrap what is asked into a mission of one robot in a wide world."""
    found = regions.all_regions if isinstance(regions, Mission) else {n: _region(n, r) for n, r in regions.items()}
    x, y, z = (float(value) for value in np.asarray(start))
    return Mission.model_validate(
        {
            "name": "assertion",
            "spec": spec,
            "regions": {name: Region.model_validate(_plain(region)) for name, region in found.items()},
            "agents": {ROBOT: Agent(start=(x, y, z))},
            "vehicle": vehicle,
            "limits": limits or Limits(),
            "workspace": Box(min=(-_FAR, -_FAR, -_FAR), max=(_FAR, _FAR, _FAR)),
        }
    )


def _plain(region: Region) -> dict[str, Any]:
    """Return a hoop's ellipsoid without its ring."""
    return {"center": region.center, "radii": region.radii, "yaw_deg": region.yaw_deg, "matrix": region.matrix}


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
    except (TypeError, ValueError):
        raise BadInput(f"Region '{name}' must be a Region, (centre, radius) or (centre, (a, b, c)), not {value!r}.") from None


def _timeline(mission: Mission, trajectory: Trajectory, margin: float) -> Timeline:
    paths = read_team(mission, {ROBOT: trajectory})
    initial, found = changes(statuses(levels(paths), Fraction(margin))[ROBOT])
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
