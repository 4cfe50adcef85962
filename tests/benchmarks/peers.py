"""Ours beside other tools, in one table: the same work in one process, in turns, with versions, what each proves, and the spread of the ratio.

    OMP_NUM_THREADS=1 python -m tests.benchmarks.peers [--rounds 3] [--only toppra] [--crazyflow PYTHON]

Times are processor time. A ratio is the peer's figure over ours, the median of all rounds with the least and the greatest; above 1 ours is
the smaller. Peers that are not installed are left out and named. crazyflow needs JAX and MuJoCo, which may live in an environment of their own:
`--crazyflow` names its interpreter. Peers that need a compiler, a licence or machines of others are listed in `PUBLISHED` with the figures that
their authors publish.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import itertools
import json
import re
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from pathlib import Path

import numpy as np

import flight as flight_package
import ltlplan
import verify
from flight.closed_loop import Setup, steps
from flight.model.airframe import airframe_of
from flight.model.reference import sample_reference
from flight.model.timing import CONTROL_STEP, SUBSTEPS
from ltlplan.logic import spot_engine
from refine import minimum_snap
from refine.solvers.fastest import time_optimal
from tests.benchmarks import audit, flight, refinement, timed_peers, times
from tests.helpers.benchmarks import LEFT_OUT, installed, is_smallest, run_benchmark
from tests.helpers.motion.stand_ins import hoop6
from verify.data import load_vehicle
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
        ours: What ours says for certain, and what it does not.
        module: Name under which it is imported.
    """

    package: str
    work: str
    measure: Callable[[], Pair]
    proves: str
    ours: str
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


def fixed_times() -> Pair:
    """Minimum snap through 30 given points at given times: ms."""
    points, times = refinement.course(30)
    return 1e3 * refinement._minsnap_trajectories(points, times), 1e3 * refinement.least(lambda: minimum_snap(points, times))


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


def rtamt_finds() -> Pair:
    """Of 100 flights that enter a forbidden region for 1 to 9 ms, those that are found."""
    import rtamt

    rng, theirs, ours = np.random.default_rng(next(_ROUNDS)), 0, 0
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
        theirs += values[0][1] <= 0
        judge = TimedJudge({"r": robot}, Relations(), Fraction(0))
        ours += judge.judge(parse_formula("G[0,9.9] !a"), slack=False).outcome != "holds"
    return float(theirs), float(ours)


def stlpy_time() -> Pair:
    """Plan two dwells of 5 s within 15 s: s, stlpy's standard encoding by HiGHS at steps of 0.5 s."""
    problem = timed_peers.PROBLEMS[-1 if is_smallest() else 0]
    alone = (
        f"from tests.benchmarks import timed_peers; print(timed_peers.ours({problem!r})[1])"  # answers are kept in a process
    )
    ours = subprocess.run([sys.executable, "-c", alone], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return timed_peers.peer(problem, 0.5, 0.1)[1], float(ours)


def stlpy_breaks() -> Pair:
    """Plan without a cost of robustness: claims of the flight that are broken between samples."""
    problem = timed_peers.PROBLEMS[-1 if is_smallest() else 0]
    return float(len(timed_peers.peer(problem, 0.5, 0.0)[2])), float(len(timed_peers.ours(problem)[2]))


def crazyflow(figure: str, interpreter: str) -> Pair:
    """Fly six hoops at 1 m/s with Mellinger's controller, by crazyflow and by ours.

    Args:
        figure: `worst` distance of one flight from the plan, mm, or time `spent` for each of many flights side by side, ms.
        interpreter: The Python that has crazyflow.
    """
    path, count = hoop6(1.0), 1 if figure == "worst" else 20 if is_smallest() else 250
    instants = np.arange(0.0, path.duration, 0.01)
    states = [[*(path.evaluate(at, order)[:3] for order in range(3)), (0.0, 0.0, 0.0, 1.0), (0.0,) * 3] for at in instants]
    with tempfile.TemporaryDirectory() as folder:
        np.savez(Path(folder) / "wanted.npz", wanted=np.array([np.concatenate(state) for state in states]))
        command = [interpreter, str(CRAZYFLOW), str(Path(folder) / "wanted.npz"), str(count)]
        answer = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True).stdout.splitlines()[-1]
    theirs = json.loads(answer)
    if figure == "worst":
        return theirs["worst"], flight.tracking(1.0, controller="mellinger")[1]
    reference = sample_reference({"quad0": path}, CONTROL_STEP, SUBSTEPS)
    conditions = flight_package.Conditions(controller="mellinger")
    begun = time.process_time()
    for _ in steps(Setup((airframe_of(load_vehicle("crazyflie-2.1")),), reference, conditions), range(count)):
        pass
    return theirs["spent"], 1000 * (time.process_time() - begun) / count


def sampled(rate: float) -> Callable[[], Pair]:
    """Return the comparison of breaches of a show that samples at a rate find, in Hz, as validators of shows look."""

    def measure() -> Pair:
        drones, seconds, count = (36, 20, 3) if is_smallest() else (256, 120, 85)
        points = audit.show(drones, seconds)[1]
        planted = audit.plant(points, count, np.random.default_rng(next(_ROUNDS)))
        steps = np.linspace(0.0, 1.0, max(round(rate), 1), endpoint=False)
        weights = np.stack([(1 - steps) ** 3, 3 * steps * (1 - steps) ** 2, 3 * steps**2 * (1 - steps), steps**3], -1)
        seen = 0
        for one, other, piece in planted:
            gap = (points[one, piece] - points[other, piece]) @ weights.T
            seen += bool(np.linalg.norm(gap, axis=0).min() < audit.ASKED.separation)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "show.skyc"
            audit.write(path, points)
            found = {
                (claim.robot, claim.other, int(claim.time or 0))
                for claim in verify.audit(path, limits=audit.ASKED).broken
                if claim.name == "separation"
            }
        return float(seen), float(len({(f"d{a}", f"d{b}", k) for a, b, k in planted} & found))

    return measure


