"""Random teams of two to six robots in random rooms: cost and duration as shares of bounds that owe nothing to the planner.

    OMP_NUM_THREADS=1 python -m tests.benchmarks.rooms [FIRST LAST] [each]

Seeds 0 to 69 by default, ten of each kind of formula. `each` prints a line for each mission, with why it is refused.
"""

from __future__ import annotations

import sys

from tests.helpers.benchmarks import run_benchmark
from tests.helpers.missions.room_figures import Figure, distribution, measured
from tests.helpers.missions.room_teams import KINDS, drawn

_SEEDS = ("0", "70")


def main() -> int:
    """Print the distribution by kind of formula, and over all."""
    numbers = [argument for argument in sys.argv[1:] if argument.isdigit()]
    first, last = (int(number) for number in numbers or _SEEDS)
    figures: list[tuple[str, Figure]] = []
    for seed in range(first, last):
        team = drawn(seed)
        figure = measured(team)
        figures.append((team.kind, figure))
        if "each" in sys.argv[1:]:
            line = f"cost {figure.cost:.2f}, nominal {figure.nominal:.2f}, paced {figure.paced:.2f}, {figure.seconds:.1f} s"
            print(f"{seed} {team.kind} {team.height} {len(team.starts)}: {figure.refusal or line}", flush=True)
    shares = ("cost", "nominal", "paced")
    print("| formula | missions | refused |" + "".join(f" {name}: median | 75 % | 90 % | most |" for name in shares))
    print("|---|---|---|" + "---|" * 12)
    for kind in (*KINDS, "all"):
        of_kind = [figure for name, figure in figures if kind in (name, "all")]
        cells = " | ".join(distribution([getattr(figure, name) for figure in of_kind]) for name in shares)
        print(f"| {kind} | {len(of_kind)} | {sum(bool(figure.refusal) for figure in of_kind)} | {cells} |")
    return 0


if __name__ == "__main__":
    run_benchmark(main, ["6", "7"])
