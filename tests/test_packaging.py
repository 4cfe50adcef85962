"""What is shipped and how it is checked: the wheel, versions, constraints, and that every way to the checks is the same."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from ruamel.yaml import YAML

import ltlplan

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
PACKAGES = ("ltlplan", "refine", "flight", "verify")


def pinned() -> dict[str, str]:
    return dict(line.split("==") for line in (ROOT / "constraints.txt").read_text().splitlines())


@pytest.fixture(scope="module")
def shipped(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Return the names of all files of the wheel."""
    folder = tmp_path_factory.mktemp("wheel")
    subprocess.run([sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)], cwd=ROOT, check=True)
    (wheel,) = folder.iterdir()
    return zipfile.ZipFile(wheel).namelist()


def test_the_wheel_holds_every_file_of_the_packages_and_their_types(shipped: list[str]) -> None:
    for package in PACKAGES:
        assert f"{package}/py.typed" in shipped
        files = (path for path in (ROOT / package).rglob("*") if path.is_file() and "__pycache__" not in path.parts)
        assert {str(path.relative_to(ROOT)) for path in files} <= set(shipped)
    assert {name.split("/")[0] for name in shipped} == {*PACKAGES, f"ltlplan-{ltlplan.__version__}.dist-info"}


def test_one_version_everywhere() -> None:
    version = ltlplan.__version__
    assert PROJECT["project"]["dynamic"] == ["version"]
    cited = YAML(typ="safe").load(ROOT / "CITATION.cff")
    assert cited["version"] == version
    newest = re.findall(r"^## (\S+) \((\S+)\)$", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)[0]
    assert newest == (version, str(cited["date-released"]))


def test_constraints_hold_every_requirement_within_its_bounds() -> None:
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    assert all(re.fullmatch(r"[a-z0-9-]+==[\w.+!]+", line) for line in lines)
    assert list(pinned()) == sorted(pinned())
    project = PROJECT["project"]
    asked = [*project["dependencies"], *(text for texts in project["optional-dependencies"].values() for text in texts)]
    for requirement in map(Requirement, asked):
        if requirement.name != "ltlplan":
            assert pinned()[canonicalize_name(requirement.name)] in requirement.specifier, requirement


def test_every_way_to_the_checks_is_the_same() -> None:
    run = (ROOT / ".ci" / "run").read_text()
    (command,) = re.findall(r"^(pip install .*\.\[test\].*) && pytest$", (ROOT / "README.md").read_text(), re.MULTILINE)
    assert f"\n{command}\npytest\n" in run
    (job,) = YAML(typ="safe").load(ROOT / ".github" / "workflows" / "ci.yml")["jobs"].values()
    assert [step["run"] for step in job["steps"] if "run" in step] == [".ci/run"]
    supported = [line.split()[-1] for line in PROJECT["project"]["classifiers"] if re.search(r":: 3\.\d+$", line)]
    assert job["strategy"]["matrix"]["python"] == supported


def test_hooks_fetch_nothing() -> None:
    (repo,) = YAML(typ="safe").load(ROOT / ".pre-commit-config.yaml")["repos"]
    assert repo["repo"] == "local"
    assert {hook["language"] for hook in repo["hooks"]} == {"system"}
