"""`ltlplan submit`: what it prints, and the exit codes of `run`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

import verify
from ltlplan.cli import app
from ltlplan.commands.submit import ADDRESS
from tests.helpers.serving.services import ONE_HOOP, Served
from verify.data import BadInput, LtlplanError, Unsatisfiable


@pytest.fixture
def mission(tmp_path: Path, served: Served, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a mission's file, with the service named as a pipeline does."""
    monkeypatch.setenv(ADDRESS, served.url)
    (tmp_path / "one.yaml").write_text(ONE_HOOP)
    return tmp_path / "one.yaml"


def _submit(*words: str | Path) -> Result:
    return CliRunner().invoke(app, ["submit", *map(str, words)])


def test_a_mission_is_accepted_and_waited_for(mission: Path, tmp_path: Path, served: Served) -> None:
    accepted = json.loads(_submit(mission, "--json").stdout)
    assert accepted["page"] == f"{served.url}/jobs/{accepted['job']}"
    waited = _submit(mission, "--wait", "--project", "ci", "--out", tmp_path / "out")
    assert waited.exit_code == 0
    assert waited.stdout.splitlines()[-1] == f"page    {accepted['page']}"
    assert verify.recheck(tmp_path / "out").holds
    told = json.loads(_submit(mission, "--wait", "--json").stdout)
    assert (told["job"], told["found"], told["holds"]) == (accepted["job"], True, True)
    assert "claims at a margin of" in _submit(mission, "--wait").stdout
    assert "was planned before" in _submit(mission).stdout


@pytest.mark.parametrize(
    ("text", "words", "error"),
    [
        (ONE_HOOP.replace("F hoop0", "F hoop0 & G !hoop0"), ("--wait",), Unsatisfiable),
        (ONE_HOOP.replace("F hoop0", "F hoop1"), ("--wait",), BadInput),
        (ONE_HOOP, ("--out", "x"), BadInput),
        (ONE_HOOP, ("--service", "http://127.0.0.1:1"), BadInput),
        (ONE_HOOP, ("--service", "nonsense"), BadInput),
    ],
)
def test_what_cannot_be_ends_as_run_would(text: str, words: tuple[str, ...], error: type[LtlplanError], mission: Path) -> None:
    mission.write_text(text)
    ended = _submit(mission, *words)
    assert isinstance(ended.exception, error)
    assert isinstance(ended.exception, LtlplanError)
    assert ended.exception.exit_code == error.exit_code
