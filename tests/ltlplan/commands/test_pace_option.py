"""`--pace` of the commands: what it is given to, and what is no pace."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.helpers.commands import Command
from tests.helpers.few import few_of
from tests.ltlplan.test_paces import REFUSED, TEXT
from verify.data import Mission
from verify.data.files.mission_file import load_mission_file


@pytest.fixture
def file(tmp_path: Path) -> str:
    (tmp_path / "small.yaml").write_text(TEXT)
    return "small.yaml"


@few_of(1, "command", ["plan", "run", "online", "online --certified"])
def test_commands_refuse_what_is_no_pace(command: str, file: str, ltlplan: Command, tmp_path: Path) -> None:
    for pace in ("2", "fast"):
        done = ltlplan(*command.split(), file, "--pace", pace, cwd=tmp_path)
        assert (done.returncode, done.stderr.count(REFUSED)) == (2, 1), done.stderr
    assert [path.name for path in tmp_path.iterdir()] == [file]


def test_a_batch_refuses_what_is_no_pace_once(file: str, ltlplan: Command, tmp_path: Path) -> None:
    folder = tmp_path / "missions"
    folder.mkdir()
    for name in ("a.yaml", "b.yaml"):
        (folder / name).write_text((tmp_path / file).read_text())
    done = ltlplan("batch", "missions", "--pace", "2", cwd=tmp_path)
    assert (done.returncode, (done.stderr + done.stdout).count(REFUSED)) == (2, 1)
    assert not (tmp_path / "out").exists()


def written(folder: Path) -> Mission:
    return load_mission_file(folder / "mission.yaml")


def test_commands_write_the_pace_that_they_are_given(file: str, ltlplan: Command, tmp_path: Path) -> None:
    done = ltlplan("plan", file, "--pace", "nominal", "--out", "planned", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert written(tmp_path / "planned").planner.pace == "nominal"


@pytest.mark.slow
def test_runs_batches_and_online_flights_are_flown_at_the_pace_that_they_are_given(
    file: str, ltlplan: Command, tmp_path: Path
) -> None:
    folder = tmp_path / "missions"
    folder.mkdir()
    (folder / file).write_text((tmp_path / file).read_text())
    for command in ("run small.yaml --out flown", "batch missions --out all", "online small.yaml --certified --out online"):
        done = ltlplan(*command.split(), "--pace", "1", cwd=tmp_path)
        assert done.returncode == 0, done.stderr
    assert [written(tmp_path / name).planner.pace for name in ("flown", "all/small", "online")] == [1.0, 1.0, 1.0]
