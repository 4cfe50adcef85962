"""Skybrush shows: hand-made files read, what is wrong with one said, and archives that mean harm refused."""

from __future__ import annotations

import contextlib
import json
import stat
import struct
import zipfile
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import verify
from tests.helpers.motion.fleets import sampled, show_of, trajectory_of, write_show
from verify.data import BadInput
from verify.third_party.importers import read_fleet
from verify.third_party.shows.show_archives import MOST_BYTES

CURVES = trajectory_of(
    [[0, [0, 0, 0], []], [2.5, [0, 0, 4]], [4, [3, 0, 5], [[0, 0, 6], [2, 0, 5]]], [5, [4, 0, 5], [[3.5, 1, 5]]]],
    takeoffTime=1.3,
)
STILL = trajectory_of([[10, [1, 2, 3]]])


def test_keyframes_become_curves_in_the_show_s_time(tmp_path: Path) -> None:
    fleet = read_fleet(write_show(tmp_path / "show.skyc", show_of([("a", CURVES), ("b", STILL)])))
    assert fleet.names == ("a", "b")
    assert [fleet.start(row) for row in range(4)] == [0, Fraction(1.3), Fraction(1.3) + Fraction(2.5), Fraction(1.3) + 4]
    assert fleet.end == 11
    times = np.array([0.0, 1.3, 2.55, 3.8, 4.55, 5.8, 6.3, 11.0])
    expected = [[0, 0, 0], [0, 0, 0], [0, 0, 2], [0, 0, 4], [1.125, 0, 5.25], [3.5, 0.5, 5], [4, 0, 5], [4, 0, 5]]
    assert sampled(fleet, 0, times) == pytest.approx(np.array(expected), abs=1e-9)
    assert sampled(fleet, 1, times) == pytest.approx(np.tile([1.0, 2.0, 3.0], (8, 1)))


@pytest.mark.parametrize(
    ("reference", "members"),
    [
        ("./drones/a/trajectory.json", {"drones/a/trajectory.json": CURVES}),
        ("drones/../drones/a.json#/path", None),
        ("drones/a.json#/path", {"drones/a.json": {"path": CURVES}}),
        ("a.json", {"a.json": {"$ref": "b.json"}, "b.json": CURVES}),
    ],
)
def test_references_are_followed_within_the_file(tmp_path: Path, reference: str, members: dict[str, Any] | None) -> None:
    path = write_show(tmp_path / "show.skyc", show_of([("a", {"$ref": reference})]), members)
    if members is None:
        with pytest.raises(BadInput, match="leads out of the file"):
            read_fleet(path)
    else:
        assert read_fleet(path).digest == read_fleet(write_show(tmp_path / "plain.skyc", show_of([("a", CURVES)]))).digest


def changed(change: Callable[[Any], None]) -> dict[str, Any]:
    show = json.loads(json.dumps(show_of([("a", CURVES), ("b", STILL)])))
    change(show)
    return show


def points(show: Any) -> Any:
    return show["swarm"]["drones"][0]["settings"]["trajectory"]["points"]


def settings(show: Any, **fields: Any) -> None:
    show["swarm"]["drones"][1]["settings"].update(fields)


