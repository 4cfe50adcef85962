"""The README links what is there, and the page on the library runs."""

import re
import runpy
from pathlib import Path

import pytest

import ltlplan

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
LIBRARY = (ROOT / "docs" / "library.md").read_text(encoding="utf-8")


def test_the_library_example_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (example,) = re.findall(r"```python\n(.*?)```", LIBRARY, re.DOTALL)
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


def test_it_fits_a_screen() -> None:
    assert len(README.splitlines()) <= 60


def test_every_page_it_links_exists() -> None:
    for target in re.findall(r"\]\(([^)#:]+)\)", README):
        assert (ROOT / target).exists(), target
