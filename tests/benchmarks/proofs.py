"""Times of judging shipped missions, of finding proofs and of checking them, in s of processor time, and the proofs' sizes in bytes.

Run `python tests/benchmarks/proofs.py [NAME ...]`; a number is a mission with so many robots (`scale.py`), at nominal pace. The ratio is of judging
and finding to judging alone, at best of three. Memory is the greatest until then, planning included.
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TypeVar

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import ltlplan
import refine
from ltlplan.missions import shipped_missions
from tests.benchmarks.scale import scale_mission
from tests.helpers.benchmarks import run_benchmark
from tests.helpers.kernel.proofs import checked, tables
from verify import Trajectory, judge
from verify.data.plan import Plan
from verify.proofs.finder import prove

_T = TypeVar("_T")


def timed(work: Callable[[], _T], times: int = 3) -> tuple[_T, float]:
    """Return what some work returns, and how long it takes at best."""
    found: list[tuple[float, _T]] = []
    for _ in range(times):
        began = time.process_time()
        result = work()
        found.append((time.process_time() - began, result))
    return found[-1][1], min(took for took, _ in found)


def flown(name: str) -> tuple[Plan, Mapping[str, Trajectory]]:
    """Return the plan and the flight of a shipped mission, or of so many robots."""
    if name.isdigit():
        plan = ltlplan.plan(scale_mission(int(name)))
        return plan, refine.refine(plan, pace="nominal")
    with tempfile.TemporaryDirectory() as folder:
        run = ltlplan.run(name, Path(folder) / name)
        return run.plan, run.team


def main() -> None:
    """Print one line for each mission."""
    for name in sys.argv[1:] or sorted(shipped_missions()):
        plan, team = flown(name)
        times = 1 if name.isdigit() else 3
        certificate, judging = timed(lambda plan=plan, team=team: judge(plan, team), times)
        proof, finding = timed(lambda plan=plan, team=team, one=certificate: prove(plan, team, one), times)
        files = tables(plan, team)
        claims, checking = timed(lambda proof=proof, files=files: checked(proof.statement, proof.evidence, files), times)
        count = f"{sum(not claim.missing for claim in claims)} of {len(claims)}"
        print(
            f"{name:<18} judging {judging:5.2f} s, finding {finding:5.2f} s, ratio {1 + finding / judging:4.2f}, "
            f"checking {checking:5.2f} s, {len(proof.evidence):6} bytes, {count} claims, "
            f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3:.0f} MB",
            flush=True,
        )


if __name__ == "__main__":
    run_benchmark(main, ["firefighting"])
