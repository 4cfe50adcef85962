"""Hand-made flights for tests: straight legs with full stops, exact in float32, made without any planner."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Sequence

import numpy as np

from ltlplan.missions import load_mission
from verify.data.files.mission_file import parse_mission
from verify.data.language.word import Word
from verify.data.mission import Mission
from verify.data.plan import Plan, RobotPlan, Visit, Waypoint
from verify.data.trajectory import Trajectory

_parsed = functools.lru_cache(maxsize=256)(parse_mission)
"""Many tests ask for the same mission, which nobody can change."""
REST_TO_REST = (35.0, -84.0, 70.0, -20.0)
"""Coefficients of s^4 to s^7 of the smooth step from 0 to 1 with three derivatives zero at both ends."""


def legs(
    points: Sequence[Sequence[float]], *, speed: float = 0.45, yaw: float = 0.0, hold: float = 0.0, cycle: int | None = None
) -> Trajectory:
    """Fly straight from point to point, stopping at each; `hold` s of hover come first."""
    at = np.array(points, dtype=np.float32).astype(np.float64)
    durations, pieces = [], []
    if hold:
        durations.append(hold)
        pieces.append(_piece(at[0], at[0], hold, yaw))
    for start, stop in itertools.pairwise(at):
        length = float(np.float32(max(float(np.linalg.norm(stop - start)) / speed, 0.25)))
        durations.append(length)
        pieces.append(_piece(start, stop, length, yaw))
    if not pieces:
        durations, pieces = [1.0], [_piece(at[0], at[0], 1.0, yaw)]
    return quantised(Trajectory(durations, np.array(pieces), cycle=cycle))


def quantised(trajectory: Trajectory) -> Trajectory:
    """Round all numbers to float32."""
    return Trajectory(
        trajectory.durations.astype(np.float32), trajectory.coefficients.astype(np.float32), cycle=trajectory.cycle
    )


def changed(trajectory: Trajectory, **entries: object) -> Trajectory:
    """Return a trajectory with durations, coefficients or cycle replaced."""
    values = {"durations": trajectory.durations, "coefficients": trajectory.coefficients, "cycle": trajectory.cycle, **entries}
    return Trajectory(values["durations"], values["coefficients"], cycle=values["cycle"])  # type: ignore[arg-type]


def through(mission: Mission, hoop: str, direction: str = "F") -> list[np.ndarray]:
    """Return the points that lead through a hoop: rear and front (or front and rear)."""
    ring = mission.hoops[hoop]
    centre, step = np.array(ring.center), (ring.reach or 0.0) * np.array(ring.normal)
    return [centre - step, centre + step] if direction == "F" else [centre + step, centre - step]


def plan_of(mission: Mission, visits: dict[str, Sequence[Visit]], words: dict[str, Word] | None = None) -> Plan:
    """Return a plan with just the visits (the judge reads nothing else of it)."""
    robots = {}
    for name, agent in mission.agents.items():
        start = Waypoint(position=agent.start, role="start")
        word = (words or {}).get(name) or Word.of([[]])
        robots[name] = RobotPlan(word=word, visits=tuple(visits.get(name, ())), waypoints=(start,), times=(0.0,))
    return Plan(mission=mission, robots=robots)


def firefighting() -> tuple[Plan, dict[str, Trajectory]]:
    """Return the fire-fighting mission flown by hand: quad0 water, smoke, loc2; quad1 loc1; quad2 stays."""
    mission = load_mission("firefighting")
    visits = {
        "quad0": (
            Visit(region="water", direction="F", actions=(mission.robot.actions[0],)),
            Visit(region="smoke", direction="F"),
            Visit(region="loc2", direction="F"),
        ),
        "quad1": (Visit(region="loc1", direction="F"),),
    }
    start = {name: np.array(agent.start) for name, agent in mission.agents.items()}
    team = {
        "quad0": legs([start["quad0"], *through(mission, "water"), *through(mission, "smoke"), *through(mission, "loc2")]),
        "quad1": legs([start["quad1"], [0.6, 0.1, 0.9], *through(mission, "loc1")], hold=6.0),
        "quad2": legs([start["quad2"]]),
    }
    return plan_of(mission, visits), team


def small_mission(
    formula: str = "true",
    *,
    regions: str = "a: {center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}",
    hoops: str = "",
    starts: Sequence[Sequence[float]] = ((0.0, 0.0, 1.0),),
    extra: str = "",
    margin: float = 0.0,
    trace: str = "finite",
    vehicle: str = "crazyflie-2.1",
) -> Mission:
    """Return a mission in a roomy box, with regions and hoops as YAML lines."""
    agents = "\n".join(f"  r{i}: {{start: {[float(x) for x in start]}}}" for i, start in enumerate(starts))
    table = "\n".join(f"  {line}" for line in regions.splitlines())
    rings = "\n".join(f"  {line}" for line in hoops.splitlines())
    text = f"""
format: 1
name: small
spec: {{formula: "{formula}", trace: {trace}}}
{"regions:" if regions else ""}
{table}
{"hoops:" if hoops else ""}
{rings}
agents:
{agents}
vehicle: {vehicle}
workspace: {{min: [-5.0, -5.0, -5.0], max: [5.0, 5.0, 5.0]}}
margin: {margin}
{extra}
"""
    return _parsed(text)


def _piece(start: np.ndarray, stop: np.ndarray, length: float, yaw: float) -> np.ndarray:
    piece = np.zeros((4, 8))
    piece[:3, 0] = start
    piece[3, 0] = np.float32(yaw)
    for power, factor in enumerate(REST_TO_REST, start=4):
        piece[:3, power] = factor * (stop - start) / math.pow(length, power)
    return piece


def wandering(rng: np.random.Generator, *, pieces: int = 3, size: float = 1.0, still: int = 0) -> Trajectory:
    """Return a random flight whose Bernstein control points lie in a cube around (0, 0, 1); joined up to float32."""
    control = rng.uniform(-size, size, (pieces, 3, 8)) + np.array([0.0, 0.0, 1.0])[:, None]
    control[1:, :, 0] = control[:-1, :, -1]
    if still:
        control[:still] = control[:still, :, :1]
    durations = rng.uniform(0.3, 2.0, pieces).astype(np.float32).astype(np.float64)
    coefficients = np.zeros((pieces, 4, 8))
    for power in range(8):
        for i in range(power + 1):
            factor = math.comb(7, power) * math.comb(power, i) * (-1) ** (power - i)
            coefficients[:, :3, power] += factor * control[:, :, i]
        coefficients[:, :3, power] /= (durations**power)[:, None]
    return quantised(Trajectory(durations, coefficients))
