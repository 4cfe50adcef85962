"""What a show's own file asks: its validation settings and its geofence, read, judged and told."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import verify
from tests.helpers.motion.fleets import show_of, trajectory_of, write_show
from verify.data import BadInput
from verify.third_party.importers import read_fleet

UP = trajectory_of([[0, [0, 0, 0], []], [5, [0, 0, 5]], [10, [4, 0, 5], [[1, 0, 5], [3, 0, 5]]]])
BESIDE = trajectory_of([[0, [0, 6, 0], []], [5, [0, 6, 5]]])
SQUARE = [[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]]


def show(folder: Path, **settings: Any) -> Path:
    return write_show(folder / "show.skyc", show_of([("a", UP), ("b", BESIDE)], settings=settings))


def fence(*polygons: tuple[bool, Any]) -> dict[str, Any]:
    return {"version": 1, "polygons": [{"isInclusion": inside, "points": points} for inside, points in polygons]}


def test_a_show_s_own_limits_are_asked_where_nothing_else_is(tmp_path: Path) -> None:
    validation = {
        "maxAltitude": 6,
        "maxVelocityXY": 2,
        "maxVelocityZ": 1.5,
        "maxVelocityZUp": 2,
        "minDistance": 3,
        "maxYawRate": 90,
    }
    path = show(tmp_path, validation=validation, geofence=fence((True, SQUARE), (False, [[5, 2], [6, 2], [6, 3]])))
    found = verify.audit(path)
    assert found
    assert {claim.name for claim in found.claims} == {
        "continuity", "altitude", "geofence", "limits.speed_xy", "limits.climb", "limits.descent", "separation",
    }  # fmt: skip
    asked = found.to_dict()["asked"]
    assert (asked["climb"], asked["descent"], asked["altitude"], asked["separation"]) == (2.0, 1.5, 6.0, 3.0)
    assert asked["from"]["climb"] == "settings.validation.maxVelocityZUp"
    assert asked["from"]["geofence"] == "settings.geofence"
    assert any("maxYawRate is not asked: it does not say how any drone turns" in note for note in found.notes)
    assert found.tightest["geofence"][0].value == pytest.approx(5**0.5)


def test_what_breaks_them_is_told_with_place_and_time(tmp_path: Path) -> None:
    validation = {"max_altitude": 4, "max_velocity_xy": 0.5, "max_velocity_z": 0.9, "min_distance": 7}
    found = verify.audit(
        show(tmp_path, validation=validation, geofence=fence((False, [[3, -1, 0], [6, -1, 0], [6, 1, 0], [3, 1, 0]])))
    )
    sentences = " ".join(claim.sentence for claim in found.broken)
    for words in ("a rises to z = 5 m", "a's horizontal speed reaches 0.9 m/s", "b's climb reaches 1 m/s", "nearer than 7.0000 m",
                  "a does not stay outside polygon 1 of the geofence: it is 1 m beyond its border at 10.0000 s"):  # fmt: skip
        assert words in sentences


def test_what_is_given_takes_their_place(tmp_path: Path) -> None:
    path = show(
        tmp_path, validation={"minDistance": 7, "maxVelocityXY": 0.1, "maxAltitude": 1}, geofence=fence((False, SQUARE))
    )
    given = verify.audit(path, limits=verify.AuditLimits(separation=5.0, speed=3.0, workspace=(-9, -9, 0, 9, 9, 9)))
    assert given
    assert given.asked["from"] == {"workspace": "given", "separation": "given", "speed": "given"}
    assert len([note for note in given.notes if "takes its place" in note]) == 4
    assert verify.audit(path, limits=verify.AuditLimits(min_height=0.0, file_limits=False))
    with pytest.raises(BadInput, match="Nothing is required"):
        verify.audit(path, limits=verify.AuditLimits(file_limits=False))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"validation": {"minDistance": "3"}}, "minDistance must be a number at least 0, not '3'"),
        ({"validation": {"maxVelocityXY": 0}}, "maxVelocityXY must be a number above 0, not 0"),
        ({"validation": {"maxAltitude": 3, "max_altitude": 4}}, "both maxAltitude and max_altitude"),
        ({"validation": []}, "settings.validation must be a table"),
        ({"geofence": {"version": 2}}, "geofence is of version 2; version 1 is read"),
        ({"geofence": fence((True, SQUARE[:2]))}, "has 2 corners; a polygon has at least 3"),
        ({"geofence": fence((True, [SQUARE[0], SQUARE[2], SQUARE[1], SQUARE[3]]))}, "its edges 0 and 2 .* meet"),
        ({"geofence": {"version": 1, "polygons": [{"points": SQUARE}]}}, "isInclusion must be true or false"),
        ({"geofence": fence((True, [*SQUARE, [float("inf"), 0, 0]]))}, "Infinity is no JSON number"),
        ({"geofence": fence((True, [*SQUARE, ["x", 0, 0]]))}, "a point is"),
    ],
)
def test_settings_that_are_none_are_refused_in_words(tmp_path: Path, settings: dict[str, Any], message: str) -> None:
    with pytest.raises(BadInput, match=message):
        read_fleet(show(tmp_path, **settings))
