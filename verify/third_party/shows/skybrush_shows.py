"""Skybrush shows (`.skyc`): for each drone keyframes in time, joined by Bezier curves of degree 1 to 3, or up to 7.

A keyframe is `[t, [x, y, z], [control points]]`; its control points are those of the curve that ends there. Times count from the drone's take-off
time, `takeoffTime`, in the show; `landingTime` and the times of `yawControl` count from the show's start. Numbers are the floats nearest to the decimals in the file, which is how every program reads them;
differences and sums of times are taken exactly. Before its first keyframe a drone stands where that is, after its last one it stays there.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from verify.arithmetic.balls import Floats
from verify.data.errors import BadInput
from verify.data.trajectory import DEGREE
from verify.third_party.fleet import LARGEST, SHORTEST, Fleet, Flight, assemble
from verify.third_party.shows.show_archives import ShowArchive, open_show
from verify.third_party.shows.show_settings import own_limits
from verify.third_party.shows.take_offs import Ends, columns_of

_UNJUDGED = {
    "lights": "Lights",
    "pyro": "Pyrotechnics",
    "rthPlan": "Plans to return home",
    "autoYaw": "Headings along the path (autoYaw)",
}
"""What a drone's settings may hold beside its trajectory, and how it is called."""

MOST_KEYFRAMES = 30_000_000
"""Of all drones; more do not fit the memory of usual machines."""

_ALONE = 1.0
"""s that a drone with one keyframe is given to stand there."""


def read_show(path: Path) -> Fleet:
    """Read a show file.

    Args:
        path: The `.skyc` file.

    Raises:
        BadInput: It is no show, a drone has no trajectory, numbers are missing, not finite or out of order, or its own limits are none.
    """
    with open_show(path) as archive:
        show = archive.value("show.json")
        show = archive.table(archive.followed(show, show), "show.json")
        if show.get("version") != 1:
            raise BadInput(f"{path}: show.json is of version {show.get('version')!r:.20}; version 1 is read.")
        swarm = archive.table(archive.followed(show.get("swarm"), show), "swarm")
        drones = archive.followed(swarm.get("drones"), show)
        if not isinstance(drones, list) or not drones:
            raise BadInput(f"{path}: swarm.drones must be a list of at least one drone.")
        seen = _Seen()
        read = [_flight(archive, show, index, drone, seen) for index, drone in enumerate(drones)]
        own, notes = own_limits(archive, show)
    notes += [f"{_UNJUDGED[key]} of {count} drones are not judged." for key, count in sorted(seen.unjudged.items())]
    fleet = assemble(str(path), "bernstein", [flight for flight, _ in read])
    columns, homes, assumed = columns_of(fleet, [ends for _, ends in read])
    return replace(fleet, own=own, homes=homes, columns=columns, assumed=assumed, notes=tuple(notes))


@dataclass(slots=True)
class _Seen:
    """The drones read so far: mutable while a show is read.

    Attributes:
        unjudged: Drones with settings of each kind that nobody checks.
        starts: Names by first positions.
        keyframes: Of all drones together.
    """

    unjudged: Counter[str] = field(default_factory=Counter[str])
    starts: dict[tuple[float, float, float], str] = field(default_factory=dict[tuple[float, float, float], str])
    keyframes: int = 0

    def count(self, source: str, where: str, name: str, keyframes: Sequence[Any]) -> None:
        """Reject a trajectory that another drone has, or one too many, before it costs anything."""
        _check_keyframe(f"{where}: points[0]", keyframes[0], first=True)
        x, y, z = keyframes[0][1]
        if (other := self.starts.setdefault((x, y, z), name)) != name:
            raise BadInput(
                f"{source}: {other} and {name} both begin at ({x:.4g}, {y:.4g}, {z:.4g}); each drone needs a pad of its own."
            )
        self.keyframes += len(keyframes)
        if self.keyframes > MOST_KEYFRAMES:
            raise BadInput(f"{source} has more than {MOST_KEYFRAMES} keyframes by {name}; audit it in parts.")


