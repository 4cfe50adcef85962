"""Recordings as they are sent to the service: known by how they begin, and archives from strangers of which nothing leads out."""

from __future__ import annotations

import io
import stat
import zipfile
from pathlib import Path

import pytest

from ltlplan.service.queries import zipped
from ltlplan.service.recordings import put_recording
from verify.data import BadInput
from verify.data.storage.archives import ArchiveBounds


@pytest.mark.parametrize(
    ("data", "name"),
    [
        (b"t,x,y,z\n0,0,0,1\n", "recording.csv"),
        (b"ULog\x01\x12\x35\x01" + bytes(8), "recording.ulg"),
        (b"\x89MCAP0\r\n" + bytes(8), "recording.mcap"),
        (b"SQLite format 3\0" + bytes(8), "recording.db3"),
        (b"", "recording.csv"),
        (zipped({"any name.csv": b"t,x,y,z\n"}), "recording.csv"),
        (zipped({"log/x.bin.mcap": b"\x89MCAP0\r\n"}), "recording.mcap"),
    ],
)
def test_a_file_is_named_by_what_it_is(tmp_path: Path, data: bytes, name: str) -> None:
    assert put_recording(tmp_path, data) == tmp_path / name
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("within", ["", "logs/today/"])
def test_a_folder_is_put_down_with_its_files_side_by_side(tmp_path: Path, within: str) -> None:
    files = {"quad0.csv": b"a", "quad1.ulg": b"b", "metadata.yaml": b"c"}
    place = put_recording(tmp_path, zipped({f"{within}{name}": data for name, data in files.items()}))
    assert place.is_dir()
    assert {path.name: path.read_bytes() for path in place.iterdir()} == files


def archive(*members: tuple[str | zipfile.ZipInfo, bytes], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method) as packed:
        for name, data in members:
            packed.writestr(name, data)
    return buffer.getvalue()


def linked() -> zipfile.ZipInfo:
    link = zipfile.ZipInfo("quad0.csv")
    link.external_attr = (stat.S_IFLNK | 0o777) << 16
    return link


HOSTILE = {
    "out of it": (archive(("../../quad0.csv", b"x"), ("quad1.csv", b"x")), "leads out of the file"),
    "absolute": (archive(("/etc/quad0.csv", b"x"), ("quad1.csv", b"x")), "leads out of the file"),
    "a link": (archive((linked(), b"/etc/passwd"), ("quad1.csv", b"x")), "is a link"),
    "another method": (archive(("quad0.csv", b"x" * 99), method=zipfile.ZIP_BZIP2), "compressed by method"),
    "several folders": (archive(("a/quad0.csv", b"x"), ("b/quad1.csv", b"x")), "lie in several folders"),
    "twofold": (archive(("quad0.csv", b"x"), ("./quad0.csv", b"y")), "twice"),
    "other files": (archive(("quad0.csv", b"x"), ("run.sh", b"x")), "holds 'run.sh'; of an archive these are read"),
    "hidden files": (archive(("quad0.csv", b"x"), (".bashrc.csv", b"x")), "holds '.bashrc.csv'"),
    "nothing": (
        archive(
            ("logs/", b""),
        ),
        "empty ZIP archive",
    ),
    "too many": (archive(*((f"r{k}.csv", b"") for k in range(301))), "301 members; a recording has at most 300"),
    "damaged": (archive(("quad0.csv", b"x" * 99))[:60], "damaged"),
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_archives_that_no_recording_makes_are_refused(tmp_path: Path, kind: str) -> None:
    data, says = HOSTILE[kind]
    with pytest.raises(BadInput, match=says):
        put_recording(tmp_path, data)
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


def test_what_unpacks_to_too_much_is_refused_before_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ltlplan.service.recordings.BOUNDS", ArchiveBounds("recording", 300, 2_000_000))
    with pytest.raises(BadInput, match="unpacks to more than 2 MB; that is no recording"):
        put_recording(tmp_path, archive(("quad0.csv", bytes(1_500_000)), ("quad1.csv", bytes(1_500_000))))


def test_a_member_that_lies_about_its_size_is_damaged(tmp_path: Path) -> None:
    data = archive(("quad0.csv", bytes(100_000)), ("quad1.csv", b"x"))
    lying = data.replace((100_000).to_bytes(4, "little"), (10).to_bytes(4, "little"))
    assert lying != data
    with pytest.raises(BadInput, match="damaged"):
        put_recording(tmp_path, lying)
