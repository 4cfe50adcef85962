"""Write the counts of all shipped missions; once on each kind of processor."""

from __future__ import annotations

from ltlplan.missions import shipped_missions
from tests.work_counts import write

if __name__ == "__main__":
    write(sorted(shipped_missions()))
