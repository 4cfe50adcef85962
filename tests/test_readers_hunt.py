"""The hunt: valid files are read as they are meant, and no mutant of one crashes, hangs or gets a false verdict."""

from __future__ import annotations

import csv
import io
import json
import math
import shutil
from collections import Counter
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from ruamel.yaml import YAML

import flight
from flight.logs.tables import log_from_csv
from tests.helpers.few import few_of, given_few
from tests.helpers.motion import dense_sampler
from tests.helpers.motion.flights import legs, plan_of, small_mission
from tests.helpers.motion.stand_ins import flight as made_flight
from tests.helpers.motion.stand_ins import stand_in
from tests.strategies.files import Recorded, certificates, missions, plans, recordings, trajectories
from tests.strategies.mutants import mutated_bytes, mutated_json, no_hang
from tests.verify.data.files.test_mission_file import GOOD
from tests.verify.test_run_folder import write_folder
from verify import certify, recheck
from verify.certificate import payload_digest
from verify.certificate_file import certificate_from_json
from verify.data import LtlplanError, Mission, Plan, Trajectory, Word, mission_to_yaml, parse_mission
from verify.data.files.trajectory_csv import read_csv, write_csv
from verify.data.plan import Visit, plan_from_json
from verify.recordings.flight_log import read_flight_log

REGIONS = "a: {center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}\nb: {center: [-1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}"


@given(recordings())
def test_recordings_are_read_as_the_numbers_that_stand_there(tmp_path_factory: pytest.TempPathFactory, table: Recorded) -> None:
    path = tmp_path_factory.getbasetemp() / "recording.csv"
    path.write_text(table.text)
    found = flight.read_recording(path, table.robots)
    assert found.times.tolist() == [float(time) for time in table.times]
    for j, robot in enumerate(table.robots):
        for place, true in zip(found.position[:, j], table.positions[robot], strict=True):
            assert np.all(np.isnan(place)) if true is None else place.tolist() == [float(x) for x in true]


@given_few(10, 60, trajectories())
def test_trajectories_are_read_to_the_last_bit(path: Trajectory) -> None:
    assert read_csv(write_csv(path)) == path


@given_few(1, 40, plans())
def test_plans_are_read_as_they_were_written(plan: Plan) -> None:
    read = plan_from_json(plan.to_json(), plan.mission)
    assert read == plan
    assert read.digest() == plan.digest()


@given_few(2, 25, missions())
def test_missions_are_read_as_they_were_written(mission: Mission) -> None:
    assert parse_mission(mission_to_yaml(mission)).digest() == mission.digest()


@given_few(10, 60, certificates())
def test_certificates_are_read_as_they_were_written(data: dict[str, Any]) -> None:
    assert certificate_from_json(json.dumps(data)) == data


