"""The page on extending is true: the package that it shows is put together from it, and every command and script on it runs.

A block of code whose first line names a file is (a part of) that file of the package; blocks of the same name are joined. The other
blocks are run: `console` shows commands and words that their output contains, line by line; `python` is a script.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"^```(\w+)(?: (\S+))?\n(.*?)^```$", re.DOTALL | re.MULTILINE)
SECTIONS = dict(re.findall(r"^## (.*?)\n(.*?)(?=^## |\Z)", PAGE, re.DOTALL | re.MULTILINE))


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that holds the page's package as if it were installed there."""
    folder = tmp_path_factory.mktemp("extending")
    for language, name, text in BLOCK.findall(PAGE):
        if name and language != "diff":
            (folder / name).parent.mkdir(exist_ok=True)
            with (folder / name).open("a", encoding="utf-8") as file:
                file.write(text)
    project = tomllib.loads((folder / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    metadata = folder / f"{project['name']}-{project['version']}.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n")
    groups = (
        f"[{group}]\n" + "".join(f"{name} = {value}\n" for name, value in points.items())
        for group, points in project["entry-points"].items()
    )
    (metadata / "entry_points.txt").write_text("\n".join(groups), encoding="utf-8")
    return folder


def run(package: Path, *words: str) -> str:
    """Run Python with the package on its path, in the package's folder; return what is printed."""
    path = os.pathsep.join([str(package), str(ROOT), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, *words], cwd=package, env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, f"{' '.join(words)}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("section", SECTIONS)
def test_the_example_does_what_the_page_says(section: str, package: Path, tmp_path: Path) -> None:
    blocks = [(language, text) for language, name, text in BLOCK.findall(SECTIONS[section]) if not name]
    assert {language for language, _ in blocks} == {"console", "python"}, "an example is tried from command line and library"
    for language, text in blocks:
        if language == "python":
            script = tmp_path / "script.py"
            script.write_text(text, encoding="utf-8")
            run(package, str(script))
            continue
        for command, says in re.findall(r"^\$ ltlplan (.*)\n((?:(?!\$ ).*\n)*)", text, re.MULTILINE):
            printed = run(package, "-m", "ltlplan", *command.split())
            for line in says.splitlines():
                assert line in printed, command


def groups(change: str) -> Iterator[tuple[list[str], list[str]]]:
    """Yield the lines that a change takes out, and those that it puts in, place by place; other lines part the places."""
    for place in re.split(r"^ .*\n", change, flags=re.MULTILINE):
        lines = place.splitlines()
        if lines:
            yield [line[1:] for line in lines if line.startswith("-")], [line[1:] for line in lines if line.startswith("+")]


def before(lines: list[str], change: str) -> list[str]:
    """Return a file's lines as they were before a change."""
    result, at = list(lines), 0
    for out, into in groups(change):
        at = next(k for k in range(at, len(result)) if result[k : k + len(into)] == into)
        result[at : at + len(into)] = out
    return result


CHANGES = [(name, text) for language, name, text in BLOCK.findall(PAGE) if language == "diff"]


def test_what_the_page_shows_as_changed_stands_in_the_code() -> None:
    assert CHANGES
    for name, text in CHANGES:
        lines = (ROOT / name).read_text(encoding="utf-8").splitlines()
        assert [line for line in text.splitlines() if (line[1:] in lines) == line.startswith("-")] == []


@pytest.mark.slow
def test_without_the_changes_there_is_no_such_operator_and_all_else_goes_on(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "verify", tmp_path / "verify")
    for name, text in CHANGES:
        lines = (ROOT / name).read_text(encoding="utf-8").splitlines()
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("\n".join(before(lines, text)) + "\n", encoding="utf-8")
    script = """
from verify.data import FormulaError, parse_formula
from verify.testing.drawn_words import formulas
assert str(parse_formula("G count(a) <= 2 & each(F b) & some(a)"))
try:
    parse_formula("ever(a) <= 1")
except FormulaError:
    print("unknown")
"""
    done = subprocess.run(
        [sys.executable, "-c", script],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
    )
    assert done.stdout == "unknown\n", done.stderr


def test_the_table_lists_every_example_and_every_group() -> None:
    rows = re.findall(r"^\| \[(.*?)\]\(#(.*?)\) \| `(.*?)` \|", PAGE, re.MULTILINE)
    added = [section for section, text in SECTIONS.items() if "```diff" not in text]
    assert [anchor for _, anchor, _ in rows] == [section.lower().replace(" ", "-") for section in added]
    joined = "".join(text for _, name, text in BLOCK.findall(PAGE) if name == "pyproject.toml")
    assert {group for _, _, group in rows} == set(tomllib.loads(joined)["project"]["entry-points"])
    for _, _, group in rows:
        brought = re.compile(rf'"{re.escape(group)}"')
        assert any(
            brought.search(path.read_text(encoding="utf-8"))
            for top in ("flight", "ltlplan", "refine", "verify")
            for path in (ROOT / top).rglob("*.py")
        ), f"nobody reads the group {group}"