FAULTS: dict[str, tuple[Callable[[Any], Any], str]] = {
    "a drone that is null": (lambda s: s["swarm"]["drones"].__setitem__(1, None), r"swarm\.drones\[1\] must be a table"),
    "no trajectory": (lambda s: s["swarm"]["drones"][1]["settings"].pop("trajectory"), "b has no trajectory"),
    "a missing member": (lambda s: settings(s, trajectory={"$ref": "b.json"}), "has no member 'b.json'"),
    "a remote reference": (lambda s: settings(s, trajectory={"$ref": "https://example.org/b.json"}), "leads out"),
    "a circle": (lambda s: settings(s, trajectory={"$ref": "#/swarm/drones/1/settings/trajectory"}), "as in a circle"),
    "no drones": (lambda s: s.update(swarm={"drones": []}), "at least one drone"),
    "another version": (lambda s: s.update(version=2), "version 2; version 1 is read"),
    "another trajectory's version": (lambda s: settings(s, trajectory={"version": 0, "points": []}), "version 0; version 1"),
    "no points": (lambda s: points(s).clear(), "no points"),
    "time that stands still": (lambda s: points(s)[2].__setitem__(0, 2.5), "piece 1 leads from 3.8 s to 3.8 s"),
    "time that goes back": (lambda s: points(s)[2].__setitem__(0, 2.0), "times must rise"),
    "a negative start": (lambda s: points(s)[0].__setitem__(0, -2.0), "times count from 0"),
    "a text for a number": (lambda s: points(s)[1][1].__setitem__(2, "4"), r"a: points\[1\]: z must be a number .*'4'"),
    "a truth for a number": (lambda s: points(s)[1][1].__setitem__(2, True), r"points\[1\]: z must be a number .*True"),
    "two coordinates": (lambda s: points(s)[1][1].pop(), r"points\[1\] must be a point \[x, y, z\]"),
    "no list": (lambda s: points(s).__setitem__(1, 7), r"points\[1\] must be \[t, \[x, y, z\]"),
    "a bad control point": (lambda s: points(s)[2][2].__setitem__(1, [0, 0]), r"points\[2\]: control point 1 must be a point"),
    "controls before the first": (lambda s: points(s)[0].__setitem__(2, [[0, 0, 0]]), "no curve ends at a first keyframe"),
    "far away": (lambda s: points(s)[1][1].__setitem__(0, 1e9), "at most 1e\\+06"),
    "a digit too many": (lambda s: points(s)[1][1].__setitem__(0, 10**400), "at most 1e\\+06"),
    "one pad": (lambda s: settings(s, trajectory=trajectory_of([[0, [0, 0, 0.005]], [1, [9, 9, 9]]])), "a and b both begin at"),
    "one name": (lambda s: settings(s, name="a"), "two drones are named 'a'"),
    "a name that writes to the terminal": (lambda s: settings(s, name="b\x1b[2J"), "that can be printed"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_what_is_wrong_with_a_show_is_said(tmp_path: Path, fault: str) -> None:
    change, message = FAULTS[fault]
    with pytest.raises(BadInput, match=message):
        read_fleet(write_show(tmp_path / "show.skyc", changed(change)))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[" * 100_000, "nested too deeply"),
        ('{"version": 1, "version": 1}', "stands twice"),
        (json.dumps(show_of([("a", CURVES)])).replace("2.5", "NaN"), "NaN is no JSON number"),
        (json.dumps(show_of([("a", CURVES)])).replace("2.5", "1e999"), "at most 1e\\+06"),
        ("version: 1", "no JSON"),
        ("[]", "must be a table"),
    ],
)
def test_what_is_wrong_with_its_json_is_said(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(BadInput, match=message):
        read_fleet(write_show(tmp_path / "show.skyc", text))


def member(name: str, mode: int = 0) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo(name)
    info.external_attr = mode << 16
    return info


@pytest.mark.parametrize(
    ("info", "message"),
    [
        (member("../../etc/passwd"), "leads out of the file"),
        (member("/etc/passwd"), "leads out of the file"),
        (member("C:\\show.json"), "leads out of the file"),
        (member("drones\\a.json"), "leads out of the file"),
        (member("a.json", stat.S_IFLNK | 0o777), "is a link"),
        (member("./show.json"), "twice"),
    ],
)
def test_hostile_members_are_refused_and_nothing_is_written(tmp_path: Path, info: zipfile.ZipInfo, message: str) -> None:
    path = write_show(tmp_path / "show.skyc", show_of([("a", CURVES)]))
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr(info, "/etc/passwd")
    with pytest.raises(BadInput, match=message):
        read_fleet(path)
    assert list(tmp_path.iterdir()) == [path]


def patched(path: Path, offset: int, value: bytes) -> Path:
    """Write bytes into every record of the zip file's directory."""
    data = bytearray(path.read_bytes())
    at = data.find(b"PK\x01\x02")
    while at >= 0:
        data[at + offset : at + offset + len(value)] = value
        at = data.find(b"PK\x01\x02", at + 1)
    path.write_bytes(data)
    return path


@pytest.mark.parametrize(
    ("offset", "value", "message"),
    [
        (8, struct.pack("<H", 1), "is encrypted"),
        (10, struct.pack("<H", 12), "compressed by method 12"),
        (24, struct.pack("<I", MOST_BYTES + 1), "at most 512 MB are read"),
        (24, struct.pack("<I", 10), "is damaged"),
        (16, struct.pack("<I", 7), "is damaged"),
    ],
)
def test_what_the_archive_says_of_its_members(tmp_path: Path, offset: int, value: bytes, message: str) -> None:
    path = patched(write_show(tmp_path / "show.skyc", show_of([("a", CURVES)])), offset, value)
    with pytest.raises(BadInput, match=message):
        read_fleet(path)


def test_what_is_no_archive(tmp_path: Path) -> None:
    path = tmp_path / "show.skyc"
    for data, message in ((b"{}", "a zip file that holds show.json"), (b"PK\x03\x04nothing", "damaged zip file")):
        path.write_bytes(data)
        with pytest.raises(BadInput, match=message):
            read_fleet(path)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("shows.json", "{}")
    with pytest.raises(BadInput, match=r"no member 'show.json'. Did you mean 'shows.json'"):
        read_fleet(path)
    with pytest.raises(BadInput, match="audit it alone"):
        read_fleet([path, path])


def test_a_show_is_judged_on_its_pads_and_where_it_says_that_they_are(tmp_path: Path) -> None:
    show = show_of([("a", CURVES), ("b", trajectory_of([[0, [0.8, 0, 0]], [3, [0.8, 0, 4]], [4, [8, 0, 4]]]))])
    found = verify.audit(write_show(tmp_path / "show.skyc", show), limits=verify.AuditLimits(separation=1.0))
    assert any(b.other == "b" and "from 0.0000 s to" in b.sentence for b in found.broken)
    show["swarm"]["drones"][0]["settings"].update(home=[0, 0.5, 0], landAt=[4, 1, 0])
    found = verify.audit(write_show(tmp_path / "show.skyc", show), limits=verify.AuditLimits(speed=50.0))
    assert [claim.witness and claim.witness.what for claim in found.broken] == ["home", "landing place"]


def test_a_member_with_many_references_is_unpacked_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Drones that are entries of one member, each by a reference of its own; counted are bytes, not seconds."""
    drones = [
        {"settings": {"name": f"d{k}", "trajectory": trajectory_of([[0, [k, 0, 0]], [9, [k, 0, 5]]])}} for k in range(300)
    ]
    show = {"version": 1, "swarm": {"drones": [{"$ref": f"./all.json#/{k}"} for k in range(300)]}}
    path = write_show(tmp_path / "show.skyc", show, {"all.json": [*drones, "x" * 20_000_000]})
    assert len(read_fleet(path)) == 300
    assert unpacked(path, monkeypatch) == {"show.json": 1, "all.json": 1}


def unpacked(path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, int]:
    """How often each member is unpacked while a file is read or refused."""
    plain, counts = zipfile.ZipFile.read, dict[str, int]()

    def read(archive: zipfile.ZipFile, name: str | zipfile.ZipInfo, pwd: bytes | None = None) -> bytes:
        key = name if isinstance(name, str) else name.filename
        counts[key] = counts.get(key, 0) + 1
        return plain(archive, name, pwd)

    monkeypatch.setattr(zipfile.ZipFile, "read", read)
    with contextlib.suppress(BadInput):
        read_fleet(path)
    return counts


@pytest.mark.slow
def test_members_that_take_turns_in_being_referenced_use_up_what_may_be_unpacked(tmp_path: Path) -> None:
    drones = [{"$ref": f"./{'ab'[k % 2]}.json#/{k}"} for k in range(40)]
    rows = [{"settings": {"name": f"d{k}", "trajectory": trajectory_of([[0, [k, 0, 0]]])}} for k in range(40)]
    members = {name: [*rows, "x" * 20_000_000] for name in ("a.json", "b.json")}
    path = write_show(tmp_path / "show.skyc", {"version": 1, "swarm": {"drones": drones}}, members)
    with pytest.raises(BadInput, match="unpack more than 2 times what the file holds"):
        read_fleet(path)


def test_one_trajectory_for_many_drones_is_refused_before_it_is_laid_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drones = [{"settings": {"name": f"d{k}", "trajectory": {"$ref": "./one.json"}}} for k in range(5_000)]
    path = write_show(tmp_path / "show.skyc", {"version": 1, "swarm": {"drones": drones}}, {"one.json": CURVES})
    with pytest.raises(BadInput, match=r"d0 and d1 both begin at \(0, 0, 0\)"):
        read_fleet(path)
    assert unpacked(path, monkeypatch) == {"show.json": 1, "one.json": 1}
