"""Results of a rehearsal: a cell for each controller, mass, latency and wind, in or out of the tube."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from flight.rehearsal.corners import Corners
from flight.rehearsal.hunt import Hunt


@dataclass(frozen=True, slots=True)
class Cell:
    """The flights of one combination.

    Attributes:
        controller: Its name.
        mass: Share of the profile's mass that the vehicles weigh; controllers are told the profile's.
        latency: s from a frame of motion capture to its use on board.
        wind: m/s, as `Wind.parse` reads it.
        worst: Largest distance of any robot from its plan at any time, m; infinite where one was lost.
        robot: Whose.
        seed: Of that flight.
        left: How many of the flights left the tube; None without a certificate.
        drag: Of vehicles whose rotors' drag is a guess: the `profile`'s, the `least` or the `most` that may be.
    """

    controller: str
    mass: float
    latency: float
    wind: str
    worst: float
    robot: str
    seed: int
    left: int | None
    drag: str = "profile"

    @property
    def inside(self) -> bool | None:
        """True if every flight stayed in its tube; None without a certificate."""
        return None if self.left is None else self.left == 0


@dataclass(frozen=True, slots=True)
class Rehearsal:
    """Results of a rehearsal.

    Attributes:
        mission: The mission's name.
        margin: Radius of the tube, m; None without a certificate.
        certificate: Its digest, or None.
        runs: Flights of each cell.
        seed: Of the first of them.
        profile: Whom the vehicles' margins are meant for.
        cells: Controller by controller, then by drag, mass, latency and wind.
        doubts: Sentences on what of the vehicles is a guess.
        corners: What was found at the corners of what is not known; None where they were not flown.
        hunt: What was found by winds that are aimed; None where nothing was hunted.
    """

    mission: str
    margin: float | None
    certificate: str | None
    runs: int
    seed: int
    profile: tuple[str, ...]
    cells: tuple[Cell, ...]
    doubts: tuple[str, ...] = ()
    corners: Corners | None = None
    hunt: Hunt | None = None

    @property
    def controllers(self) -> tuple[str, ...]:
        """Controllers that flew, in order."""
        return tuple(dict.fromkeys(cell.controller for cell in self.cells))

    def of(self, controller: str) -> tuple[Cell, ...]:
        """Return the cells of one controller.

        Args:
            controller: Its name.
        """
        return tuple(cell for cell in self.cells if cell.controller == controller)

    @property
    def sentences(self) -> tuple[str, ...]:
        """The results, a sentence a controller, and how much of them depends on drags that are a guess."""
        found: list[str] = []
        for name in self.controllers:
            cells = self.of(name)
            worst = max(cells, key=lambda cell: cell.worst)
            farthest = (
                f"worst {_millimetres(worst.worst)} by {worst.robot} (mass x {worst.mass:g}, {1000 * worst.latency:g} ms late, "
                f"wind {worst.wind}, seed {worst.seed}{_drag(worst)})."
            )
            if self.margin is None:
                found.append(f"{name}: {farthest}")
                continue
            kept = sum(cell.inside is True for cell in cells)
            meant = ", whom the margin is meant for," if name in self.profile else ""
            found.append(f"{name}{meant} stayed in the tube of {self.margin:g} m in {kept} of {len(cells)} cells; {farthest}")
        corners = () if self.corners is None else self.corners.sentences
        hunted = () if self.hunt is None else (self.hunt.sentence,)
        return (*found, *self._of_drags(), *corners, *hunted, *(doubt[:1].upper() + doubt[1:] for doubt in self.doubts))

    def _of_drags(self) -> list[str]:
        """Say at which end of drags that are a guess controllers leave a tube that they keep to with the profile's."""
        found: list[str] = []
        cells = {(c.controller, c.mass, c.latency, c.wind, c.drag): c for c in self.cells}
        for name in self.controllers:
            for end in ("least", "most"):
                flown = [cell for cell in self.of(name) if cell.drag == end]
                lost = [
                    cell
                    for cell in flown
                    if cell.inside is False
                    and (usual := cells.get((name, cell.mass, cell.latency, cell.wind, "profile"))) is not None
                    and usual.inside
                ]
                if lost:
                    worst = max(lost, key=lambda cell: cell.worst)
                    found.append(
                        f"{name} leaves its tube in {len(lost)} of {len(flown)} cells with the {end} drag that may be, and not with the profile's there: "
                        f"worst {_millimetres(worst.worst)} (mass x {worst.mass:g}, {1000 * worst.latency:g} ms late, wind {worst.wind})."
                    )
        return found

    def rows(self) -> list[list[str]]:
        """Return the table as text, its heading first: a row for each controller, drag and mass, a column for each latency and wind.

        Cells are the worst error in mm, with `*` where a flight left its tube.
        """
        columns = list(dict.fromkeys((cell.latency, cell.wind) for cell in self.cells))
        table = [["controller", "mass", *(f"{1000 * latency:g} ms, {wind} m/s" for latency, wind in columns)]]
        found = {(cell.controller, cell.drag, cell.mass, cell.latency, cell.wind): cell for cell in self.cells}
        for name, drag, mass in dict.fromkeys((cell.controller, cell.drag, cell.mass) for cell in self.cells):
            cells: Sequence[Cell] = [found[name, drag, mass, *column] for column in columns]
            row = name if drag == "profile" else f"{name}, {drag} drag"
            table.append([row, f"x {mass:g}", *(_entry(cell) for cell in cells)])
        return table

    def to_dict(self) -> dict[str, Any]:  # of any type: JSON nests
        """Return the findings as plain data; a lost robot's error is null."""
        return {
            "mission": self.mission,
            "margin": self.margin,
            "certificate": self.certificate,
            "runs": self.runs,
            "seed": self.seed,
            "profile": list(self.profile),
            "doubts": list(self.doubts),
            **({} if self.corners is None else {"corners": self.corners.to_dict()}),
            **({} if self.hunt is None else {"hunt": self.hunt.to_dict()}),
            "cells": [
                {**asdict(cell), "worst": None if cell.worst == float("inf") else cell.worst, "inside": cell.inside}
                for cell in self.cells
            ],
        }


def _drag(cell: Cell) -> str:
    return "" if cell.drag == "profile" else f", {cell.drag} drag"


def _entry(cell: Cell) -> str:
    worst = "lost" if cell.worst == float("inf") else f"{1000 * cell.worst:.0f}"
    return worst if cell.inside is not False else f"{worst} *"


def _millimetres(error: float) -> str:
    return "beyond all bounds" if error == float("inf") else f"{1000 * error:.1f} mm"
