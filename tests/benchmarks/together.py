"""Teams that are counted, all at once: how long they fly, against the longest of their robots flown alone at the same pace.

    OMP_NUM_THREADS=1 python -m tests.benchmarks.together [ROBOTS ...]

Half of the robots gather in one region, two come to another one at the same time, and never three, and all go home. By default there are 4, 6 and 10.
"""

from __future__ import annotations

import sys
import time

import ltlplan
import verify
from refine import refine
from tests.helpers.benchmarks import run_benchmark
from tests.helpers.counted_halls import gathering, longest_alone


def main() -> int:
    """Print the table; the exit code counts flights that are refused."""
    refused = 0
    print("| robots | pace | planning, s | refinement, s | cost | longest alone, s | all at once, s | ratio |")
    print("|---|---|---|---|---|---|---|---|")
    for count in [int(argument) for argument in sys.argv[1:]] or [4, 6, 10]:
        for pace in ("nominal", "0.7", "1"):
            begin = time.process_time()
            plan = ltlplan.plan(gathering(count, pace))
            planned = time.process_time()
            team = refine(plan)
            refined = time.process_time()
            alone, lasts = longest_alone(plan), max(flight.duration for flight in team.values())
            refused += not verify.judge(plan, team, largest=False).holds
            print(
                f"| {count} | {pace} | {planned - begin:.1f} | {refined - planned:.1f} | {plan.cost:.1f} | {alone:.1f} | {lasts:.1f} | "
                f"{lasts / alone:.2f} |"
            )
    return refused


if __name__ == "__main__":
    run_benchmark(main, ["4"])
