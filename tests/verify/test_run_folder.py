import json
import math
import os
import re
import shutil

import numpy as np
import pytest

from tests.helpers.few import few_of
from tests.helpers.motion.flights import firefighting, legs, plan_of, small_mission
from verify import certify, recheck
from verify.certificate import payload_digest
from verify.certificate_file import certificate_from_json
from verify.data.errors import BadInput, LtlplanError, NotCertified
from verify.data.files.mission_file import mission_to_yaml
from verify.data.files.trajectory_csv import HEADER, load_csv, read_csv, write_csv
from verify.data.plan import Visit
from verify.data.trajectory import Trajectory
from verify.run_folder import read_folder

BALL = "a: {center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}"


def write_folder(folder, plan, team, certificate, laps=1):
    folder.mkdir(exist_ok=True)
    (folder / "mission.yaml").write_text(mission_to_yaml(plan.mission))
    (folder / "plan.json").write_text(plan.to_json())
    for name, trajectory in team.items():
        (folder / f"{name}.csv").write_text(write_csv(trajectory, laps))
    (folder / "certificate.json").write_text(certificate.to_json())
    return folder


@pytest.fixture(scope="module")
def fire():
    plan, team = firefighting()
    return plan, team, certify(plan, team)


@pytest.fixture(scope="module")
def small():
    mission = small_mission("F a", regions=BALL, margin=0.01)
    plan = plan_of(mission, {"r0": [Visit(region="a")]})
    team = {"r0": legs([[0, 0, 1], [1, 0, 1]])}
    return plan, team, certify(plan, team)


@pytest.fixture
def folder(tmp_path, small):
    return write_folder(tmp_path / "out", *small)


def test_a_folder_is_proved_again(tmp_path, fire):
    plan, team, certificate = fire
    out = write_folder(tmp_path / "out", plan, team, certificate)
    again = recheck(out)
    assert again.digest() == certificate.digest()
    assert again.covers(team)
    read_plan, read_team = read_folder(out)
    assert read_plan.digest() == plan.digest()
    assert read_team == team


def test_a_lasso_is_proved_again_from_its_laps(tmp_path):
    mission = small_mission("G F a", regions=BALL, trace="infinite", margin=0.01)
    mission = mission.model_copy(update={"spec": mission.spec.model_copy(update={"repeat": 3})})
    plan = plan_of(mission, {"r0": [Visit(region="a")]})
    robot = plan.robots["r0"].model_copy(update={"cycle_visit": 0, "cycle_waypoint": 1})
    plan = plan.model_copy(update={"robots": {"r0": robot}})
    team = {"r0": legs([[0, 0, 1], [0, 1, 1], [1, 0, 1], [0, 1, 1]], cycle=1)}
    certificate = certify(plan, team)
    out = write_folder(tmp_path / "out", plan, team, certificate, laps=3)
    assert len(load_csv(out / "r0.csv")) == 7
    assert recheck(out).digest() == certificate.digest()
    assert read_folder(out)[1] == team
    lines = (out / "r0.csv").read_text().splitlines(keepends=True)
    (out / "r0.csv").write_text("".join(lines[:-2]))
    with pytest.raises(NotCertified, match=r"r0\.csv was changed"):
        recheck(out)
    with pytest.raises(BadInput, match="cycle"):
        read_folder(out)


@pytest.mark.parametrize("name", ["hover", "elsewhere", "moving", "turned", "a little off"])
def test_a_second_piece_that_was_not_certified_is_refused(folder, small, name):
    path = small[1]["r0"]
    second = np.zeros((1, 4, 8))
    second[0, :3, 0] = np.float32(path.evaluate(path.duration)[:3])
    axis, power, value = {
        "hover": (3, 0, 0.0),
        "elsewhere": (0, 0, 2.0),
        "moving": (0, 4, 50.0),
        "turned": (3, 0, 0.1),
        "a little off": (1, 0, 1e-5),
    }[name]
    second[0, axis, power] = np.float32(value)
    longer = Trajectory(np.append(path.durations, 1.0), np.concatenate([path.coefficients, second]))
    (folder / "r0.csv").write_text(write_csv(longer))
    with pytest.raises(NotCertified, match=r"r0\.csv was changed"):
        recheck(folder)


