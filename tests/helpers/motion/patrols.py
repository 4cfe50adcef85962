"""A robot that speeds up and goes round and round, made by hand: laps that are flown through."""

from __future__ import annotations

import numpy as np

from tests.helpers.motion.flights import plan_of, small_mission
from verify.data import Trajectory
from verify.data.plan import Visit

EAST, NORTH = (
    "east: {center: [1.0, 0.0, 1.0], radii: [0.3, 0.3, 0.3]}",
    "north: {center: [0.0, 1.0, 1.0], radii: [0.3, 0.3, 0.3]}",
)


def hermite(begin: np.ndarray, end: np.ndarray, length: float) -> np.ndarray:
    """The piece of degree 7 between two states, of shape (4 orders, 4 axes)."""
    rows = [[np.prod(np.arange(k - d + 1, k + 1)) * t ** max(k - d, 0) if k >= d else 0.0 for k in range(8)] for t in (0.0, length) for d in range(4)]  # fmt: skip
    return np.linalg.solve(np.array(rows), np.concatenate([begin, end])).T


def circle(turn: float, speed: float) -> np.ndarray:
    """Position and derivatives on a circle of 1 m at a height of 1 m."""
    state = np.zeros((4, 4))
    for order in range(4):
        angle = turn + order * np.pi / 2
        state[order, :2] = speed**order * np.array([np.cos(angle), np.sin(angle)])
    state[0, 2] = 1.0
    return state


def patrol(speed: float = 1.0, repeat: int = 2, *, ahead: bool = False):
    """A robot that speeds up to the north-east and goes round and round, past east and north; looking ahead, it turns around once a lap."""
    begin = np.zeros((4, 4))
    begin[0, :3] = (1.4, -0.2, 1.0)
    turns = np.pi / 4 + np.pi / 2 * np.arange(5)
    states = [begin, *(circle(turn, speed) for turn in turns)]
    for turn, state in zip(turns, states[1:], strict=True):
        state[:2, 3] = (turn + np.pi / 2, speed) if ahead else 0.0
    lengths = np.array([2.0, *[np.pi / 2 / speed] * 4]).astype(np.float32).astype(np.float64)
    pieces = np.array([hermite(a, b, t) for a, b, t in zip(states, states[1:], lengths, strict=False)])
    path = Trajectory(lengths, pieces.astype(np.float32), cycle=1)
    mission = small_mission(
        "G F east & G F north", regions=f"{EAST}\n{NORTH}", starts=[begin[0, :3]], margin=0.05, trace="infinite"
    )
    mission = mission.model_copy(update={"spec": mission.spec.model_copy(update={"repeat": repeat})})
    visits = [Visit(region=name) for name in ("east", "north", "east")]
    plan = plan_of(mission, {"r0": visits})
    robot = plan.robots["r0"].model_copy(update={"cycle_visit": 1, "cycle_waypoint": 0})
    return plan.model_copy(update={"robots": {"r0": robot}}), path
