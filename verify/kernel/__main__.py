"""Check the proof in a folder (`python check.pyz FOLDER`); print each field of the statement, so that no assumption is left out, and what is checked."""

import sys
from collections.abc import Iterator, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

from . import VERSION
from .checking import Check, Checked
from .flights import read_team
from .formulas import show
from .statement import Inequality, Refused, Statement, read_statement, require
from .trees import read_evidence

MOST_BYTES = 50_000_000
_SAID = ("format", "name", "lasso", "repeat", "joint", "formula", "timed", "margin", "clock_error")  # in the first lines
_WORDS = {
    "low": "workspace from", "high": "workspace to", "start": "starts at", "yaw": "with heading", "end": "finishes at", "closed": "may not enter",
    "edges": "may go from one region to others", "vertex": "comes from", "actions": "permitted changes of the internal state", "cuts": "parts begin with pieces",
    "changes": "planned changes of it", "cycle": "laps begin with piece", "cycle_visit": "laps begin with visit", "legs": "limits on the way to",
    "digests": "digests, not looked at", "parts": "parts, around the center",
}  # fmt: skip


def _text(path: Path) -> str:
    try:
        require(path.is_file() and path.stat().st_size <= MOST_BYTES, f"{path} is no file, or too large.")
        return path.read_bytes().decode()
    except (OSError, ValueError) as error:
        raise Refused(f"{path} cannot be read: {error}.") from None


def check_folder(folder: Path) -> tuple[Statement, list[Checked]]:
    """Return the statement of a folder with statement.json, proof.json and each robot's CSV file, and each claim that it owes."""
    statement = read_statement(_text(folder / "statement.json"))
    team = read_team(statement, {name: _text(folder / f"{name}.csv") for name in statement.robots})
    return statement, Check(statement, team, read_evidence(_text(folder / "proof.json"))).claims()


def _said(value: Any) -> str:  # of any type: a statement's values
    """Return what takes one line."""
    if isinstance(value, Fraction):
        return str(float(value)).removesuffix(".0")
    if isinstance(value, Inequality):
        square = "" if value.quadratic is None else f"x'{' '.join(map(_said, value.quadratic))}x"
        linear = "" if value.linear is None else f"{_said(value.linear)}.x"
        return f"{' + '.join(filter(None, (square, linear))) or '0'} <= {_said(value.bound)}"
    if hasattr(value, "_asdict"):
        return ", ".join(f"{key} {_said(one)}" for key, one in value._asdict().items() if one is not None)
    if isinstance(value, tuple | frozenset):
        return f"({', '.join(map(_said, sorted(value) if isinstance(value, frozenset) else value))})"
    return str(value)


def _lines(name: str, value: Any, depth: int = 1) -> Iterator[str]:  # of any type, as above
    """Yield what a field says, if it says anything; tables take a line for each of their fields."""
    table = value._asdict() if hasattr(value, "_asdict") else value
    if isinstance(table, dict) and table:
        yield f"{'  ' * depth}{name}:"
        for key, one in table.items():
            yield from _lines(_WORDS.get(str(key), str(key).replace("_", " ")), one, depth + 1)
    elif value not in (None, (), {}, frozenset()):
        yield f"{'  ' * depth}{name}: {_said(value)}"


def statement_lines(statement: Statement) -> Iterator[str]:
    """Yield what a statement says."""
    yield f"Mission {statement.name}. Every flight whose robots stay within {_said(statement.margin)} m of their paths at every time,"
    yield f"with clocks that never differ by more than {_said(statement.clock_error)} s (all values in SI units, angles in rad):"
    letters = "letters of all robots are joined" if statement.joint else "each robot is read by itself"
    trace = f"laps for ever, of which {statement.repeat} are in the files" if statement.lasso else "a finite flight"
    yield f"  formula {show(statement.formula)} ({letters}; {trace})"
    for part in statement.timed or ():
        yield f"  at time 0 of a clock that differs from theirs by no more, last letters being held: {show(part)}"
    for key, value in statement._asdict().items():
        if key not in _SAID:
            yield from _lines(_WORDS.get(key, key.replace("_", " ")), value)


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


def main() -> int:
    """Print what a folder's statement says and what of it is checked; return 0 where all of it is, 1 where not, 2 without a proof."""
    try:
        require(len(sys.argv) == 2, "usage: check.pyz FOLDER")
        statement, claims = check_folder(Path(sys.argv[1]))
        lines = [f"Kernel {VERSION}", *statement_lines(statement), "", *claim_lines(claims)]
        result = int(any(claim.missing for claim in claims))
    except Refused as refused:
        result, lines = 2, [f"refused: {refused}"]
    for line in lines:
        print(line.encode("unicode_escape").decode())  # names print no lines of their own
    return result


if __name__ == "__main__":
    sys.exit(main())
