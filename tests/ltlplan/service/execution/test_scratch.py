"""Temporary files of a service's workers: found again after any end, and nobody else's."""

from __future__ import annotations

import tempfile
from pathlib import Path

import pytest

from ltlplan.service.execution.scratch import NOTE, PREFIX, drop_scratch, fresh_scratch


def test_what_a_killed_service_left_is_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    data = tmp_path / "data"
    data.mkdir()
    first = fresh_scratch(data)
    assert first is not None
    (first / "ltlplan-x").mkdir()
    (first / "ltlplan-x" / "file").write_text("half")
    second = fresh_scratch(data)
    assert second is not None
    assert second.exists()
    assert not first.exists()
    drop_scratch(data)
    assert not second.exists()
    drop_scratch(data)


def test_what_is_not_ours_is_left_alone(tmp_path: Path) -> None:
    theirs, linked, data = tmp_path / "theirs", tmp_path / f"{PREFIX}link", tmp_path / "data"
    for folder in (theirs, data):
        folder.mkdir()
    (theirs / "file").write_text("mine")
    linked.symlink_to(theirs)
    for noted in (str(theirs), str(linked), "", "\0", str(tmp_path / "nothing")):
        (data / NOTE).write_text(noted, encoding="utf-8")
        drop_scratch(data)
    assert (theirs / "file").read_text() == "mine"


def test_without_a_place_workers_do_without(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    assert fresh_scratch(tmp_path / "nothing") is None
    assert list(tmp_path.iterdir()) == []
