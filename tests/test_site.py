"""The site's pages do what they say: each walk is typed from its page in an empty folder, and every command that any page names is one.

The first tutorial is typed whole, its install included, in an environment of its own.
"""

from __future__ import annotations

import ast
import os
import re
import shlex
import subprocess
import sys
import venv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
import typer

import ltlplan
from ltlplan.cli import COMMANDS, load
from verify.data.language.formula_reader import parse_formula

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [*sorted(DOCS.rglob("*.md")), ROOT / "README.md"]
FIRST = DOCS / "tutorials" / "first-mission.md"
WATCHING = DOCS / "how-to" / "watch-flights.md"
"""A page whose commands ask a service; `test_page_commands` runs them."""
WALKS = [
    *(page for page in sorted((DOCS / "tutorials").glob("*.md")) if page != FIRST),
    *(page for page in sorted((DOCS / "how-to").glob("*.md")) if page != WATCHING),
    DOCS / "index.md",
    *(page for page in sorted((DOCS / "explanation").glob("*.md")) if "```" in page.read_text(encoding="utf-8")),
]
BLOCK = re.compile(r"^```(\w+)(?: (\S+))?\n(.*?)^```$", re.DOTALL | re.MULTILINE)
EXTENDING = "extending.md"
"""A page whose commands are of a package that is shown on it; `test_extending` runs them."""
INSTALL = "pip install ."
"""Typed in the project's folder; all else in an empty one."""


