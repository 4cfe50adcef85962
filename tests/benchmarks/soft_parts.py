"""Times of missions with soft parts: which of them to keep, and the plan that keeps them.

Run `OMP_NUM_THREADS=1 python tests/benchmarks/soft_parts.py [SEEDS] [FAMILY]`, where a family is `families`, `drawn` or `sequences`; all without it. Times are CPU
seconds of this process, of `ltlplan.plan` from the mission on.
"""

from __future__ import annotations

import random
import statistics
import sys
import time
from collections.abc import Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import ltlplan
from tests.helpers.benchmarks import is_smallest, run_benchmark
from tests.helpers.missions.worlds import world
from verify.data import Mission, Plan

EIGHT = {f"p{i}": (float(3 * i % 8), 1.3 * i - 4.0) for i in range(8)}
FIVE = {"a": (0.0, 0.0), "b": (2.0, 0.0), "c": (2.0, 1.5), "d": (-1.5, 2.0), "e": (3.5, -1.5)}
SHAPES = ("F {}", "G !{}", "!{} U {}", "F({} & F {})", "G({} -> F {})", "F G !{}", "F {} & G !{}", "{} R !{}", "free U {}")
TEAMS = ((1, "own"), (2, "own"), (3, "own"), (3, "joint"), (4, "joint"))
Parts = Sequence[tuple[str, float]]
FAMILIES: dict[str, Parts] = {
    "all can be kept": [(f"F p{i}", 1.0) for i in range(8)],
    "half against half": [*((f"F p{i}", 1.0 + i) for i in range(4)), *((f"G !p{i}", 2.0) for i in range(4))],
    "in a circle": [(f"!p{i} U p{(i + 1) % 8}", 1.0) for i in range(8)],
    "answers": [*((f"G(p{i} -> F p{i + 3})", 1.0) for i in range(4)), *((f"F(p{i} & F p{(i + 1) % 4})", 2.0) for i in range(4))],
    "meetings by names of places": [
        *((f"F(p{i} & p{i + 1})", 1.0) for i in range(4)), *((f"G !(p{i} & p{(i + 1) % 4})", 1.0 + i) for i in range(4)),
    ],
    "counts": [*((f"F(count(p{i}) >= 2)", 1.0) for i in range(4)), *((f"G(count(p{i}) <= 1)", 2.0) for i in range(4))],
}  # fmt: skip


def wishing(formula: str, parts: Parts, regions: dict[str, tuple[float, float]], robots: int, team: str) -> Mission:
    """Return a mission with soft parts."""
    plain = world(formula, robots=robots, regions=regions, team=team)
    return plain.changed(spec={**plain.spec.model_dump(), "soft": [{"formula": text, "weight": by} for text, by in parts]})


def drawn(seed: int, robots: int, team: str) -> Mission:
    """Return a mission with eight parts that are drawn."""
    draw = random.Random(seed)

    def part() -> str:
        shape = draw.choice(SHAPES)
        return shape.format(*(draw.choice(list(FIVE)) for _ in range(shape.count("{}"))))

    parts = [(part(), draw.choice([0.1, 0.2, 0.3, 1.0, 2.0])) for _ in range(8)]
    return wishing(draw.choice(["F a", "F(a | b)", "true"]), parts, FIVE, robots, team)


def sequences(seed: int, count: int, robots: int, team: str) -> Mission:
    """Return a mission with soft sequences of three places each, in orders that are drawn."""
    draw = random.Random(seed)
    shape = "F({} & F({} & F {}))"
    parts = [(shape.format(*draw.sample(list(EIGHT), 3)), draw.choice([1.0, 2.0, 3.0])) for _ in range(count)]
    return wishing("true", parts, EIGHT, robots, team)


def planned(mission: Mission) -> tuple[float, Plan]:
    """Return the CPU time of planning, s, and the plan."""
    begin = time.process_time()
    made = ltlplan.plan(mission)
    return time.process_time() - begin, made


def said(made: Plan) -> str:
    """Return what is said of the weight that is kept."""
    return " ".join(note for note in made.notes if note.startswith(("Planned words keep", "Not all choices")))


def main() -> None:
    """Print a line for each family and team, and what drawn ones take."""
    seeds, only = int(sys.argv[1]) if len(sys.argv) > 1 else 20, sys.argv[2] if len(sys.argv) > 2 else None
    for each in (families, drawn_ones, all_sequences):
        if only is None or each.__name__.startswith((only, f"all_{only}")):
            each(seeds)


def all_sequences(seeds: int) -> None:
    """Print, for more and more sequences, times, how many plans are proved cheapest, and how far bounds are from the others' costs."""
    for robots, team in TEAMS[:2] if is_smallest() else TEAMS:
        for count in (2,) if is_smallest() else (2, 4, 6, 8, 10):
            made = [planned(sequences(seed, count, robots, team)) for seed in range(seeds)]
            seconds = [taken for taken, _ in made]
            gaps = [
                1.0 - plan.lower_bound / plan.cost for _, plan in made if not plan.complete and plan.lower_bound is not None
            ]
            most = f", {statistics.median(gaps):.0%} between bound and cost of the others in the middle" if gaps else ""
            print(
                f"{count} sequences, {robots} robots, {team}: {statistics.median(seconds):.2f} s in the middle, {max(seconds):.2f} s "
                f"at most; {sum(plan.complete for _, plan in made)} of {seeds} proved cheapest{most}",
                flush=True,
            )


def families(_: int) -> None:
    """Print a line for each family and team."""
    for name, parts in FAMILIES.items():
        for robots, team in TEAMS[:2] if is_smallest() else TEAMS:
            if team == "own" and (name == "counts" or name.startswith("meetings")):
                continue
            seconds, made = planned(wishing("true", parts, EIGHT, robots, team))
            print(f"{name}, {robots} robots, {team}: {seconds:.2f} s. {said(made)}", flush=True)


def drawn_ones(seeds: int) -> None:
    """Print what missions with drawn parts take."""
    for robots, team in TEAMS[:2] if is_smallest() else TEAMS:
        taken = [planned(drawn(seed, robots, team))[0] for seed in range(seeds)]
        middle, most = statistics.median(taken), max(taken)
        print(f"{seeds} drawn, {robots} robots, {team}: {middle:.2f} s in the middle, {most:.2f} s at most", flush=True)


if __name__ == "__main__":
    run_benchmark(main, ["1"])
