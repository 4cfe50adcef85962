"""Flights made by hand for the tests: polynomials from numpy, plans around them, and a certificate's stand-in."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from fractions import Fraction

import numpy as np

from flight.logs.log import FlightLog
from tests.helpers.missions.hoops import small_mission
from verify.data import Mission, Plan, RobotPlan, Trajectory, Visit, Waypoint, Word
from verify.data.files.mission_file import parse_mission

HOOP6 = np.array([(1, 0, 0.8), (2, 1, 1), (0.5, 2, 1.3), (-1, 1, 1.1), (-0.6, -0.8, 0.9), (1, 0, 0.8)], dtype=float)


def float32(values) -> np.ndarray:
    return np.asarray(values, dtype=np.float32).astype(np.float64)


def rest_to_rest(points, times, yaw=0.0) -> Trajectory:
    """Straight legs, at rest at each point: the degree-7 polynomial with no velocity, acceleration, jerk at its ends."""
    points, times = np.asarray(points, dtype=float), np.asarray(times, dtype=float)
    shape = np.array([35.0, -84.0, 70.0, -20.0])
    coefficients = np.zeros((len(times), 4, 8))
    for i, duration in enumerate(times):
        step = points[i + 1] - points[i]
        coefficients[i, :3, 0] = points[i]
        for power, value in zip(range(4, 8), shape, strict=True):
            coefficients[i, :3, power] = value * step / duration**power
    coefficients[:, 3, 0] = yaw
    return Trajectory(float32(times), float32(coefficients))


def minimum_snap(points, times) -> Trajectory:
    """The minimum-snap path through points at rest at both ends, by solving its optimality conditions."""
    points, n = np.asarray(points, dtype=float), len(times)

    def row(piece, time, order):
        entry = np.zeros(n * 8)
        for k in range(order, 8):
            entry[piece * 8 + k] = np.prod(np.arange(k - order + 1, k + 1)) * time ** (k - order)
        return entry

    rows = [(row(i, 0.0, 0), points[i]) for i in range(n)] + [(row(i, times[i], 0), points[i + 1]) for i in range(n)]
    rows += [(row(0, 0.0, d), np.zeros(3)) for d in (1, 2, 3)] + [(row(n - 1, times[-1], d), np.zeros(3)) for d in (1, 2, 3)]
    rows += [(row(i, times[i], d) - row(i + 1, 0.0, d), np.zeros(3)) for i in range(n - 1) for d in range(1, 7)]
    solved = np.linalg.solve(np.array([r for r, _ in rows]), np.array([b for _, b in rows])).reshape(n, 8, 3)
    coefficients = np.zeros((n, 4, 8))
    coefficients[:, :3] = solved.transpose(0, 2, 1)
    return Trajectory(float32(times), float32(coefficients))


def hoop6(speed=1.0) -> Trajectory:
    """The course that all peers were measured on, each leg's time its length over `speed`."""
    return minimum_snap(HOOP6, np.linalg.norm(np.diff(HOOP6, axis=0), axis=1) / speed)


MISSION = """
format: 1
name: two-tasks
spec: {formula: F left & F right & G(right -> carrying)}
regions:
  left: {center: [0.0, 0.8, 1.0], radii: [0.2, 0.2, 0.2]}
  right: {center: [0.0, -0.8, 1.0], radii: [0.2, 0.2, 0.2]}
  tank: {center: [0.8, -0.4, 0.9], radii: [0.2, 0.2, 0.2]}
robot:
  initial: empty
  states: {empty: [], full: [carrying]}
  actions: [{from: empty, to: full, at: tank}]
agents:
  quad0: {start: [1.2, -0.9, 0.8]}
  quad1: {start: [1.2, 0.9, 0.8]}
vehicle: VEHICLE
limits: {}
workspace: {min: [-1.6, -1.3, 0.2], max: [1.6, 1.3, 1.8]}
margin: 0.05
"""


def mission(vehicle="crazyflie-2.1") -> Mission:
    return parse_mission(MISSION.replace("VEHICLE", vehicle))


