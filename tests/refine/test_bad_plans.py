"""Plans and questions that make no sense: a clear error, or a flight that is proved; never a hang or a traceback of an engine."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import verify
from refine import on_grid, refine
from tests.helpers.few import few_of
from tests.helpers.motion.plans_by_hand import ball, patrol_plan, robot_plan, room, straight
from verify.data import BadInput, Infeasible, Plan, Visit, Waypoint
from verify.data.plan import Role
from verify.data.sections import Agent
from verify.data.shapes.region import Hoop

POINTS = ((-1.5, 0, 1), (0, 0, 1), (1.0, 1.0, 1))


def plan_of(*points: tuple[float, float, float], visit: int = 1, times: tuple[float, ...] | None = None, **agent) -> Plan:
    """Return a plan that visits a ball in the middle, at these times instead of those of 0.45 m/s."""
    mission = room({"a": ball(0, 0)}, {"q": Agent(start=points[0], **agent)})
    robot = straight(*points, visits={visit: "a"})
    return Plan(mission=mission, robots={"q": robot if times is None else robot.model_copy(update={"times": times})})


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"pace": "fast"}, "pace is 'fast'; it must be a number above 0 up to 1, or one of 'nominal', 'time', 'blend'"),
        ({"pace": 1.5}, r"pace is 1\.5"),
        ({"pace": 0}, "pace is 0"),
        ({"pace": float("nan")}, "pace is nan"),
        ({"pace": True}, "pace is True"),
        ({"too_long": "cut"}, "too_long is 'cut'; it must be one of 'refuse', 'rest'"),
        ({"effort": "much"}, "effort is 'much'; it must be one of 'full', 'soon', 'least'"),
        ({"weight": 0.0}, "weight is 0.0"),
        ({"weight": float("nan")}, "weight is nan"),
        ({"weight": "much"}, "weight is 'much'"),
        ({"max_pieces": 0}, "max_pieces is 0"),
        ({"max_pieces": 3.5}, "max_pieces is 3.5"),
    ],
)
def test_wrong_options_are_named(asked: dict, message: str) -> None:
    with pytest.raises(BadInput, match=message):
        refine(plan_of(*POINTS), **asked)


@pytest.mark.parametrize("plan", ["x", None, 3, {"robots": {}}])
def test_what_is_no_plan_is_refused(plan: object) -> None:
    with pytest.raises(BadInput, match=f"refine takes a Plan, not {type(plan).__name__}"):
        refine(plan)  # pyright: ignore[reportArgumentType]


@few_of(1, "times", [(0.0, 0.0, 0.0), (0.0, 1e-9, 2e-9), (0.0, 5.0, 5.0)])
def test_no_time_at_all_becomes_enough_time(times: tuple[float, ...]) -> None:
    plan = plan_of(*POINTS, times=times)
    team = refine(plan)
    assert verify.judge(plan, team, largest=False).holds
    assert team["q"].duration > 2.0


@pytest.mark.parametrize("longest", [1e5, 1e9, 1e300])
def test_absurd_times_are_refused(longest: float) -> None:
    with pytest.raises(BadInput, match=r"q would fly for 1e\+\d+ s; plans of up to 86400 s"):
        refine(plan_of(*POINTS, times=(0.0, 0.5 * longest, longest)))


def test_points_that_coincide_are_one_point() -> None:
    plain = refine(plan_of(*POINTS))["q"]
    doubled = plan_of(POINTS[0], POINTS[0], POINTS[1], POINTS[1], POINTS[2], visit=2)
    team = refine(doubled)
    assert verify.judge(doubled, team, largest=False).holds
    assert team["q"].duration == pytest.approx(plain.duration, rel=1e-3)


def test_a_start_outside_the_workspace_is_refused() -> None:
    with pytest.raises(Infeasible, match=r"waypoint \(-5.000, 0.000, 1.000\) leaves the workspace"):
        refine(plan_of((-5.0, 0.0, 1.0), (0, 0, 1)))


def test_a_hoop_smaller_than_the_vehicle_is_refused() -> None:
    mission = room({}, {"q": Agent(start=(-1.5, 0.0, 1.0))})
    hoop = Hoop(center=(1.2, 0.0, 1.0), pitch_deg=0.0, radii=(0.3, 0.3, 0.3), opening=0.05, rim=0.02)
    mission = mission.model_copy(update={"hoops": {"h": hoop}})
    points = [Waypoint(position=(-1.5, 0.0, 1.0), role="start")]
    passage: tuple[tuple[float, Role], ...] = ((0.75, "rear"), (1.2, "centre"), (1.65, "front"))
    for x, role in passage:
        points.append(Waypoint(position=(x, 0.0, 1.0), role=role, region="h", visit=0))
    with pytest.raises(
        Infeasible, match=r"'h' has an opening of 0.05 m; vehicle radius 0.07 m and margin 0.05 m leave no room"
    ):
        refine(Plan(mission=mission, robots={"q": robot_plan(points, (Visit(region="h", direction="F"),))}))


def test_headings_across_half_a_turn_do_not_jump() -> None:
    """A flight that turns through the direction of -x: the heading goes on past pi, within its rate."""
    plan = plan_of((1.5, -0.8, 1), (0, 0, 1), (-1.0, 0.1, 1), (-1.5, -0.8, 1), (0.0, -1.5, 1), heading="path")
    flight = refine(plan)["q"]
    assert verify.judge(plan, {"q": flight}, largest=False).holds
    yaw = flight.evaluate(np.linspace(0, flight.duration, 2000))[:, 3]
    assert yaw.max() > np.pi  # without a jump the turn ends beyond half a turn
    assert np.abs(np.diff(yaw)).max() < 0.05
    for before, after in itertools.pairwise(np.hsplit(np.cumsum(flight.durations), len(flight.durations))):
        around = flight.evaluate(np.array([before[0] - 1e-6, before[0] + 1e-6]))[:, 3]
        assert after > before
        assert abs(around[1] - around[0]) < 1e-4


def test_a_flight_on_the_compressed_grid_lies_on_it_and_stays_near() -> None:
    plan = plan_of(*POINTS)
    flight = refine(plan)["q"]
    rounded = on_grid(flight)
    np.testing.assert_allclose(on_grid(rounded).coefficients, rounded.coefficients, atol=1e-6)
    times = np.linspace(0, flight.duration, 500)
    assert np.abs(rounded.evaluate(times)[:, :3] - flight.evaluate(times)[:, :3]).max() < 5e-3


@pytest.mark.slow
def test_a_lap_on_the_compressed_grid_closes() -> None:
    flight = refine(patrol_plan())["quad0"]
    rounded = on_grid(flight)
    assert rounded.cycle == flight.cycle is not None
    last, first = rounded.coefficients[-1], rounded.coefficients[rounded.cycle]
    np.testing.assert_allclose((last * rounded.durations[-1] ** np.arange(8)).sum(axis=-1)[:3], first[:3, 0], atol=1e-9)
