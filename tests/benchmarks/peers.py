"""Ours beside other tools, in one table: the same work in one process, in turns, with versions, what each proves, and the spread of the ratio.

    OMP_NUM_THREADS=1 python -m tests.benchmarks.peers [--rounds 5] [--only toppra]

Times are processor time. A ratio is the peer's figure over ours, the median of all rounds with the least and the greatest; above 1 ours is
the smaller. Peers that are not installed are left out and named. Those that need a compiler or a licence are listed in `PUBLISHED` with the figures that
they publish.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import itertools
import re
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

import ltlplan
import verify
from ltlplan.logic import spot_engine
from refine.solvers.fastest import time_optimal
from tests.benchmarks import audit, flight, refinement, times
from tests.helpers.benchmarks import installed, is_smallest, run_benchmark
from tests.helpers.stand_ins import hoop6
from verify.data.language.formula_reader import parse_formula
from verify.model_checking.timeline import Change, Enclosure, Relations, Timeline
from verify.model_checking.timing.timed_verdict import TimedJudge

_ROUNDS = itertools.count()
Pair = tuple[float, float]
"""A figure of the peer, and ours."""


@dataclass(frozen=True, slots=True)
class Row:
    """A comparison.

    Attributes:
        package: The peer's name on the package index; the same in lower case, with `_`, is imported unless `module` says otherwise.
        work: What both do, and the unit.
        measure: Does it once.
        proves: What the peer's answer says for certain, and what it does not.
        module: Name under which it is imported.
    """

    package: str
    work: str
    measure: Callable[[], Pair]
    proves: str
    module: str = ""


def spot() -> Pair:
    """Translate ten requirements on finite words to one automaton: s."""
    number = next(_ROUNDS)  # names that no round before had: answers are kept
    text = " & ".join(f"(!b{number}_{k} U a{number}_{k})" for k in range(3 if is_smallest() else 5))
    engine, begun = spot_engine.engine(), time.process_time()
    finite = engine.from_ltlf(text)
    engine.translate(finite, "deterministic")
    theirs, begun = time.process_time() - begun, time.process_time()
    ltlplan.translate(text)
    return theirs, time.process_time() - begun


def toppra() -> Pair:
    """Fly six hoops within limits of speed and acceleration: s of flight."""
    theirs = refinement._toppra()  # one figure of that page
    assert theirs is not None
    return theirs, float(time_optimal(refinement.HOOP6, refinement.HOOP6_LIMITS, pieces=2).duration)


def minimum_snap() -> Pair:
    """Minimum snap through given points at given times: ms."""
    row = next(row for row in refinement.fixed_times() if "minsnap-trajectories" in row)
    return row["minsnap-trajectories"], row["ours"]


def rotorpy() -> Pair:
    """Fly six hoops at 1 m/s with rotorpy's Crazyflie: worst distance from the plan, mm."""
    return flight.rotorpy_run(hoop6(1.0), 10)[1], flight.tracking(1.0)[1]


