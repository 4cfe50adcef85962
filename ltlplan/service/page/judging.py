"""Fields of a form about a recorded flight, read as options."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from ltlplan.service.recordings import RecordingAsked
from verify.data import BadInput


def recording_asked(fields: Mapping[str, str]) -> RecordingAsked:
    """Return what a person says of a recording. A field that is empty says nothing.

    Args:
        fields: As they were typed, by the names of `RecordingAsked`.

    Raises:
        BadInput: A field holds no number where it must.
    """
    given = {name: text.strip() for name, text in fields.items() if text.strip()}
    return RecordingAsked(
        max_speed=_number(given, "max_speed", None),
        error=_number(given, "error", 0.0) or 0.0,
        start=given.get("start"),
        start_error=_number(given, "start_error", 0.0) or 0.0,
        called=_listed(given.get("called", ""), "[;,]"),
        axes=given.get("axes"),
        origin=_listed(given.get("origin", ""), ";"),
        pauses=tuple(_finite(text, "pauses") for text in _listed(given.get("pauses", ""), r"[;,\s]")),
    )


def _listed(text: str, between: str) -> tuple[str, ...]:
    return tuple(part.strip() for part in re.split(between, text) if part.strip())


def _number(given: Mapping[str, str], name: str, missing: float | None) -> float | None:
    return _finite(given[name], name) if name in given else missing


def _finite(text: str, name: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or value < 0 or (name == "max_speed" and value == 0):
        raise BadInput(f"'{text[:60]}' is not a number that {name.replace('_', ' ')} can be; write one such as 1.5.")
    return value