class Seeds:
    """Valid files, and the reader of each: returns what it read of a mutant."""

    def __init__(self, folder: Path) -> None:
        mission = small_mission("F a & G !b", margin=0.01, regions=REGIONS, starts=((0.0, 0.0, 1.0), (0.0, 1.0, 1.0)))
        self.plan = plan_of(mission, {"r0": [Visit(region="a")]}, {"r0": Word.of([[], ["a"]])})
        self.team = {"r0": legs([[0, 0, 1], [0.5, 0.2, 1], [1, 0, 1]]), "r1": legs([[0, 1, 1]])}
        self.folder = write_folder(folder / "valid", self.plan, self.team, certify(self.plan, self.team))
        _, flown = made_flight()
        log = flight.fly(*self._flown(), seed=1)
        table = "t,r0.x,r0.y,r0.z,r1_x,r1_y,r1_z\n" + "".join(f"{i / 10},{i / 20},0,1,{i / 30:.4f},1,1\n" for i in range(8))
        long = "time_ns,robot,x_mm,y_mm,z_mm\n" + "".join(f"{10**18 + i},{r},{i},2,3\n" for i in range(6) for r in ("r0", "r1"))
        ours = "t,robot,x,y,z,letter\n" + "".join(
            f"{i / 10},{r},{i / 20},0,1,{'a' * (i > 6)}\n" for i in range(9) for r in ("r0", "r1")
        )
        self.path = folder / "mutant.csv"
        (folder / "log.parquet").unlink(missing_ok=True)
        self.parquet = flight.write_log(log, folder / "log.parquet").read_bytes()
        del flown
        bytes_of: dict[str, bytes] = {name.name: name.read_bytes() for name in self.folder.iterdir()}
        self.files: dict[str, tuple[bytes, Callable[[bytes, Random], bytes], Callable[[bytes], Any], int]] = {
            # name: bytes, how it is mutated, who reads it, its share of the mutants
            "mission": (bytes_of["mission.yaml"], mutated_bytes, self._mission, 2),
            "mission by hand": (BY_HAND.encode(), mutated_bytes, self._mission, 3),
            "plan": (bytes_of["plan.json"], mutated_json, lambda data: plan_from_json(_text(data), mission), 10),
            "certificate": (bytes_of["certificate.json"], mutated_json, certificate_from_json, 10),
            "trajectory": (bytes_of["r0.csv"], mutated_bytes, lambda data: read_csv(_text(data)), 10),
            "wide recording": (table.encode(), mutated_bytes, self._recording, 10),
            "long recording": (long.encode(), mutated_bytes, self._recording, 10),
            "our recording": (ours.encode(), mutated_bytes, lambda data: read_flight_log(_text(data), "log", mission), 10),
            "log": (
                "".join(log.to_csv().splitlines(keepends=True)[:9]).encode(),
                mutated_bytes,
                lambda data: log_from_csv(_text(data)),
                10,
            ),
            "parquet": (self.parquet, mutated_bytes, self._parquet, 1),
        }

    def _flown(self) -> tuple[Any, Any, Any]:
        plan, team = made_flight()
        return plan, team, stand_in(plan, team)

    def _mission(self, data: bytes) -> Mission:
        return parse_mission(_text(data))

    def _recording(self, data: bytes) -> flight.Recording:
        self.path.write_bytes(data)
        return flight.read_recording(self.path, ("r0", "r1"))

    def _parquet(self, data: bytes) -> flight.FlightLog:
        self.path.with_suffix(".parquet").write_bytes(data)
        return flight.read_log(self.path.with_suffix(".parquet"))


BY_HAND = "".join(line for line in GOOD.splitlines(keepends=True) if not line.startswith(("robot:", "  quad1:")))


def _text(data: bytes) -> str:
    """As files are decoded; what is no UTF-8 is refused before any reader sees it."""
    from verify.data.storage.safe_reading import decoded

    return decoded(data, "mutant", "file")


@pytest.fixture(scope="module")
def seeds(tmp_path_factory: pytest.TempPathFactory) -> Seeds:
    return Seeds(tmp_path_factory.mktemp("seeds"))


def hunt(seeds: Seeds, count: int, seed: int) -> Counter[str]:
    """Read that many mutants; every one must be read or refused in words. Returns how many of each were read."""
    rng, read = Random(seed), Counter[str]()
    names = [name for name, (_, _, _, share) in seeds.files.items() for _ in range(share)]
    for number in range(count):
        name = names[number % len(names)]
        whole, mutate, reader, _ = seeds.files[name]
        data = mutate(whole, rng)
        try:
            with no_hang():
                found = reader(data)
        except LtlplanError as error:
            _readable(str(error))
        except BaseException as error:
            raise AssertionError(f"{name}: {type(error).__name__}: {error} of {data[:3000]!r}") from error
        else:
            read[name] += 1
            _same_to_another_reader(name, data, found)
    return read


def _readable(sentence: str) -> None:
    assert sentence
    assert len(sentence) < 20_000
    assert "set_int_max_str_digits" not in sentence
    assert sentence.encode()


def _same_to_another_reader(name: str, data: bytes, found: Any) -> None:
    """Hold what was read of a mutant against the standard library's readers."""
    text = "" if name == "parquet" else data.decode("utf-8-sig")
    if name == "certificate":
        assert found == json.loads(text)
    elif name == "plan":
        visits = {
            robot: [visit["region"] for visit in entry["visits"]]
            for robot, entry in json.loads(text)["robots"].items()
            if "visits" in entry
        }
        assert all(visits.get(robot, []) == [v.region for v in own.visits] for robot, own in found.robots.items())
    elif name == "trajectory":
        rows = [row for row in csv.reader(io.StringIO(text, newline="")) if row][1:]
        table = np.array([[np.float32(float(cell)) for cell in row] for row in rows], dtype=float)
        assert np.array_equal(np.column_stack([found.durations, found.coefficients.reshape(len(found), -1)]), table)
    elif name in ("our recording", "wide recording", "long recording"):
        _same_recording(name, text, found)


