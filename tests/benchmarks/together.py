"""Teams that are counted, all at once: how long they fly, against the longest of their robots flown alone at the same pace.

    OMP_NUM_THREADS=1 python -m tests.benchmarks.together [ROBOTS ...] [rests]

Half of the robots gather in one region, two come to another one at the same time, and never three, and all go home. By default there are 4, 6, 10,
16 and 30. With 3, robots cross three fields side by side.
`rests` prints what small missions cost instead, against their lower bounds: machines that are shared, regions to keep out of, rooms to stay in.
"""

from __future__ import annotations

import sys
import time

import ltlplan
import verify
from refine import refine
from tests.helpers.benchmarks import run_benchmark
from tests.helpers.missions.counted_halls import abreast, gathering, longest_alone
from tests.helpers.missions.rooms_and_rests import (
    FIELD_OR_SPOT,
    escort,
    fields_or_spots,
    keeping_out,
    room_with_a_corner,
    shared_machine,
)

_ABREAST = 3
SHELF = "shelf: {center: [-1.3, 0, 1], size: [1.0, 2.0, 0.8]}"


def rests() -> int:
    """Print what small missions cost and how long they are flown; the exit code counts flights that are refused."""
    missions = {f"machine, {count} robots": shared_machine(count) for count in (2, 3, 4, 5)}
    missions |= {f"machine and shelf, {count} robots": shared_machine(count, more=SHELF) for count in (2, 3)}
    missions |= {f"machine with parts, {count} robots": shared_machine(count, parts=True) for count in (2, 3)}
    missions |= {"escort": escort(), "keep-out": keeping_out(), "obstacles": keeping_out(of="obstacles")}
    missions |= {"room with a corner": room_with_a_corner(), "field or spot": fields_or_spots(FIELD_OR_SPOT)}
    refused = 0
    print("| mission | planning, s | cost, m | lower bound, m | nominal, s | pace 0.7, s | refinement, s |")
    print("|---|---|---|---|---|---|---|")
    for name, mission in missions.items():
        begin = time.process_time()
        plan = ltlplan.plan(mission)
        planned = time.process_time()
        teams = [refine(plan, pace="nominal"), refine(plan, pace=0.7)]
        refined = time.process_time()
        refused += sum(not verify.judge(plan, team, largest=False).holds for team in teams)
        bound = "" if plan.lower_bound is None else f"{plan.lower_bound:.2f}"
        lasts = [f"{max(flown.duration for flown in team.values()):.1f}" for team in teams]
        print(
            f"| {name} | {planned - begin:.1f} | {plan.cost:.2f} | {bound} | {lasts[0]} | {lasts[1]} | {refined - planned:.1f} |",
            flush=True,
        )
    return refused


def main() -> int:
    """Print the table; the exit code counts flights that are refused."""
    if "rests" in sys.argv[1:]:
        return rests()
    refused = 0
    print("| robots | pace | planning, s | refinement, s | judging, s | cost | longest alone, s | all at once, s | ratio |")
    print("|---|---|---|---|---|---|---|---|---|")
    for count in [int(argument) for argument in sys.argv[1:]] or [3, 4, 6, 10, 16, 30]:
        for pace in ("nominal", "0.7", "1"):
            begin = time.process_time()
            plan = ltlplan.plan(abreast(pace) if count == _ABREAST else gathering(count, pace))
            planned = time.process_time()
            team = refine(plan)
            refined = time.process_time()
            alone, lasts = longest_alone(plan), max(flight.duration for flight in team.values())
            begin_judging = time.process_time()
            refused += not verify.judge(plan, team, largest=False).holds
            judged = time.process_time() - begin_judging
            print(
                f"| {count} | {pace} | {planned - begin:.1f} | {refined - planned:.1f} | {judged:.1f} | {plan.cost:.1f} | {alone:.1f} | {lasts:.1f} | "
                f"{lasts / alone:.2f} |"
            )
    return refused


if __name__ == "__main__":
    run_benchmark(main, ["4"])
