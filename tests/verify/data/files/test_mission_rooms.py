"""Missions that include rooms: the same as if they stood in one file, and nothing else is ever opened."""

import os
from pathlib import Path

import pytest
from typer.testing import CliRunner

from ltlplan.cli import app
from ltlplan.missions import load_mission
from ltlplan.service.execution.batches import run_batch
from verify.data import BadInput, Mission, MissionError, mission_to_yaml, parse_mission
from verify.data.files.mission_file import load_mission_file
from verify.data.files.mission_rooms import MAX_ROOMS

ROOM = """\
format: 1
hoops:
  a: {center: [0.5, 0.0, 1.0], radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}
regions:
  b: {center: [-0.5, 0.5, 1.0], size: [0.4, 0.6, 0.4], yaw_deg: 30}
environment: {edges: [[a, b]]}
workspace: {min: [-1.6, -1.3, 0.2], max: [1.6, 1.3, 1.8]}
"""
MISSION = """\
format: 1
name: test
include: lab.yaml
spec: {formula: F a & F c & G !b}
regions:
  c: {center: [-0.5, -0.7, 1.0], radii: [0.2, 0.2, 0.2]}
environment: {edges: [[robot, a], [a, c]]}
agents:
  quad0: {start: [1.2, 0.0, 0.8]}
vehicle: crazyflie-2.1
"""
WHOLE = """\
format: 1
name: test
spec: {formula: F a & F c & G !b}
hoops:
  a: {center: [0.5, 0.0, 1.0], radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}
regions:
  b: {center: [-0.5, 0.5, 1.0], size: [0.4, 0.6, 0.4], yaw_deg: 30}
  c: {center: [-0.5, -0.7, 1.0], radii: [0.2, 0.2, 0.2]}
environment: {edges: [[a, b], [robot, a], [a, c]]}
agents:
  quad0: {start: [1.2, 0.0, 0.8]}
vehicle: crazyflie-2.1
workspace: {min: [-1.6, -1.3, 0.2], max: [1.6, 1.3, 1.8]}
"""


def written(folder: Path, **files: str) -> Path:
    """Write files into a folder, `/` in a name given as `__`, and return the mission's."""
    for name, text in {"mission": MISSION, "lab": ROOM, **files}.items():
        file = folder / (name.replace("__", "/") + ".yaml")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    return folder / "mission.yaml"


def refusal(folder: Path, **files: str) -> str:
    with pytest.raises(BadInput) as caught:
        load_mission_file(written(folder, **files))
    return str(caught.value)


def test_a_mission_with_rooms_is_the_mission_written_out_in_one_file(tmp_path: Path) -> None:
    mission, whole = load_mission_file(written(tmp_path)), parse_mission(WHOLE)
    assert mission == whole
    assert mission.digest() == whole.digest()
    assert mission_to_yaml(mission) == mission_to_yaml(whole)
    assert "include" not in mission.resolved()


def test_rooms_are_put_together_in_the_order_in_which_they_are_included(tmp_path: Path) -> None:
    parts = ROOM.splitlines(keepends=True)
    hoops, rest = "".join(parts[:3]), parts[0] + "".join(parts[3:])
    listed = MISSION.replace("lab.yaml", "[rooms/ring.yaml, ./lab.yaml]")
    assert load_mission_file(written(tmp_path / "list", mission=listed, rooms__ring=hoops, lab=rest)) == parse_mission(WHOLE)
    nested = rest + "include: rooms/ring.yaml\n"
    assert load_mission_file(written(tmp_path / "nested", rooms__ring=hoops, lab=nested)) == parse_mission(WHOLE)
    both = [list(load_mission_file(tmp_path / way / "mission.yaml").all_regions) for way in ("list", "nested")]
    assert both == [["a", "b", "c"]] * 2


