"""Names that are loaded at first use are those that type checkers read, and what is not asked for is not loaded."""

import ast
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGES = ("ltlplan", "ltlplan.online", "verify", "verify.data", "refine", "flight", "flight.exports")
HEAVY = ("numpy", "scipy", "pydantic", "casadi", "cvxpy", "flint", "plotly", "pandas", "networkx", "ruamel.yaml")


def checked_names(package: str) -> dict[str, str]:
    """Return the names that a type checker finds in a package, each with the module that it is imported from."""
    source = Path(str(importlib.import_module(package).__file__)).read_text(encoding="utf-8")
    (block,) = (
        node
        for node in ast.parse(source).body
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"
    )
    return {alias.name: str(node.module) for node in block.body if isinstance(node, ast.ImportFrom) for alias in node.names}


@pytest.mark.parametrize("package", PACKAGES)
def test_names_are_what_type_checkers_take_them_for(package: str) -> None:
    module = importlib.import_module(package)
    homes = checked_names(package)
    assert sorted(homes) == sorted(module.__all__)
    assert set(homes) <= set(dir(module))
    for name, home in homes.items():
        assert getattr(module, name) is getattr(importlib.import_module(home), name)


@pytest.mark.parametrize("package", PACKAGES)
def test_a_name_that_is_not_there_is_an_error(package: str) -> None:
    with pytest.raises(AttributeError, match=f"module '{package}' has no attribute 'certifi'"):
        _ = importlib.import_module(package).certifi


def test_a_package_loads_nothing_that_was_not_asked_for() -> None:
    asked = f"import sys, {', '.join(PACKAGES)}; print([name for name in {HEAVY} if name in sys.modules])"
    assert subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True).stdout == "[]\n"
