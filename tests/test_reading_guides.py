"""Docstrings of packages as tables of contents: each names every module and subpackage of its folder, and no other module."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = sorted(
    path.parent.relative_to(ROOT)
    for top in ("ltlplan", "refine", "verify", "flight")
    for path in (ROOT / top).rglob("__init__.py")
)


def contents(package: Path) -> set[str]:
    """Return the names of a package's modules and subpackages."""
    folder = ROOT / package
    modules = {path.stem for path in folder.glob("*.py")} - {"__init__", "__main__"}
    return modules | {path.parent.name for path in folder.glob("*/__init__.py")}


def quoted(package: Path) -> set[str]:
    """Return the plain names in backquotes of a package's docstring."""
    guide = ast.get_docstring(ast.parse((ROOT / package / "__init__.py").read_text(encoding="utf-8"))) or ""
    return set(re.findall(r"`(\w+)(?:\.py)?`", guide))


def defined(package: Path) -> set[str]:
    """Return the names that a package's modules define or that it hands on."""
    found: set[str] = set()
    for path in (ROOT / package).glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            match node:
                case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
                    found.add(name)
                case ast.Constant(value=str(name)) | ast.Name(id=name) | ast.alias(name=name):
                    found.add(name)
                case _:
                    pass
    return found


@pytest.mark.parametrize("package", PACKAGES, ids=str)
def test_a_package_names_each_of_its_modules(package: Path) -> None:
    assert contents(package) - quoted(package) == set()


@pytest.mark.parametrize("package", PACKAGES, ids=str)
def test_a_package_names_no_module_that_is_elsewhere(package: Path) -> None:
    unknown = {name for name in quoted(package) if "_" in name} - contents(package)
    assert not unknown or unknown <= defined(package)


def test_packages_are_found() -> None:
    assert len(PACKAGES) > 70
    assert "certification" in quoted(Path("verify"))
