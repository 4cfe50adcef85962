"""A Skybrush show's own limits: `settings.validation` and `settings.geofence` of `show.json`.

Validation settings are written in camel case, or with underscores as older files have them. A limit that says `Up` is for what goes
upwards, and the one without it then for what goes down. Of a geofence's points x and y count, in the show's own frame.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from verify.arithmetic.balls import Floats
from verify.data.errors import BadInput
from verify.third_party.fleet import LARGEST
from verify.third_party.shows.own_limits import NO_LIMITS, Fence, OwnLimits
from verify.third_party.shows.show_archives import ShowArchive

MOST_CORNERS = 1000
"""Of one polygon; fences have a dozen."""
MOST_POLYGONS = 100
"""Of one geofence."""

_NAMES = {
    "minDistance": ("separation",),
    "maxAltitude": ("altitude",),
    "maxVelocityXY": ("speed_xy",),
    "maxVelocityZ": ("climb", "descent"),
    "maxVelocityZUp": ("climb",),
    "maxAccelerationXY": ("acceleration_xy",),
    "maxAccelerationZ": ("acceleration_up", "acceleration_down"),
    "maxAccelerationZUp": ("acceleration_up",),
    "maxYawRate": ("yaw_rate",),
}
"""Names of validation settings, the more special ones later, and what they limit."""

_NAVIGATION = " Distances are asked at every height; --separation-above asks them above one."
_INSTEAD = {"minNavAltitude": _NAVIGATION, "min_nav_altitude": _NAVIGATION}


def own_limits(archive: ShowArchive, show: Mapping[str, Any]) -> tuple[OwnLimits, list[str]]:
    """Return what a show asks of itself, and what of that is not checked, in sentences.

    Args:
        archive: The open file.
        show: Its `show.json`.

    Raises:
        BadInput: A setting is no number, or a polygon no polygon.
    """
    settings = archive.followed(show.get("settings"), show)
    if settings is None:
        return NO_LIMITS, []
    settings = archive.table(settings, "settings")
    found, where, notes = _validation(archive, archive.followed(settings.get("validation"), show))
    fences = _fences(archive, archive.followed(settings.get("geofence"), show), show)
    if fences:
        where["fences"] = "settings.geofence"
    return OwnLimits(**found, fences=fences, where=tuple(where.items())), notes


def _validation(archive: ShowArchive, value: Any) -> tuple[dict[str, float], dict[str, str], list[str]]:
    found: dict[str, float] = {}
    where: dict[str, str] = {}
    if value is None:
        return found, where, []
    rest = dict(archive.table(value, "settings.validation"))
    for name, limited in _NAMES.items():
        spelled = [key for key in (name, _underscored(name)) if rest.get(key) is not None]
        if len(spelled) > 1:
            raise BadInput(f"{archive.source}: settings.validation has both {spelled[0]} and {spelled[1]}, which are the same.")
        for key in spelled:
            number = rest[key]
            least = 0.0 if name == "minDistance" else None
            if not _is_number(number) or (number <= 0 if least is None else number < least):
                kind = "at least 0" if least is not None else "above 0"
                raise BadInput(f"{archive.source}: settings.validation.{key} must be a number {kind}, not {number!r:.40}.")
            found.update(dict.fromkeys(limited, float(number)))
            where.update(dict.fromkeys(limited, f"settings.validation.{key}"))
    known = {spelling for name in _NAMES for spelling in (name, _underscored(name))}
    unknown = sorted(str(key)[:60] for key in rest if key not in known and rest[key] is not None)
    notes = [f"settings.validation.{key} is not judged.{_INSTEAD.get(key, '')}" for key in unknown]
    return found, where, notes


def _underscored(name: str) -> str:
    """Return a name in camel case as older files spell it: `maxVelocityZUp` to `max_velocity_z_up`."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=Z)(?=Up)", "_", name).lower()


