"""How long the judge takes for obstacles: a robot that flies through the streets of a town of two hundred houses.

python tests/benchmarks/obstacles.py
"""

from __future__ import annotations

import time

import numpy as np

from tests.helpers.benchmarks import run_benchmark
from verify.data import Mission, Trajectory, load_vehicle
from verify.data.sections import Agent, Box, Spec
from verify.data.shapes.obstacle import Obstacle
from verify.motion.obstacles.approaches import SolidWorld
from verify.motion.paths import read_team

PIECES = 500
SMOOTH = np.array([0, 0, 0, 0, 35, -84, 70, -20])


def house(kind: str, x: int, y: int) -> Obstacle:
    """Return a house of 0.4 m about a crossing of the grid."""
    center = (float(x), float(y), 1.0)
    corners = [[x - 0.25, y - 0.2], [x + 0.2, y - 0.25], [x + 0.25, y + 0.1], [x + 0.1, y + 0.25], [x - 0.2, y + 0.2]]
    shapes = {
        "boxes": {"center": center, "size": [0.4, 0.4, 1.5], "yaw_deg": 5.0 * y},
        "cylinders": {"center": center, "cylinder": {"radius": 0.22, "height": 1.5}},
        "prisms": {"prism": {"polygon": corners, "z": [0.2, 1.8]}},
        "ellipsoids": {"center": center, "radii": [0.25, 0.2, 0.8], "yaw_deg": 20.0},
    }
    return Obstacle.model_validate(shapes[kind])


def streets(rng: np.random.Generator) -> Trajectory:
    """Return a walk from crossing to crossing between the houses, at rest at each."""
    places, way = [np.array([0.5, 0.5, 1.0])], np.array([1, 0])
    while len(places) <= PIECES:
        turn = np.array([(1, 0), (-1, 0), (0, 1), (0, -1)][int(rng.integers(4))])
        there = np.floor(places[-1][:2]) + turn
        if (there >= 0).all() and (there < [19, 9]).all() and (turn + way).any():
            places.append(np.array([*(there + 0.5 + rng.uniform(-0.08, 0.08, 2)), 1 + 0.1 * rng.normal()]))
            way = turn
    corners = np.array(places)
    table = np.zeros((PIECES, 4, 8))
    table[:, :3] = np.diff(corners, axis=0)[:, :, None] * SMOOTH / 1.5 ** np.arange(8)
    table[:, :3, 0] += corners[:-1]
    return Trajectory(np.full(PIECES, 1.5), table.astype(np.float32).astype(np.float64))


def main() -> None:
    """Print what each shape costs."""
    flight = streets(np.random.default_rng(0))
    start = Agent(start=tuple(flight.coefficients[0, :3, 0].tolist()))
    space = Box(min=(-2, -2, 0), max=(22, 12, 3))
    for kind in ("boxes", "cylinders", "prisms", "ellipsoids"):
        houses = {f"h{x}_{y}": house(kind, x, y) for x in range(20) for y in range(10)}
        mission = Mission(
            name="town", spec=Spec(formula="true"), agents={"r": start}, vehicle=load_vehicle("crazyflie-2.1"), workspace=space
        ).model_copy(update={"obstacles": houses})
        world = SolidWorld.of(read_team(mission, {"r": flight}))
        spent = []
        for _ in range(6):
            begun = time.process_time()
            nearest, *_ = world.approaches({"r": 0.12})["r"]
            spent.append(time.process_time() - begun)
        near = 2 * PIECES  # a street has houses on both sides
        print(
            f"{kind:10}  {PIECES} pieces, {len(houses)} obstacles: {1000 * min(spent):5.1f} ms, {1e6 * min(spent) / near:4.1f} us a piece "
            f"and near obstacle (nearest {nearest.high:.3f} m)"
        )


if __name__ == "__main__":
    run_benchmark(main)
