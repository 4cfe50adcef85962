"""What a roadmap of many obstacles and regions takes: to lay it out, for one way, and for the lengths between all regions.

python tests/benchmarks/roadmaps.py [--rows 20]
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np

from ltlplan.free_space.free_space import FreeSpace, Place
from tests.helpers.benchmarks import run_benchmark
from tests.helpers.missions.walled_rooms import shelves

WAYS = 40


def seconds(work: Callable[..., object], *told: object) -> float:
    """Return the processor time of some work, s."""
    begun = time.process_time()
    work(*told)
    return time.process_time() - begun


def main() -> None:
    """Print what a hall takes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=20, help="rows of ten posts, with a region beside each")
    mission = shelves(parser.parse_args().rows, "F at0_0")
    space = FreeSpace.of(mission)
    laying = seconds(lambda: space.roadmap().joints)
    middles = {name: np.array(region.center) for name, region in mission.regions.items()}
    drawn = np.random.default_rng(0).choice(sorted(middles), (WAYS, 2))
    spent = sorted(seconds(space.way, middles[one], middles[other], {one, other}) for one, other in drawn)
    places = [Place(tuple(center.tolist()), frozenset({name})) for name, center in middles.items()]
    between = seconds(lambda: [space.lengths(place, places) for place in places])
    size = np.subtract(mission.workspace.max, mission.workspace.min)
    print(f"{len(mission.obstacles)} obstacles, {len(middles)} regions, a hall of {size[0]:g} m by {size[1]:g} m")
    print(f"points of the roadmap: {len(space.roadmap().bends.points)}, lines: {len(space.roadmap().joints.first)}")
    print(f"laid out in {laying:.2f} s")
    print(f"{WAYS} ways: {1000 * spent[0]:.1f} to {1000 * spent[-1]:.1f} ms, half of them in {1000 * spent[WAYS // 2]:.1f} ms")
    print(f"lengths between all regions: {between:.2f} s")


if __name__ == "__main__":
    run_benchmark(main, ["--rows", "2"])
