"""Write golden results anew (only when a new set of cases is begun), or compare with those of another checkout."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from tests.golden import CHANGED, RESULTS, cases, differences, golden, result, write


def main() -> int:
    """Write or compare; the exit code counts the cases that differ and are not listed."""
    parser = argparse.ArgumentParser(prog="python -m tests.golden", description=__doc__)
    parser.add_argument("file", nargs="?", type=Path, default=RESULTS, help="where to write")
    parser.add_argument("--against", type=Path, help="compare with this file instead of writing")
    given = parser.parse_args()
    if given.against is None:
        write(given.file)
        return 0
    wanted = golden(given.against)[1]
    unlisted = 0
    for case in cases():
        differs = differences(wanted[case], result(case))
        if differs:
            unlisted += case not in CHANGED
            print(f"{case}: {', '.join(differs)} ({CHANGED.get(case, 'not listed')})")
    print(f"{len(cases())} cases, {unlisted} differ that are not listed")
    return unlisted


if __name__ == "__main__":
    sys.exit(main())