@pytest.mark.parametrize("name", ["r0.csv", "certificate.json"])
def test_a_pipe_is_not_waited_for(folder, name):
    (folder / name).unlink()
    os.mkfifo(folder / name)
    with pytest.raises(BadInput, match="no file"):
        recheck(folder)


def test_a_number_of_thousands_of_digits_is_bad_input(folder):
    for name in ("plan.json", "certificate.json"):
        whole = (folder / name).read_text()
        number = json.loads(whole)["format"]
        (folder / name).write_text(whole.replace(f'"format": {number}', '"format": ' + "1" * 5000))
        with pytest.raises(BadInput, match="no JSON"):
            recheck(folder)
        (folder / name).write_text(whole)


@pytest.mark.parametrize("name", ["mission.yaml", "plan.json", "r0.csv", "certificate.json"])
def test_a_missing_file_is_named(folder, name):
    (folder / name).unlink()
    with pytest.raises(BadInput, match=name.replace(".", r"\.")):
        recheck(folder)


def change(folder, name, old, new):
    text = (folder / name).read_text()
    assert old in text
    (folder / name).write_text(text.replace(old, new, 1))


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("mission.yaml", "margin: 0.01", "margin: 0.02"),
        ("mission.yaml", "F a", "G a"),
        ("mission.yaml", "name: small", "name: large"),
        ("plan.json", '"seed": 0', '"seed": 1'),
        ("plan.json", '"method": "exact"', '"method": "mtac-e"'),
        ("r0.csv", "duration", "duration"),
    ],
)
def test_the_changed_file_is_named(folder, name, old, new):
    if name == "r0.csv":
        path = load_csv(folder / name)
        values = path.coefficients.copy()
        values[0, 0, 7] = np.nextafter(np.float32(values[0, 0, 7]), np.float32(9))
        (folder / name).write_text(write_csv(Trajectory(path.durations, values)))
    else:
        change(folder, name, old, new)
    with pytest.raises(NotCertified, match=name.replace(".", r"\.") + " was changed"):
        recheck(folder)


def edits():
    def put(data, path, value):
        for key in path[:-1]:
            data = data[key]
        data[path[-1]] = value

    paths = {
        "margin up": (["margin"], 0.2),
        "margin a little": (["margin"], 0.011),
        "largest margin": (["largest_margin"], 1.0),
        "no largest margin": (["largest_margin"], None),
        "duration": (["duration"], 99.0),
        "verdict": (["claims", 0, "verdict"], "fails"),
        "bound": (["claims", -1, "bound"], 1.0),
        "limit": (["claims", -1, "limit"], 1.0),
        "sentence": (["claims", 0, "sentence"], "All is well."),
        "robot": (["claims", 1, "robot"], "r1"),
        "time": (["claims", -1, "time"], 0.123),
        "digest": (["digest"], "0" * 64),
        "trajectory": (["trajectories", "r0", "digest"], "0" * 64),
        "cycle": (["trajectories", "r0", "cycle"], 0),
        "mission": (["mission"], "0" * 64),
        "plan": (["plan"], "0" * 64),
        "no claims": (["claims"], []),
        "action": (["actions"], [{"robot": "r0", "visit": 0, "time": 1.0, "source": "idle", "target": "idle"}]),
        "robots": (["trajectories"], {}),
        "clock error": (["clock_error"], 0.25),
    }
    return {name: (lambda d, p=path, v=value: put(d, p, v)) for name, (path, value) in paths.items()}


@few_of(4, "name", list(edits()))
def test_a_hand_edited_certificate_is_refused(folder, name):
    path = folder / "certificate.json"
    data = json.loads(path.read_text())
    edits()[name](data)
    path.write_text(json.dumps(data))
    with pytest.raises(NotCertified):
        recheck(folder)


