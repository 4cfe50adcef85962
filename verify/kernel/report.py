"""A statement in words, and what is checked of it. All of a statement is printed, by the names of its fields: no assumption can be left out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any

from .checking import Checked
from .formulas import show
from .statement import Inequality, Statement

_SAID = ("format", "name", "lasso", "repeat", "joint", "formula", "margin", "clock_error")
"""Fields that the first lines speak of."""
_WORDS = {
    "low": "workspace from", "high": "workspace to", "start": "starts at", "yaw": "with heading", "end": "finishes at", "closed": "may not enter",
    "edges": "may go from one region to others", "vertex": "comes from", "actions": "permitted changes of the internal state", "cuts": "parts begin with pieces",
    "changes": "planned changes of it", "cycle": "laps begin with piece", "cycle_visit": "laps begin with visit", "legs": "limits on the way to",
    "digests": "digests, not looked at", "parts": "parts, around the center",
}  # fmt: skip


def _text(value: Any) -> str:  # of any type: a statement's values
    """Return what takes one line."""
    if isinstance(value, Fraction):
        return str(float(value)).removesuffix(".0")
    if isinstance(value, Inequality):
        square = "" if value.quadratic is None else f"x'{' '.join(map(_text, value.quadratic))}x"
        linear = "" if value.linear is None else f"{_text(value.linear)}.x"
        return f"{' + '.join(filter(None, (square, linear))) or '0'} <= {_text(value.bound)}"
    if hasattr(value, "_asdict"):
        return ", ".join(f"{key} {_text(one)}" for key, one in value._asdict().items() if one is not None)
    if isinstance(value, tuple | frozenset):
        return f"({', '.join(map(_text, sorted(value) if isinstance(value, frozenset) else value))})"
    return str(value)


def _lines(name: str, value: Any, depth: int = 1) -> Iterator[str]:  # of any type, as above
    """Yield what a field says, if it says anything; tables take a line for each of their fields."""
    table = value._asdict() if hasattr(value, "_asdict") else value
    if isinstance(table, dict) and table:
        yield f"{'  ' * depth}{name}:"
        for key, one in table.items():
            yield from _lines(_WORDS.get(str(key), str(key).replace("_", " ")), one, depth + 1)
    elif value not in (None, (), {}, frozenset()):
        yield f"{'  ' * depth}{name}: {_text(value)}"


def statement_lines(statement: Statement) -> Iterator[str]:
    """Yield what a statement says."""
    yield f"Mission {statement.name}. Every flight whose robots stay within {_text(statement.margin)} m of their paths at every time,"
    yield f"with clocks that never differ by more than {_text(statement.clock_error)} s (all values in SI units, angles in rad):"
    letters = "letters of all robots are joined" if statement.joint else "each robot is read by itself"
    trace = f"laps for ever, of which {statement.repeat} are in the files" if statement.lasso else "a finite flight"
    yield f"  formula {show(statement.formula)} ({letters}; {trace})"
    for key, value in statement._asdict().items():
        if key in ("regions", "obstacles", "robots"):
            for name, one in value.items():
                yield from _lines(f"{key[:-1]} {name}", one)
        elif key not in _SAID:
            yield from _lines(_WORDS.get(str(key), str(key).replace("_", " ")), value)


def claim_lines(claims: Sequence[Checked]) -> Iterator[str]:
    """Yield each claim, and how many of them are checked."""
    for claim in claims:
        of = f" of {' and '.join(claim.robots)}" if claim.robots else ""
        missing = f"not covered by the kernel: {claim.name}{of}: {claim.missing}."
        yield missing if claim.missing else f"checked: {claim.name}: {claim.sentence}"
    yield summary(claims)


def summary(claims: Sequence[Checked]) -> str:
    """Return how many claims are checked."""
    return f"{sum(not claim.missing for claim in claims)} of {len(claims)} claims checked by the kernel"
