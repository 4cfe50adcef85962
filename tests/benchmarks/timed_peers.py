"""stlpy beside ours on the published problems of one robot, each answer judged by us.

    pip install stlpy
    OMP_NUM_THREADS=1 python -m tests.benchmarks.timed_peers [STEP ...]

stlpy (V. Kurtz and H. Lin, "Mixed-integer programming for signal temporal logic with fewer binary variables", 2022) plans a double integrator at fixed
steps. Its own mixed-integer solvers need Gurobi, Mosek or Drake. Here its formulas and its system are kept, and its standard encoding (C. Belta and
S. Sadraddini, "Formal methods for control synthesis", 2019) is solved by HiGHS. Accelerations are constant between samples, so that its flight is
exact polynomials, which `verify.audit` judges: speed and acceleration, workspace, walls, and the formula, at margin 0.
Steps are in seconds; STEP is 0.5 and 0.25 where none is given.
"""

from __future__ import annotations

import contextlib
import io
import math
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import csr_array

import ltlplan
import verify
from ltlplan.pipeline import certified_team
from tests.helpers.benchmarks import LEFT_OUT, is_smallest, run_benchmark
from verify.data import Mission

PROBLEMS = ("stlcg-1", "stlcg-2")
_SECONDS = 60.0
"""For how long HiGHS may look."""
_LARGE = 10.0
"""Above every predicate's value, m."""
_ROBUST = (0.1, 0.0)
"""m; robustness up to this is worth as much as it can be, as with stlpy's `robustness_cost`; 0: none is asked for."""

_PUSH = 0.01
"""Worth of 1 m/s^2 for 1 s against 1 m of robustness."""

Stlpy = Any  # of any type: stlpy has no annotations
Floats = NDArray[np.float64]


def stlpy_formula(name: str, mission: Mission, step: float) -> Stlpy:
    """Return a problem's formula in stlpy's terms; bounds are counted in steps."""
    from stlpy.benchmarks.common import inside_rectangle_formula, outside_rectangle_formula  # pyright: ignore[reportMissingImports]

    def box(region: str) -> tuple[float, float, float, float]:
        body = mission.regions[region]
        (x, y, _), (a, b, _) = body.center, body.half_lengths
        return x - a, x + a, y - b, y + b

    def steps(seconds: float) -> int:
        return math.ceil(seconds / step)

    def dwell(region: str, within: float) -> Stlpy:
        return inside_rectangle_formula(box(region), 0, 1, 6).always(0, steps(5)).eventually(0, steps(within))

    def avoid(region: str, until: float) -> Stlpy:
        return outside_rectangle_formula(box(region), 0, 1, 6).always(0, steps(until))

    if name == "stlcg-1":
        return dwell("b2", 15) & dwell("b3", 15) & avoid("c", 15)
    return dwell("b1", 10) & avoid("b3", 10) & avoid("c", 10)