def commands_of(text: str) -> Iterator[tuple[str, str]]:
    """Yield what is typed in a block of a console, with the lines that it prints among others."""
    yield from re.findall(r"^\$ (.*)\n((?:(?!\$ ).*\n)*)", text, re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Reader:
    """A reader at a shell.

    Attributes:
        folder: In which all is typed but the install.
        programs: The folder whose `python` and `ltlplan` are found first.
        paths: What Python imports from besides.
    """

    folder: Path
    programs: Path
    paths: str

    def type(self, command: str) -> str:
        """Return what a command prints, errors too."""
        path = os.pathsep.join([str(self.programs), os.environ["PATH"]])
        more = {"PATH": path, "PYTHONPATH": self.paths, "PIP_CONSTRAINT": str(ROOT / "constraints.txt")}
        done = subprocess.run(
            command, shell=True, cwd=ROOT if command.startswith(INSTALL) else self.folder, env={**os.environ, **more}, capture_output=True,
            text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0 or not command.startswith(INSTALL), done.stderr
        return done.stdout + done.stderr

    def finish(self, command: str) -> str:
        """Return what a command prints that does what it is asked."""
        before, _, rest = self.type(f"{command}\necho ended with $?").rpartition("ended with ")
        code, _, errors = rest.partition("\n")
        assert code == "0", f"$ {command}\n{before}{errors}"
        return before + errors

    def walk(self, page: Path) -> list[str]:
        """Type all that a page shows, look for the lines that it says are printed, and return what was typed."""
        printed, typed = "", list[str]()
        for language, name, text in BLOCK.findall(page.read_text(encoding="utf-8")):
            if name:
                (self.folder / name).parent.mkdir(exist_ok=True)
                (self.folder / name).write_text(text, encoding="utf-8")
            elif language == "python":
                (self.folder / "script.py").write_text(text, encoding="utf-8")
                printed = self.finish("python script.py")
                typed.append("python script.py")
            elif language == "text":
                assert printed == text
            elif language == "console":
                for command, says in commands_of(text):
                    printed = self.type(command) if says else self.finish(command)
                    missing = [line for line in says.splitlines() if line not in printed]
                    assert missing == [], f"$ {command}\n{printed}"
                    typed.append(command)
        return typed


@pytest.mark.slow
@pytest.mark.parametrize("page", WALKS, ids=lambda page: str(page.relative_to(DOCS)))
def test_a_walk_through_a_page_goes_as_it_says(page: Path, tmp_path: Path) -> None:
    paths = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")]))
    assert Reader(tmp_path, Path(sys.executable).parent, paths).walk(page) != [], "a page that shows nothing is no walk"


@pytest.mark.slow
def test_the_first_mission_goes_as_it_says_from_its_install_to_a_judged_recording(tmp_path: Path) -> None:
    """Nothing is there but Python: what `pip install .` brings has to do."""
    venv.create(tmp_path / "environment", with_pip=True)
    folder = tmp_path / "empty"
    folder.mkdir()
    assert INSTALL in Reader(folder, tmp_path / "environment" / "bin", "").walk(FIRST)
    assert (folder / "judged.html").exists()
    room = (folder / "room.yaml").read_text(encoding="utf-8")
    assert all(word in room for word in ("window:", "wall:", "quad0:", "quad1:"))


def named_commands(page: Path) -> list[str]:
    """Return every command of ours in a page's blocks of a shell, without comments and what is piped on."""
    blocks = [text for language, _, text in BLOCK.findall(page.read_text(encoding="utf-8")) if language in ("sh", "console")]
    lines = "".join(blocks).replace("\\\n", " ").splitlines()
    return [line.removeprefix("$ ") for line in lines if re.match(r"(\$ )?ltlplan [a-z]", line)]


def fault_of(line: str) -> str:
    """Return why a command is none of ours, or nothing; it is parsed and not run."""
    words = shlex.split(line, comments=True)[1:]
    name, *arguments = words[: next((k for k, word in enumerate(words) if word in ("|", "&&", ">", "&")), len(words))]
    if name not in COMMANDS:
        return "no command"
    try:
        load(name).make_context(name, arguments)
    except typer.Exit:  # of --help
        return ""
    except Exception as error:  # typer's own kind of click's error, which differs between its versions
        return error.format_message() if hasattr(error, "format_message") else repr(error)
    return ""


def test_blocks_are_in_languages_that_are_known() -> None:
    """`diff` and `toml` are put together by `test_extending`; `py` is parsed only: it needs people who log in."""
    known = {"console", "sh", "python", "py", "yaml", "text", "toml", "diff"}
    assert {language for page in PAGES for language, _, _ in BLOCK.findall(page.read_text(encoding="utf-8"))} <= known


def test_python_that_is_only_parsed_calls_what_is_there() -> None:
    texts = [
        text for page in PAGES for language, _, text in BLOCK.findall(page.read_text(encoding="utf-8")) if language == "py"
    ]
    calls = [node for text in texts for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Attribute)]
    asked = {(node.value.id, node.attr) for node in calls if isinstance(node.value, ast.Name)}
    owners = {"ltlplan": ltlplan, "client": ltlplan.Client}
    assert [name for owner, name in asked if owner in owners and not hasattr(owners[owner], name)] == []
    assert {owner for owner, _ in asked} & set(owners) == set(owners)


def test_a_command_that_is_none_is_told() -> None:
    assert fault_of("ltlplan run firefighting --out run | tail") == ""
    assert fault_of("ltlplan fly run --help") == ""
    assert fault_of("ltlplan land run") == "no command"
    assert "--sead" in fault_of("ltlplan run firefighting --sead 1")


@pytest.mark.parametrize(
    "page", [page for page in PAGES if page.name != EXTENDING], ids=lambda page: str(page.relative_to(ROOT))
)
def test_every_command_on_a_page_is_one(page: Path) -> None:
    assert [f"{line}: {fault}" for line in named_commands(page) if (fault := fault_of(line))] == []


def formulas_of(page: Path) -> list[str]:
    """Return the formulas of a page's tables of formulas and what they mean."""
    tables = re.findall(r"^\| formula \| meaning \|\n\|[-|]+\n((?:\|.*\n)+)", page.read_text(encoding="utf-8"), re.MULTILINE)
    firsts = [re.split(r"(?<!\\)\|", row)[1].replace("\\|", "|") for table in tables for row in table.splitlines()]
    return [formula for first in firsts for formula in re.findall("`([^`]+)`", first)]


def test_formulas_that_pages_explain_are_formulas() -> None:
    explained = {page.name: formulas_of(page) for page in PAGES}
    assert {name for name, formulas in explained.items() if formulas} == {"time.md", "team-with-counts.md"}
    for formulas in explained.values():
        for formula in formulas:
            parse_formula(formula, allow_next=False)


def test_every_page_is_in_the_navigation() -> None:
    """Warnings are errors where the site is built; this says it sooner."""
    listed = set(re.findall(r"^\s+- (?:[^:\n]+: )?(\S+\.md)$", (ROOT / "mkdocs.yml").read_text(encoding="utf-8"), re.MULTILINE))
    written = {str(page.relative_to(DOCS)) for page in DOCS.rglob("*.md")}
    made = {"reference/commands.md", *(f"reference/{package}.md" for package in ("ltlplan", "refine", "verify", "flight"))}
    assert listed == written | made


@pytest.mark.parametrize("page", PAGES[:-1], ids=lambda page: str(page.relative_to(DOCS)))
def test_each_page_says_first_what_its_reader_can_do_after(page: Path) -> None:
    if page.name != "index.md":
        assert re.match(r"# .*\n\nAfter this page ", page.read_text(encoding="utf-8"))
