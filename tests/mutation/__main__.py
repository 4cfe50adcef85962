"""Plant faults in the judge and print those that no test notices."""

from __future__ import annotations

import argparse
import sys

from tests.mutation.equivalent import EQUIVALENT
from tests.mutation.sites import draw
from tests.mutation.trial import Finding, try_faults


def main() -> int:
    """Print what became of each fault; the exit code counts survivors that are not known to change nothing."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutation", description=__doc__)
    parser.add_argument("--count", type=int, default=200, help="how many faults")
    parser.add_argument("--seed", type=int, default=0, help="which faults")
    parser.add_argument("--only", action="append", help="only faults whose name holds this text; may be given again")
    parser.add_argument("--jobs", type=int, default=2, help="processes at once")
    given = parser.parse_args()
    drawn = [fault for fault in draw(given.count, given.seed) if any(text in fault.name for text in given.only or [""])]
    findings = try_faults(drawn, jobs=given.jobs, told=_show)
    survivors = [finding for finding in findings if not finding.noticed]
    unknown = [finding for finding in survivors if finding.fault.name not in EQUIVALENT]
    print(f"{len(findings)} faults, {len(findings) - len(survivors)} noticed, {len(unknown)} survive that are not equivalent")
    return len(unknown)


def _show(finding: Finding) -> None:
    what = finding.noticed or ("changes nothing" if finding.fault.name in EQUIVALENT else "SURVIVES")
    print(f"{finding.fault.path}:{finding.fault.line} {finding.fault.name}\n    {what} ({finding.tried} tests)", flush=True)


if __name__ == "__main__":
    sys.exit(main())
