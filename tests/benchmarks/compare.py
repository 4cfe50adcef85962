"""Two checkouts beside each other: what the library's public calls take in both, measured in turns.

    git worktree add --detach OLD COMMIT
    OMP_NUM_THREADS=1 python tests/benchmarks/compare.py OLD [NEW] [--rounds 15] [--only planning]

A process in each checkout makes a case ready once; then both run it in turns, so that other work on the machine meets them alike.
A figure is processor time, the least of all rounds. Cases use names that both checkouts have, and so public ones. NEW is this
checkout where it is not given.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol

ROOT = Path(__file__).parents[2]
SHORTEST = 0.02
"""s that one round measures at least: what is quicker is called several times."""
CASES: dict[str, Callable[[], Callable[[], Any]]] = {}
"""By name, "what: how much": makes a case ready, and returns what is measured."""


def case(name: str) -> Callable[[Callable[[], Callable[[], Any]]], Callable[[], Callable[[], Any]]]:
    """Put a case into the table."""

    def put(make: Callable[[], Callable[[], Any]]) -> Callable[[], Callable[[], Any]]:
        CASES[name] = make
        return make

    return put


def by_method(method: str) -> Any:  # a Mission; importing its type here would load one checkout for both
    """Return the fire-fighting mission planned by another method."""
    import ltlplan

    mission = ltlplan.load_mission("firefighting")
    return mission.model_copy(update={"planner": mission.planner.model_copy(update={"method": method})})


def planned(name: str = "firefighting") -> Any:  # a Plan
    """Return the plan of a shipped mission."""
    import ltlplan

    return ltlplan.plan(ltlplan.load_mission(name), seed=0)


def field(regions: int) -> str:
    """Return a mission of one robot among so many balls, of which its formula names two."""
    side = int(regions**0.5) + 1
    balls = "".join(f"  r{i}: {{center: [{i % side}, {i // side}, 1], radii: [0.2, 0.2, 0.2]}}\n" for i in range(regions))
    workspace = f"{{min: [-2, -2, 0.2], max: [{side + 1}, {side + 1}, 2]}}"
    return (
        f"format: 1\nname: field\nspec: {{formula: F r1 & F r5}}\nregions:\n{balls}"
        f"agents: {{q: {{start: [-0.5, -0.5, 1]}}}}\nvehicle: crazyflie-2.1\nworkspace: {workspace}\n"
    )


@case("mission file: 128 regions")
def _() -> Callable[[], Any]:
    import ltlplan

    text = field(128)
    return lambda: ltlplan.parse_mission(text)


@case("planning: a formula of five responses to its automaton and back")
def _() -> Callable[[], Any]:
    import ltlplan

    text = " & ".join(f"G(a{i} -> F b{i})" for i in range(5))
    return lambda: ltlplan.decomposition_set(ltlplan.translate(text))


@case("planning: fire fighting, exact")
def _() -> Callable[[], Any]:
    import ltlplan

    mission = ltlplan.load_mission("firefighting")
    return lambda: ltlplan.plan(mission, seed=0)


@case("planning: fire fighting, MTAC-E")
def _() -> Callable[[], Any]:
    import ltlplan

    mission = by_method("mtac-e")
    return lambda: ltlplan.plan(mission, seed=0)


@case("planning: fire fighting, online MTAC-E")
def _() -> Callable[[], Any]:
    import ltlplan

    mission = by_method("online-mtac-e")
    return lambda: ltlplan.plan(mission, seed=0)


@case("planning: a sequence through three hoops")
def _() -> Callable[[], Any]:
    import ltlplan

    mission = ltlplan.load_mission("hoops-sequence")
    return lambda: ltlplan.plan(mission, seed=0)


@case("planning: a patrol")
def _() -> Callable[[], Any]:
    import ltlplan

    mission = ltlplan.load_mission("hoops-ltl")
    return lambda: ltlplan.plan(mission, seed=0)


@case("planning: two of 128 regions")
def _() -> Callable[[], Any]:
    import ltlplan

    mission = ltlplan.parse_mission(field(128))
    return lambda: ltlplan.plan(mission, seed=0)


def flown(mission: Any, seconds: float) -> Callable[[], Any]:
    """Return the steps of an online team whose robots are where they should be."""
    import numpy as np

    from ltlplan.online_mtac.online_team import OnlineTeam

    period, starts = 0.02, {name: agent.start for name, agent in mission.agents.items()}

    def fly() -> None:
        team, positions = OnlineTeam(mission, rng=np.random.default_rng(0)), starts
        for step in range(round(seconds / period)):
            desired = team.step(step * period, positions)
            positions = {name: tuple(desired.flat[0, :3, j]) for j, name in enumerate(team.pilots)}

    return fly


@case("online steps: 4 s of ten robots among nine balls")
def _() -> Callable[[], Any]:
    import ltlplan

    starts = "".join(f"  q{i}: {{start: [{-1.2 + 0.5 * (i % 5)}, {-0.6 - 0.6 * (i // 5)}, 1]}}\n" for i in range(10))
    wanted = " & ".join(f"F r{i}" for i in range(9))
    text = field(9).replace("F r1 & F r5", wanted).replace("agents: {q: {start: [-0.5, -0.5, 1]}}", f"agents:\n{starts}")
    return flown(ltlplan.parse_mission(text), 4.0)


@case("online steps: 6 s of fire fighting")
def _() -> Callable[[], Any]:
    import ltlplan

    return flown(ltlplan.load_mission("firefighting"), 6.0)


def walk(count: int) -> tuple[Any, Any]:
    """Return points of a random walk and times for them."""
    import numpy as np

    rng = np.random.default_rng(count)
    points = np.c_[rng.normal(size=(count, 3)).cumsum(axis=0), np.zeros(count)]
    return points, np.concatenate([[0.0], rng.uniform(0.5, 2.0, count - 1).cumsum()])


@case("refinement: minimum snap, 6 points")
def _() -> Callable[[], Any]:
    import refine

    points, times = walk(6)
    return lambda: refine.minimum_snap(points, times)


@case("refinement: minimum snap, 300 points")
def _() -> Callable[[], Any]:
    import refine

    points, times = walk(300)
    return lambda: refine.minimum_snap(points, times)


@case("refinement: shortest time through six points")
def _() -> Callable[[], Any]:
    import numpy as np

    import refine

    points = np.array([(1, 0, 0.8), (2, 1, 1), (0.5, 2, 1.3), (-1, 1, 1.1), (-0.6, -0.8, 0.9), (1, 0, 0.8)], dtype=float)
    limits = refine.Limits(speed=2.0, acceleration=8.0)
    return lambda: refine.time_optimal(points, limits)


@case("refinement: fire fighting, the plan's own times")
def _() -> Callable[[], Any]:
    import refine

    plan = planned()
    return lambda: refine.refine(plan)


@case("refinement: a sequence, time-optimised")
def _() -> Callable[[], Any]:
    import refine

    plan = planned("hoops-sequence")
    return lambda: refine.refine(plan, pace="time")


@case("certificates: fire fighting, all claims")
def _() -> Callable[[], Any]:
    import refine
    import verify

    plan = planned()
    team = refine.refine(plan)
    return lambda: verify.judge(plan, team, largest=False)


@case("certificates: fire fighting, and the largest margin")
def _() -> Callable[[], Any]:
    import refine
    import verify

    plan = planned()
    team = refine.refine(plan)
    return lambda: verify.judge(plan, team)


@case("certificates: a flight among 128 regions")
def _() -> Callable[[], Any]:
    import ltlplan
    import refine
    import verify

    plan = ltlplan.plan(ltlplan.parse_mission(field(128)), seed=0)
    team = refine.refine(plan)
    return lambda: verify.judge(plan, team, largest=False)


@case("words: a lasso of 56 letters")
def _() -> Callable[[], Any]:
    import verify

    prefix, cycle = (
        [[["a"], ["b"], [], ["a", "c"]][i % 4] for i in range(40)],
        [[["a"], [], ["b"], ["c"]][i % 4] for i in range(16)],
    )
    return lambda: verify.check_word("G(a -> F b) & G F c & (!c U a)", prefix, cycle)


@case("words: fifty robots, all orders")
def _() -> Callable[[], Any]:
    import verify

    words = {f"q{i}": [[], ["loc1"] if i % 2 else ["loc2"], []] for i in range(49)}
    words["carrier"] = [[], ["water"], ["carrying"], ["carrying", "smoke"], ["carrying"]]
    return lambda: verify.check_team("F loc1 & F loc2 & F smoke & G(smoke -> carrying)", words)


@case("recordings: 20 s at 100 Hz")
def _() -> Callable[[], Any]:
    import numpy as np

    import verify

    times = np.arange(0.0, 20.0, 0.01)
    places = np.stack([np.stack([np.sin(0.4 * times) - 0.5, 0.4 * times - 1.0, np.ones_like(times)], axis=1)], axis=1)
    import ltlplan

    mission = ltlplan.parse_mission(field(9))
    return lambda: verify.check_samples(times, places, mission, max_speed=1.0)


@case("flight: one robot to a ball beside it, with noise")
def _() -> Callable[[], Any]:
    import ltlplan
    import refine
    import verify

    text = field(9).replace("F r1 & F r5", "F r0").replace("q: {start: [-0.5, -0.5, 1]}", "q: {start: [-0.3, -0.3, 1]}")
    plan = ltlplan.plan(ltlplan.parse_mission(text), seed=0)
    team = refine.refine(plan)
    certificate = verify.certify(plan, team)
    import flight

    return lambda: flight.fly(plan, team, certificate, noise=0.001, seed=0)


class Side(Protocol):
    """A checkout that runs cases."""

    def __call__(self, name: str) -> float:
        """Run a case once and return its processor time, in s."""
        ...


def serve() -> None:
    """Run the cases whose names are read, and print what each took; what is made ready stays."""
    sys.path[0] = str(Path.cwd())  # for this file's folder, whose names are like the packages'
    ready: dict[str, tuple[Callable[[], Any], int]] = {}
    for line in sys.stdin:
        name = line.rstrip("\n")
        if name not in ready:
            run = CASES[name]()
            run()  # compiled and loaded from here on
            begun = time.process_time()
            run()
            ready[name] = run, 1 + int(SHORTEST / max(time.process_time() - begun, 1e-6))
        run, times = ready[name]
        begun = time.process_time()
        for _ in range(times):
            run()
        print((time.process_time() - begun) / times, flush=True)


@contextmanager
def side(checkout: Path) -> Iterator[Side]:
    """Give a checkout that runs cases in a process of its own."""
    environment = {**os.environ, "PYTHONPATH": str(checkout.resolve())}
    command = [sys.executable, str(Path(__file__).resolve()), "--serve"]
    process = subprocess.Popen(
        command, cwd=checkout, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
    )
    assert process.stdin is not None
    assert process.stdout is not None

    def run(name: str) -> float:
        process.stdin.write(name + "\n")
        return float(process.stdout.readline())

    try:
        yield run
    finally:
        process.stdin.close()
        process.wait()


def compare(old: Path, new: Path, *, rounds: int, only: str) -> None:
    """Print the table of all cases whose names hold a text."""
    print(f"{'ms, least of ' + str(rounds) + ' rounds':<62} {'before':>9} {'now':>9} {'now / before':>13}")
    with side(old) as before, side(new) as now:
        for name in (name for name in CASES if only in name):
            taken = [(before(name), now(name)) if i % 2 else (now(name), before(name))[::-1] for i in range(rounds)]
            first, second = (1e3 * min(figures) for figures in zip(*taken, strict=True))
            print(f"{name:<62} {first:9.3f} {second:9.3f} {second / first:13.2f}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("checkouts", nargs="*", type=Path, help="OLD, and NEW unless that is this checkout")
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--only", default="", help="cases whose names hold this")
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.serve:
        serve()
    elif len(asked.checkouts) in (1, 2):
        compare(asked.checkouts[0], (*asked.checkouts, ROOT)[1], rounds=asked.rounds, only=asked.only)
    else:
        parser.error("name the checkout to compare with")


if __name__ == "__main__":
    if "--serve" in sys.argv:  # in a checkout that may be older than the helper
        main()
    else:
        sys.path.insert(0, str(ROOT))
        from tests.helpers.benchmarks import run_benchmark

        run_benchmark(main, [str(ROOT), "--rounds", "1"])
