"""What a person is shown of a live flight: lines where nobody watches a terminal, one line that is written anew where somebody does."""

from __future__ import annotations

import math
import sys

import pytest

from flight.link.tracking_monitor import Look
from flight.logs.log import Event
from ltlplan.commands.support.live_view import View


def look(time: float, *, to_do: tuple[str, ...] = (), events: tuple[Event, ...] = ()) -> Look:
    return Look("flight", time, 8.0, {"quad0": 0.0123, "quad1": math.nan}, 0.05, events, to_do)


def test_each_second_says_time_errors_against_the_margin_and_what_is_to_do(capsys) -> None:
    view = View(quiet=False)
    view.show(look(0.0, to_do=("F a", "F b")))
    view.show(look(0.5, to_do=("F b",)))
    view.show(look(1.0, events=(Event(1.0, None, "formula", "the formula is satisfied."),)))
    view.end()
    assert capsys.readouterr().out.splitlines() == [
        "flight    0.0 s, 8.0 s to go, of 50 mm: quad0 12 mm, quad1 unseen; still to do: `F a`, `F b`",
        "flight     1.00 s  the formula is satisfied.",
        "flight    1.0 s, 7.0 s to go, of 50 mm: quad0 12 mm, quad1 unseen",
    ]


def test_of_many_parts_a_few_are_named(capsys) -> None:
    View(quiet=False).show(look(0.0, to_do=tuple(f"F p{k}" for k in range(9))))
    assert capsys.readouterr().out.endswith("still to do: `F p0`, `F p1`, `F p2` and 6 more\n")


def test_a_terminals_line_is_cut_where_it_would_run_over(capsys, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True, raising=False)
    monkeypatch.setenv("COLUMNS", "40")
    view = View(quiet=False)
    view.show(look(0.0, to_do=("F a",)))
    view.show(look(0.1, to_do=("F a",)))
    shown = capsys.readouterr().out
    assert "\n" not in shown
    assert [len(text) for text in shown.split("\r\x1b[2K")[1:]] == [39, 39]


def test_who_is_quiet_is_shown_nothing(capsys) -> None:
    View(quiet=True).show(look(0.0))
    assert capsys.readouterr().out == ""
