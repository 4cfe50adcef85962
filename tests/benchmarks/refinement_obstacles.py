"""Times of refinement among obstacles: a slalom between walls, and a straight hall with two hundred bodies beside the way.

Run by `OMP_NUM_THREADS=1 python -m tests.benchmarks.refinement_obstacles`; processor time, the second of two refinements.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

import verify
from refine import refine
from tests.helpers.benchmarks import run_benchmark
from tests.helpers.motion.plans_by_hand import robot_plan
from verify.data import Plan, Visit, Waypoint, parse_mission

NEAR = 0.125
"""m from walls at which the slalom turns: radius, margin and 5 mm."""


def plan_through(points: list[tuple[float, float, float]], obstacles: list[str], wide: float) -> Plan:
    """Return a plan of one robot by some points to a box at the last of them."""
    end = points[-1]
    mission = parse_mission(f"""
format: 1
name: obstacles
spec: {{formula: F goal}}
regions: {{goal: {{center: {list(end)}, size: [0.5, 0.5, 0.5]}}}}
agents: {{q: {{start: {list(points[0])}}}}}
vehicle: crazyflie-2.1
workspace: {{min: [-1, {-wide}, 0], max: [{end[0] + 1}, {wide}, 2]}}
margin: 0.05
obstacles: {{{", ".join(obstacles)}}}
""")
    led = [Waypoint(position=point, role="avoid") for point in points[1:-1]]
    start = Waypoint(position=points[0], role="start")
    goal = Waypoint(position=end, role="centre", region="goal", visit=0)
    return Plan(mission=mission, robots={"q": robot_plan([start, *led, goal], (Visit(region="goal"),))})


def slalom(walls: int) -> Plan:
    """Return a plan around the ends of walls that stand across a hall, left and right in turn."""
    obstacles, points = [], [(0.0, 0.0, 1.0)]
    for k in range(walls):
        x, side = 1.0 + 0.8 * k, 1.0 if k % 2 else -1.0
        obstacles.append(f"w{k}: {{center: [{x:.3f}, {1.35 * side}, 1], size: [0.05, 3.3, 2]}}")
        y = -side * (0.3 + NEAR)
        points += [(x - 0.025 - NEAR, y, 1.0), (x + 0.025 + NEAR, y, 1.0)]
    return plan_through([*points, (1.5 + 0.8 * walls, 0.0, 1.0)], obstacles, 3.0)


def hall(bodies: int) -> Plan:
    """Return a plan of thirty legs straight on, with bodies at random beside them."""
    rng = np.random.default_rng(0)
    obstacles = []
    for k in range(bodies):
        x, y, z = rng.uniform([0, 0.7, 0.3], [30, 9, 1.7])
        size = rng.uniform(0.1, 0.5, 3).round(3).tolist()
        obstacles.append(f"o{k}: {{center: [{x:.3f}, {y if k % 2 else -y:.3f}, {z:.3f}], size: {size}, yaw_deg: {7 * k % 90}}}")
    return plan_through([(float(x), 0.2 * float(np.sin(x)), 1.0) for x in range(31)], obstacles, 10.0)


def main() -> None:
    """Print a line for each plan."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--walls", type=int, nargs="*", default=[10, 30, 80])
    parser.add_argument("--obstacles", type=int, nargs="*", default=[1, 200])
    asked = parser.parse_args()
    cases = {f"slalom between {count} walls": slalom(count) for count in asked.walls}
    cases |= {f"hall with {count} obstacles": hall(count) for count in asked.obstacles}
    for name, plan in cases.items():
        seconds = []
        for _ in range(2):
            begin = time.process_time()
            team = refine(plan, pace="nominal", max_pieces=1000)
            seconds.append(time.process_time() - begin)
        proved = verify.judge(plan, team, largest=False).holds
        print(f"{name}: {len(team['q'])} pieces, {team['q'].duration:.1f} s, computed in {seconds[1]:.3f} s, proved: {proved}")


if __name__ == "__main__":
    run_benchmark(main, ["--walls", "10", "--obstacles", "1"])