def _flight(archive: ShowArchive, show: Any, index: int, drone: Any, seen: _Seen) -> tuple[Flight, Ends]:
    where = f"swarm.drones[{index}]"
    drone = archive.table(archive.followed(drone, show), where)
    settings = archive.table(archive.followed(drone.get("settings"), show), f"{where}.settings")
    name = settings.get("name", f"drone {index + 1}")
    if not isinstance(name, str) or not name or len(name) > 200 or not name.isprintable():
        raise BadInput(f"{archive.source}: {where}.settings.name must be a short text that can be printed, not {name!r:.40}.")
    where = f"{archive.source}: {name}"
    seen.unjudged.update(key for key in _UNJUDGED if settings.get(key) is not None)
    if settings.get("trajectory") is None:
        raise BadInput(f"{where} has no trajectory; every drone of a show needs one (settings.trajectory).")
    trajectory = archive.table(archive.followed(settings["trajectory"], show), f"{name}: trajectory")
    if trajectory.get("version") != 1:
        raise BadInput(f"{where}: its trajectory is of version {trajectory.get('version')!r:.20}; version 1 is read.")
    keyframes = archive.followed(trajectory.get("points"), trajectory)
    if not isinstance(keyframes, list) or not keyframes:
        raise BadInput(f"{where}: its trajectory has no points; at least one keyframe [t, [x, y, z], []] is needed.")
    seen.count(archive.source, where, name, keyframes)
    takeoff, landing = (_time(trajectory, key, where) for key in ("takeoffTime", "landingTime"))
    times, values, degrees = _pieces(where, keyframes)
    home, land = (None if settings.get(key) is None else _point(settings[key], f"{where}: {key}") for key in ("home", "landAt"))
    yaw = _yaw(archive, archive.followed(settings.get("yawControl"), show), name, seen)
    knots = _exact_sums(times, takeoff or 0.0)
    return Flight(name=name, knots=knots, values=values, degrees=degrees, yaw=yaw), Ends(home, land, landing)


def _time(trajectory: Mapping[str, Any], key: str, where: str) -> float | None:
    """Return a time that may be missing or null, in s."""
    value = trajectory.get(key)
    return None if value is None else _number(value, f"{where}: {key}")


def _yaw(archive: ShowArchive, value: Any, name: str, seen: _Seen) -> Floats | None:
    """Return times in s and headings in deg; None where none are given. Shape (setpoints, 2)."""
    if value is None:
        return None
    where = f"{archive.source}: {name}"
    control = archive.table(value, f"{name}: yawControl")
    if control.get("version") != 1:
        raise BadInput(f"{where}: its yawControl is of version {control.get('version')!r:.20}; version 1 is read.")
    setpoints = archive.followed(control.get("setpoints"), control)
    if not isinstance(setpoints, list):
        raise BadInput(f"{where}: yawControl.setpoints must be a list of [t, degrees], not {setpoints!r:.40}.")
    if control.get("autoYaw"):
        seen.unjudged["autoYaw"] += 1
        return None
    rows: list[tuple[float, float]] = []
    for index, setpoint in enumerate(setpoints):
        what = f"{where}: yawControl.setpoints[{index}]"
        if not isinstance(setpoint, list) or len(setpoint) < 2:
            raise BadInput(f"{what} must be [t, degrees], not {setpoint!r:.40}.")
        time, angle = _number(setpoint[0], f"{what}: its time"), _number(setpoint[1], f"{what}: its heading")
        if rows and time - rows[-1][0] < SHORTEST:
            raise BadInput(
                f"{what} is at {time:g} s, after one at {rows[-1][0]:g} s; times must rise, by {SHORTEST:g} s at the least."
            )
        rows.append((time, angle))
    return np.array(rows) if rows else None


