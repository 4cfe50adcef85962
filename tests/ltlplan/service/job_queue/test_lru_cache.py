"""What was asked for lately is kept, up to a size."""

from __future__ import annotations

from ltlplan.service.job_queue.lru_cache import Recent


def test_what_was_not_asked_for_longest_is_forgotten() -> None:
    recent: Recent[str] = Recent(10)
    assert recent.put("a", "A", 4) == "A"
    recent.put("b", "B", 4)
    assert recent.get("a") == "A"
    recent.put("c", "C", 4)
    assert "b" not in recent
    assert [recent.get(key) for key in "abc"] == ["A", None, "C"]


def test_what_is_too_large_is_not_kept_and_nothing_is_lost_for_it() -> None:
    recent: Recent[str] = Recent(10)
    recent.put("a", "A", 10)
    assert recent.put("b", "B", 11) == "B"
    assert recent.put("a", "another A", 1) == "another A"
    assert recent.get("a") == "A"
    assert recent.get("b") is None
