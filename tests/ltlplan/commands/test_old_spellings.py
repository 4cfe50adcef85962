"""What a command was called before goes on, with a note that is no part of its output."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from ltlplan.cli import app
from ltlplan.commands.support.old_spellings import spelled_now
from tests.ltlplan.commands.test_commands import SMALL


@pytest.mark.parametrize(
    ("written", "now", "says"),
    [
        ("fly run --seed 3", "fly run --seed 3", None),
        ("run fly --online", "run fly --online", None),
        ("fly run --runs 20 --workers 2", "campaign run --runs 20 --workers 2", "campaign --runs"),
        ("fly run --runs=20", "campaign run --runs=20", "campaign --runs"),
        ("fly run --runs 1 --wind 1", "fly run --wind 1", "flies once"),
        ("fly --workers 2 run", "fly run", "flies once"),
        ("fly --online m.yaml --event x", "online m.yaml --event x", "`ltlplan online`"),
        ("fly run --runs", "fly run --runs", None),
        ("fly -- --online", "fly -- --online", None),
    ],
)
def test_words_as_they_are_now(written: str, now: str, says: str | None) -> None:
    words, note = spelled_now(written.split())
    assert words == now.split()
    assert note is None if says is None else note is not None and says in note


def test_the_note_is_on_standard_error(tmp_path: Path) -> None:
    mission = tmp_path / "small.yaml"
    mission.write_text(SMALL)
    done = CliRunner().invoke(app, ["fly", str(mission), "--runs", "2", "--noise", "0.001", "--json"], catch_exceptions=False)
    assert done.exit_code == 0
    assert json.loads(done.stdout)["asked"] == 2
    assert done.stderr == "note: `ltlplan fly --runs` is `ltlplan campaign --runs` now.\n"


@pytest.mark.parametrize(("command", "option"), [("fly", "--controller"), ("campaign", "--model"), ("export", "--format")])
def test_choices_are_those_of_the_registries(command: str, option: str) -> None:
    refused = CliRunner().invoke(app, [command, "run", option, "nothing"])
    assert refused.exit_code == 2
    first = {"--controller": "geometric", "--model": "full", "--format": "crazyswarm2"}[option]
    assert "nothing" in refused.stderr
    assert first in refused.stderr
    assert first in CliRunner().invoke(app, [command, "--help"]).stdout
