"""Times as the service keeps and tells them."""

from __future__ import annotations

from datetime import UTC, datetime


def utc_now() -> str:
    """Return the time: ISO 8601, to the millisecond, so that texts are ordered as times are."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")
