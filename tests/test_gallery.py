"""The gallery lists what was found, and finds what changed."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from gallery.building import ANY, HERE, build, changes
from gallery.entries import ENTRIES, NUMBERS, Entry
from gallery.pages import INDEX, accepted, entry_page, index_page
from gallery.picture import FILE, HOLD, SLOWER
from ltlplan.cli import load
from ltlplan.missions import shipped_missions

BY_NAME = {entry.name: entry for entry in ENTRIES}
QUICK = ("no-plan", "show-that-collides", "robot-lost-hoop-moved")


def test_the_page_lists_the_results_that_were_accepted() -> None:
    assert list(accepted()) == [entry.name for entry in ENTRIES]
    assert INDEX.read_text(encoding="utf-8") == index_page(accepted())


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.name)
def test_commands_are_commands_of_missions_that_are_there(entry: Entry) -> None:
    for command in entry.commands:
        if command.startswith("show"):
            continue
        name, source, *_ = words = shlex.split(command)
        load(name).make_context(name, [*words[1:], "--json"])
        if name in ("run", "plan", "online"):
            assert source in shipped_missions() or (HERE / "missions" / source).exists()


def test_every_mission_of_the_gallery_is_shown() -> None:
    shown = " ".join(command for entry in ENTRIES for command in entry.commands)
    assert [file.name for file in (HERE / "missions").glob("*.yaml") if file.name not in shown] == []


def test_the_first_page_counts_the_reports_that_play() -> None:
    playing = sum(bool(entry.page) for entry in ENTRIES)
    assert f"beside {playing - 1} others" in (INDEX.parent / "index.md").read_text(encoding="utf-8")


def test_the_moving_picture_shows_the_flight_of_today() -> None:
    """`python -m gallery.picture` makes it anew."""
    (lasts,) = set(re.findall(r'dur="([\d.]+)s"', FILE.read_text(encoding="utf-8")))
    assert float(lasts) == pytest.approx(SLOWER * accepted()["firefighting"]["duration"] / (1 - HOLD), rel=0.01)


def test_what_changed_is_found() -> None:
    known = {"firefighting": {"cost": 4.0, "words": {"quad0": "{a}"}, "claims": 3}}
    close = {"firefighting": {"cost": 4.0 + 1e-9, "words": {"quad0": "{a}"}, "claims": 3}}
    other = {"firefighting": {"cost": 4.1, "words": {"quad0": "{b}"}, "claims": 3, "checked": 2}}
    number = NUMBERS["firefighting"]
    assert changes(known, close) == []
    assert [line.partition(" was ")[0] for line in changes(known, other, ANY)] == [
        f"{number} firefighting: words",
        f"{number} firefighting: checked",
    ]
    assert [line.partition(" was ")[0] for line in changes(known, other)] == [
        f"{number} firefighting: cost",
        f"{number} firefighting: words",
        f"{number} firefighting: checked",
    ]


@pytest.mark.slow
@pytest.mark.parametrize("name", QUICK)
def test_an_entry_is_built_with_the_figures_that_were_accepted(name: str, tmp_path: Path) -> None:
    entry = BY_NAME[name]
    found = build(entry, tmp_path)
    assert changes(accepted(), {name: found}, ANY) == []
    folder = tmp_path / f"{NUMBERS[name]}-{name}"
    assert ("iframe" in entry_page(entry, found, folder)) == bool(entry.page)


@pytest.mark.slow
def test_an_entry_whose_command_ends_otherwise_is_told(tmp_path: Path) -> None:
    entry = Entry("firefighting", "", "", ("plan firefighting --formula 'F nowhere'",))
    with pytest.raises(RuntimeError, match="ended with 2, not 0"):
        build(entry, tmp_path)
