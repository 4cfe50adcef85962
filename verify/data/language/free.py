"""`free` written out: in no region of the mission."""

from __future__ import annotations

from collections.abc import Collection

from verify.data.language.formula import TRUE, Formula

_CHAIN = 40
"""Terms of a conjunction that are joined one after another; more are halved."""


def in_no_region(regions: Collection[str]) -> Formula:
    """Return the formula for `free`: in none of these regions. The conjunction of many is halved, so that it is never deep."""
    names = list(regions)
    if len(names) > _CHAIN:
        half = len(names) // 2
        return Formula("&", (in_no_region(names[:half]), in_no_region(names[half:])))
    formula = TRUE
    for name in names:
        outside = Formula("!", (Formula("name", (), name),))
        formula = outside if formula == TRUE else Formula("&", (formula, outside))
    return formula