@pytest.mark.parametrize(
    ("room", "says"),
    [
        ("../lab.yaml", "leads out of the mission's folder"),
        ("rooms/../../lab.yaml", "leads out of the mission's folder"),
        ("/etc/lab.yaml", "leads out of the mission's folder"),
        ("lab.txt", "they are called *.yaml or *.yml"),
        ("/etc/passwd", "leads out of the mission's folder"),
        ("'rooms\\lab.yaml'", "write it with `/`"),
        ("'c:lab.yaml'", "write it with `/`"),
        ('"lab\\0.yaml"', "write it with `/`"),
        ("''", "is no path of a room"),
        ("7", "must be the name of a room's file"),
        ("{a: b}", "must be the name of a room's file"),
        ("[[lab.yaml]]", "must be the name of a room's file"),
        ("lap.yaml", "there is no file 'lap.yaml' beside mission.yaml. Did you mean 'lab.yaml'?"),
        ("[lab.yaml, ./lab.yaml]", "'./lab.yaml' is included twice; the first time is at"),
        ("mission.yaml", "'mission.yaml' includes itself"),
        ("folder.yaml", "it is a folder"),
    ],
)
def test_what_is_no_room_beside_the_mission_is_refused_at_its_line(tmp_path: Path, room: str, says: str) -> None:
    (tmp_path / "folder.yaml").mkdir()
    found = refusal(tmp_path, mission=MISSION.replace("lab.yaml", room))
    assert says in found
    assert f"{tmp_path / 'mission.yaml'}:3: include" in found


def test_links_lead_no_further_than_the_missions_folder(tmp_path: Path) -> None:
    written(tmp_path / "elsewhere")
    mission = written(tmp_path / "here", mission=MISSION.replace("lab.yaml", "rooms/lab.yaml"), inner__lab=ROOM)
    (tmp_path / "here" / "rooms").symlink_to(tmp_path / "here" / "inner")
    assert load_mission_file(mission) == parse_mission(WHOLE)
    (tmp_path / "here" / "rooms").unlink()
    (tmp_path / "here" / "rooms").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(MissionError, match="leads out of the mission's folder by a link"):
        load_mission_file(mission)
    (tmp_path / "here" / "rooms").unlink()
    (tmp_path / "here" / "rooms").mkdir()
    (tmp_path / "here" / "rooms" / "lab.yaml").symlink_to(tmp_path / "elsewhere" / "lab.yaml")
    with pytest.raises(MissionError, match="leads out of the mission's folder by a link"):
        load_mission_file(mission)


def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.yaml")
    assert "it is no file but a pipe" in refusal(tmp_path, mission=MISSION.replace("lab.yaml", "pipe.yaml"))


def test_rooms_that_include_each_other_end(tmp_path: Path) -> None:
    found = refusal(tmp_path, lab=ROOM + "include: other.yaml\n", other="format: 1\ninclude: [lab.yaml, other.yaml]\n")
    assert "other.yaml:2: include.0: 'lab.yaml' includes itself" in found
    assert "other.yaml:2: include.1: 'other.yaml' includes itself" in found


def test_names_given_twice_are_faults_with_both_places(tmp_path: Path) -> None:
    twice = MISSION.replace("  c: {", "  b: {center: [0, 0, 1], radii: [0.1, 0.1, 0.1]}\n  c: {")
    found = refusal(tmp_path, mission=twice + "workspace: {min: [0, 0, 0], max: [1, 1, 1]}\n")
    assert f"{tmp_path}/mission.yaml:6: regions.b: 'b' is given twice; the first is at {tmp_path}/lab.yaml:5." in found
    assert f"mission.yaml:12: workspace: `workspace` is given twice; the first is at {tmp_path}/lab.yaml:7." in found
    directed = ROOM.replace("[[a, b]]", "[[a, b]], directed: true")
    assert "`directed` must be the same in all files" in refusal(tmp_path / "directed", lab=directed)
    hoop = MISSION.replace("  c: {", "  a: {center: [0, 0, 1], radii: [0.1, 0.1, 0.1]}\n  c: {")
    assert "mission.yaml:6: regions.a: 'a' names both a hoop and a region." in refusal(tmp_path / "hoop", mission=hoop)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (
            "center: [-0.5, 0.5, 1.0]",
            "center: [-0.5, 5.5, 1.0]",
            ":5: regions.b.center: (-0.5, 5.5, 1) lies outside the workspace [",
        ),
        ("size:", "sise:", ":5: regions.b.sise: unknown key. Did you mean 'size'?"),
        ("[[a, b]]", "[[a, d]]", ":6: environment.edges.0: 'd' is not a region of this mission."),
        ("format: 1", "format: 2", ":1: format: must be 1, not 2."),
        ("format: 1\n", "format: true\n", ":1: format: must be 1, not True."),
        ("format: 1\n", "", ":1: format: missing: a room's file begins with `format: 1`."),
        (
            "format: 1\n",
            "format: 1\nagents: {q: {start: [0, 0, 1]}}\n",
            ":2: agents: a room has no such key. It may hold: format",
        ),
        ("format: 1\n", "format: 1\nregoins: {}\n", ":2: regoins: a room has no such key. Did you mean 'regions'?"),
        ("  b: {", "  b: {<<: {}, ", ":5: merge keys (`<<`) are not accepted; write the keys out."),
        ("environment: {", "environment: {{", ":7: this is no YAML"),
        ("regions:\n  b", "regions: 3\nx:\n  b", ":4: regions: must be a table of keys"),
        ("environment: {edges: [[a, b]]}", "environment: 3", "environment: must be a table with a list of `edges`."),
        ("hoops:", "hoops: &x\n  a: 1\nhoops:", "duplicate key"),
    ],
)
def test_faults_of_a_room_have_its_file_and_line(tmp_path: Path, old: str, new: str, says: str) -> None:
    assert old in ROOM
    found = refusal(tmp_path, lab=ROOM.replace(old, new, 1))
    assert says in found
    assert f"{tmp_path}/lab.yaml:" in found