def test_an_edit_with_its_digest_made_anew_is_refused(folder):
    path = folder / "certificate.json"
    for name, edit in edits().items():
        if name in ("digest", "trajectory", "mission", "plan", "robots", "cycle"):
            continue
        data = json.loads(path.read_text())
        edit(data)
        data["digest"] = payload_digest({k: v for k, v in data.items() if k != "digest"})
        other = folder.parent / f"copy-{name.replace(' ', '-')}"
        shutil.copytree(folder, other)
        (other / "certificate.json").write_text(json.dumps(data))
        if name == "clock error":  # one robot has no other's clock to differ from: proved as written
            assert recheck(other).clock_error == 0.25
            continue
        with pytest.raises(NotCertified):
            recheck(other)


def test_a_forged_sentence_is_refused_whatever_versions_are_named(folder):
    path = folder / "certificate.json"
    for sentence, accepted in ((None, True), ("All is well, and {}", False), ("{}9", False)):
        data = json.loads(path.read_text())
        data["versions"] = {"ltlplan": "0.0.1"}
        if sentence is not None:
            data["claims"][-1]["sentence"] = sentence.format(data["claims"][-1]["sentence"])
        data["digest"] = payload_digest({k: v for k, v in data.items() if k != "digest"})
        other = folder.parent / f"copy-{len(sentence or '')}"
        shutil.copytree(folder, other)
        (other / "certificate.json").write_text(json.dumps(data))
        if accepted:
            assert recheck(other).holds
            continue
        with pytest.raises(NotCertified, match="its sentence is not the one that is proved"):
            recheck(other)


@few_of(1, "name", ["limits.speed", "limits.yaw_rate"])  # 0.98438 m/s, 7.7505e-290 rad/s
@pytest.mark.parametrize(("places", "accepted"), [(-2, False), (-1, True), (0, True), (1, True), (2, False)])
def test_a_sentence_may_differ_by_one_last_place_as_other_machines_round(folder, name, places, accepted):
    path = folder / "certificate.json"
    data = json.loads(path.read_text())
    (claim,) = (claim for claim in data["claims"] if claim["name"] == name)
    before, digits, after = re.split(r"(?<=\.)(\d+)", claim["sentence"], maxsplit=1)
    claim["sentence"] = f"{before}{int(digits) + places:0{len(digits)}d}{after}"
    data["digest"] = payload_digest({k: v for k, v in data.items() if k != "digest"})
    path.write_text(json.dumps(data))
    if accepted:
        assert recheck(folder).holds
        return
    with pytest.raises(NotCertified, match="its sentence is not the one that is proved"):
        recheck(folder)


def test_a_sentences_whole_numbers_are_not_rounded(folder):
    path = folder / "certificate.json"
    for old, new in (("1 planned", "2 planned"), ("(limit 2)", "(limit 3)"), ("r0", "r1")):
        data = json.loads(path.read_text())
        claim = next(claim for claim in data["claims"] if old in claim["sentence"])
        claim["sentence"] = claim["sentence"].replace(old, new, 1)
        data["digest"] = payload_digest({k: v for k, v in data.items() if k != "digest"})
        other = folder.parent / f"copy-{new[0]}{len(new)}"
        shutil.copytree(folder, other)
        (other / "certificate.json").write_text(json.dumps(data))
        with pytest.raises(NotCertified, match="its sentence is not the one that is proved"):
            recheck(other)


HOSTILE = {
    "empty": "",
    "no json": "certified!",
    "cut": '{"format": 2, "margin": 0.0',
    "list": "[]",
    "number": "1",
    "null": "null",
    "no format": "{}",
    "later format": '{"format": 3}',
    "much later": '{"format": 99999999999999999999999}',
    "format as text": '{"format": "2"}',
    "format true": '{"format": true}',
    "no such format": '{"format": 0}',
    "NaN": '{"format": 2, "margin": NaN}',
    "infinity": '{"format": 2, "margin": Infinity}',
    "deep": "[" * 100_000,
    "key twice": '{"format": 2, "format": 2}',
    "only format": '{"format": 2}',
    "bytes": "\udcff\udcfe",
    "huge number": '{"format": 2, "margin": 1e999}',
}


