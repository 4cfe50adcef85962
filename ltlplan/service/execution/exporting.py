"""Exports of certified flights: what is asked, as bytes, and the archive that is made of it."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ltlplan.service.execution.serialization import from_bytes, to_bytes
from ltlplan.service.queries import without_places, zipped
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

    def plain(self) -> dict[str, Any]:
        """Return what is asked as plain data."""
        return {**asdict(self), "options": dict(self.options or {})}


def export_bytes(asked: ExportAsked, files: Mapping[str, bytes]) -> bytes:
    """Return what an export is made of, as the bytes that its stage takes.

    Args:
        asked: What the flight is to be written for.
        files: What the flight's job has made.
    """
    return to_bytes((asked.plain(), {name: np.frombuffer(data, dtype=np.uint8) for name, data in files.items()}))


def export_archive(value: bytes, progress: Progress) -> tuple[str, bytes]:
    """Return the name of an export's archive, and the archive: a certified flight, proved again and flown in simulation first.

    Args:
        value: What `export_bytes` made.
        progress: Receives a sentence and the share done, 0 to 1.

    Raises:
        LtlplanError: The flight is not written, and why.
    """
    from ltlplan.output import make_export

    plain, files = from_bytes(value)
    asked = ExportAsked(**plain)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for name, data in files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(data.tobytes())
        with without_places(folder):
            made = make_export(
                folder,
                asked.target,
                vehicle=asked.vehicle,
                robots=asked.robots,
                options=asked.options or {},
                force=asked.anyway,
                progress=progress,
            )
            return f"{asked.target}.zip", zipped(made.files)
