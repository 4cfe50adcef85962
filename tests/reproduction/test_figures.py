"""Every figure of docs/reproduction against a rerun of the command that the page names."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from tests.reproduction.figures import FIGURES, NOT_RERUN, TIMES_OF_COMPUTING, Figure

ROOT = Path(__file__).resolve().parents[2]
PAGES = {path.name: path for path in (ROOT / "docs/reproduction").glob("*.md")}
KERNELS = {
    "OMP_NUM_THREADS": "1", "OPENBLAS_CORETYPE": "Haswell", "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
}  # fmt: skip
NUMBER = r"(\d+(?:\.\d+)?)"


def pattern(passage: str) -> re.Pattern[str]:
    """Return a passage as a pattern: `#` is a number, `~` one that is not compared, `...` anything within the line."""
    spaced = r"\s+".join(re.escape(word) for word in passage.split(" "))
    numbers = spaced.replace(r"\#", NUMBER).replace(r"\~", r"[\d.]+")
    return re.compile(numbers.replace(r"\.\.\.", r"[^\n]*?"))


@cache
def output(command: tuple[str, ...]) -> str:
    """Return what a command prints with the kernels fixed."""
    done = subprocess.run(
        [sys.executable, *command], cwd=ROOT, env={**os.environ, **KERNELS}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


@cache
def text(page: str) -> str:
    """Return a page in one line a paragraph."""
    return re.sub(r"(?<=[^\n|])\n(?=[^\n|*#])", " ", PAGES[page].read_text(encoding="utf-8"))


def agree(said: str, printed: str, within: float) -> bool:
    """Return whether a page's number is the command's, rounded to the page's digits and within a share of it."""
    digits = len(said.partition(".")[2])
    return abs(float(said) - float(printed)) <= 0.5000001 * 10**-digits + within * float(printed)


@pytest.mark.slow
@pytest.mark.parametrize("figure", FIGURES, ids=lambda figure: f"{figure.page}: {figure.said}")
def test_figures_are_what_their_command_prints(figure: Figure) -> None:
    said = pattern(figure.said).findall(text(figure.page))
    assert len(said) == 1, f"{figure.page} has {figure.said!r} {len(said)} times"
    ours = [said[0]] if isinstance(said[0], str) else list(said[0])
    printed = pattern(figure.printed).findall(output(figure.command))
    theirs = [number for match in printed for number in ([match] if isinstance(match, str) else match)]
    assert len(ours) == len(theirs), f"{figure.page} gives {ours}, the command {theirs}"
    assert all(agree(said, value, figure.within) for said, value in zip(ours, theirs, strict=True)), (ours, theirs)


@pytest.mark.parametrize("page", sorted(PAGES))
def test_no_figure_stands_on_a_page_without_a_rerun_or_a_reason(page: str) -> None:
    left = text(page)
    for figure in (figure for figure in FIGURES if figure.page == page):
        found = pattern(figure.said).search(text(page))
        assert found, figure.said
        for number in range(1, found.re.groups + 1):
            begin, end = found.span(number)
            left = f"{left[:begin]}{'_' * (end - begin)}{left[end:]}"
    for passage, _ in NOT_RERUN[page]:
        assert pattern(passage).search(text(page)), f"{page} does not say {passage!r} any more"
        whole = pattern(passage).search(left)
        left = left if whole is None else left.replace(whole.group(), "_" * len(whole.group()))
    for cells in TIMES_OF_COMPUTING.get(page, ()):
        left = re.sub(cells, lambda cell: "_" * len(cell.group()), left)
    left = re.sub(r"`[^`]*`|\]\([^)]*\)|^ {4}.*$", "", left, flags=re.MULTILINE)
    open_figures = re.findall(r"[^|\n]{0,30}\b\d+\.\d+\b[^|\n]{0,20}|[^|\n]{0,30}\b\d+ (?:m|s|mm|%)(?!\w)[^|\n]{0,20}", left)
    assert open_figures == []


def test_a_figure_that_is_off_by_one_digit_is_found() -> None:
    assert agree("6.40", "6.4049", 0.0)
    assert not agree("6.40", "6.4151", 0.0)
    assert not agree("6.64", "6.40", 0.03)
    assert pattern("a # m").findall("a  6.40 m") == ["6.40"]
