"""The service's log: an error that comes again and again does not fill the disk."""

from __future__ import annotations

import io
import json
import logging

import pytest

from ltlplan.service.log import begin_log, note_bug


def _bug(wanted: str) -> None:
    try:
        int(wanted) if wanted else [][0]
    except (ValueError, IndexError) as error:
        note_bug(error, path="/x")


def test_an_error_at_one_place_is_noted_once_a_minute(monkeypatch: pytest.MonkeyPatch) -> None:
    root = logging.getLogger()
    handlers, level = root.handlers[:], root.level
    now, out = [100.0], io.StringIO()
    monkeypatch.setattr("ltlplan.service.log.time.monotonic", lambda: now[0])
    try:
        begin_log(out)
        for _ in range(1000):
            _bug("x")
        _bug("")
        now[0] += 61.0
        _bug("y")
    finally:
        root.handlers[:], root.level = handlers, level
    noted = [json.loads(line) for line in out.getvalue().splitlines()]
    assert [each["traceback"].splitlines()[-1].partition(":")[0] for each in noted] == [
        "ValueError",
        "IndexError",
        "ValueError",
    ]
    assert [each.get("left_out") for each in noted] == [None, None, 999]