SAMPLES = "nothing between samples"
ROOT = Path(__file__).parents[2]
CRAZYFLOW = ROOT / "tests" / "helpers" / "vehicles" / "crazyflow_flights.py"


def table(interpreter: str) -> tuple[Row, ...]:
    """Return the comparisons.

    Args:
        interpreter: The Python that has crazyflow.
    """
    return (
        Row("spottl", "until formulas on finite words to an automaton, s", spot, "the automaton is the formula's", "the same; Spot translates each conjunct", "spot"),
        Row("toppra", "six hoops, speed and acceleration: flight, s", toppra, "limits at grid points; by axis, in a box within the ball", "limits at samples; the checker proves them for all times"),
        Row("minsnap-trajectories", "minimum snap, 30 points, ms", fixed_times, "no limits", "no limits yet", "minsnap_trajectories"),
        Row("rotorpy", "six hoops at 1 m/s: worst error, mm", rotorpy, "one simulated flight", "one simulated flight"),
        Row("crazyflow", "six hoops at 1 m/s, Mellinger's controller: worst error, mm", partial(crazyflow, "worst", interpreter), "one simulated flight, the state known", "one simulated flight, the state estimated"),
        Row("crazyflow", "the same 250 times side by side: a flight, ms", partial(crazyflow, "spent", interpreter), "simulated flights", "simulated flights"),
        Row("stlpy", "two dwells of 5 s within 15 s: planning, s", stlpy_time, "the formula at samples of 0.5 s", "formula, walls and limits at all times, 0.03 m around the path"),
        Row("stlpy", "the same without its cost of robustness: claims broken between samples", stlpy_breaks, SAMPLES, "every claim at all times"),
        Row("rtamt", "20 bounded operators over 100 s, 200 changes, ms (rtamt: at 10 Hz)", rtamt_time, SAMPLES, "the verdict at all times"),
        Row("rtamt", "visits of 1 to 9 ms to a forbidden region, found at 100 Hz, of 100", rtamt_finds, SAMPLES, "the verdict at all times"),
        *(
            Row("numpy", f"breaches of 50 ms in a show, found at {rate} Hz, of 85", sampled(rate), SAMPLES, "distances at all times")
            for rate in (4, 5, 100)
        ),
    )  # fmt: skip


PUBLISHED = (
    ("Foehn, Romero, Scaramuzza 2021", "hours of a solver", "Split-S race: flight, computing", "17.56 s, about 50 min", "limits at samples"),
    ("AOS, in TOGT-Planner's README", "a compiler", "Split-S race: flight, computing", "17.91 to 17.93 s, about 6 s", "limits at samples"),
    ("Hierarchical-LTL-STAP", "no package", "Schillinger's second and third: computing", "11.5 s and 21.1 s", "discrete words"),
    ("sampling_ltl_planning", "no package", "Bai's second: computing", "0.41 s by search, 3.7 s by sampling", "discrete words"),
    ("offline MTAC-E, 2022 paper", "no package", "fire-fighting, three robots: computing", "about 300 s", "nothing between samples"),
    ("STLPlanning, STLCCP, STL-GCS, CT-STL", "Gurobi or Mosek", "bounded formulas", "no figure of a problem that was run here", "the first: straight legs in a bound on tracking; else samples"),
    ("GCOPTER, FASTER, EGO-Planner", "a compiler and ROS", "paths among obstacles", "no figure of a problem that was run here", "no formulas; limits at samples or control points"),
)  # fmt: skip
"""Name, what it needs, the work, the figure that its authors publish, and what their answer proves. None was run here."""


def version_of(package: str, interpreter: str) -> str:
    """Return a peer's name with its version; nothing where crazyflow is in no interpreter that was named."""
    if package == "numpy":
        return "our sampler"
    if package != "crazyflow":
        return f"{package} {importlib.metadata.version(package)}"
    asked = "import importlib.metadata as m; print('crazyflow', m.version('crazyflow'))"
    return subprocess.run([interpreter, "-c", asked], capture_output=True, text=True, check=False).stdout.strip()


def rows(only: str, rounds: int, interpreter: str) -> Iterator[str]:
    """Yield the table's rows, each when it is measured."""
    for row in table(interpreter):
        if only not in row.package:
            continue
        if row.package == "crazyflow":
            if not version_of(row.package, interpreter):
                print(f"{LEFT_OUT}crazyflow is not installed", flush=True)
                continue
        elif not installed(row.module or row.package.lower().replace("-", "_"), row.package):
            continue
        pairs = [row.measure() for _ in range(rounds)]
        theirs, ours = (statistics.median(column) for column in zip(*pairs, strict=True))
        ratios = sorted(their / our for their, our in pairs if our)
        spread = f"{statistics.median(ratios):.2g} ({ratios[0]:.2g} to {ratios[-1]:.2g})" if ratios else "-"
        cells = (version_of(row.package, interpreter), row.work, f"{theirs:.3g}", f"{ours:.3g}", spread, row.proves, row.ours)
        yield f"| {' | '.join(cells)} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--only", default="")
    parser.add_argument("--crazyflow", default=sys.executable, help="the Python that has crazyflow (default: this one)")
    arguments = parser.parse_args()
    print("| peer | work | peer | ours | peer / ours | the peer's answer proves | ours proves |\n|---|---|---|---|---|---|---|")
    for line in rows(arguments.only, arguments.rounds, arguments.crazyflow):
        print(line, flush=True)
    print("\n| not run | needs | work | published | its answer proves |\n|---|---|---|---|---|")
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
