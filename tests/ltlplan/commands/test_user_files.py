"""Whatever command writes a folder a second time: what a person put there or changed is kept, or refused by its name."""

import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

import flight
import ltlplan
from flight.storage.ownership import files_in
from ltlplan.cli import app
from ltlplan.online.files import ONLINE_FILES
from ltlplan.output import CAMPAIGN_FILES, LOG_FILES, PLAN_FILES, REHEARSAL_FILES, run_files
from tests.helpers.few import few_of
from tests.ltlplan.commands.test_commands import SMALL
from verify.data import BadInput

COMMANDS = {
    "run": (["run", "small.yaml", "--out", "out"], run_files),
    "plan": (["plan", "small.yaml", "--out", "out"], lambda _mission: PLAN_FILES),
    "fly": (["fly", "small.yaml", "--out", "out"], lambda _mission: LOG_FILES),
    "campaign": (
        ["campaign", "small.yaml", "--runs", "2", "--noise", "0.001", "--out", "out"],
        lambda _mission: CAMPAIGN_FILES,
    ),
    "rehearse": (
        [
            "rehearse",
            "small.yaml",
            "--runs",
            "1",
            "--controller",
            "lee",
            "--mass",
            "1",
            "--latency",
            "0.01",
            "--wind",
            "0",
            "--out",
            "out",
        ],
        lambda _mission: REHEARSAL_FILES,
    ),
    "online": (["online", "small.yaml", "--out", "out"], lambda _mission: ONLINE_FILES),
    "export": (["export", "run", "--format", "crazyflie", "--out", "out"], None),
    "compressed": (["export", "run", "--format", "crazyflie-compressed", "--out", "out"], None),
}
MINE = {"recorded.csv": "flown", "mocap.csv": "seen", "notes/ideas.txt": "mine", "crazyswarm2/fly_twice.py": "script"}


def run(*arguments: str) -> str:
    done = CliRunner().invoke(app, list(arguments), catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.output


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a small mission and a run of it."""
    folder = tmp_path_factory.mktemp("made")
    (folder / "small.yaml").write_text(SMALL)
    run("run", str(folder / "small.yaml"), "--out", str(folder / "run"))
    return folder


@pytest.fixture
def here(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    shutil.copytree(made, tmp_path / "here")
    monkeypatch.chdir(tmp_path / "here")
    return tmp_path / "here"


@few_of(1, "command", [pytest.param(name, marks=pytest.mark.slow) if name == "compressed" else name for name in COMMANDS])
def test_a_second_time_nothing_of_the_users_is_lost(command: str, here: Path) -> None:
    arguments, names = COMMANDS[command]
    said = run(*arguments)
    written = files_in(here / "out")
    assert "manifest.json" in written
    if names is not None:
        assert {*names(ltlplan.load_mission(here / "small.yaml")), "manifest.json"} == set(written), "what is looked at before"
    for name, content in MINE.items():
        (here / "out" / name).parent.mkdir(exist_ok=True)
        (here / "out" / name).write_text(content)
    run(*arguments)
    assert {name: (here / "out" / name).read_text() for name in MINE} == MINE
    assert set(files_in(here / "out")) == {*written, *MINE}
    for name in {*written} - {"manifest.json"}:
        path = here / "out" / name
        original = path.read_bytes()
        path.write_bytes(original + b"\n# my own")
        refused = CliRunner().invoke(app, arguments)
        assert isinstance(refused.exception, BadInput)
        assert f"{Path('out') / name} is yours, or was changed since ltlplan wrote it" in str(refused.exception)
        assert "proving" not in refused.output, "refused before the work"
        if names is None:
            assert "proving" in said
            assert "simulating the flight" not in refused.output, "refused before it is flown"
        assert path.read_bytes() == original + b"\n# my own"
        path.write_bytes(original)


@pytest.mark.parametrize("command", COMMANDS)
def test_a_folder_made_by_hand_is_refused(command: str, here: Path) -> None:
    by_hand = {"mission.yaml": "name: mine", "flight.csv": "t,x", "report.html": "<p>mine", "crazyswarm2/run.py": "pass"}
    for name, content in by_hand.items():
        (here / "out" / name).parent.mkdir(parents=True, exist_ok=True)
        (here / "out" / name).write_text(content)
    refused = CliRunner().invoke(app, COMMANDS[command][0])
    assert isinstance(refused.exception, BadInput)
    assert "has no manifest.json, so ltlplan did not write it" in str(refused.exception)
    assert {name: (here / "out" / name).read_text() for name in files_in(here / "out")} == by_hand


@pytest.mark.slow
def test_exports_into_a_runs_folder_outlive_the_next_run(here: Path) -> None:
    run("export", "run", "--format", "crazyflie")
    run("export", "run")  # crazyswarm2, as the run wrote it
    run("run", "small.yaml", "--out", "run")
    run("recheck", "run")
    assert "crazyflie/quad0.bin" in files_in(here / "run")
    run("export", "run", "--format", "crazyflie")


@pytest.mark.slow
def test_show_replaces_its_own_page_and_no_other(here: Path) -> None:
    page = here / "small.html"
    for _ in range(2):
        run("show", "small.yaml")
    page.write_text(page.read_text().replace("<title>", "<title>My own "))
    with pytest.raises(BadInput, match=r"small\.html is yours, or was changed since ltlplan wrote it"):
        run("show", "small.yaml")
    assert "<title>My own " in page.read_text()
    page.write_text("by hand")
    with pytest.raises(BadInput, match=r"small\.html is yours"):
        run("show", "small.yaml")
    assert page.read_text() == "by hand"


def test_a_log_is_not_written_over_another_file(here: Path) -> None:
    log = flight.read_log(here / "run" / "flight.csv")
    target = here / "recorded.csv"
    for _ in range(2):
        flight.write_log(log, target)  # the same bytes
    target.write_text("recorded")
    with pytest.raises(BadInput, match=r"recorded\.csv exists already"):
        flight.write_log(log, target)
    assert target.read_text() == "recorded"
    flight.write_log(log, target, overwrite=True)
    assert target.read_text() == log.to_csv()
