"""Registries find built-in objects and those of other packages, and say what is wrong with the rest."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import pytest

from tests.helpers.packages import install
from verify.data import BadInput
from verify.data.names.registry import Registry

MODULE = """
from fractions import Fraction
third = Fraction(1, 3)
text = "no fraction"
"""


def fractions() -> Registry[Fraction]:
    """Return a registry of fractions with one of ours."""
    return Registry("a fraction", "tests.fractions", {"half": "tests.verify.data.names.test_registry:HALF"}, Fraction)


HALF = Fraction(1, 2)
Bring = Callable[..., None]


@pytest.fixture
def bring(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Bring:
    """Return a way to put a package on the path that brings fractions by these names."""
    return lambda **points: install(tmp_path, monkeypatch, "brings_fractions", MODULE, {"tests.fractions": points})


def test_names_are_found_here_and_in_other_packages(bring: Bring) -> None:
    bring(third="brings_fractions:third")
    assert fractions().names() == ("half", "third")
    assert fractions().find("half") == Fraction(1, 2)
    assert fractions().find("third") == Fraction(1, 3)
    assert fractions().resolve("third") == Fraction(1, 3)
    assert fractions().resolve(Fraction(2, 7)) == Fraction(2, 7)


@pytest.mark.parametrize(
    ("points", "name", "says"),
    [
        ({}, "hald", "'hald' is not a fraction. Did you mean 'half'? Names: half."),
        ({"half": "brings_fractions:third"}, "half", "several packages: brings-fractions (brings_fractions:third), ltlplan"),
        ({"text": "brings_fractions:text"}, "text", "is not a fraction: a str, not a Fraction"),
        ({"lost": "brings_fractions:lost"}, "lost", "cannot be loaded: AttributeError"),
        ({"lost": "nowhere:lost"}, "lost", "cannot be loaded: ModuleNotFoundError"),
    ],
)
def test_what_is_wrong_is_said(bring: Bring, points: dict[str, str], name: str, says: str) -> None:
    bring(**points)
    with pytest.raises(BadInput) as refused:
        fractions().find(name)
    assert says in str(refused.value)


def test_neither_an_object_nor_a_name() -> None:
    with pytest.raises(BadInput, match="neither a Fraction nor a name of one"):
        fractions().resolve(7)  # pyright: ignore[reportArgumentType]
