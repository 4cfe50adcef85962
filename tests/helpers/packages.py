"""Packages of somebody else's: a module and entry points in a temporary folder that is on the path."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from importlib.metadata import entry_points
from pathlib import Path

import pytest

from verify.data.names import registry


def install(
    folder: Path, monkeypatch: pytest.MonkeyPatch, module: str, text: str, points: Mapping[str, Mapping[str, str]]
) -> None:
    """Put a module and its entry points on the path, until `monkeypatch` is undone.

    Args:
        folder: Where they are written.
        monkeypatch: The test's.
        module: Its name.
        text: Its source.
        points: Group: {name: "module:object"}.
    """
    (folder / f"{module}.py").write_text(text)
    info = folder / f"{module}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {module.replace('_', '-')}\nVersion: 1.0\n")
    lines = [line for group, named in points.items() for line in (f"[{group}]", *(f"{k} = {v}" for k, v in named.items()))]
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n")
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.setattr(
        registry, "_installed", lambda: entry_points().select
    )  # what was installed before the process began is read once
    monkeypatch.delitem(sys.modules, module, raising=False)
