from pathlib import Path

import pytest
import ruamel.yaml

from ltlplan.missions import load_mission, shipped_missions
from tests.helpers.few import few_of
from verify.data import BadInput, Mission, MissionError, mission_to_yaml, parse_mission
from verify.data.files.mission_file import MAX_BYTES
from verify.data.storage import strict_yaml

GOOD = """\
format: 1
name: test
spec: {formula: F a & G !b}
hoops:
  a: {center: [0.5, 0.0, 1.0], radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}
regions:
  b: {center: [-0.5, 0.5, 1.0], radii: [0.2, 0.3, 0.2], yaw_deg: 30}
environment: {edges: [[robot, a], [a, b]]}
robot: {initial: off, states: {off: [], on: [lit]}, actions: [{from: off, to: on, at: a}]}
agents:
  quad0: {start: [1.2, 0.0, 0.8]}
  quad1: {start: [1.2, 0.8, 0.8]}
vehicle: crazyflie-2.1
workspace: {min: [-1.6, -1.3, 0.2], max: [1.6, 1.3, 1.8]}
"""


def faults(text: str) -> str:
    with pytest.raises(BadInput) as caught:
        parse_mission(text, "test.yaml")
    return str(caught.value)


def test_a_sound_mission_is_read() -> None:
    mission = parse_mission(GOOD)
    assert mission.propositions == {"a", "b", "lit", "free"}
    assert mission.effective_limits.speed == mission.vehicle.speed


def test_a_mission_is_written_alike_whether_or_not_yamls_c_library_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    """Digests are taken of what is written, so one machine's emitter must not fold lines otherwise than another's."""

    class OtherEmitter(ruamel.yaml.emitter.Emitter):
        def __init__(self, *arguments: object, **options: object) -> None:
            raise AssertionError("the C library's emitter was asked for")

    written = mission_to_yaml(load_mission("firefighting"))
    monkeypatch.setattr(ruamel.yaml.main, "CEmitter", OtherEmitter)
    assert mission_to_yaml(load_mission("firefighting")) == written


@few_of(3, "name", shipped_missions())
def test_a_resolved_mission_reads_back_as_itself(name: str) -> None:
    mission = load_mission(name)
    again = parse_mission(mission_to_yaml(mission))
    assert again == mission
    assert again.digest() == mission.digest()
    assert mission_to_yaml(again) == mission_to_yaml(mission)