def test_faults_of_the_missions_own_edges_keep_their_lines(tmp_path: Path) -> None:
    found = refusal(tmp_path, mission=MISSION.replace("[a, c]]", "[a, e]]"))
    assert "mission.yaml:7: environment.edges.2: 'e' is not a region of this mission." in found


def test_faults_of_the_missions_own_format_and_of_keys_that_are_missing_have_its_file(tmp_path: Path) -> None:
    found = refusal(tmp_path, mission=MISSION.replace("format: 1", "format: 2").replace("vehicle: crazyflie-2.1\n", ""))
    assert f"{tmp_path}/mission.yaml:1: format: input should be 1, not 2." in found
    assert f"{tmp_path}/mission.yaml:1: vehicle: missing" in found


def test_rooms_are_few_and_small(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    many = {f"r{i}": "format: 1\n" for i in range(MAX_ROOMS + 1)}
    listed = f"[{', '.join(f'{name}.yaml' for name in many)}]"
    assert f"at most {MAX_ROOMS} files" in refusal(tmp_path, mission=MISSION.replace("lab.yaml", listed), **many)
    half = ROOM + "#" * 600_000
    listed = MISSION.replace("lab.yaml", "[lab.yaml, more.yaml]")
    assert "the mission with its rooms is larger than 1 MB" in refusal(tmp_path, mission=listed, lab=half, more="#" * 600_000)
    assert "is larger than 1 MB; that is no room file" in refusal(tmp_path, lab="#" * 1_000_001)
    monkeypatch.setattr("verify.data.files.mission_rooms.MAX_NODES", 100)
    long = "format: 1\nregions: {" + ", ".join(f"r{i}: [1, 2, 3]" for i in range(20)) + "}\n"
    assert "more than 100 keys and values" in refusal(tmp_path, mission=listed, lab=long, more=long.replace("r", "q"))


def test_text_opens_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written(tmp_path)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(
        MissionError, match="mission:3: include: rooms are read only for a mission file that is named by its path"
    ):
        parse_mission(MISSION)


def test_a_runs_folder_stands_on_its_own(tmp_path: Path) -> None:
    with pytest.raises(MissionError, match="not in a run's folder"):
        load_mission_file(written(tmp_path), alone=True)


def test_a_room_is_no_mission_and_says_so(tmp_path: Path) -> None:
    written(tmp_path)
    with pytest.raises(MissionError, match=r"this is a room, which missions have by `include: lab\.yaml`"):
        load_mission(tmp_path / "lab.yaml")


def test_a_mission_is_written_out_by_a_command(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["missions", "--resolved", str(written(tmp_path))])
    assert done.exit_code == 0, done.output
    assert parse_mission(done.stdout) == parse_mission(WHOLE)


def test_the_rooms_in_a_folder_of_missions_are_not_run(tmp_path: Path) -> None:
    class NoWorkers:
        count = 1

        def __getattr__(self, name: str) -> object:
            raise AssertionError(f"nothing is to be run, but {name} was asked for")

    written(tmp_path / "missions", mission=MISSION.replace("F a", "F aa"))
    (entry,) = run_batch(tmp_path / "missions", tmp_path / "out", workers=NoWorkers())  # type: ignore[arg-type]  # never used
    assert (entry.name, entry.exit_code) == ("mission", 2)
    assert "'aa' is not a name" in entry.sentence


def test_missions_that_share_a_room_differ_only_in_what_they_ask(tmp_path: Path) -> None:
    first = load_mission_file(written(tmp_path))
    second = load_mission_file(written(tmp_path, mission=MISSION.replace("F a & F c", "F c")))
    assert first.digest() != second.digest()
    assert isinstance(second, Mission)
    assert second.changed(spec=first.spec) == first
