"""Evidence of a proof, by what it is evidence of."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .refused import Refused


class Evidence:
    """Evidence as a proof's file holds it."""

    def __init__(self, table: Mapping[str, Any]) -> None:
        self._table = table

    def get(self, key: str) -> Any:  # of any type: JSON nests
        """Return an entry.

        Raises:
            Refused: There is none.
        """
        if key not in self._table:
            raise Refused(f"the proof has nothing on {key}")
        return self._table[key]
