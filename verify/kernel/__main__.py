"""Check the proof in a folder: `python check.pyz FOLDER`, or `python -m verify.kernel FOLDER`."""

from __future__ import annotations

import sys
from pathlib import Path

from . import VERSION
from .checking import Check, Checked
from .flights import read_team
from .report import claim_lines, statement_lines
from .statement import Refused, Statement, read_statement, require
from .trees import read_evidence

MOST_BYTES = 50_000_000


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