class Encoding:
    """Standard mixed-integer encoding of an stlpy formula over a double integrator in the plane.

    Args:
        mission: Gives start, end, workspace and limits; walls and workspace become bounds on the position.
        step: s.
        count: Steps.
        robust: m; more robustness is worth nothing.
    """

    def __init__(self, mission: Mission, step: float, count: int, robust: float) -> None:
        agent, limits = mission.agents["quad0"], mission.limits_of("quad0")
        inside = 1.5 - 0.05 - mission.vehicle.radius  # the walls are 0.1 m thick, around a square of 3 m
        size = 6 * (count + 1)
        self.low, self.high = np.full(size, -np.inf), np.full(size, np.inf)
        self.whole, self.worth = [0] * size, [0.0] * size
        self.rows: list[tuple[dict[int, float], float, float]] = []
        for t in range(count + 1):
            for axis in range(2):
                self.low[6 * t + axis], self.high[6 * t + axis] = -inside, inside
                self.low[6 * t + 2 + axis], self.high[6 * t + 2 + axis] = -limits.speed, limits.speed
                self.low[6 * t + 4 + axis], self.high[6 * t + 4 + axis] = -limits.acceleration, limits.acceleration
        assert agent.end is not None
        for axis in range(2):
            for index, value in (
                (axis, agent.start[axis]),
                (2 + axis, 0.0),
                (6 * count + axis, agent.end[axis]),
                (6 * count + 2 + axis, 0.0),
            ):
                self.low[index] = self.high[index] = value
            for t in range(count):
                p, v, u, then = 6 * t + axis, 6 * t + 2 + axis, 6 * t + 4 + axis, 6 * (t + 1) + axis
                self.rows.append(({then: 1.0, p: -1.0, v: -step, u: -(step**2) / 2}, 0.0, 0.0))
                self.rows.append(({then + 2: 1.0, v: -1.0, u: -step}, 0.0, 0.0))
        self.robust = self._variable(0.0, robust, worth=-1.0)
        for t in range(count):  # of robust flights the one that pushes least
            for axis in range(2):
                push = self._variable(0.0, np.inf, worth=_PUSH * step)
                self.rows += [({push: 1.0, 6 * t + 4 + axis: sign}, 0.0, np.inf) for sign in (1.0, -1.0)]

    def _variable(self, low: float, high: float, *, whole: bool = False, worth: float = 0.0) -> int:
        self.low, self.high = np.append(self.low, low), np.append(self.high, high)
        self.whole.append(int(whole))
        self.worth.append(worth)
        return len(self.whole) - 1

    def ask(self, formula: Stlpy) -> None:
        """Ask that a formula holds from the first sample on."""
        self._node(formula, 0, self._variable(1.0, 1.0))

    def _node(self, node: Stlpy, t: int, chosen: int) -> None:
        if node.is_predicate():
            values = {6 * t + i: float(a) for i, a in enumerate(node.a[:, 0]) if a}
            self.rows.append(({**values, self.robust: -1.0, chosen: -_LARGE}, float(node.b[0]) - _LARGE, np.inf))
            return
        any_of = node.combination_type == "or"
        parts = [self._variable(0.0, 1.0, whole=any_of) for _ in node.subformula_list]
        if any_of:
            self.rows.append(({chosen: -1.0, **dict.fromkeys(parts, 1.0)}, 0.0, np.inf))
        else:
            self.rows += [({part: 1.0, chosen: -1.0}, 0.0, np.inf) for part in parts]
        for part, child, later in zip(parts, node.subformula_list, node.timesteps, strict=True):
            self._node(child, t + later, part)

    def solve(self) -> tuple[Floats, float] | None:
        """Return positions, speeds and accelerations in the plane, shape (samples, 6), and the robustness in m; None where none were found."""
        i, j, shares = (
            np.array(column)
            for column in zip(*((i, j, s) for i, (row, _, _) in enumerate(self.rows) for j, s in row.items()), strict=True)
        )
        matrix = csr_array((shares, (i, j)), shape=(len(self.rows), len(self.whole)))
        lows, highs = np.array([low for _, low, _ in self.rows]), np.array([high for _, _, high in self.rows])
        found = milp(
            np.array(self.worth),
            integrality=np.array(self.whole),
            bounds=Bounds(self.low, self.high),  # pyright: ignore[reportArgumentType]  # SciPy takes sequences
            constraints=LinearConstraint(matrix, lows, highs),  # pyright: ignore[reportArgumentType]  # SciPy takes sequences
            options={"time_limit": _SECONDS},
        )
        return None if found.x is None else (found.x[: 6 * (found.x.size // 6)].reshape(-1, 6), float(found.x[self.robust]))


def written(samples: Floats, step: float, folder: Path) -> Path:
    """Write a flight at constant accelerations between samples as crazyswarm2 has it; return its file."""
    axes = ("x", "y", "z", "yaw")
    lines = ["duration," + ",".join(f"{axis}^{power}" for axis in axes for power in range(8))]
    for row in samples[:-1]:
        numbers = [[row[0], row[2], row[4] / 2], [row[1], row[3], row[5] / 2], [1.0], [0.0]]
        padded = [[*each, *[0.0] * (8 - len(each))] for each in numbers]
        lines.append(",".join(f"{np.float32(value):.9g}" for value in (step, *(value for each in padded for value in each))))
    path = folder / "quad0.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def peer(name: str, step: float, robust: float) -> tuple[str, float, Sequence[str]]:
    """Return what stlpy's encoding finds for a problem, in how many s of processor time, and what of it is broken between samples."""
    mission = ltlplan.load_mission(name)
    begin = time.process_time()
    count = math.ceil({"stlcg-1": 20.0, "stlcg-2": 15.0}[name] / step)
    encoding = Encoding(mission, step, count, robust)
    formula = stlpy_formula(name, mission, step)
    encoding.ask(formula)
    found = encoding.solve()
    took = time.process_time() - begin
    if found is None:
        return "none found", took, []
    samples = found[0][: count + 1]
    found_robust = float(formula.robustness(samples.T, 0)[0])  # by stlpy itself
    with tempfile.TemporaryDirectory() as folder:
        audit = verify.audit(written(samples, step, Path(folder)), mission.changed(margin=0.0))
    broken = [claim.sentence for claim in audit.claims if claim.outcome != "holds"]
    return f"{count * step:g} s, robustness {abs(found_robust):.3f} m at samples", took, broken


def ours(name: str) -> tuple[str, float, Sequence[str]]:
    """Return the same of our flight, certified at the mission's margin."""
    begin = time.process_time()
    certificate = certified_team(ltlplan.plan(name)).certificate
    slack = min(claim.bound for claim in certificate.claims if claim.name == "timing" and claim.bound is not None)
    return (
        f"{certificate.duration:.2f} s, margin {certificate.margin:g} m at all times, {slack:.2f} s of slack",
        time.process_time() - begin,
        [],
    )


def say(who: str, answer: tuple[str, float, Sequence[str]]) -> None:
    """Print one answer."""
    found, took, broken = answer
    print(f"{who}: {found}; {took:.1f} s of processor time; {'broken:' if broken else 'nothing broken'}")
    for sentence in broken:
        print(f"  {sentence}")


def main() -> int:
    """Print what each finds."""
    try:
        with contextlib.redirect_stdout(io.StringIO()):  # it names the solvers that are not installed
            import stlpy.benchmarks.common  # pyright: ignore[reportMissingImports]  # noqa: F401
    except ImportError as error:
        print(f"{LEFT_OUT}stlpy ({error}); `pip install stlpy`")
        return 0
    print("Accelerations of stlpy's flights jump at samples, which no quadcopter follows; that is not counted here.")
    steps = [float(step) for step in sys.argv[1:]] or [0.5, 0.25]
    for name in PROBLEMS[-1:] if is_smallest() else PROBLEMS:
        say(f"{name}, ltlplan", ours(name))
        for step in steps:
            for robust in _ROBUST:
                say(f"{name}, stlpy, {step:g} s, {'most robust' if robust else 'not robust'}", peer(name, step, robust))
    return 0


if __name__ == "__main__":
    run_benchmark(main, ("1",))
