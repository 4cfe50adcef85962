"""One door for files: what is no regular file of bounded size, or has two meanings, ends quickly in one sentence."""

import os
from pathlib import Path

import pytest

from verify.data import BadInput
from verify.data.storage.safe_reading import begins_with, parse_json, read_bytes, read_text


def read(path: Path) -> bytes:
    return read_bytes(path, most=10, what="list")


def test_a_file_and_a_link_to_one_are_read(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"0123456789")
    (tmp_path / "link").symlink_to(tmp_path / "a")
    assert read(tmp_path / "a") == read(tmp_path / "link") == b"0123456789"
    (tmp_path / "a").write_bytes(b"\xef\xbb\xbfabc")
    assert read_text(tmp_path / "a", most=10, what="list") == "abc"
    assert begins_with(tmp_path / "a", b"ab", "list")
    assert not begins_with(tmp_path / "a", b"b", "list")


@pytest.mark.parametrize(
    ("wanted", "near"), [("runs/rom.yaml", "runs/room.yaml"), ("rnus/room.yaml", "runs"), ("runs/x", ""), ("a/b/c", "")]
)
def test_a_file_that_is_missing_is_answered_with_the_nearest_name(
    wanted: str, near: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "room.yaml").touch()
    monkeypatch.chdir(tmp_path)
    hint = f" Did you mean '{near}'?" if near else ""
    with pytest.raises(BadInput) as caught:
        read(Path(wanted))
    assert str(caught.value) == f"{wanted} cannot be read: No such file or directory.{hint}"


@pytest.mark.parametrize("kind", ["pipe", "link to a pipe", "device", "folder", "missing", "too large", "loop", "nul"])
def test_whatever_is_no_such_file_is_refused_at_once(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "a"
    match kind:
        case "pipe":
            os.mkfifo(path)
        case "link to a pipe":
            os.mkfifo(tmp_path / "pipe")
            path.symlink_to(tmp_path / "pipe")
        case "device":
            path = Path("/dev/zero")
        case "folder":
            path.mkdir()
        case "too large":
            path.write_bytes(b"0" * 11)
        case "loop":
            path.symlink_to(path)
        case "nul":
            path = tmp_path / "a\0b"
    with pytest.raises(BadInput, match="larger than" if kind == "too large" else "cannot be read"):
        read(path)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('{"a": 1, "a": 1}', "'a' stands twice"),
        ('[{"b": {"c": 1, "d": 2, "c": 3}}]', "'c' stands twice"),
        ("NaN", "NaN is no JSON number"),
        ("[-Infinity]", "no JSON number"),
        ("1e999", "too large"),
        ("[" + "1" * 5000 + "]", "5000 digits"),
        ("[" * 100_000, "nested too deeply"),
        ('{"a":' * 100_000, "nested too deeply"),
        ('"\\ud800"', "surrogate"),
        ('{"\\udfff": 1}', "surrogate"),
        ("{", "no JSON"),
        ("", "no JSON"),
        (b"\xff", "not UTF-8"),
        ("1 2", "no JSON"),
    ],
)
def test_json_with_two_meanings_or_none_is_refused(text: str | bytes, says: str) -> None:
    with pytest.raises(BadInput, match=says) as caught:
        parse_json(text, "plan.json")
    assert "\n" not in str(caught.value)
    assert "set_int_max_str_digits" not in str(caught.value)


def test_json_is_read_as_it_is_written() -> None:
    assert parse_json('{"a": [1, 2.5, null, "\\ud83d\\ude00"], "b": {"a": true}}', "x") == {
        "a": [1, 2.5, None, "\U0001f600"],
        "b": {"a": True},
    }