def _same_recording(name: str, text: str, found: Any) -> None:
    lines = [
        line
        for line in csv.reader(io.StringIO(text, newline=""))
        if line and not (name != "our recording" and line[0].startswith("#"))
    ]
    header, rows = [cell.strip() for cell in lines[0]], lines[1:]
    assert len({len(row) for row in lines}) == 1
    clock = next(i for i, cell in enumerate(header) if cell.lower() in ("t", "time_ns", "time"))
    unit = Fraction(1, 10**9) if header[clock].lower() == "time_ns" else Fraction(1)
    robot = header.index("robot") if "robot" in header else None
    own = rows if robot is None else [row for row in rows if row[robot].strip() in ("r0", "r1")]
    times = sorted({Fraction(row[clock].strip()) for row in own})
    first = Fraction(0) if name == "our recording" else times[0]  # our own are on the clock of their flight
    assert found.times.tolist() == [float((time - first) * unit) for time in times]
    if robot is not None:
        assert len({(Fraction(row[clock].strip()), row[robot].strip()) for row in own}) == len(own)


@pytest.mark.parametrize("count", [90, pytest.param(900, marks=pytest.mark.slow)])
def test_no_mutant_crashes_a_reader(seeds: Seeds, count: int) -> None:
    read = hunt(seeds, count, seed=0)
    assert sum(read.values()) > count / 30  # some are harmless, or the hunt would show nothing


@pytest.mark.slow
def test_a_hundred_thousand_mutants_crash_no_reader(seeds: Seeds) -> None:
    read = hunt(seeds, 100_000, seed=1)
    assert all(read[name] for name in seeds.files if name != "parquet")


FILES = ("mission.yaml", "plan.json", "r0.csv", "r1.csv", "certificate.json")


def meaning(folder: Path) -> dict[str, Any]:
    """What a folder says, read by others than the project: YAML, JSON and CSV of libraries, numbers as float32."""
    plan = json.loads((folder / "plan.json").read_text())
    tables = {}
    for name in ("r0", "r1"):
        with (folder / f"{name}.csv").open(newline="", encoding="utf-8-sig") as file:
            tables[name] = [[float(np.float32(float(cell))) for cell in row] for row in list(csv.reader(file))[1:] if row]
    return {
        "mission": YAML(typ="safe", pure=True).load((folder / "mission.yaml").read_text(encoding="utf-8-sig")),
        "plan": plan,
        "tables": tables,
        "certificate": {
            k: v for k, v in json.loads((folder / "certificate.json").read_text()).items() if k not in ("versions", "digest")
        },
    }


def agree(a: Any, b: Any) -> bool:
    if isinstance(a, str) and isinstance(b, str):
        return a == b or sorted(c for c in a if not c.isdigit()) == sorted(c for c in b if not c.isdigit())
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(agree(a[key], b[key]) for key in a)
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(map(agree, a, b))
    if isinstance(a, bool) or isinstance(b, bool) or a is None or b is None or isinstance(a, str) or isinstance(b, str):
        return a is b or a == b
    return math.isclose(a, b, rel_tol=2e-6, abs_tol=2e-6)


def only(a: Any, b: Any) -> Any:
    """Return `a` without the keys that `b` leaves out."""
    if isinstance(a, dict) and isinstance(b, dict):
        return {key: only(value, b[key]) for key, value in a.items() if key in b}
    if isinstance(a, list) and isinstance(b, list) and len(a) == len(b):
        return [only(x, y) for x, y in zip(a, b, strict=True)]
    return a


def forge(folder: Path) -> None:
    """Make all digests anew, as anybody can, where the files can be read at all."""
    try:
        mission = parse_mission((folder / "mission.yaml").read_text())
        plan = plan_from_json((folder / "plan.json").read_text(), mission)
        data = json.loads((folder / "certificate.json").read_text())
        data["mission"], data["plan"] = mission.digest(), plan.digest()
        for name in ("r0", "r1"):
            data["trajectories"][name]["digest"] = read_csv((folder / f"{name}.csv").read_text()).digest()
        data["digest"] = payload_digest({key: value for key, value in data.items() if key != "digest"})
        (folder / "certificate.json").write_text(json.dumps(data))
    except (LtlplanError, ValueError, KeyError, TypeError):
        return


