"""Times of judging shipped missions, of finding proofs and of checking them, in s of processor time, and the proofs' sizes in bytes.

Run `python tests/benchmarks/proofs.py [NAME ...]`. The ratio is of judging and finding to judging alone, at best of three.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import ltlplan
from ltlplan.missions import shipped_missions
from tests.helpers.benchmarks import run_benchmark
from tests.helpers.proofs import checked, tables
from verify import judge
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


def main() -> None:
    """Print one line for each mission."""
    for name in sys.argv[1:] or sorted(shipped_missions()):
        with tempfile.TemporaryDirectory() as folder:
            run = ltlplan.run(name, Path(folder) / name)
        certificate, judging = timed(lambda run=run: judge(run.plan, run.team))
        proof, finding = timed(lambda run=run, certificate=certificate: prove(run.plan, run.team, certificate))
        files = tables(run.plan, run.team)
        claims, checking = timed(lambda proof=proof, files=files: checked(proof.statement, proof.evidence, files))
        count = f"{sum(not claim.missing for claim in claims)} of {len(claims)}"
        print(
            f"{name:<18} judging {judging:5.2f} s, finding {finding:5.2f} s, ratio {1 + finding / judging:4.2f}, "
            f"checking {checking:5.2f} s, {len(proof.evidence):6} bytes, {count} claims",
            flush=True,
        )


if __name__ == "__main__":
    run_benchmark(main, ["firefighting"])
