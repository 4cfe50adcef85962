"""Exports of certified flights: what is asked, and the archive that is made of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ltlplan.service.models import DerivedKind
from ltlplan.service.queries import zipped
from verify.data.progress import Progress


@dataclass(frozen=True, slots=True)
class ExportAsked:
    """Request for an export.

    Attributes:
        target: Name of the format.
        vehicle: Name of the airframe that will fly, where it is to be compared with the certificate's.
        robots: Those that are written, where others of the team fly from another export; None for all.
        options: The target's own.
        anyway: Write without a simulated flight that stayed in its tube, with a warning in the files.
    """

    target: str
    vehicle: str | None = None
    robots: tuple[str, ...] | None = None
    options: Mapping[str, float] | None = None
    anyway: bool = False

    @property
    def kind(self) -> DerivedKind:
        """Kind of what is made of the flight."""
        return "export"

    @property
    def title(self) -> str:
        """Kind and options in words."""
        return f"export for {self.target}"

    @property
    def recording(self) -> bytes:
        """Bytes that were sent with it: none."""
        return b""

    def plain(self) -> dict[str, Any]:
        """Return what is asked as plain data."""
        return {**asdict(self), "options": dict(self.options or {})}


def export_archive(asked: ExportAsked, run: Path, progress: Progress) -> tuple[str, bytes]:
    """Return the name of an export's archive, and the archive: a certified flight, proved again and flown in simulation first.

    Args:
        asked: What the flight is to be written for.
        run: Folder of what the flight's job has made.
        progress: Receives a sentence and the share done, 0 to 1.

    Raises:
        LtlplanError: The flight is not written, and why.
    """
    from ltlplan.output import make_export

    made = make_export(
        run,
        asked.target,
        vehicle=asked.vehicle,
        robots=asked.robots,
        options=asked.options or {},
        force=asked.anyway,
        progress=progress,
    )
    return f"{asked.target}.zip", zipped(made.files)
