"""The kernel uses the standard library and itself, and nothing else."""

from __future__ import annotations

import ast
import sys
from pathlib import Path

import pytest

import verify.kernel

HOME = Path(verify.kernel.__file__).parent


@pytest.mark.parametrize("path", sorted(HOME.rglob("*.py")), ids=lambda path: path.name)
def test_the_kernel_imports_nothing_of_ours(path: Path) -> None:
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            assert all(one.name.partition(".")[0] in sys.stdlib_module_names for one in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            assert (node.module or "").partition(".")[0] in sys.stdlib_module_names
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 1