def sampled_claims(folder: Path, margin: float) -> None:
    """Assert densely sampled what an accepted folder claims of its paths: visits, regions kept out of, walls, separation, limits."""
    mission = parse_mission((folder / "mission.yaml").read_text(encoding="utf-8-sig")).resolved()  # with defaults for lost keys
    for name in ("r0", "r1"):  # headers may have white space or a byte order mark, which the sampler does not know
        lines = (folder / f"{name}.csv").read_text(encoding="utf-8-sig").replace("\ufeff", "").splitlines()
        (folder / f"{name}.csv").write_text("\n".join(["".join(lines[0].split()), *(line for line in lines[1:] if line), ""]))
    ends = [dense_sampler.read_flight(folder / f"{name}.csv", 200.0).t[-1] for name in ("r0", "r1")]
    flights = {name: dense_sampler.read_flight(folder / f"{name}.csv", 200.0, max(ends) + 0.01) for name in ("r0", "r1")}
    regions = dense_sampler.regions_of(mission)
    planned = json.loads((folder / "plan.json").read_text())["robots"]
    for name, flown in flights.items():
        points, slack = flown.d[0][:, :3], 1e-6
        low, high = (np.array(mission["workspace"][key]) for key in ("min", "max"))
        assert np.all(points >= low + margin - slack)
        assert np.all(points <= high - margin + slack)
        visited = {visit["region"] for visit in planned[name].get("visits", ())}
        for region, ball in regions.items():
            closest = float(np.sqrt(np.min(dense_sampler.level(ball, points))))
            radius = min(ball["radii"])
            if region in visited:
                assert closest <= 1 - margin / radius + 1e-3
            else:
                assert closest > 1 + margin / max(ball["radii"]) - 1e-3
        assert np.max(dense_sampler.quantities(mission, flown)["speed"]) <= mission["vehicle"]["speed"] + 1e-6
    at = np.arange(0, max(ends), 0.005)
    place = {n: np.stack([np.interp(at, f.t, f.d[0][:, axis]) for axis in range(3)], axis=1) for n, f in flights.items()}
    apart = float(np.min(np.linalg.norm(place["r0"] - place["r1"], axis=1)))
    assert apart >= mission["separation"] + 2 * margin - 1e-3


def hunt_folders(seeds: Seeds, place: Path, count: int, seed: int) -> tuple[int, int]:
    """Prove mutated folders again; return how many were accepted as they were, and how many with digests made anew."""
    rng, accepted = Random(seed), [0, 0]
    true = meaning(seeds.folder)
    sampled_claims(seeds.folder, 0.01)
    for number in range(count):
        shutil.rmtree(place, ignore_errors=True)
        shutil.copytree(seeds.folder, place)
        name, forged = rng.choice(FILES), number % 2
        mutate = mutated_json if name.endswith(".json") else mutated_bytes
        (place / name).write_bytes(mutate((place / name).read_bytes(), rng))
        if forged:
            forge(place)
        try:
            with no_hang(60.0):
                made = recheck(place)
        except LtlplanError:
            continue
        except BaseException as error:
            raise AssertionError(
                f"{name}: {type(error).__name__}: {error} of {(place / name).read_bytes()[:3000]!r}"
            ) from error
        accepted[forged] += 1
        sampled_claims(place, made.margin)
        if not forged:
            other = meaning(place)
            # a key that is left out has its default, so the digest tells; whatever stands there must be the same
            kept = {part: only(true[part], other[part]) if part in ("mission", "plan") else true[part] for part in true}
            assert agree(kept, other), (name, (place / name).read_bytes()[:3000])
    return accepted[0], accepted[1]


@few_of(1, "count", [24, 36])
def test_no_mutated_folder_gets_a_false_verdict(seeds: Seeds, tmp_path: Path, count: int) -> None:
    as_they_were, _ = hunt_folders(seeds, tmp_path / "mutant", count, seed=0)
    assert as_they_were


@pytest.mark.slow
def test_no_mutated_folder_of_thousands_gets_a_false_verdict(seeds: Seeds, tmp_path: Path) -> None:
    as_they_were, made_anew = hunt_folders(seeds, tmp_path / "mutant", 2500, seed=1)
    assert as_they_were
    assert made_anew