def test_a_certificate_of_an_earlier_format_is_to_be_made_again(folder):
    path = folder / "certificate.json"
    data = {**json.loads(path.read_text()), "format": 1}
    data["digest"] = payload_digest({k: v for k, v in data.items() if k != "digest"})
    path.write_text(json.dumps(data))
    with pytest.raises(
        BadInput, match="earlier version of ltlplan, whose sentences can mean something else; certify the folder again"
    ):
        recheck(folder)
    plan, team = read_folder(folder)
    path.write_text(certify(plan, team, margin=data["margin"], clock_error=data["clock_error"]).to_json())
    assert recheck(folder).format == 2


@pytest.mark.parametrize("name", list(HOSTILE))
def test_hostile_certificates_are_bad_input(folder, name):
    (folder / "certificate.json").write_bytes(HOSTILE[name].encode("utf-8", "surrogateescape"))
    with pytest.raises(BadInput):
        recheck(folder)


@few_of(
    10,
    ("key", "value"),
    [
        ("margin", -1), ("margin", "0.01"), ("margin", True), ("margin", None), ("margin", 10**400), ("claims", {}),
        ("claims", [1]), ("claims", None), ("trajectories", []), ("trajectories", {"r0": "x"}),
        ("trajectories", {"r0": {"digest": 1, "cycle": None}}), ("trajectories", {"r0": {"digest": "x", "cycle": -1}}),
        ("trajectories", {"r0": {"digest": "x", "cycle": 1.5}}), ("versions", None), ("actions", "none"), ("duration", []),
        ("actions", [{}]), ("actions", [{"robot": "r0"}]), ("versions", {"numpy": [[]]}), ("mission", None), ("digest", 5), ("largest_margin", "big"), ("extra", 1), ("clock_error", -0.5),
    ],
)  # fmt: skip
def test_certificates_of_the_wrong_shape_are_bad_input(folder, key, value):
    path = folder / "certificate.json"
    data = json.loads(path.read_text())
    data[key] = value
    path.write_text(json.dumps(data))
    with pytest.raises(BadInput, match=r"certificate\.json"):
        recheck(folder)
    if key != "extra":
        del data[key]
        with pytest.raises(BadInput, match=key):
            certificate_from_json(json.dumps(data))


@few_of(1, "count", [5, 12])
def test_every_truncation_of_every_file_is_refused_without_a_traceback(folder, count):
    rng = np.random.default_rng(0)
    for name in ("mission.yaml", "plan.json", "r0.csv", "certificate.json"):
        whole = (folder / name).read_bytes()
        for cut in rng.integers(0, len(whole) - 1, count).tolist():
            (folder / name).write_bytes(whole[:cut])
            try:
                recheck(folder)
            except LtlplanError:
                pass
            else:  # only white space or an untouched last digit may be missing
                assert whole[cut:].strip() in (b"", b"}") or name in ("r0.csv", "mission.yaml")
                assert name != "mission.yaml" or recheck(folder).holds
        (folder / name).write_bytes(whole)
    assert recheck(folder).holds


@few_of(1, "count", [3, 15])
def test_every_flipped_byte_is_refused_or_harmless(folder, small, count):
    rng = np.random.default_rng(1)
    digest = small[2].digest()
    for name in ("plan.json", "r0.csv", "certificate.json"):
        whole = (folder / name).read_bytes()
        for at in rng.integers(0, len(whole), count).tolist():
            changed = bytearray(whole)
            changed[at] ^= 1 << int(rng.integers(0, 7))
            (folder / name).write_bytes(bytes(changed))
            try:
                again = recheck(folder)
            except LtlplanError:
                continue
            assert again.digest() == digest  # white space, or a digit beyond float32
        (folder / name).write_bytes(whole)


def test_a_folder_that_is_not_certified_says_which_claim(tmp_path, small):
    plan, _, certificate = small
    away = {"r0": legs([[0, 0, 1], [0, 1, 1]])}
    out = write_folder(tmp_path / "out", plan, away, certificate)
    data = json.loads((out / "certificate.json").read_text())
    data["trajectories"]["r0"]["digest"] = away["r0"].digest()
    (out / "certificate.json").write_text(json.dumps(data))
    with pytest.raises(NotCertified, match="not proved") as caught:
        recheck(out)
    assert {w.claim for w in caught.value.witnesses} >= {"formula", "visits"}


