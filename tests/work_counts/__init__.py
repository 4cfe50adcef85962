"""How much work shipped missions take, in counts that do not hang on the clock.

`counts.json` holds, for each shipped mission, how often refinement asked its engines: the greatest of two kinds of processors, whose
paths differ in the last digits. A change that needs more than a tenth more fails `test_work`; whoever means it writes the file anew
(`python -m tests.work_counts`) and says why. `tests/benchmarks/shipped.py` times the same missions.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest import mock

from ltlplan import load_mission, plan
from ltlplan.pipeline import certified_team
from refine.coordination.avoidance import joint_bending
from refine.single_robot import time_optimised
from refine.solvers import qp

COUNTS = Path(__file__).parent / "counts.json"


def counted(name: str) -> dict[str, int]:
    """Plan, refine and judge a shipped mission; return how often each engine was asked, and the rounds."""
    with _counting() as found:
        done = certified_team(plan(load_mission(name)))
    return {**found, "rounds": done.rounds}


def wanted() -> dict[str, dict[str, int]]:
    """Read the reviewed counts."""
    return json.loads(COUNTS.read_text())


def write(names: list[str]) -> None:
    """Write the counts of these missions, or keep what is there where that is more."""
    old = wanted() if COUNTS.exists() else {}
    new = {name: counted(name) for name in names}
    kept = {
        name: {key: max(old.get(name, {}).get(key, 0), count) for key, count in found.items()} for name, found in new.items()
    }
    COUNTS.write_text(json.dumps(kept, indent=1) + "\n")


@contextmanager
def _counting() -> Iterator[Counter[str]]:
    found = Counter({"projections": 0, "bending evaluations": 0, "time-optimal programmes": 0})

    def counting(key: str, function: Callable[..., Any], amount: Callable[[Any], int]) -> Callable[..., Any]:
        def called(*given: Any, **named: Any) -> Any:
            answer = function(*given, **named)
            found[key] += amount(answer)
            return answer

        return called

    with (
        mock.patch.object(qp, "nnls", counting("projections", qp.nnls, lambda _: 1)),
        mock.patch.object(
            joint_bending,
            "bent_from",
            counting("bending evaluations", joint_bending.bent_from, lambda bent: bent.evaluations),
        ),
        mock.patch.object(
            time_optimised, "optimise", counting("time-optimal programmes", time_optimised.optimise, lambda _: 1)
        ),
    ):
        yield found
