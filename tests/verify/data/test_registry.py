"""Registries find built-in objects and those of other packages, and say what is wrong with the rest."""

from __future__ import annotations

import sys
from fractions import Fraction
from pathlib import Path

import pytest

from verify.data import BadInput
from verify.data.registry import Registry

MODULE = """
from fractions import Fraction
third = Fraction(1, 3)
text = "no fraction"
"""


def fractions() -> Registry[Fraction]:
    """Return a registry of fractions with one of ours."""
    return Registry("a fraction", "tests.fractions", {"half": "tests.verify.data.test_registry:HALF"}, Fraction)


HALF = Fraction(1, 2)


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the metadata folder of a package that is found on the path and brings fractions."""
    (tmp_path / "brings_fractions.py").write_text(MODULE)
    folder = tmp_path / "brings_fractions-1.0.dist-info"
    folder.mkdir()
    (folder / "METADATA").write_text("Metadata-Version: 2.1\nName: brings-fractions\nVersion: 1.0\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "brings_fractions", raising=False)
    return folder


def named(folder: Path, *lines: str) -> None:
    (folder / "entry_points.txt").write_text("\n".join(["[tests.fractions]", *lines]))


def test_names_are_found_here_and_in_other_packages(package: Path) -> None:
    named(package, "third = brings_fractions:third")
    assert fractions().names() == ("half", "third")
    assert fractions().find("half") == Fraction(1, 2)
    assert fractions().find("third") == Fraction(1, 3)
    assert fractions().resolve("third") == Fraction(1, 3)
    assert fractions().resolve(Fraction(2, 7)) == Fraction(2, 7)


@pytest.mark.parametrize(
    ("lines", "name", "says"),
    [
        ((), "hald", "'hald' is not a fraction. Did you mean 'half'? Names: half."),
        (("half = brings_fractions:third",), "half", "several packages: brings-fractions (brings_fractions:third), ltlplan"),
        (("text = brings_fractions:text",), "text", "is not a fraction: a str, not a Fraction"),
        (("lost = brings_fractions:lost",), "lost", "cannot be loaded: AttributeError"),
        (("lost = nowhere:lost",), "lost", "cannot be loaded: ModuleNotFoundError"),
    ],
)
def test_what_is_wrong_is_said(package: Path, lines: tuple[str, ...], name: str, says: str) -> None:
    named(package, *lines)
    with pytest.raises(BadInput) as refused:
        fractions().find(name)
    assert says in str(refused.value)


def test_neither_an_object_nor_a_name() -> None:
    with pytest.raises(BadInput, match="neither a Fraction nor a name of one"):
        fractions().resolve(7)  # pyright: ignore[reportArgumentType]
