"""Errors in a formula's text: each in a sentence, with a caret under its place."""

from __future__ import annotations

from verify.data.errors import BadInput


class FormulaError(BadInput):
    """A formula that cannot be read.

    Attributes:
        formula: The text.
        position: Offset of the first fault in it.
        reasons: One sentence per fault.
    """

    def __init__(self, formula: str, faults: list[tuple[int, str]]) -> None:
        self.formula = formula
        self.position = faults[0][0]
        self.reasons = tuple(reason for _, reason in faults)
        super().__init__("\n".join(f"{reason}\n{_caret(formula, position)}" for position, reason in faults))


def _caret(text: str, position: int) -> str:
    """Return the line of `text` that holds `position` with a caret under it, cut to a readable width."""
    start = text.rfind("\n", 0, position) + 1
    end = text.find("\n", position)
    line = text[start : end if end >= 0 else len(text)]
    column = position - start
    if column > 60:
        line, column = "..." + line[column - 50 :], 53
    return f"  {line[:100]}\n  {' ' * column}^"
