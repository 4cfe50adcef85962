"""Published case studies for teams: words, flights and certificates.

Run `python tests/benchmarks/cases.py [NAME...]`, names of `tests/helpers/published_cases.py` or parts of them. Times are CPU seconds of this process;
words are searched for from the mission (automata made anew), and "certified" begins with the mission, too.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import ltlplan
from ltlplan.logic.conjunction import conjunct_automaton
from ltlplan.pipeline import certified_team
from ltlplan.search.exact import assign
from tests.helpers.benchmarks import run_benchmark
from tests.helpers.published_cases import CASES, WORDS_ONLY
from verify.data import Plan


def main() -> None:
    """Print a row for each case."""
    wanted = sys.argv[1:]
    print("case | published | words | cost | proved cheapest | certified | flight")
    for name, (mission_of, published) in CASES.items():
        if wanted and not any(part in name for part in wanted):
            continue
        mission = mission_of()
        conjunct_automaton.cache_clear()
        begin = time.process_time()
        words = assign(mission)
        searched = time.process_time() - begin
        begin = time.process_time()
        plan = ltlplan.plan(mission)
        flown = "- | -" if name in WORDS_ONLY else _flown(plan, begin)
        least = "no" if words.lower_bound is None else f"no, at least {words.lower_bound:.1f} m"
        proved = "yes" if words.complete else least
        print(f"{name} | {published} | {searched:.2f} s | {words.cost:.1f} m | {proved} | {flown}", flush=True)


def _flown(plan: Plan, begin: float) -> str:
    """Return the seconds up to a certificate, and the flight's."""
    certificate = certified_team(plan).certificate
    assert certificate.holds
    return f"{time.process_time() - begin:.1f} s | {certificate.duration:.1f} s"


if __name__ == "__main__":
    run_benchmark(main, ["Bai, first", "five gather"])