def rtamt_time() -> Pair:
    """Judge a formula of 20 bounded operators over 100 s with 200 changes: ms; rtamt reads 10 samples a second."""
    import rtamt

    robot = times.timeline(25 if is_smallest() else 100)
    ours = times.judged(len(robot.changes) // 2, slack=False)
    spec = rtamt.StlDiscreteTimeSpecification()
    for name in "abc":
        spec.declare_var(name, "float")
    spec.set_sampling_period(100, "ms", 0.1)
    spec.unit = "s"
    spec.spec = _as_stl(times.FORMULA)
    spec.parse()
    clock = np.arange(0.0, 100.0, 0.1)
    signals = {name: _samples(robot, name, clock) for name in "abc"}
    begun = time.process_time()
    spec.evaluate({"time": clock.tolist(), **{name: values.tolist() for name, values in signals.items()}})
    return 1000 * (time.process_time() - begun), ours


def rtamt_misses() -> Pair:
    """Of 100 flights that enter a forbidden region for 1 to 9 ms, those that are called safe."""
    import rtamt

    rng, missed, ours = np.random.default_rng(0), 0, 0
    clock = np.arange(0.0, 10.0, 0.01)
    for _ in range(10 if is_smallest() else 100):
        begin, lasts = (
            Fraction(int(rng.integers(1000, 9000)), 1000) + Fraction(1, 2000),
            Fraction(int(rng.integers(1, 10)), 1000),
        )
        visit = (Change(Enclosure(begin, begin), "a", "must"), Change(Enclosure(begin + lasts, begin + lasts), "a", "no"))
        robot = Timeline("r", {"a": "no"}, visit, Fraction(10))
        spec = rtamt.StlDiscreteTimeSpecification()
        spec.declare_var("a", "float")
        spec.set_sampling_period(10, "ms", 0.1)
        spec.unit = "s"
        spec.spec = "always[0:9.9](a < 0.5)"
        spec.parse()
        values = spec.evaluate({"time": clock.tolist(), "a": _samples(robot, "a", clock).tolist()})
        missed += values[0][1] > 0
        judge = TimedJudge({"r": robot}, Relations(), Fraction(0))
        ours += judge.judge(parse_formula("G[0,9.9] !a"), slack=False).outcome == "holds"
    return float(missed), float(ours)


def sampled(rate: float) -> Callable[[], Pair]:
    """Return the comparison of breaches of a show that samples at a rate miss, in Hz, as validators of shows look."""

    def measure() -> Pair:
        drones, seconds, count = (36, 20, 3) if is_smallest() else (256, 120, 85)
        points = audit.show(drones, seconds)[1]
        planted = audit.plant(points, count, np.random.default_rng(0))
        steps = np.linspace(0.0, 1.0, max(round(rate), 1), endpoint=False)
        weights = np.stack([(1 - steps) ** 3, 3 * steps * (1 - steps) ** 2, 3 * steps**2 * (1 - steps), steps**3], -1)
        missed = 0
        for one, other, piece in planted:
            gap = (points[one, piece] - points[other, piece]) @ weights.T
            missed += bool(np.linalg.norm(gap, axis=0).min() >= audit.ASKED.separation)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "show.skyc"
            audit.write(path, points)
            found = {
                (claim.robot, claim.other, int(claim.time or 0))
                for claim in verify.audit(path, limits=audit.ASKED).broken
                if claim.name == "separation"
            }
        return float(missed), float(len({(f"d{a}", f"d{b}", k) for a, b, k in planted} - found))

    return measure


SAMPLES = "nothing between samples"
ROWS = (
    Row("spottl", "until formulas on finite words to an automaton, s", spot, "the automaton is the formula's, as ours", "spot"),
    Row(
        "toppra",
        "six hoops, speed and acceleration: flight, s",
        toppra,
        "limits at grid points; by axis, in a box within the ball",
    ),
    Row("minsnap-trajectories", "minimum snap, 30 points, ms", minimum_snap, "no limits", "minsnap_trajectories"),
    Row("rotorpy", "six hoops at 1 m/s: worst error, mm", rotorpy, "one simulated flight"),
    Row("rtamt", "20 bounded operators over 100 s, 200 changes, ms (rtamt: at 10 Hz)", rtamt_time, SAMPLES),
    Row("rtamt", "visits of 1 to 9 ms to a forbidden region that are missed at 100 Hz, of 100", rtamt_misses, SAMPLES),
    *(
        Row("numpy", f"breaches of 50 ms in a show that samples at {rate} Hz miss, of 85", sampled(rate), SAMPLES)
        for rate in (4, 5, 100)
    ),
)
PUBLISHED = (
    ("STLCCP, STL-GCS, CT-STL", "planning of bounded formulas", "need Gurobi or Mosek", "see docs/time.md for the problems that both plan"),
    ("crazyflow", "simulation of many Crazyflies", "needs JAX and MuJoCo", "not compared"),
    ("FASTER, EGO-Planner", "replanning in flight", "need a compiler and ROS", "no formulas; limits at control points"),
)  # fmt: skip


def rows(only: str, rounds: int) -> Iterator[str]:
    """Yield the table's rows, each when it is measured."""
    for row in ROWS:
        if only not in row.package or not installed(row.module or row.package.lower().replace("-", "_"), row.package):
            continue
        pairs = [row.measure() for _ in range(rounds)]
        theirs, ours = (statistics.median(column) for column in zip(*pairs, strict=True))
        ratios = sorted(their / our for their, our in pairs if our)
        spread = f"{statistics.median(ratios):.2g} ({ratios[0]:.2g} to {ratios[-1]:.2g})" if ratios else "-"
        version = "our sampler" if row.package == "numpy" else f"{row.package} {importlib.metadata.version(row.package)}"
        yield f"| {version} | {row.work} | {theirs:.3g} | {ours:.3g} | {spread} | {row.proves} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--only", default="")
    arguments = parser.parse_args()
    print("| peer | work | peer | ours | peer / ours | what the peer's answer proves |\n|---|---|---|---|---|---|")
    for line in rows(arguments.only, arguments.rounds):
        print(line, flush=True)
    print("\n| not run | what | why | published |\n|---|---|---|---|")
    for cells in PUBLISHED:
        print(f"| {' | '.join(cells)} |")


def _as_stl(text: str) -> str:
    """Return a formula of ours as rtamt writes it."""
    stl = text
    for ours, theirs in (
        ("G[", "always["),
        ("F[", "eventually["),
        (" U[", " until["),
        ("&", " and "),
        ("|", " or "),
        ("->", " implies "),
    ):
        stl = stl.replace(ours, theirs)
    stl = stl.replace(",", ":")
    for name in "abc":
        stl = _proposition(stl, name)
    return stl


def _proposition(text: str, name: str) -> str:
    """Return a text with a name that stands alone as an inequality; `!name` as its opposite."""
    text = re.sub(rf"!{name}\b", f"({name} < 0.5)", text)
    return re.sub(rf"(?<![\w(]){name}\b(?! <)|(?<=\(){name}\b(?! <)", f"({name} > 0.5)", text)


def _samples(robot: Timeline, region: str, clock: np.ndarray) -> np.ndarray:
    """Return 1 where a robot is in a region for sure, else 0, at times in s."""
    value, found = 0.0, np.zeros(len(clock))
    changes = [change for change in robot.changes if change.region == region]
    edges = [float(change.time.low) for change in changes] + [float("inf")]
    for change, (begin, end) in zip(changes, itertools.pairwise(edges), strict=True):
        value = 1.0 if change.status == "must" else 0.0
        found[(clock >= begin) & (clock < end)] = value
    return found


if __name__ == "__main__":
    run_benchmark(main, ["--rounds", "1"])
    sys.exit()