@pytest.mark.parametrize(
    ("old", "new", "line", "says"),
    [
        (
            "radii: [0.2, 0.2, 0.2], opening",
            "raduis: [0.2, 0.2, 0.2], opening",
            5,
            "hoops.a.raduis: unknown key. Did you mean 'radii'?",
        ),
        ("F a & G !b", "F a, soft: [{formula: F b, wieght: 2}]", 3, "soft.0.wieght: unknown key. Did you mean 'weight'?"),
        ("radii: [0.2, 0.2, 0.2], opening", "opening", 5, "hoops.a.radii: missing"),
        (
            "min: [-1.6, -1.3, 0.2]",
            "min: [-1.6, -1.3, 1.1000000000000001]",
            12,
            "(1.2, 0.8, 0.8) lies outside the workspace [-1.6, -1.3, 1.1] to [",
        ),
        ("[0.2, 0.2, 0.2]", "[0.2, 0.2]", 5, "hoops.a.radii"),
        ("[0.2, 0.2, 0.2]", "[0,2, 0,2]", 5, "must have 3 entries, not 4: [0, 2, 0, 2]."),
        ("[0.2, 0.2, 0.2]", "0.2", 5, "must be a list, such as [1, 2], not 0.2."),
        ("F a & G !b", "GFa & G !b", 3, "'GFa' is not a name of this mission. `GFa` is one name here; write `G F a`."),
        ("[0.2, 0.2, 0.2]", "!!python/tuple [0.2, 0.2, 0.2]", 5, "YAML tags such as tag:yaml.org,2002:python/tuple"),
        ("name: test", "name: ../../etc", 2, "letters, digits, `_ . -` and spaces only, not '../../etc'."),
        (
            "center: [0.5, 0.0, 1.0]",
            "center: [5, 0.0, 1.0]",
            5,
            "workspace [-1.6, -1.3, 0.2] to [1.6, 1.3, 1.8]; move the hoop.",
        ),
        ("[0.2, 0.2, 0.2]", "[0.2, -0.2, 0.2]", 5, "greater than 0"),
        ("center: [0.5, 0.0, 1.0]", "center: [0.5, .nan, 1.0]", 5, "finite"),
        ("center: [0.5, 0.0, 1.0]", "center: [0.5, true, 1.0]", 5, "hoops.a.center.1"),
        ("F a & G !b", "F a & G !c", 3, "'c' is not a name of this mission"),
        ("F a & G !b", "F a & & b", 3, "^"),
        ("F a & G !b", "X a", 3, "no next step"),
        ("[a, b]]", "[a, bb]]", 8, "Did you mean 'b'?"),
        ("[[robot, a]", "[[a, a]", 8, "joins two different"),
        ("initial: off", "initial: of", 9, "Did you mean 'off'?"),
        ("at: a}", "at: q}", 9, "robot.actions.0.at: 'q' is not a region"),
        ("on: [lit]", "on: [a]", 9, "both a region and an internal"),
        ("start: [1.2, 0.0, 0.8]", "start: [2.2, 0.0, 0.8]", 11, "outside the workspace"),
        ("start: [1.2, 0.0, 0.8]", "start: [0.7, 0.0, 1.0]", 11, "edge of 'a'"),
        ("start: [1.2, 0.0, 0.8]", "start: [0.5, 0.26, 1.0]", 11, "rim of 'a'"),
        ("start: [1.2, 0.8, 0.8]", "start: [1.2, 0.1, 0.8]", 12, "separation"),
        (
            "start: [1.2, 0.8, 0.8]",
            "start: [1.2, 0.4, 0.8]",
            12,
            "is 0.4000 m from quad0's start; 0.401 m is needed: separation",
        ),
        ("start: [1.2, 0.8, 0.8]", "start: [1.55, 0.8, 0.8]", 12, "from the workspace's wall; 0.0501 m is needed"),
        ("start: [1.2, 0.8, 0.8]", "start: [1.2, 0.8, 0.8], end: [1.57, 0.8, 0.8]", 12, "from the workspace's wall"),
        ("start: [1.2, 0.8, 0.8]", "start: [1.2, 0.8, 0.8], end: [-0.3, 0.5, 1.0]", 12, "edge of 'b'"),
        ("start: [1.2, 0.8, 0.8]", "start: [0.52, 0.0, 1.0]", 12, "0.020 m from the opening of 'a'"),
        ("crazyflie-2.1", "crazyflie-2.1\nseparation: 0.02", 14, "lets robots touch: two radii of 0.07 m"),
        ("crazyflie-2.1", "crazyflie-2.1\nseparation_z: 0.1", 14, "lets robots above each other touch: two radii"),
        ("crazyflie-2.1", "crazyflie-2.1\nseparation_z: 0", 14, "must be above 0 m"),
        ("crazyflie-2.1", "crazyfly-2.1", 13, "Did you mean 'crazyflie-2.1'?"),
        ("min: [-1.6,", "min: [2.6,", 14, "must be below max"),
        ("format: 1", "format: 2", 1, "format"),
        ("name: test", "name: ''", 2, "name"),
        ("name: test", "name: test\n7: lucky", 3, "7: a key must be text; put it in quotes."),
        ("  b: {center", "  b: {7: x, center", 7, "regions.b.7: a key must be text; put it in quotes."),
        ("opening: 0.25", "opening: 0.05", 5, "no wider than the vehicle"),
        ("opening: 0.25", "opening: 0.1", 5, "leaves no room"),
        ("  b: {center: [-0.5, 0.5, 1.0]", "  b: {center: [-0.5, 0.5, 2.0]", 7, "outside the workspace"),
    ],
)
def test_each_fault_is_named_with_line_and_key(old: str, new: str, line: int, says: str) -> None:
    assert old in GOOD
    message = faults(GOOD.replace(old, new, 1))
    assert f"test.yaml:{line}:" in message
    assert says in message


@pytest.mark.parametrize("name", ["F", "G", "U", "X", "xor", "V", "free"])
def test_operator_names_are_refused_as_regions(name: str) -> None:
    assert f"'{name}'" in faults(GOOD.replace("  b: {", f"  {name}: {{").replace("!b", "!a").replace("[a, b]", "[robot, a]"))


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("flight", "'flight' cannot name a robot: its trajectory would be flight.csv, which is the flight's log."),
        ("Flight", "'Flight' cannot name a robot"),
        ("QUAD0", "'QUAD0' and 'quad0' differ only in case"),
        ("con", "'con' is a device on Windows"),
        ("Lpt7", "'Lpt7' is a device on Windows"),
        ("q" * 101, "has 101 characters"),
        ("..", "'..' is no name"),
        ("a/b", "'a/b' is no name"),
        ("a.", "'a.' is no name"),
        ("'a '", "'a ' is no name"),
        ("quad1\u0301", "is no name"),
    ],
)
def test_robots_whose_files_would_be_somebody_elses_are_refused(name: str, says: str) -> None:
    message = faults(GOOD.replace("quad1:", f"{name}:"))
    assert "test.yaml:12:" in message
    assert says in message


