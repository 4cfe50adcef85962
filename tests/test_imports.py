"""No modules of a package import each other in a circle; imports inside functions and for type checkers only count as well."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import networkx
import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("ltlplan", "refine", "flight", "verify")


def modules_of(package: str) -> dict[str, Path]:
    """Return a package's modules by their dotted names; a package's own name is that of its `__init__`."""
    found = {}
    for path in sorted((ROOT / package).rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imported(module: str, path: Path, modules: dict[str, Path]) -> Iterator[str]:
    """Yield the modules that one module imports, anywhere in its text."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                home = module.split(".")[: len(module.split(".")) - node.level + (path.name == "__init__.py")]
                base = ".".join([*home, base] if base else home)
            for alias in node.names:
                yield f"{base}.{alias.name}" if f"{base}.{alias.name}" in modules else base


def circles(package: str) -> list[frozenset[str]]:
    """Return the sets of modules that import each other in circles."""
    modules = modules_of(package)
    graph = networkx.DiGraph()
    graph.add_nodes_from(modules)
    graph.add_edges_from((a, b) for a, path in modules.items() for b in imported(a, path, modules) if b in modules)
    return [frozenset(each) for each in networkx.strongly_connected_components(graph) if len(each) > 1]


@pytest.mark.parametrize("package", PACKAGES)
def test_no_modules_import_each_other_in_a_circle(package: str) -> None:
    assert [sorted(circle) for circle in circles(package)] == []


def test_imports_are_read_at_every_level(tmp_path: Path) -> None:
    text = "import a.b\nfrom a import c, name\nfrom . import d\nfrom .d import e\nfrom .. import f\nif TYPE_CHECKING:\n    import g\n"
    file = tmp_path / "module.py"
    file.write_text(text + "def h():\n    from a.b import i\n")
    assert list(imported("p.q.module", file, {"a.c": file, "p.q.d": file})) == [
        "a.b", "a.c", "a", "p.q.d", "p.q.d", "p", "g", "a.b",
    ]  # fmt: skip
