"""Provenance of results beside their requests: versions of the software, and how the machine computes.

Where these are equal, the same mission and seed give the same bytes; so results are found again by them, and a machine where they
differ takes no part in the work.
"""

from __future__ import annotations

import ctypes
import hashlib
import json
import platform
import sys
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from verify.data import Mission

_ENGINES = (
    "casadi", "clarabel", "cvxpy", "networkx", "numpy", "osqp", "plotly", "pydantic", "python-flint", "ruamel.yaml", "scipy", "spottl",
)  # fmt: skip
_GROUPS = "ltlplan."
"""What the groups of entry points begin with in which other packages name what they bring."""


@cache
def software() -> dict[str, str]:
    """Return the versions of ltlplan, Python, the engines, and of other packages that bring something to ltlplan."""
    found = {name: _version(name) for name in ("ltlplan", *_ENGINES)}
    found["python"] = ".".join(map(str, sys.version_info[:2]))
    for group in metadata.entry_points().groups:
        if group.startswith(_GROUPS):
            found.update({point.dist.name: point.dist.version for point in metadata.entry_points(group=group) if point.dist})
    return dict(sorted(found.items()))


@cache
def machine() -> dict[str, str]:
    """Return what decides the last bit of an operation here: processor, the kernels that numpy and BLAS chose for it, the C library."""
    import numpy as np

    found: Any = np.show_config(mode="dicts")  # its type is numpy's own
    extensions = found.get("SIMD Extensions", {})
    return {
        "system": platform.system(),
        "processor": platform.machine(),
        "C library": " ".join(platform.libc_ver()).strip() or "unknown",
        "instructions": " ".join([*extensions.get("baseline", ()), *extensions.get("found", ())]),
        "BLAS kernels": _kernels(Path(np.__file__).parents[1] / "numpy.libs"),
    }


def here() -> dict[str, str]:
    """Return `software` and `machine` as one table."""
    return {**software(), **machine()}


def differences(ours: dict[str, str], theirs: dict[str, str]) -> list[str]:
    """Return a phrase for each entry in which two tables differ: "numpy 2.1 there, 2.4 here"."""
    names = sorted(ours.keys() | theirs.keys())
    return [
        f"{name} {theirs.get(name, 'missing')} there, {ours.get(name, 'missing')} here"
        for name in names
        if ours.get(name) != theirs.get(name)
    ]


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "missing"


def _kernels(libraries: Path) -> str:
    """Return the kernels that OpenBLAS, which numpy brings, chose for this processor."""
    for library in sorted(libraries.glob("*openblas*")):
        for name in ("scipy_openblas_get_corename64_", "scipy_openblas_get_corename", "openblas_get_corename"):
            try:
                asked = getattr(ctypes.CDLL(str(library)), name)
            except (OSError, AttributeError):
                continue
            asked.restype = ctypes.c_char_p
            return asked().decode()
    return "unknown"


def key_of(mission: Mission) -> str:
    """Return the key of what is found for a mission: of all that was asked, its seed too, and of the software that answers."""
    return key_of_asked({"mission": mission.resolved()})


def key_of_asked(asked: dict[str, Any]) -> str:
    """Return the key of what is found for something that was asked, which is plain data, and of the software that answers."""
    text = json.dumps({**asked, "software": software()}, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()