@pytest.mark.parametrize("name", ["flights", "flight0", "cone", "com10", "_con", "q" * 100])
def test_other_names_like_them_are_fine(name: str) -> None:
    assert list(parse_mission(GOOD.replace("quad1:", f"{name}:")).agents) == ["quad0", name]


@pytest.mark.parametrize(
    ("name", "says"),
    [("a.", "ends with a dot or a space"), ("'a '", "ends with a dot or a space"), ("NUL", "device"), ("aux.run", "device")],
)
def test_missions_that_could_name_no_folder_are_refused(name: str, says: str) -> None:
    message = faults(GOOD.replace("name: test", f"name: {name}"))
    assert "test.yaml:2: name: " in message
    assert says in message
    assert "Value error" not in message


def test_all_faults_at_once() -> None:
    text = (
        GOOD.replace("radii: [0.2, 0.2, 0.2]", "raddii: [0.2, 0.2, 0.2]")
        .replace("!b", "!bb")
        .replace("vehicle: crazyflie-2.1", "vehicle: kite")
    )
    message = faults(text)
    for says in ("raddii", "'bb' is not a name", "'kite' is not a shipped vehicle", "hoops.a.radii: missing"):
        assert says in message


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "empty"),
        ("   \n# nothing\n", "table of keys"),
        ("[1, 2]", "table of keys"),
        ("just words", "table of keys"),
        ("a: [1, 2", "no YAML"),
        ("a: 1\na: 2\n", "duplicate"),
        ("a: &x 1\nb: *x\nname: !!python/object:os.system 1\n", "tags|unknown key"),
        ("? [1, 2]\n: 3\n", "key must be text|unknown key|table"),
        ("a: " + "[" * 5000, "nested|no YAML"),
        ("a: " + "{b: " * 400 + "1" + "}" * 400, "nested"),
        ("1: 2\n", "key must be text"),
        ("\x00", "YAML|mission"),
        ("a: 'open", "no YAML"),
        ("--- a\n--- b\n", "YAML|mission"),
    ],
)
def test_what_is_no_mission_gets_one_clear_message(text: str, says: str) -> None:
    import re

    assert re.search(says, faults(text)), faults(text)


def test_aliases_cannot_blow_up() -> None:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 12)]
    assert "too many" in faults("\n".join(lines))


def test_unreadable_files(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="cannot be read"):
        load_mission(tmp_path / "none.yaml")
    with pytest.raises(BadInput, match="folder"):
        load_mission(tmp_path)
    large = tmp_path / "large.yaml"
    large.write_bytes(b"#" * (MAX_BYTES + 1))
    with pytest.raises(BadInput, match="larger than"):
        load_mission(large)
    binary = tmp_path / "binary.yaml"
    binary.write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(BadInput, match="UTF-8"):
        load_mission(binary)


def test_a_team_that_flies_for_ever_has_no_end() -> None:
    endless = GOOD.replace("F a & G !b}", "G F a, trace: infinite}")
    assert parse_mission(endless).spec.trace == "infinite"
    ends = endless.replace("quad1: {start: [1.2, 0.8, 0.8]}", "quad1: {start: [1.2, 0.8, 0.8], end: [1.2, 0.8, 0.8]}")
    assert "never ends" in faults(ends)


def test_limits_only_tighten() -> None:
    assert "above the vehicle's own" in faults(GOOD + "limits: {speed: 99.0}\n")
    assert "cannot hold the vehicle's weight" in faults(GOOD + "limits: {thrust_max: 0.1}\n")
    assert "is not below the vehicle's weight" in faults(GOOD + "limits: {thrust_min: 0.4}\n")
    assert parse_mission(GOOD + "limits: {thrust_min: 0.2}\n").effective_limits.thrust_min == 0.2


def test_a_vehicle_that_cannot_hover_is_refused() -> None:
    inline = parse_mission(GOOD).vehicle.model_dump(exclude_none=True)
    inline["mass"] = 0.06
    text = GOOD.replace("vehicle: crazyflie-2.1", f"vehicle: {inline}".replace("(", "[").replace(")", "]"))
    assert "cannot hover" in faults(text)


