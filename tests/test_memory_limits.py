"""What many robots may cost in memory, held by the operating system: a process that asks for more than its limit gets none."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.benchmarks.audit import show, write
from tests.benchmarks.scale import scale_mission
from verify.data import mission_to_yaml

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="RLIMIT_AS is kept by Linux"),
]

_LIMITED = """
import resource, sys
limit = int(sys.argv[1])
resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
sys.argv[:] = ["ltlplan", *sys.argv[2:]]
from ltlplan.start import main
main()
"""


def within(gigabytes: float, *arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Run `ltlplan ARGUMENTS` where no process of it, libraries included, may take more memory."""
    limit = str(round(gigabytes * 2**30))
    command = [sys.executable, "-c", _LIMITED, limit, *arguments]
    return subprocess.run(
        command, cwd=cwd, capture_output=True, text=True, check=False, env={**os.environ, "OMP_NUM_THREADS": "1"}
    )


def test_a_limit_that_is_too_low_ends_a_run_with_an_error(tmp_path: Path) -> None:
    """So that the others mean something."""
    (tmp_path / "mission.yaml").write_text(mission_to_yaml(scale_mission(4)))
    done = within(0.1, "run", "mission.yaml", "--out", "run", cwd=tmp_path)
    assert done.returncode != 0
    assert not (tmp_path / "run").exists()


def test_a_hundred_robots_from_a_mission_to_files_take_four_gigabytes_at_most(tmp_path: Path) -> None:
    (tmp_path / "mission.yaml").write_text(mission_to_yaml(scale_mission(100)))
    done = within(4, "run", "mission.yaml", "--out", "run", cwd=tmp_path)
    assert done.returncode == 0, done.stderr[-2000:]
    files = [path for path in (tmp_path / "run").rglob("*") if path.is_file()]
    assert {"flight.csv", "report.html", "certificate.json", "q99.csv"} <= {path.name for path in files}
    assert max(path.stat().st_size for path in files) < 20_000_000


def test_an_audit_of_a_thousand_drones_takes_two_gigabytes_at_most(tmp_path: Path) -> None:
    _, points = show(1000, 600)
    write(tmp_path / "show.skyc", points)
    done = within(2, "audit", "show.skyc", "--separation", "2", "--speed", "8", "--acceleration", "8", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr[-2000:]
    assert '"holds": true' in done.stdout
