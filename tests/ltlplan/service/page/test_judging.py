"""What a person types of a recording, as the command's options: nothing that they did not type."""

from __future__ import annotations

import pytest

from ltlplan.service.page.judging import recording_asked
from ltlplan.service.recordings import RecordingAsked
from verify.data import BadInput


def test_empty_fields_say_nothing() -> None:
    names = ("max_speed", "error", "start", "start_error", "pauses", "called", "axes", "origin")
    assert recording_asked({}) == recording_asked(dict.fromkeys(names, " ")) == RecordingAsked()


def test_every_field_is_read() -> None:
    fields = {
        "max_speed": " 1.5", "error": "2e-3", "start": "quad0=3.2,quad1=5.7", "start_error": "0.1", "pauses": "4, 2.5;1 3",
        "called": "quad0=cf 231, quad1=cf7;", "axes": "x,-z,y", "origin": "quad0=1,0,0; quad1=0,2,0",
    }  # fmt: skip
    assert recording_asked(fields) == RecordingAsked(
        max_speed=1.5, error=0.002, start="quad0=3.2,quad1=5.7", start_error=0.1, called=("quad0=cf 231", "quad1=cf7"), axes="x,-z,y",
        origin=("quad0=1,0,0", "quad1=0,2,0"), pauses=(4.0, 2.5, 1.0, 3.0),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("max_speed", "fast"),
        ("max_speed", "0"),
        ("max_speed", "-1"),
        ("error", "nan"),
        ("error", "-0.1"),
        ("start_error", "inf"),
        ("pauses", "4, x"),
    ],
)
def test_what_is_no_number_is_said(name: str, text: str) -> None:
    with pytest.raises(BadInput, match="is not a number that"):
        recording_asked({name: text})
