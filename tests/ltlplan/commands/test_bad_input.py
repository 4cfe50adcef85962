"""Every mistake of a user ends with one clear message, its exit code, no traceback and no folder."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from ltlplan import __version__
from tests.helpers.commands import Command
from tests.helpers.few import few_of
from tests.helpers.motion.flights import legs, plan_of, small_mission
from tests.verify.data.files.test_mission_file import GOOD
from tests.verify.test_run_folder import write_folder
from verify import certify


def assert_refused(ltlplan: Command, arguments: list[str], code: int, says: str, cwd: Path) -> None:
    before = sorted(cwd.rglob("*"))
    done = ltlplan(*arguments, cwd=cwd)
    assert done.returncode == code, done.stderr
    assert says in done.stderr, done.stderr
    assert "Traceback" not in done.stderr
    assert sorted(cwd.rglob("*")) == before, "something was left behind"


@few_of(
    5,
    ("old", "new", "code", "says"),
    [
        ("name: test", "name: test\ncolour: red", 2, "unknown key"),
        ("vehicle: crazyflie-2.1\n", "", 2, "missing"),
        ("center: [0.5, 0.0, 1.0]", "center: here", 2, "hoops.a.center"),
        ("F a & G !b", "F a & G !bee", 2, "is not a name of this mission"),
        ("F a & G !b", "F (a", 2, "never closed"),
        ("F a & G !b", "F X a", 2, "no next step"),
        ("start: [1.2, 0.0, 0.8]", "start: [9, 0.0, 0.8]", 2, "outside the workspace"),
        ("start: [1.2, 0.0, 0.8]", "start: [0.5, 0.2, 1.0]", 2, "edge of 'a'"),
        ("F a & G !b", "F a & G !a", 3, "unsatisfiable"),
        ("F a & G !b", "G (a | b)", 3, "unsatisfiable"),
    ],
)
def test_damaged_missions(old: str, new: str, code: int, says: str, ltlplan: Command, tmp_path: Path) -> None:
    assert old in GOOD
    (tmp_path / "m.yaml").write_text(GOOD.replace(old, new, 1))
    assert_refused(ltlplan, ["run", "m.yaml"], code, says, tmp_path)


@few_of(
    3,
    ("content", "says"),
    [
        (b"", "empty"),
        (b"{", "no YAML"),
        (b"\xff\xfe\x00", "UTF-8"),
        (b"#" * 2_000_000, "larger than"),
        (b"- 1\n", "table of keys"),
    ],
)
def test_files_that_are_no_mission(content: bytes, says: str, ltlplan: Command, tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_bytes(content)
    assert_refused(ltlplan, ["run", "m.yaml"], 2, says, tmp_path)


def test_unknown_missions_and_folders(ltlplan: Command, tmp_path: Path) -> None:
    assert_refused(ltlplan, ["run", "firefightin"], 2, "Did you mean 'firefighting'?", tmp_path)
    assert_refused(ltlplan, ["run", "nowhere.yaml"], 2, "cannot be read", tmp_path)
    assert_refused(ltlplan, ["recheck", "nowhere"], 2, "nowhere", tmp_path)
    (tmp_path / "delivery.yaml").write_text(GOOD)
    assert_refused(ltlplan, ["plan", "delivery"], 2, "Did you mean 'delivery.yaml'?", tmp_path)


def test_mistakes_in_the_commands_words(ltlplan: Command, tmp_path: Path) -> None:
    assert_refused(ltlplan, ["rum", "firefighting"], 2, "Did you mean 'run'?", tmp_path)
    assert_refused(ltlplan, ["run", "firefighting", "--sed", "3"], 2, "--seed", tmp_path)
    assert_refused(ltlplan, ["run", "firefighting", "--margin", "-1"], 2, "--margin", tmp_path)
    told = ltlplan("plan", "firefighting", "--seed", "many", "--json", cwd=tmp_path)
    assert told.returncode == 2
    assert json.loads(told.stdout)["exit_code"] == 2
    assert "--seed" in json.loads(told.stdout)["message"]


def test_a_misspelt_mission_is_not_silently_a_formula(ltlplan: Command, tmp_path: Path) -> None:
    shown = ltlplan("automaton", "firefightin", cwd=tmp_path)
    assert shown.returncode == 0
    assert "read as a formula. Did you mean 'firefighting'?" in shown.stderr


def test_version_and_completion(ltlplan: Command, tmp_path: Path) -> None:
    assert ltlplan("--version", cwd=tmp_path).stdout == f"ltlplan {__version__}\n"
    script = Path(sys.executable).with_name("ltlplan")
    if not script.exists():
        pytest.skip("ltlplan is not installed as a command")
    (tmp_path / "fire.yaml").write_text(GOOD)
    environment = {**os.environ, "_LTLPLAN_COMPLETE": "complete_bash", "COMP_WORDS": "ltlplan run fire", "COMP_CWORD": "2"}
    done = subprocess.run([script], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False, timeout=60)
    assert done.stdout.split() == ["firefighting", "fire.yaml"]


def test_a_folder_of_somebody_else_is_not_touched(ltlplan: Command, tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("years of work")
    assert_refused(ltlplan, ["run", "firefighting", "--out", "mine"], 2, "ltlplan did not write it", tmp_path)


def test_a_mission_to_start_from(ltlplan: Command, tmp_path: Path) -> None:
    done = ltlplan("missions", "--new", "delivery", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "delivery.yaml").exists()
    again = ltlplan("missions", "--new", "delivery", cwd=tmp_path)
    assert again.returncode == 2
    assert "exists already" in again.stderr
    planned = ltlplan("plan", "delivery.yaml", cwd=tmp_path)
    assert planned.returncode == 0, planned.stderr
    assert "pickup" in planned.stdout


def test_help_does_not_import_the_engines(tmp_path: Path) -> None:
    code = "import sys, ltlplan.cli; print([m for m in ('casadi', 'spot', 'osqp', 'plotly', 'numpy', 'networkx') if m in sys.modules])"
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


@few_of(2, "name", ["mission.yaml", "plan.json", "certificate.json", "r0.csv", "flight.csv"])
def test_a_pipe_is_never_waited_for(name: str, ltlplan: Command, tmp_path: Path) -> None:
    plan = plan_of(small_mission("true", regions=""), {})
    team = {"r0": legs([[0, 0, 1]])}
    folder = write_folder(tmp_path / "run", plan, team, certify(plan, team))
    (folder / name).unlink(missing_ok=True)
    os.mkfifo(folder / name)
    commands = {"flight.csv": ["certify", str(folder), "--flight", str(folder / name), "--max-speed", "1"]}
    assert_refused(ltlplan, commands.get(name, ["recheck", str(folder)]), 2, "no file but a pipe", tmp_path)
