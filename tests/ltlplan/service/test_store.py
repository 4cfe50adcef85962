"""Values on disk: whole or not at all, found again by their digest, and never another's."""

from __future__ import annotations

import hashlib
import resource
from pathlib import Path

import pytest

from ltlplan.service.store import NoRoom, Store
from verify.data import InternalError


def test_a_value_is_found_by_its_digest(tmp_path: Path) -> None:
    store = Store(tmp_path / "values")
    digest = store.put(b"value")
    assert digest == hashlib.sha256(b"value").hexdigest()
    assert store.put(b"value") == digest
    assert store.get(digest) == b"value"
    assert store.digests() == {digest}


def test_a_changed_value_is_refused(tmp_path: Path) -> None:
    store = Store(tmp_path)
    digest = store.put(b"value")
    store.path(digest).write_bytes(b"valuE")
    with pytest.raises(InternalError, match="was changed"):
        store.get(digest)


def test_a_value_that_is_gone_is_refused(tmp_path: Path) -> None:
    store = Store(tmp_path)
    digest = store.put(b"value")
    store.drop(digest)
    store.drop(digest)
    with pytest.raises(InternalError, match="cannot be read"):
        store.get(digest)


@pytest.mark.parametrize("name", ["../../etc/passwd", "", "a" * 63, "A" * 64, "a" * 64 + "/.."])
def test_only_digests_are_names(tmp_path: Path, name: str) -> None:
    with pytest.raises(InternalError, match="no digest"):
        Store(tmp_path).path(name)


def test_a_disk_without_room_leaves_nothing_half_written(tmp_path: Path) -> None:
    store = Store(tmp_path / "values")
    store.put(b"first")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))
    try:
        with pytest.raises(NoRoom, match="the disk is full"):
            store.put(b"x" * 2000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert [path.read_bytes() for path in (tmp_path / "values").rglob("*") if path.is_file()] == [b"first"]


def test_what_a_kill_left_half_written_is_removed(tmp_path: Path) -> None:
    store = Store(tmp_path)
    digest = store.put(b"value")
    (tmp_path / ".new-abc").write_bytes(b"val")
    store.open()
    assert [path.name for path in tmp_path.rglob("*") if path.is_file()] == [digest]