def flight(vehicle="crazyflie-2.1") -> tuple[Plan, dict[str, Trajectory]]:
    """A plan for two robots, and trajectories that fly it: quad0 by the tank to `right`, quad1 to `left`."""
    made = mission(vehicle)
    starts = {name: agent.start for name, agent in made.agents.items()}
    goals = {"quad0": [made.regions["tank"].center, made.regions["right"].center], "quad1": [made.regions["left"].center]}
    team = {name: rest_to_rest([starts[name], *goals[name]], [2.5, 2.5][: len(goals[name])]) for name in starts}
    action = made.robot.actions[0]
    visits = {"quad0": (Visit(region="tank", actions=(action,)), Visit(region="right")), "quad1": (Visit(region="left"),)}
    words = {
        "quad0": Word.of([[], ["tank"], ["tank", "carrying"], ["carrying"], ["right", "carrying"]]),
        "quad1": Word.of([[], ["left"]]),
    }
    robots = {
        name: RobotPlan(
            word=words[name],
            visits=visits[name],
            waypoints=tuple(Waypoint(position=tuple(p), role="via") for p in [starts[name], *goals[name]]),
            times=tuple(float(t) for t in team[name].knots),
        )
        for name in starts
    }
    return Plan(mission=made, robots=robots), team


def hop() -> tuple[Plan, dict[str, Trajectory]]:
    """A plan for one robot, and a flight of a second for it: enough where a test asks what differs between two flights."""
    made = mission()
    made = made.model_copy(update={"agents": {"quad0": made.agents["quad0"]}})
    start = made.agents["quad0"].start
    team = {"quad0": rest_to_rest([start, (start[0] - 0.3, start[1], start[2])], [1.0])}
    waypoints = (Waypoint(position=start, role="start"),)
    return Plan(
        mission=made, robots={"quad0": RobotPlan(word=Word.of([[]]), visits=(), waypoints=waypoints, times=(0.0,))}
    ), team


@dataclass(frozen=True)
class Instant:
    robot: str
    visit: int
    time: Fraction
    source: str
    target: str


@dataclass(frozen=True)
class Claim:
    name: str = "formula"
    outcome: str = "holds"
    sentence: str = "it holds."


@dataclass(frozen=True)
class StandIn:
    """What flight uses of a certificate, without a proof."""

    mission: Mission
    trajectories: dict[str, str]
    margin: float = 0.05
    claims: tuple[Claim, ...] = (Claim(),)
    actions: tuple[Instant, ...] = ()
    duration: float = 5.0
    note: str = field(default="stand-in")

    def covers(self, team) -> bool:
        return {name: path.digest() for name, path in team.items()} == self.trajectories

    def digest(self) -> str:
        return hashlib.sha256(repr(sorted(self.trajectories.items())).encode()).hexdigest()


def stand_in(plan: Plan, team, **changes) -> StandIn:
    """A certificate's stand-in for a team; quad0 fills its tank, if it visits it, at 2.5 s."""
    visits = any(visit.region == "tank" for visit in plan.robots["quad0"].visits)
    actions = (Instant("quad0", 0, Fraction(5, 2), "empty", "full"),) if visits else ()
    return StandIn(plan.mission, {name: path.digest() for name, path in team.items()}, actions=actions, **changes)


def hover(pieces=1, place=(0.0, 0.0, 1.0), duration=1.0) -> Trajectory:
    """Pieces of a hover, all of one length in s."""
    coefficients = np.zeros((pieces, 4, 8))
    coefficients[:, :3, 0] = float32(place)
    return Trajectory(np.full(pieces, duration), coefficients)


def changed_log(log: FlightLog, **changes: object) -> FlightLog:
    """Return a log with some of its columns replaced, and nothing that was said of it."""
    values = {
        name: getattr(log, name)
        for name in ("mission", "robots", "times", "position", "velocity", "attitude", "thrust", "rates", "error", "letters")
    }
    return FlightLog(**{**values, **changes})


def through_a_hoop() -> tuple[Plan, dict[str, Trajectory]]:
    """A plan for a mission that has a sequence of hoops and no formula, and a flight of two seconds for it."""
    made = small_mission()
    start = made.agents["quad0"].start
    team = {"quad0": rest_to_rest([start, (1.2, 0.0, 1.0)], [2.0])}
    waypoints = (Waypoint(position=start, role="start"), Waypoint(position=(1.2, 0.0, 1.0), role="end"))
    robot = RobotPlan(
        word=Word.of([[], ["h0"], []]), visits=(Visit(region="h0", direction="F"),), waypoints=waypoints, times=(0.0, 2.0)
    )
    return Plan(mission=made, robots={"quad0": robot}), team
