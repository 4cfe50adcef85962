"""A second, independent reading of what a run wrote: files in, dense float samples out. Judges the judge.

Shares no code with the project: CSVs by the standard library, polynomials by numpy, the mission by a YAML parser.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml import YAML

G = 9.80665


@dataclass
class Flight:
    """Samples of one robot: t (n,), and derivatives 0 to 4 of x, y, z, yaw, shape (5, n, 4)."""

    t: np.ndarray
    d: np.ndarray


def read_mission(folder: Path) -> dict[str, Any]:
    return YAML(typ="safe", pure=True).load((folder / "mission.yaml").read_text())


def read_flight(path: Path, rate: float, end: float | None = None) -> Flight:
    """Sample a polynomial CSV at `rate` Hz; after its end the robot hovers until `end`."""
    with path.open(newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["duration", *(f"{axis}^{power}" for axis in ("x", "y", "z", "yaw") for power in range(8))]
    pieces = [np.array(row, dtype=np.float32).astype(float) for row in rows[1:]]
    times, values, start = [], [], 0.0
    for piece in pieces:
        duration, coefficients = piece[0], piece[1:].reshape(4, 8)
        local = np.linspace(0.0, duration, max(int(duration * rate), 2))
        derivatives = []
        for order in range(5):
            columns = [
                np.polynomial.polynomial.polyval(local, np.polynomial.polynomial.polyder(c, order)) for c in coefficients
            ]
            derivatives.append(np.stack(columns, axis=-1))
        times.append(start + local)
        values.append(np.stack(derivatives))
        start += duration
    if end is not None and end > start:
        hover = np.arange(start, end, 1 / rate)
        last = np.zeros((5, len(hover), 4))
        last[0] = values[-1][0, -1]
        times.append(hover)
        values.append(last)
    return Flight(np.concatenate(times), np.concatenate(values, axis=1))


def level(region: dict[str, Any], points: np.ndarray) -> np.ndarray:
    offset = points - np.array(region["center"])
    return np.einsum("...i,ij,...j->...", offset, np.array(region["matrix"]), offset)


def regions_of(mission: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {**mission.get("hoops", {}), **mission.get("regions", {})}


def quantities(mission: dict[str, Any], flight: Flight) -> dict[str, np.ndarray]:
    """The limited quantities by textbook formulas: attitude by cross products, rates by projecting the jerk."""
    vehicle = mission["vehicle"]
    v, a, j, s = (flight.d[i, :, :3] for i in (1, 2, 3, 4))
    yaw, yaw_dot, yaw_ddot = flight.d[0, :, 3], flight.d[1, :, 3], flight.d[2, :, 3]
    f = a + np.array([0, 0, G])
    size = np.linalg.norm(f, axis=1)
    zb = f / size[:, None]
    xc = np.stack([np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)], axis=1)
    yb = np.cross(zb, xc)
    norm_y = np.linalg.norm(yb, axis=1)
    yb = yb / norm_y[:, None]
    xb = np.cross(yb, zb)
    h = (j - np.sum(zb * j, axis=1)[:, None] * zb) / size[:, None]
    p, q = -np.sum(h * yb, axis=1), np.sum(h * xb, axis=1)
    yc = np.stack([-np.sin(yaw), np.cos(yaw), np.zeros_like(yaw)], axis=1)
    r = (yaw_dot * np.sum(xc * xb, axis=1) + q * np.sum(yc * zb, axis=1)) / norm_y
    del s, yaw_ddot
    return {
        "speed": np.linalg.norm(v, axis=1),
        "acceleration": np.linalg.norm(a, axis=1),
        "thrust": vehicle["mass"] * size,
        "tilt": np.arccos(np.clip(zb[:, 2], -1, 1)),
        "body_rate": np.hypot(p, q),
        "yaw_rate": np.abs(r),
    }
