"""Drafts at the service: each user's own, the newest text of each, and not for ever more of them."""

from __future__ import annotations

import stat
from pathlib import Path

import pytest

from ltlplan.service.storage.drafts import FILE, LONGEST, MOST, OF_JOB, Draft, Drafts
from verify.data import BadInput


def test_drafts_are_kept_for_their_user_through_a_restart(tmp_path: Path) -> None:
    drafts = Drafts(tmp_path)
    drafts.keep("alice", "a", Draft("name: x\n# \ud7ff é 🚁", 1.0))
    drafts.keep("bob", "a", Draft("name: y", 2.0))
    drafts.close()
    again = Drafts(tmp_path)
    assert again.of("alice") == {"a": Draft("name: x\n# \ud7ff é 🚁", 1.0)}
    assert (again.of("bob"), again.of("' OR 1=1 --")) == ({"a": Draft("name: y", 2.0)}, {})
    assert stat.S_IMODE((tmp_path / FILE).stat().st_mode) == 0o600
    again.close()


def test_what_comes_late_is_not_written_over_what_is_newer(tmp_path: Path) -> None:
    drafts = Drafts(tmp_path)
    for text, changed in (("second", 2.0), ("first", 1.0), ("third", 3.0), ("second", 2.0)):
        drafts.keep("alice", "a", Draft(text, changed))
    assert drafts.of("alice")["a"].text == "third"
    drafts.close()


def test_the_newest_are_kept_and_jobs_push_no_draft_out(tmp_path: Path) -> None:
    drafts = Drafts(tmp_path)
    for number in range(MOST + 3):
        drafts.keep("alice", f"d{number}", Draft("x", float(number)))
    for number in range(MOST + 3):
        drafts.keep("alice", f"{OF_JOB}{number}", Draft("x", float(1000 + number)))
    kept = drafts.of("alice")
    assert {name for name in kept if not name.startswith(OF_JOB)} == {f"d{number}" for number in range(3, MOST + 3)}
    assert {name for name in kept if name.startswith(OF_JOB)} == {f"{OF_JOB}{number}" for number in range(3, MOST + 3)}
    drafts.close()


def test_what_cannot_be_kept_is_said(tmp_path: Path) -> None:
    drafts = Drafts(tmp_path)
    with pytest.raises(BadInput, match="letters is not kept"):
        drafts.keep("alice", "a", Draft("x" * (LONGEST + 1), 1.0))
    drafts.close()
    (tmp_path / FILE).write_bytes(b"no database at all, but long enough to be one" * 50)
    with pytest.raises(BadInput, match="cannot be used"):
        Drafts(tmp_path).of("alice")