def _pieces(where: str, keyframes: Sequence[Any]) -> tuple[Floats, Floats, np.ndarray]:
    """Return times (pieces + 1,), control points (pieces, 3, degree + 1) and degrees (pieces,) of keyframes."""
    _check_shapes(where, keyframes)
    times = np.array([keyframe[0] for keyframe in keyframes], dtype=np.float64)
    places = _points([keyframe[1] for keyframe in keyframes])
    inner = [keyframe[2] if len(keyframe) > 2 else () for keyframe in keyframes[1:]]
    counts = np.array([len(points) for points in inner], dtype=np.intp)
    if not len(counts):  # one keyframe: the drone stands there
        return np.array([times[0], times[0] + _ALONE]), places[:, :, None], np.zeros(1, dtype=np.int8)
    values = np.zeros((len(counts), 3, int(counts.max()) + 2))
    values[:, :, 0] = places[:-1]
    for count in np.unique(counts):
        own = np.flatnonzero(counts == count)
        values[own, :, count + 1] = places[1:][own]
        if count:
            points = _points(list(chain.from_iterable(inner[k] for k in own.tolist())))
            values[own, :, 1 : count + 1] = points.reshape(len(own), count, 3).transpose(0, 2, 1)
    return times, values, (counts + 1).astype(np.int8)


def _points(rows: Sequence[Sequence[float]]) -> Floats:
    """Return points as an array. Shape (points, 3)."""
    return np.array(list(chain.from_iterable(rows)), dtype=np.float64).reshape(-1, 3)


def _check_shapes(where: str, keyframes: Sequence[Any]) -> None:
    """Reject what is no keyframe; looked at all at once, and one by one only to say which is at fault."""
    numbers: set[type] = {int, float}
    try:
        points = [keyframe[1] for keyframe in keyframes]
        inner = [points for keyframe in keyframes if len(keyframe) > 2 for points in keyframe[2]]
        sound = (
            set(map(type, chain(keyframes, points, inner, (k[2] for k in keyframes if len(k) > 2)))) == {list}
            and set(map(len, chain(points, inner))) == {3}
            and set(map(len, keyframes)) <= {2, 3}
            and set(map(type, chain.from_iterable(chain(points, inner)))) <= numbers
            and {type(keyframe[0]) for keyframe in keyframes} <= numbers
            and max((len(k[2]) for k in keyframes if len(k) > 2), default=0) < DEGREE
            and not (len(keyframes[0]) > 2 and keyframes[0][2])
        )
        if sound:
            largest = max(map(abs, chain((k[0] for k in keyframes), chain.from_iterable(chain(points, inner)))))
            sound = bool(largest <= LARGEST)
    except (TypeError, IndexError, KeyError):
        sound = False
    if sound:
        return
    for index, keyframe in enumerate(keyframes):
        _check_keyframe(f"{where}: points[{index}]", keyframe, first=index == 0)


def _check_keyframe(where: str, keyframe: Any, *, first: bool) -> None:
    if not isinstance(keyframe, list) or len(keyframe) not in (2, 3):
        raise BadInput(f"{where} must be [t, [x, y, z], [control points]], not {keyframe!r:.60}.")
    _number(keyframe[0], f"{where}: its time")
    _point(keyframe[1], where)
    inner = keyframe[2] if len(keyframe) > 2 else []
    if not isinstance(inner, list) or len(inner) >= DEGREE:
        raise BadInput(f"{where}: its control points must be a list of at most {DEGREE - 1} points.")
    if first and inner:
        raise BadInput(f"{where} has control points, but no curve ends at a first keyframe.")
    for number, point in enumerate(inner):
        _point(point, f"{where}: control point {number}")


def _exact_sums(times: Floats, offset: float) -> Floats:
    """Return times plus an offset, each exactly as the sum of two floats (Knuth's two-sum). Shape (times, 2)."""
    total = times + offset
    part = total - times
    return np.stack([total, (times - (total - part)) + (offset - part)], -1)


def _number(value: Any, what: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= LARGEST:
        raise BadInput(f"{what} must be a number of at most {LARGEST:g}, not {value!r:.40}.")
    return float(value)


def _point(value: Any, what: str) -> tuple[float, float, float]:
    if not isinstance(value, list) or len(value) != 3:
        raise BadInput(f"{what} must be a point [x, y, z] in m, not {value!r:.60}.")
    x, y, z = (_number(part, f"{what}: {axis}") for part, axis in zip(value, "xyz", strict=True))
    return x, y, z
