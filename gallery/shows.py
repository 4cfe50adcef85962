"""A show of 100 drones as others plan them: folders of CSV files, a cubic a piece, without any proof."""

from __future__ import annotations

import math
from pathlib import Path

DRONES, PIECES, LASTS = 100, 24, 48.0
SPEED, MEET = 2.4, 20.1
HEADER = "duration," + ",".join(f"{axis}^{power}" for axis in ("x", "y", "z", "yaw") for power in range(8))


def write_show(folder: Path, *, divers: bool = False) -> None:
    """Write the show: ten rings of ten drones that turn against each other, rise and sink in a wave.

    Args:
        folder: Is made.
        divers: Whether two more cross above it, at 2.4 m/s and 0.15 m apart at 20.1 s: samples at 4 and 5 Hz see them 0.5 m apart.
    """
    folder.mkdir(parents=True)
    step = LASTS / PIECES
    for drone in range(DRONES):
        ring, place = divmod(drone, 10)
        rows = [HEADER]
        for piece in range(PIECES):
            begin, end = _state(ring, place, piece * step), _state(ring, place, (piece + 1) * step)
            axes = [_cubic(before, after, step) for before, after in zip(begin, end, strict=True)]
            rows.append(",".join(map(repr, [step, *axes[0], *axes[1], *axes[2], *[0.0] * 8])))
        (folder / f"drone{drone:03}.csv").write_text("\n".join(rows) + "\n")
    for name, way, lane in (("diver0", 1.0, 0.0), ("diver1", -1.0, 0.15)) if divers else ():
        row = [LASTS, -way * SPEED * MEET, way * SPEED, *[0.0] * 6, lane, *[0.0] * 7, 12.0, *[0.0] * 7, *[0.0] * 8]
        (folder / f"{name}.csv").write_text(f"{HEADER}\n{','.join(map(repr, row))}\n")


def _state(ring: int, place: int, time: float) -> tuple[tuple[float, float], ...]:
    """Return position and velocity along each axis."""
    radius, turn = 2.0 + 0.9 * ring, (1.0 if ring % 2 else -1.0) * 1.2 / (2.0 + 0.9 * ring)
    angle, wave = 2 * math.pi * place / 10 + turn * time, 2 * math.pi * time / LASTS + ring / 3
    return (
        (radius * math.cos(angle), -radius * turn * math.sin(angle)),
        (radius * math.sin(angle), radius * turn * math.cos(angle)),
        (6.0 + 1.5 * math.sin(wave), 1.5 * math.cos(wave) * 2 * math.pi / LASTS),
    )


def _cubic(begin: tuple[float, float], end: tuple[float, float], lasts: float) -> list[float]:
    """Return the cubic with these values and slopes at its ends, as eight ascending coefficients."""
    (p, v), (q, w) = begin, end
    rise = (q - p) / lasts
    return [p, v, (3 * rise - 2 * v - w) / lasts, (v + w - 2 * rise) / lasts**2, 0.0, 0.0, 0.0, 0.0]
