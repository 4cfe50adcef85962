"""Shows made at random or by hand, as fleets and as files, and what a dense sampler sees of them."""

from __future__ import annotations

import csv
import io
import json
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from verify.arithmetic.balls import Floats
from verify.data.files.trajectory_csv import HEADER
from verify.third_party.fleet import Fleet, Flight, assemble


def wandering(drones: int, pieces: int, rng: np.random.Generator, *, size: float = 6.0, common: bool = True) -> Fleet:
    """Return drones that wander in a cube on curves of degree 1 to 3.

    Args:
        drones: How many.
        pieces: Of each.
        rng: Source of every draw.
        size: Of the cube, m.
        common: Whether all pieces begin at the same times.
    """
    shared = np.cumsum(np.concatenate([[0.0], rng.uniform(0.3, 1.5, pieces)]))
    flights: list[Flight] = []
    for index in range(drones):
        own = np.cumsum(np.concatenate([[rng.uniform(0.0, 1.0)], rng.uniform(0.3, 1.5, pieces)]))
        times = shared if common else own
        points = rng.uniform(0.0, size, (pieces + 1, 3))
        values = np.zeros((pieces, 3, 4))
        degrees = rng.integers(1, 4, pieces).astype(np.int8)
        for piece, degree in enumerate(degrees.tolist()):
            inner = points[piece] + rng.uniform(-2.0, 2.0, (degree - 1, 3))
            values[piece, :, : degree + 1] = np.concatenate([points[piece : piece + 1], inner, points[piece + 1 : piece + 2]]).T
        flights.append(Flight(f"d{index}", np.stack([times, np.zeros_like(times)], -1), values, degrees))
    return assemble("show", "bernstein", flights)


def sampled(fleet: Fleet, drone: int, times: Floats) -> Floats:
    """Return where a drone is at times, by plain evaluation. Shape (times, 3)."""
    result = np.empty((len(times), 3))
    rows = range(int(fleet.first[drone]), int(fleet.first[drone + 1]))
    starts = np.array([float(fleet.start(row)) for row in rows])
    for index, time in enumerate(times.tolist()):
        row = rows[max(int(np.searchsorted(starts, time, side="right")) - 1, 0)]
        place = (time - float(fleet.start(row))) / float(fleet.stop(row) - fleet.start(row))
        result[index] = [_at(fleet, row, axis, min(max(place, 0.0), 1.0)) for axis in range(3)]
    return result


def _at(fleet: Fleet, row: int, axis: int, place: float) -> float:
    if fleet.basis == "power":
        local = place * float(fleet.stop(row) - fleet.start(row))
        return float(np.polynomial.polynomial.polyval(local, fleet.values[row, axis]))
    values = fleet.values[row, axis, : fleet.degrees[row] + 1]
    while len(values) > 1:
        values = values[:-1] * (1 - place) + values[1:] * place
    return float(values[0])


def csv_text(pieces: Sequence[tuple[float, Mapping[str, Sequence[float]]]]) -> str:
    """Return crazyswarm2's CSV of pieces: durations, and the coefficients of each axis that are not all zero."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADER)
    for duration, axes in pieces:
        cells = [(*axes.get(axis, ()), *[0.0] * 8)[:8] for axis in ("x", "y", "z", "yaw")]
        writer.writerow([duration, *(value for row in cells for value in row)])
    return text.getvalue()


def show_of(drones: Iterable[tuple[str, Any]], **more: Any) -> dict[str, Any]:
    """Return `show.json` of drones given by name and trajectory."""
    rows = [{"type": "generic", "settings": {"name": name, "trajectory": trajectory}} for name, trajectory in drones]
    return {"version": 1, "swarm": {"drones": rows}, **more}


def trajectory_of(points: Sequence[Sequence[Any]], **more: Any) -> dict[str, Any]:
    """Return a trajectory of keyframes `[t, [x, y, z], [control points]]`."""
    return {"version": 1, "points": list(points), **more}


def write_show(path: Path, show: Any, members: Mapping[str, Any] | None = None) -> Path:
    """Write a `.skyc` file: `show.json`, and other members by their names."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("show.json", show if isinstance(show, str) else json.dumps(show))
        for name, content in (members or {}).items():
            archive.writestr(name, content if isinstance(content, str | bytes) else json.dumps(content))
    return path


def exported_show(drones: Mapping[str, Mapping[str, Any]], **validation: float) -> dict[str, Any]:
    """Return `show.json` as Skybrush Studio for Blender (August 2026) asks for it, with what its server adds to a drone's settings.

    Args:
        drones: Settings by name: "trajectory", and "home", "landAt" or "yawControl".
        validation: Limits by the names of `settings.validation`.
    """
    return {
        "version": 1,
        "environment": {"type": "outdoor"},
        "settings": {"cues": {"version": 1, "items": []}, "validation": validation},
        "swarm": {
            "drones": [
                {"type": "generic", "settings": {"name": name, "lights": {"version": 1, "data": "B6MQAA=="}, **settings}}
                for name, settings in drones.items()
            ]
        },
        "meta": {"title": "A show", "segments": {"show": [0, 60]}},
        "media": {},
    }


def compiled_show(drones: Mapping[str, Mapping[str, Any]], **validation: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the same as compiled files have it: `show.json`, and each trajectory in a member of its own, by `$ref`."""
    show, members = exported_show(drones, **validation), dict[str, Any]()
    for index, drone in enumerate(show["swarm"]["drones"]):
        path = f"drones/drone_{index + 1:02d}/trajectory.json"
        members[path] = drone["settings"]["trajectory"]
        drone["settings"]["trajectory"] = {"$ref": f"./{path}#"}
    return show, members