def test_free_is_written_out() -> None:
    mission = parse_mission(GOOD.replace("F a & G !b", "(a | free) U b"))
    assert mission.formula.names() == {"a", "b"}


def test_a_missing_spec_and_sequence() -> None:
    assert "spec.formula, a sequence, or both" in faults(GOOD.replace("spec: {formula: F a & G !b}\n", ""))
    sequence = GOOD.replace("spec: {formula: F a & G !b}\n", "sequence: aF aR\n").replace(
        "  quad1: {start: [1.2, 0.8, 0.8]}\n", ""
    )
    assert isinstance(parse_mission(sequence), Mission)


def test_an_error_carries_its_faults() -> None:
    with pytest.raises(MissionError) as caught:
        parse_mission(GOOD.replace("F a & G !b", "F q"), "m.yaml")
    (fault,) = caught.value.faults
    assert fault.keys == ("spec", "formula")
    assert fault.line == 3


HOSTILE = {
    "merge": ("a: &x {b: 1}\nc: {<<: *x}\n", ":2: merge keys"),
    "merge list": ("a: &x {b: 1}\nc:\n  <<: [*x]\n", ":3: merge keys"),
    "table as a key": ("a: 1\n? {b: 1}\n", ":2: a key must be text"),
    "list as a key": ("a: 1\n? [b]\n: 2\n", ":2: a key must be text"),
    "omap": ("a: 1\nb: !!omap [c: 1]\n", ":2: YAML tags"),
    "set": ("a: !!set {x, y}\n", ":1: YAML tags"),
    "text by tag": ("name: !!str 5\n", ":1: YAML tags"),
    "anchor twice": ("a: &x 1\nb: &x 2\nc: *x\n", ":2: the anchor &x is set twice"),
    "digits": ("name: " + "1" * 5000 + "\n", ":1: a number of 5000 characters"),
    "hexadecimal": ("margin: 0x" + "f" * 380 + "\n", ":1: margin: a whole number beyond"),
    "brackets": ("[" * 20_000, ":1: this is nested too deeply"),
    "braces": ("a: " + "{b: " * 20_000, ":1: this is nested too deeply"),
    "indented": ("".join(" " * depth + "a:\n" for depth in range(900)), "nested too deeply"),
    "long": ("name: " + "a" * 200_000, "a text or number of 200000 characters"),
}


@pytest.mark.parametrize("name", list(HOSTILE))
def test_hostile_yaml_ends_in_one_sentence(name):
    text, says = HOSTILE[name]
    with pytest.raises(BadInput, match=says) as caught:
        parse_mission(text)
    assert len(str(caught.value)) < 400
    assert "set_int_max_str_digits" not in str(caught.value)


MANY = {"values": ("a: [", "1, "), "aliases": ("a: &x 1\nb: [", "*x, ")}


@pytest.mark.parametrize("most", [1_000, pytest.param(strict_yaml.MAX_NODES, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", MANY)
def test_a_file_of_too_many_values_ends_in_one_sentence(name, most, monkeypatch):
    monkeypatch.setattr(strict_yaml, "MAX_NODES", most)
    begins, each = MANY[name]
    with pytest.raises(BadInput, match=f"too long for a mission: more than {most} keys and values") as caught:
        parse_mission(begins + each * (most + most // 5) + "]")
    assert len(str(caught.value)) < 400


@pytest.mark.parametrize(
    ("far", "accepted"), [(1000.0, True), (1023.9, True), (1024.0, False), (-1024.0, False), (5e6, False), (1e300, False)]
)
def test_a_workspace_where_float32_is_coarse_is_refused(far, accepted):
    old, new = ("1.3, 1.8]", f"{far!r}, 1.8]") if far > 0 else ("min: [-1.6", f"min: [{far!r}")
    text = GOOD.replace(old, new)
    assert text != GOOD
    if accepted:
        assert parse_mission(text).workspace.max[1] == far
        return
    with pytest.raises(BadInput, match=r"workspace\.(min|max): .* Use local coordinates"):
        parse_mission(text)


@pytest.mark.parametrize("text", ['a: "\\ud83d"', '{"\\udc00": 1}', 'a: "\\ud83d\\ude81"'])
def test_halves_of_surrogate_pairs_are_no_characters(text: str) -> None:
    with pytest.raises(MissionError, match="half of a surrogate pair"):
        parse_mission(text)
