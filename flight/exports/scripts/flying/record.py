"""Record of a flight: a new folder each time, written as things happen, so that nothing is lost where the script is killed.

`poses.csv` and `setpoints.csv` have all that was measured and asked, `live.csv` what was measured of the certified flight, time 0 where it
began (what `ltlplan certify RUN --flight` reads), and `live.json` when what began and ended, parameters, batteries and all that was said.
Copied into exports.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

from flying.watch import Refused

FLIGHT = "flight"
HEAD = "t,robot,x,y,z\n"
BESIDE = 0.2  # s before and after the flight in which each robot's last and first position still belong to it

Row = tuple[float, str, float, float, float]


class Record:
    """Grows while a flight is flown; older ones stay as they are."""

    def __init__(self, beside: Path, about: dict[str, Any]) -> None:
        """Make a new folder, `flown-001` or the next number that is free.

        Args:
            beside: Where.
            about: What is known before, for `live.json`.

        Raises:
            Refused: It cannot be written there.
        """
        self.folder = _new_folder(beside)
        self.said: dict[str, Any] = {**about, "starts": {}, "ends": {}, "parts": {}, "parameters": {}, "batteries": {}}
        self.said |= {"worst": {}, "events": [], "reason": "it was not ended by the script itself"}
        self._flight: list[Row] = []
        self._before: dict[str, Row] = {}
        self._lost = False
        self._poses, self._setpoints = self._table("poses.csv"), self._table("setpoints.csv")
        self._write()

    def _table(self, name: str) -> IO[str]:
        file = (self.folder / name).open("x", encoding="utf-8", newline="\n")
        file.write(HEAD)
        file.flush()
        return file

    def pose(
        self, stage: str, time: float, robot: str, place: tuple[float, ...], wanted: tuple[float, ...], off: float
    ) -> None:
        """Add where a robot was measured, and where it should have been.

        Args:
            stage: What is flown.
            time: s of the script's clock.
            robot: Its name.
            place: x, y, z in m.
            wanted: As well.
            off: m between them, as it is judged.
        """
        row = (time, robot, place[0], place[1], place[2])
        self._keep(lambda: self._append(self._poses, row))
        self._keep(lambda: self._append(self._setpoints, (time, robot, wanted[0], wanted[1], wanted[2])))
        worst = self.said["worst"].setdefault(stage, {})
        worst[robot] = max(worst.get(robot, 0.0), round(off, 6))
        if FLIGHT in self.said["starts"]:
            self._flight.append(row)
        else:
            self._before[robot] = row

    def began(self, stage: str, time: float) -> None:
        """Note when a stage began, s of the script's clock."""
        self.said["starts"].setdefault(stage, time)
        self._write()

    def ended(self, stage: str, time: float) -> None:
        """Note when a stage ended, s of the script's clock."""
        self.said["ends"][stage] = time
        self._write()

    def part(self, begin: float, end: float) -> None:
        """Note when a part of the flight began and was to end, s of the script's clock."""
        self.said["parts"].setdefault(FLIGHT, []).append([begin, end])
        self._write()

    def event(self, time: float, sentence: str, kind: str = "note") -> None:
        """Note what happened, and say it.

        Args:
            time: s of the script's clock.
            sentence: For a person.
            kind: `check`, `alarm`, `reaction` or `note`.
        """
        self.said["events"].append({"time": time, "robot": None, "kind": kind, "sentence": sentence})
        self._write()
        print(sentence, flush=True)

    def close(self, reason: str) -> None:
        """Write how it ended, and the flight as it is judged.

        Args:
            reason: Why it ended; empty where it was flown to its end.
        """
        self.said["reason"] = reason
        self._write()
        self._keep(self._poses.close)
        self._keep(self._setpoints.close)
        begin = self.said["starts"].get(FLIGHT)
        if begin is None:
            return
        end = self.said["ends"].get(FLIGHT, float("inf"))
        after: dict[str, float] = {}
        for time, robot, *_ in self._flight:
            if end <= time <= end + BESIDE:
                after[robot] = min(time, after.get(robot, time))
        last = max([end, *after.values()])
        hovering = (row for row in self._before.values() if begin - BESIDE <= row[0] < begin)
        rows = sorted([*hovering, *(row for row in self._flight if begin <= row[0] <= last)])
        text = HEAD + "".join(_line((time - begin, *rest)) for time, *rest in rows)
        self._keep(lambda: (self.folder / "live.csv").write_text(text, encoding="utf-8"))

    def _write(self) -> None:
        def write() -> None:
            aside = self.folder / "live.json.part"
            aside.write_text(json.dumps(self.said, indent=1, default=str) + "\n", encoding="utf-8")
            aside.replace(self.folder / "live.json")

        self._keep(write)

    def _append(self, file: IO[str], row: Row) -> None:
        file.write(_line(row))
        file.flush()

    def _keep(self, write: Callable[[], object]) -> None:
        """Write something; a full disk must not keep robots from landing."""
        try:
            write()
        except OSError as error:
            if not self._lost:
                self._lost = True
                print(f"what happens cannot be written to {self.folder}: {error.strerror}", flush=True)


def _line(row: tuple[Any, ...]) -> str:
    time, robot, x, y, z = row
    return f"{time:.9g},{robot},{x:.9g},{y:.9g},{z:.9g}\n"


def _new_folder(beside: Path) -> Path:
    number = 1
    while True:
        folder = beside / f"flown-{number:03d}"
        try:
            folder.mkdir()
        except FileExistsError:
            number += 1
        except OSError as error:
            raise Refused(f"what happens cannot be written into {beside}: {error.strerror}") from None
        else:
            return folder
