"""Enumerations for the command line: what `--help` lists, a shell completes and a misspelt name is compared with.

They are read from the registries, so that what another package brings is a choice like ours.
"""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum
from typing import Any


def choices(title: str, names: Iterable[str]) -> type[StrEnum]:
    """Return an enumeration whose values are names.

    Args:
        title: What the enumeration is called.
        names: In the order in which they are shown.
    """
    made: Any = StrEnum(
        title, {f"choice_{index}": name for index, name in enumerate(names)}
    )  # a class, which pyright does not see
    return made