# The CSV.


def test_csv_keeps_every_bit():
    rng = np.random.default_rng(2)
    for _ in range(20):
        values = rng.normal(size=(5, 4, 8)) * 10.0 ** rng.integers(-30, 30, (5, 4, 8))
        durations = rng.uniform(0.01, 100, 5)
        path = Trajectory(durations.astype(np.float32), values.astype(np.float32))
        assert read_csv(write_csv(path)) == path
    assert write_csv(path).splitlines()[0] == ",".join(HEADER)
    assert len(HEADER) == 33
    with pytest.raises(BadInput, match="float32"):
        write_csv(Trajectory([0.1], np.zeros((1, 4, 8))))


def test_the_largest_float32_is_read_back():
    """Its nine digits are a little more than it is."""
    largest = float(np.finfo(np.float32).max)
    assert f"{largest:.9g}" == "3.40282347e+38"
    text = GOOD + row(**{"x^7": f"{largest:.9g}", "y^7": f"{-largest:.9g}"}) + "\n"
    path = read_csv(text)
    assert (path.coefficients[0, 0, 7], path.coefficients[0, 1, 7]) == (largest, -largest)
    assert read_csv(write_csv(path)) == path


def row(**cells):
    values = dict.fromkeys(HEADER, "0") | {"duration": "1"} | cells
    return ",".join(values[name] for name in HEADER)


GOOD = ",".join(HEADER) + "\n"


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "header"),
        ("x,y\n", "header"),
        (GOOD, "no pieces"),
        (GOOD + row() + ",0\n", "34 columns"),
        (GOOD + "1,2,3\n", "3 columns"),
        (GOOD + row(**{"x^3": "nan"}), r":2: x\^3"),
        (GOOD + row(**{"x^3": "inf"}), "finite"),
        (GOOD + row(**{"yaw^7": "1e39"}), "float32"),
        (GOOD + row(**{"y^0": ""}), "finite"),
        (GOOD + row(**{"y^0": "0x10"}), "finite"),
        (GOOD + row(**{"y^0": "1_0"}), "finite"),
        (GOOD + row(**{"y^0": "١"}), "finite"),
        (GOOD + row(duration="0"), "positive"),
        (GOOD + row(duration="-1"), "positive"),
        (GOOD + row(duration="1e-60"), "positive"),
        (GOOD + (row() + "\n") * 10_000, "more than 4096"),
        (GOOD + row() + "\0", "NUL"),
        (GOOD + '"' + row(), "CSV"),
        (GOOD + row(**{"y^0": '"1"2'}), "CSV"),
        ("x" * 5_000_000, "larger"),
    ],
)
def test_bad_csv_is_bad_input(text, why):
    with pytest.raises(BadInput, match=why):
        read_csv(text, "quad0.csv")


def test_unreadable_files_are_bad_input(tmp_path):
    (tmp_path / "a.csv").write_bytes(b"\xff\xfe")
    with pytest.raises(BadInput, match="UTF-8"):
        load_csv(tmp_path / "a.csv")
    with pytest.raises(BadInput, match="cannot be read"):
        load_csv(tmp_path)
    assert math.isclose(load_and_back(tmp_path), 1.0)


def load_and_back(folder):
    (folder / "b.csv").write_text("\ufeff" + GOOD + row() + "\n\n")
    return load_csv(folder / "b.csv").duration


def test_a_folder_without_a_certificate_is_named(tmp_path):
    with pytest.raises(BadInput, match=r"has no certificate.json; name a folder"):
        recheck(tmp_path)
    with pytest.raises(BadInput, match=r"absent is no folder"):
        recheck(tmp_path / "absent")
    with pytest.raises(BadInput, match=r"has no mission.yaml; name a folder"):
        read_folder(tmp_path)
