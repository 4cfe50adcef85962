"""Files that the docs name are there, so that whoever looks for one finds it."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = [*sorted((ROOT / "docs").rglob("*.md")), ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
NAMED = re.compile(r"`((?:ltlplan|refine|flight|verify|tests)/[\w./-]*[\w/]|[\w/]+\.py)`")
MADE_BY_READERS = re.compile(r"kestrel/|my_|\w*script\.py|fly_mission\.py|stream_setpoints\.py")


@pytest.fixture(scope="module")
def places() -> set[str]:
    """All files of the repository, and all ends of their paths, with the folders that they are in."""
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False).stdout.split()
    files = listed or [str(path.relative_to(ROOT)) for path in ROOT.rglob("*.*") if ".git" not in path.parts]
    found: set[str] = set()
    for file in files:
        parts = file.split("/")
        for begin in range(len(parts)):
            for end in range(begin + 1, len(parts) + 1):
                found.add("/".join(parts[begin:end]))
    return found


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_files_that_a_page_names_are_there(page: Path, places: set[str]) -> None:
    named = {name.rstrip("/") for name in NAMED.findall(page.read_text(encoding="utf-8"))}
    assert {name for name in named - places if not MADE_BY_READERS.match(name)} == set()


def test_names_are_found_on_pages() -> None:
    assert NAMED.findall("in `ltlplan/search/exact.py`, `reading.py` and `verify/data/`; not `a.b`") == [
        "ltlplan/search/exact.py",
        "reading.py",
        "verify/data/",
    ]
