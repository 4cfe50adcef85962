"""Every snippet of the README runs."""

import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

import ltlplan

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_library_example_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (example,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    mission = ltlplan.load_mission("firefighting")  # at nominal pace, which takes less work to find
    nominal = mission.changed(planner=mission.planner.model_copy(update={"pace": "nominal"}))
    monkeypatch.setattr(ltlplan, "load_mission", {"firefighting": nominal}.__getitem__)
    script = tmp_path / "example.py"
    script.write_text(example, encoding="utf-8")
    values = runpy.run_path(str(script))
    assert (tmp_path / "run" / "certificate.json").exists()
    assert (tmp_path / "exported" / "quad0.csv").exists()
    assert values["cert"]


def test_every_command_it_names_exists() -> None:
    (line,) = re.findall(r"^ltlplan (run \|.*)$", README, re.MULTILINE)
    helped = subprocess.run([sys.executable, "-m", "ltlplan", "--help"], cwd=ROOT, capture_output=True, text=True, check=True)
    for command in line.split(" | "):
        assert re.search(rf"^\W*{command}\b", helped.stdout, re.MULTILINE), command


def test_every_page_it_links_exists() -> None:
    for target in re.findall(r"\]\(([^)#:]+)\)", README):
        assert (ROOT / target).exists(), target
