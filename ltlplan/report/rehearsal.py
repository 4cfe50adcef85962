"""The page of a rehearsal: what was found in sentences, and the table of its cells."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ltlplan.report.page import listed, page_html, section, table

if TYPE_CHECKING:
    from flight.rehearsal.table import Rehearsal

_NOTE = (
    "Worst distance from the plan of any robot at any time in mm, of all flights of a cell; * where one left its tube, lost where a robot "
    "fell. Masses are shares of the profile's, which controllers are told; latencies are motion capture's, winds in m/s."
)


def rehearsal_html(found: Rehearsal) -> str:
    """Return one self-contained page for a rehearsal."""
    header, *rows = found.rows()
    flights = f"{len(found.cells)} cells of {found.runs} flight{'s' * (found.runs != 1)}"
    return page_html(
        f"{found.mission}: rehearsal of {flights}",
        header=listed([sentence[:1].upper() + sentence[1:] for sentence in found.sentences]),
        sections=[section("Cells", table(header, rows, numbers=range(1, len(header))), note=_NOTE)],
        figures={},
    )
