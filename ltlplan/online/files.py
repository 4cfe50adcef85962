"""Files of a flight flown online; `flight.storage.folders` writes the folder whole or not at all."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from flight.logs.large_logs import run_csv
from ltlplan.report.online import online_html
from verify.data import mission_to_yaml
from verify.data.events import EVENTS_FILE, events_to_json

if TYPE_CHECKING:
    from ltlplan.online.online_flight import OnlineFlight

ONLINE_FILES = ("mission.yaml", EVENTS_FILE, "flight.csv", "report.html", "summary.txt")


def write_online(flown: OnlineFlight, lines: Sequence[str], folder: Path) -> None:
    """Write `ONLINE_FILES`: the mission as it was at take-off, what changed, and what was flown.

    Args:
        flown: The flight.
        lines: What is said of it, a sentence each.
        folder: Where; it exists.
    """
    (folder / "mission.yaml").write_text(mission_to_yaml(flown.asked), encoding="utf-8")
    (folder / EVENTS_FILE).write_text(events_to_json(flown.events), encoding="utf-8")
    (folder / "flight.csv").write_text(run_csv(flown.log), encoding="utf-8")
    (folder / "report.html").write_text(online_html(flown), encoding="utf-8")
    (folder / "summary.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
