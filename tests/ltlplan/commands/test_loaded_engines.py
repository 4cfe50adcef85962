"""Commands load the engines that they use, and no others: loading them takes longer than planning."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.ltlplan.commands.test_commands import SMALL

ENGINES = {
    "casadi", "cvxpy", "dask", "fastapi", "flint", "networkx", "nicegui", "osqp", "plotly", "rich", "scipy.ndimage", "scipy.optimize",
    "scipy.spatial", "spot",
}  # fmt: skip


def loaded(*words: str, cwd: Path) -> set[str]:
    """Return the modules that a process has loaded at the end of a command."""
    code = "import atexit, sys; atexit.register(lambda: print(*sys.modules)); from ltlplan.start import main; main()"
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])}
    done = subprocess.run(
        [sys.executable, "-c", code, *words], cwd=cwd, env=environment, capture_output=True, text=True, check=True
    )
    return set(done.stdout.splitlines()[-1].split())


@pytest.mark.slow
def test_run_makes_pages_without_plotlys_objects(tmp_path: Path) -> None:
    (tmp_path / "small.yaml").write_text(SMALL)
    modules = loaded("run", "small.yaml", "--out", "run", cwd=tmp_path)
    assert not modules & {"cvxpy", "dask", "fastapi", "networkx", "nicegui", "plotly.graph_objs", "rich"}


def test_plan_loads_only_spot(tmp_path: Path) -> None:
    modules = loaded("plan", "firefighting", cwd=tmp_path)
    assert modules & ENGINES == {"spot"}
    readings = {name for name in modules if name.startswith("ltlplan.search.") and name.endswith(".planning")}
    assert readings == {"ltlplan.search.own.planning"}
