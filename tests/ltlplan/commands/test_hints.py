"""What a page, a template or a message tells a user to write is what works."""

import ast
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from ltlplan.cli import COMMANDS, app, load
from ltlplan.commands.missions import write_template
from ltlplan.missions import load_mission, shipped_mission_text
from ltlplan.pipeline import plan
from verify.data import BadInput, parse_mission

ROOT = Path(__file__).parents[3]


def test_the_page_on_missions_shows_the_shipped_one() -> None:
    page = (ROOT / "docs" / "missions.md").read_text()
    assert shipped_mission_text("firefighting") in re.findall(r"```yaml\n(.*?)```", page, re.DOTALL)


def test_the_template_says_how_work_is_shared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = write_template("windows").read_text()
    assert "longest: share" in text
    windows = "".join(
        f"  w{i}: {{center: [-0.2, {y}, 1.0], radii: [0.1, 0.1, 0.1]}}\n" for i, y in enumerate((-0.9, -0.3, 0.3, 0.9))
    )
    text = text.replace("regions:\n", f"regions:\n{windows}", 1)
    text = text.replace("F pickup & F dropoff & (!dropoff U pickup)", "F w0 & F w1 & F w2 & F w3")
    visits = {}
    for objective in ("sum", "longest"):
        made = plan(parse_mission(text.replace("objective: sum", f"objective: {objective}")))
        visits[objective] = sorted(len(robot.visits) for robot in made.robots.values())
    assert visits == {"sum": [0, 4], "longest": [2, 2]}


def test_what_the_template_shows_of_the_world_works_when_it_is_uncommented(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    text = write_template("world").read_text()
    for commented in ("  # room:", "  # hall:", "# obstacles:", "#   pillar:", "#   wall:"):
        assert commented in text
        text = text.replace(commented, commented.replace("# ", "", 1) if commented.startswith("  ") else commented[2:])
    mission = parse_mission(text)
    assert list(mission.regions) == ["dropoff", "room", "hall"]
    assert list(mission.obstacles) == ["pillar", "wall"]
    (tmp_path / "lab.yaml").write_text("format: 1\nobstacles: {box: {center: [0, 0, 0.4], size: [0.2, 0.2, 0.2]}}\n")
    (tmp_path / "world.yaml").write_text(text.replace("# include: lab.yaml", "include: lab.yaml"))
    assert list(load_mission("world.yaml").obstacles) == ["box", "pillar", "wall"]


def test_the_template_is_refused_as_a_name_that_no_mission_can_have(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("con", "a.", "..", "a b/../.."):
        with pytest.raises(BadInput):
            write_template(name)
    assert list(tmp_path.iterdir()) == []


def test_options_that_messages_name_exist() -> None:
    known = {
        option
        for name in COMMANDS
        for parameter in load(name).params
        for option in (*parameter.opts, *parameter.secondary_opts)
    }
    known |= {"--help", "--version", "--install-completion", "--ros-args"}  # the last one is ROS 2's own
    for script in (ROOT / "flight" / "exports" / "scripts").glob("*.py"):  # which exports carry along
        known |= set(re.findall(r'add_argument\(\s*"(--[a-z-]+)"', script.read_text()))
    for package in ("ltlplan", "refine", "flight", "verify"):
        for path in (ROOT / package).rglob("*.py"):
            if path.name in ("old_spellings.py", "plain_pages.py") or path.parent.name == "report":
                continue  # what there was; pages, whose styles have names like these
            text = path.read_text()
            if re.search(r"(?<![\w-])--[a-z]", text) is None:
                continue
            for node in ast.walk(ast.parse(text)):
                if isinstance(node, ast.Constant) and isinstance(node.value, str):
                    for option in re.findall(r"(?<![\w-])--[a-z][a-z-]+", node.value):
                        assert option in known, f"{path.name}:{node.lineno} names {option}"


@pytest.mark.parametrize("header", ["when,quad0.x,quad0.y,quad0.z", "t,a,b,c"])
def test_hints_about_columns_say_that_they_are_the_librarys(header: str, tmp_path: Path) -> None:
    table = tmp_path / "table.csv"
    table.write_text(f"{header}\n0,0,0,1\n1,0,0,1\n")
    (tmp_path / "mission.yaml").write_text(shipped_mission_text("firefighting"))
    told = CliRunner().invoke(app, ["certify", str(tmp_path / "mission.yaml"), "--flight", str(table), "--max-speed", "1"])
    assert isinstance(told.exception, BadInput)
    assert "`columns=` of `flight.read_recording`" in str(told.exception)


def test_a_missing_bound_on_speed_is_asked_for_by_its_option(tmp_path: Path) -> None:
    table = tmp_path / "table.csv"
    table.write_text(
        "t,"
        + ",".join(f"quad{i}.{axis}" for i in range(3) for axis in "xyz")
        + "\n0,1,-.5,1,1,0,1,1,.5,1\n1,1,-.5,1,1,0,1,1,.5,1\n"
    )
    (tmp_path / "mission.yaml").write_text(shipped_mission_text("firefighting"))
    told = CliRunner().invoke(app, ["certify", str(tmp_path / "mission.yaml"), "--flight", str(table)])
    assert isinstance(told.exception, BadInput)
    assert "--max-speed" in str(told.exception)
