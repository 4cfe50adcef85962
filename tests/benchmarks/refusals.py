"""Random plans by the hundred: how many are certified, how many refused, how long each takes, and whether a refusal was wrong.

    OMP_NUM_THREADS=1 python -m tests.benchmarks.refusals [FIRST [LAST]]

refines the plans of these seeds (0 to 299 where none are given) as `tests/refine/test_random_plans.py` does; every flight passes
the judge or is named, every refusal is held to a dense search for an easy answer.
"""

from __future__ import annotations

import sys
import time
from contextlib import suppress

import numpy as np
import pytest

import refine
from tests.helpers.benchmarks import run_benchmark
from tests.helpers.motion.random_plans import random_plan
from tests.refine import test_random_plans as plans
from verify.data import DoesNotFit, Infeasible


def main() -> None:
    """Refine, judge and print what came of it."""
    first, last = [*map(int, sys.argv[1:]), *(0, 300)[len(sys.argv) - 1 :]][:2]
    count, wrong = plans.Count(), []
    seconds: dict[str, list[float]] = {"flown": [], "refused": []}
    for seed in range(first, last):
        plan, start, kind = random_plan(seed), time.perf_counter(), "refused"
        with suppress(Infeasible, DoesNotFit):
            refine.refine(plan)
            kind = "flown"
        seconds[kind].append(time.perf_counter() - start)
        try:
            plans.hold_to_it(seed, count)
        except (AssertionError, pytest.fail.Exception) as error:
            wrong.append(seed)
            print(f"seed {seed}: {str(error)[:200]}", flush=True)
    print(f"seeds {first} to {last - 1}: {count.certified} certified ({count.at_once} at once), {count.refused} refused")
    print(f"wrong: {wrong or 'none'}")
    for kind, times in seconds.items():
        if times:
            middle, most = np.median(times), max(times)
            print(f"{kind}: {middle:.2f} s in the middle, {np.percentile(times, 95):.2f} s at 95 %, {most:.1f} s at most")


if __name__ == "__main__":
    run_benchmark(main, ["0", "2"])