def _fences(archive: ShowArchive, value: Any, show: Any) -> tuple[Fence, ...]:
    if value is None:
        return ()
    geofence = archive.table(value, "settings.geofence")
    if geofence.get("version") != 1:
        raise BadInput(f"{archive.source}: settings.geofence is of version {geofence.get('version')!r:.20}; version 1 is read.")
    polygons = archive.followed(geofence.get("polygons", []), show)
    if not isinstance(polygons, list):
        raise BadInput(f"{archive.source}: settings.geofence.polygons must be a list, not {polygons!r:.40}.")
    if len(polygons) > MOST_POLYGONS:
        raise BadInput(
            f"{archive.source}: settings.geofence has {len(polygons)} polygons; at most {MOST_POLYGONS} are checked."
        )
    found: list[Fence] = []
    for index, polygon in enumerate(polygons):
        where = f"settings.geofence.polygons[{index}]"
        polygon = archive.table(archive.followed(polygon, show), where)
        inside = polygon.get("isInclusion")
        if not isinstance(inside, bool):
            raise BadInput(f"{archive.source}: {where}.isInclusion must be true or false, not {inside!r:.40}.")
        corners = _corners(f"{archive.source}: {where}", archive.followed(polygon.get("points"), show))
        found.append(Fence(f"polygon {index + 1}", inside, corners))
    return tuple(found)


def _corners(where: str, points: Any) -> Floats:
    """Return the corners of a polygon that does not cross itself, none twice in a row. Shape (corners, 2)."""
    if not isinstance(points, list) or len(points) > MOST_CORNERS:
        raise BadInput(f"{where}.points must be a list of at most {MOST_CORNERS} points [x, y, z].")
    for point in points:
        if not isinstance(point, list) or len(point) not in (2, 3) or not all(map(_is_number, point)):
            raise BadInput(f"{where}.points: a point is [x, y, z] in m, not {point!r:.60}.")
    corners = np.array([point[:2] for point in points], dtype=np.float64).reshape(-1, 2)
    corners = corners[(corners != np.roll(corners, 1, axis=0)).any(-1)] if len(corners) > 1 else corners
    if len(corners) < 3:
        raise BadInput(f"{where} has {len(corners)} corners; a polygon has at least 3.")
    if (crossing := _first_crossing(corners)) is not None:
        one, other = crossing
        raise BadInput(
            f"{where}: its edges {one} and {other} (counted from 0) meet, so that its inside is undefined; give the corners in order "
            "around it."
        )
    return corners


def _first_crossing(corners: Floats) -> tuple[int, int] | None:
    """Return two edges of a polygon that meet elsewhere than at the corner of neighbours."""
    ends = np.roll(corners, -1, axis=0)
    count = len(corners)
    for one in range(count):
        rest = np.arange(one + 1, count)
        near = (rest == one + 1) | ((one == 0) & (rest == count - 1))
        a, b = _sides(corners[one], ends[one], corners[rest]), _sides(corners[one], ends[one], ends[rest])
        c, d = _sides(corners[rest], ends[rest], corners[one]), _sides(corners[rest], ends[rest], ends[one])
        over = (np.maximum(corners[one], ends[one]) >= np.minimum(corners[rest], ends[rest])).all(-1)
        over &= (np.minimum(corners[one], ends[one]) <= np.maximum(corners[rest], ends[rest])).all(-1)
        meet = (a * b <= 0) & (c * d <= 0) & over & ~near
        # neighbours share a corner; more than that they share only where one lies back on the other
        back = near & (a == 0) & (b == 0) & (((ends[one] - corners[one]) * (ends[rest] - corners[rest])).sum(-1) < 0)
        if (meet | back).any():
            return one, int(rest[np.argmax(meet | back)])
    return None


def _sides(start: Floats, end: Floats, point: Floats) -> Floats:
    """Return on which side of lines points are: 1, 0 or -1."""
    along, to = end - start, point - start
    return np.sign(along[..., 0] * to[..., 1] - along[..., 1] * to[..., 0])


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= LARGEST
