"""Evidence of a proof: marks of trees and other values, by what they are evidence of.

Marks stand one after another in the order in which the kernel asks; a number before one says how often it stands there.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from .refused import Refused
from .statement import read_json
from .trees import Marks, Part

FORMAT = 1
_RUN = re.compile(r"(\d{0,9})([a-z?])")


class Evidence:
    """Evidence as a proof's file holds it."""

    def __init__(self, table: Mapping[str, Any]) -> None:
        self._table = table

    def optional(self, key: str) -> Any:
        """Return an entry, or None where there is none."""
        return self._table.get(key)

    def get(self, key: str) -> Any:
        """Return an entry.

        Raises:
            Refused: There is none.
        """
        if (found := self.optional(key)) is None:
            raise Refused(f"the proof has nothing on {key}")
        return found

    def number(self, key: str) -> Fraction:
        """Return an entry that is a number.

        Raises:
            Refused: It is none.
        """
        if not isinstance(found := self.get(key), int | Fraction):
            raise Refused(f"the proof has no number for {key}")
        return Fraction(found)

    def rows(self, key: str, width: int) -> list[list[list[int]]]:
        """Return an entry that is a list of lists of so many whole numbers; nothing where there is none.

        Raises:
            Refused: It is none, or numbers are out of range.
        """
        found = self.optional(key) or []
        if not isinstance(found, list) or not all(isinstance(row, list) for row in found):
            raise Refused(f"the proof has no lists for {key}")
        for entry in (entry for row in found for entry in row):
            if (
                not isinstance(entry, list)
                or len(entry) != width
                or not all(type(k) is int and 0 <= k < 1 << 80 for k in entry)
            ):
                raise Refused(f"the proof has lists for {key} that are none")
        return found

    def marks(self, key: str) -> Marks:
        """Return an entry's marks.

        Raises:
            Refused: It has none.
        """
        if not isinstance(text := self.get(key), str):
            raise Refused(f"the proof has no marks for {key}")
        return _Marks(text, key)


class _Marks:
    def __init__(self, text: str, key: str) -> None:
        self._text, self._key = text, key
        self._at, self._left, self._mark = 0, 0, ""

    def take(self, part: Part, depth: int) -> str:
        del part, depth
        while not self._left:
            run = _RUN.match(self._text, self._at)
            if run is None:
                raise Refused(f"the proof's marks for {self._key} end early")
            self._at, self._left, self._mark = run.end(), int(run[1] or 1), run[2]
        self._left -= 1
        return self._mark


def read_evidence(text: str) -> Evidence:
    """Read a proof's file.

    Raises:
        Refused: It is none.
    """
    data = read_json(text, "proof.json")
    if not isinstance(data, dict) or data.get("format") != FORMAT or not isinstance(data.get("evidence"), dict):
        raise Refused(f"proof.json is no proof of format {FORMAT}.")
    return Evidence(data["evidence"])
