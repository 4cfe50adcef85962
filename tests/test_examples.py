"""Every example runs: scripts as a user runs them, tests by the plugin, notebooks from their first cell to their last."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import nbclient
import nbformat
import pytest

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"


def run(*arguments: str | Path, cwd: Path) -> str:
    """Run Python with these arguments, and return what it printed."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, *arguments], cwd=cwd, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_every_example_is_run_here() -> None:
    assert {path.name for path in EXAMPLES.iterdir() if path.is_file()} == {
        "README.md", "explore.ipynb", "judge_a_flight.py", "plan_to_export.py", "test_course.py",
    }  # fmt: skip


@pytest.mark.slow
def test_plan_to_export(tmp_path: Path) -> None:
    said = run(EXAMPLES / "plan_to_export.py", "sent", cwd=tmp_path)
    assert "certified for" in said
    assert (tmp_path / "sent" / "quad0.csv").exists()


def test_judge_a_flight_which_loads_no_planner(tmp_path: Path) -> None:
    script = str(EXAMPLES / "judge_a_flight.py")
    code = f"import runpy, sys; runpy.run_path({script!r}, run_name='__main__'); print(*sys.modules)"
    *said, loaded = run("-c", code, cwd=tmp_path).splitlines()
    assert [line.split(": ")[1].split(".")[0] for line in said] == ["holds", "fails", "fails", "holds", "undecided"]
    assert not {"ltlplan", "refine", "flight", "casadi", "plotly"} & set(loaded.split())
    assert "verify" in loaded.split()


@pytest.mark.slow
def test_a_course_of_ones_own(tmp_path: Path) -> None:
    said = run(
        "-m", "pytest", "-p", "verify.testing", "-p", "no:cacheprovider", EXAMPLES / "test_course.py", "--rootdir", tmp_path,
        "-c", os.devnull, cwd=tmp_path,
    )  # fmt: skip
    assert "flights are judged for all times" in said
    assert "3 passed" in said


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::RuntimeWarning")  # of the kernel's own libraries
@pytest.mark.slow
def test_the_notebook_runs_and_is_stored_without_outputs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    notebook = nbformat.read(EXAMPLES / "explore.ipynb", as_version=4)
    nbformat.validate(notebook)
    for cell in notebook.cells:
        assert not cell.get("outputs")
        assert cell.get("execution_count") is None
    nbclient.NotebookClient(
        notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": str(tmp_path)}}
    ).execute()
    printed = "".join(output.get("text", "") for cell in notebook.cells for output in cell.get("outputs", ()))
    assert "hoop0" in printed
    assert "limits.speed             holds" in printed
    assert re.search(r"True [\d.]+ s instead of", printed), "the slower flight holds"
