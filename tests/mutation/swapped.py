"""A package of `verify` that is loaded anew with a fault in it, in this process, and stands in for the real one for a while."""

from __future__ import annotations

import ast
import importlib.machinery
import importlib.util
import sys
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from types import CodeType
from typing import Any

from tests.mutation.sites import ROOT, Fault, plant


@contextmanager
def swapped(fault: Fault | None, *packages: str) -> Generator[None]:
    """Have all imports of some packages find them loaded anew, with a fault in one of their modules.

    Args:
        fault: The fault; None for the packages as they are.
        packages: Names of packages of `verify`, those first that others import.
    """
    parent = importlib.import_module("verify")
    before = {name: sys.modules.pop(name) for name in list(sys.modules) if _is_in(name, packages)}
    known = {name: getattr(parent, name) for name in (one.partition(".")[2] for one in packages) if hasattr(parent, name)}
    finder = _Finder(fault, packages)
    sys.meta_path.insert(0, finder)
    try:
        yield
    finally:
        sys.meta_path.remove(finder)
        for name in [name for name in sys.modules if _is_in(name, packages)]:
            del sys.modules[name]
        sys.modules.update(before)
        for name, module in known.items():
            setattr(parent, name, module)


def _is_in(name: str, packages: Sequence[str]) -> bool:
    return any(name == one or name.startswith(f"{one}.") for one in packages)


class _Finder:
    def __init__(self, fault: Fault | None, packages: Sequence[str]) -> None:
        self.fault, self.packages = fault, packages

    def find_spec(self, name: str, _path: object = None, _target: object = None) -> importlib.machinery.ModuleSpec | None:
        if not _is_in(name, self.packages):
            return None
        stem = ROOT / name.replace(".", "/")
        file = stem / "__init__.py" if stem.is_dir() else stem.with_suffix(".py")
        loader = _Loader(name, str(file), self.fault if self.fault and self.fault.module == name else None)
        return importlib.util.spec_from_file_location(name, file, loader=loader)


class _Loader(importlib.machinery.SourceFileLoader):
    def __init__(self, name: str, path: str, fault: Fault | None) -> None:
        super().__init__(name, path)
        self.fault = fault

    def get_code(self, fullname: str) -> CodeType | None:
        return _code(self.path) if self.fault is None else compile(plant(self.fault), self.path, "exec")


@cache
def _code(path: str) -> Any:
    return compile(ast.parse(Path(path).read_text()), path, "exec")
