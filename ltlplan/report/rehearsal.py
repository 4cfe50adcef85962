"""The page of a rehearsal: what was found in sentences, and the table of its cells."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ltlplan.report.page import folded, listed, page_html, section, table

if TYPE_CHECKING:
    from flight.rehearsal.table import Rehearsal

_NOTE = (
    "Worst distance from the plan of any robot at any time in mm, of all flights of a cell; * where one left its tube, lost where a robot "
    "fell. Masses are shares of the profile's, which controllers are told; latencies are motion capture's, winds in m/s."
)


_BEGIN, _END = "<!-- rehearsal -->", "<!-- end of rehearsal -->"


def rehearsal_html(found: Rehearsal) -> str:
    """Return one self-contained page for a rehearsal."""
    return page_html(
        f"{found.mission}: {_title(found)}",
        header=listed(_sentences(found)),
        sections=[section("Cells", _cells(found), note=_NOTE)],
        figures={},
    )


def with_rehearsal(page: str, found: Rehearsal) -> str:
    """Return a run's page with a section on a rehearsal of it as its last one, in place of an earlier rehearsal's.

    Args:
        page: The run's page.
        found: The rehearsal.
    """
    shown, scripts, data = page.partition('<script id="plotly"')
    before, begin, rest = shown.partition(_BEGIN)
    if begin:
        shown = before + rest.partition(_END)[2].removeprefix("\n")
    above, main, below = shown.rpartition("</main>")
    heading = _title(found)
    made = section(heading[:1].upper() + heading[1:], listed(_sentences(found)) + _cells(found), note=_NOTE)
    return f"{above}{_BEGIN}{made}{_END}\n{main}{below}{scripts}{data}"


def _title(found: Rehearsal) -> str:
    cells = len(found.cells)
    return f"rehearsal of {cells} cell{'s' * (cells != 1)} of {found.runs} flight{'s' * (found.runs != 1)}"


def _sentences(found: Rehearsal) -> list[str]:
    return [sentence[:1].upper() + sentence[1:] for sentence in found.sentences]


def _cells(found: Rehearsal) -> str:
    header, *rows = found.rows()
    return folded(table(header, rows, numbers=range(1, len(header))), len(rows), "rows")
