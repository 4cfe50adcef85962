"""Values on disk: whole or not at all, found again by their digest, and never another's."""

from __future__ import annotations

import hashlib
import resource
from pathlib import Path

import pytest

from ltlplan.service.job_queue.store import NoRoom, Store
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


def test_only_what_is_named_is_kept(tmp_path: Path) -> None:
    store = Store(tmp_path)
    first, second = store.put(b"first"), store.put(b"second")
    assert store.keep_only({first, "of a value that is not there"}) == 1
    assert store.digests() == {first}
    assert second != first


def test_a_store_knows_whose_values_it_has(tmp_path: Path) -> None:
    store = Store(tmp_path / "values")
    store.open()
    assert store.is_owned("ours")
    store.put(b"value")
    assert store.is_owned("ours")
    assert not store.is_owned("another's")
    assert not store.is_owned("ours")


def test_values_of_before_that_was_noted_are_nobody_s_to_remove(tmp_path: Path) -> None:
    store = Store(tmp_path / "values")
    store.put(b"value")
    assert not store.is_owned("ours")
    assert not store.is_owned("ours")
