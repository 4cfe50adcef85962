"""What the kernel has to refuse: false statements, flights that are not as stated, and evidence that is none."""

import functools
import json
import random
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest

from tests.helpers.few import few_of
from tests.helpers.kernel.edits import edited_text
from tests.helpers.kernel.proofs import checked, missing, tables, untrue
from tests.helpers.motion.small_flights import small_flight
from verify import judge
from verify.data.errors import LtlplanError
from verify.data.trajectory import Trajectory
from verify.kernel.statement import Refused
from verify.proofs.finder import Proof, prove
from verify.proofs.statement import statement_of

MISSIONS = (
    "firefighting",
    *(
        pytest.param(name, marks=pytest.mark.slow)
        for name in (
            "hoops-published",
            "hoops-ltl",
            "meeting",
            "window-inspection",
            "wall-2",
            "doorpuzzle-1",
            "rover-2",
            "stlcg-1",
            "stlcg-2",
        )
    ),
)


@pytest.fixture(scope="module")
def proved(shipped_run, shipped_folder):
    """A shipped mission's plan, flight, certificate and proof, as its run wrote it."""

    @functools.cache
    def of(name):
        run, folder = shipped_run(name), shipped_folder(name)
        proof = Proof(*((folder / file).read_text(encoding="utf-8") for file in ("statement.json", "proof.json")))
        return run.plan, run.team, run.certificate, proof

    return of


@pytest.fixture(scope="module")
def lap():
    """A small flight's plan, team and proof: one robot laps through a hoop."""
    plan, team = small_flight("lap through hoop")
    return plan, team, prove(plan, team, judge(plan, team, largest=False))


@pytest.mark.parametrize("name", MISSIONS)
def test_what_is_true_is_checked(proved, name):
    plan, team, _certificate, proof = proved(name)
    claims = checked(proof.statement, proof.evidence, tables(plan, team))
    assert missing(claims) == set()


def test_a_robot_needs_a_file(lap):
    _, _, proof = lap
    with pytest.raises(Refused, match=r"\.csv is no flight"):
        checked(proof.statement, proof.evidence, {})


def changed(statement, **changes):
    """A statement's text with some values changed, by paths such as `robots__quad0__limits__speed`."""
    table = json.loads(statement)
    for path, value in changes.items():
        *way, last = path.split("__")
        at = table
        for key in way:
            at = at[int(key)] if isinstance(at, list) else at[key]
        if isinstance(at, list):
            last = int(last)
        at[last] = value(at[last]) if callable(value) else value
    return json.dumps(table)


FALSE = [
    ({"margin": 0.09}, {"visits"}),
    ({"margin": 0.2}, {"visits", "passages", "rims", "formula"}),
    ({"clock_error": 2.0}, {"formula"}),
    ({"separation": 0.6}, {"separation"}),
    ({"separation_z": 0.1}, {"separation"}),
    ({"low__0": -1.2}, {"workspace"}),
    ({"high__2": 1.0}, {"workspace"}),
    ({"robots__quad0__limits__speed": 0.5}, {"limits.speed"}),
    ({"robots__quad0__limits__acceleration": 0.1}, {"limits.acceleration"}),
    ({"robots__quad0__limits__thrust_max": 0.32}, {"limits.thrust_max"}),
    ({"robots__quad0__limits__thrust_min": 0.33}, {"limits.thrust_min", "limits.tilt", "limits.body_rate"}),
    ({"robots__quad0__limits__tilt": 0.01}, {"limits.tilt"}),
    ({"robots__quad0__limits__body_rate": 0.01}, {"limits.body_rate"}),
    ({"robots__quad0__limits__yaw_rate": 1e-6}, {"limits.yaw_rate", "limits.rotor_thrust_max", "limits.rotor_thrust_min"}),
    ({"robots__quad0__limits__rotor_thrust_max": 0.081}, {"limits.rotor_thrust_max"}),
    ({"robots__quad0__limits__rotor_thrust_min": 0.0809}, {"limits.rotor_thrust_min"}),
    ({"robots__quad0__torque_to_thrust": 1e-9}, {"limits.rotor_thrust_max"}),
    ({"robots__quad0__endurance": 12.0}, {"limits.endurance"}),
    ({"robots__quad0__start": [1.001, -0.5, 0.8]}, {"continuity"}),
    ({"robots__quad0__yaw": 0.01}, {"continuity"}),
    ({"robots__quad0__end": [0.0, 0.0, 1.0]}, {"continuity"}),
    ({"robots__quad0__radius": 0.2}, {"passages", "rims"}),
    ({"robots__quad0__visits__1__direction": "R"}, {"passages"}),
    ({"robots__quad0__visits": lambda visits: visits[::-1]}, {"visits"}),
    ({"robots__quad0__visits": lambda visits: visits[:-1]}, {"visits"}),
    ({"robots__quad0__changes__0__time": 2.9}, {"visits", "formula"}),
    ({"robots__quad0__changes": []}, {"formula"}),
    ({"robots__quad0__actions": []}, {"visits"}),
    ({"robots__quad0__closed": ["smoke"]}, {"transitions"}),
    ({"robots__quad0__edges__water": ["loc1"]}, {"transitions"}),
    ({"robots__quad2__edges__robot": []}, {"transitions"}),
    ({"regions__smoke__center__0": -0.3}, {"passages"}),
    ({"regions__water__ring__opening": 0.1}, {"passages", "rims"}),
    ({"regions__water__ring__rim": 0.3}, {"rims"}),
    ({"sequence": [[["water", "F"]], None]}, {"passages"}),
    ({"formula": ["G", ["!", ["name", "smoke"]]]}, {"formula"}),
    ({"formula": ["F", ["&", ["name", "smoke"], ["name", "loc1"]]]}, {"formula"}),
    ({"joint": True, "formula": ["G", ["->", ["name", "loc1"], ["name", "carrying"]]]}, {"formula"}),
    ({"timed": ["F[0,5] loc1"]}, {"timing"}), ({"timed": [["F[0,0.5]", ["name", "loc1"]]]}, {"timing"}),
]  # fmt: skip


@few_of(8, ("changes", "wanted"), FALSE, ids=lambda value: next(iter(value)) if isinstance(value, dict) else "")
def test_what_is_false_is_refused(proved, changes, wanted):
    plan, team, _certificate, proof = proved("firefighting")
    statement = changed(proof.statement, **changes)
    assert missing(checked(statement, proof.evidence, tables(plan, team))) >= wanted


UNREADABLE = [
    {"margin": -0.1}, {"margin": "0.1"}, {"margin": 1e12}, {"margin": True}, {"order": ["quad0"]}, {"robots": {}},
    {"robots__quad0__limits": lambda limits: {name: limit for name, limit in limits.items() if name != "tilt"}}, {"robots__quad0__limits__thrust_min": 0},
    {"format": 1}, {"repeat": 0}, {"lasso": True}, {"robots__quad0__cycle": 3}, {"robots__quad0__mass": 0}, {"robots__quad0__more": 1},
    {"regions__smoke__parts": []}, {"regions__smoke__parts__0": []}, {"robots__quad0__visits__0__region": "nowhere"},
    {"robots__quad0__visits__0__direction": "L"}, {"robots__quad0__initial": "flying"}, {"robots__quad0__changes__0__visit": 7},
    {"regions__smoke__parts__0__0__quadratic": [[1, 2, 0], [0, 1, 0], [0, 0, 1]]}, {"regions__smoke__ring__normal": [0, 0, 0]},
    {"waits": [{"first": ["quad0", 9], "then": ["quad2", 0], "done": "left", "due": "enters"}]}, {"words": {"quad9": [[]]}}, {"robots": []},
]  # fmt: skip


@pytest.mark.parametrize("changes", UNREADABLE, ids=lambda changes: next(iter(changes)))
def test_what_cannot_be_read_is_refused(proved, changes):
    plan, team, _certificate, proof = proved("firefighting")
    with pytest.raises(Refused):
        checked(changed(proof.statement, **changes), proof.evidence, tables(plan, team))


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", "[" * 100_000, '{"format": 1, "format": 1}', "nan", '{"a": NaN}', '{"a": 1e999}', "1" * 5000]
)
def test_what_is_no_file_is_refused(proved, text):
    plan, team, _certificate, proof = proved("firefighting")
    for statement, evidence in ((text, proof.evidence), (proof.statement, text)):
        with pytest.raises(Refused):
            checked(statement, evidence, tables(plan, team))


@pytest.mark.parametrize(
    "edit",
    [
        lambda text: "", lambda text: text.splitlines()[0], lambda text: text.replace("duration", "length", 1), lambda text: text + "1,2,3\n",
        lambda text: text.replace("\n", "\n\n").replace(",0,", ",nan,", 1), lambda text: text.replace(",0,", ",1e39,", 1),
        lambda text: text.replace(",0,", ",0x1,", 1), lambda text: text.replace(",0,", ",1e300,", 1), lambda text: text.replace("\n0", "\n-0", 1),
    ],
)  # fmt: skip
def test_what_is_no_flight_is_refused(proved, edit):
    plan, team, _certificate, proof = proved("firefighting")
    files = tables(plan, team)
    with pytest.raises(Refused):
        checked(proof.statement, proof.evidence, {**files, "quad0": edit(files["quad0"])})


@few_of(1, ("name", "values"), [("firefighting", (None, [])), ("firefighting", (7, "")), ("meeting", (None, 7, "", []))])
def test_every_kind_of_evidence_is_needed(proved, name, values):
    plan, team, _certificate, proof = proved(name)
    table = json.loads(proof.evidence)
    kinds = {key.split("/")[0]: key for key, value in table["evidence"].items() if value}  # boxes may do without marks
    for key in kinds.values():
        for value in values:
            other = {**table, "evidence": {**table["evidence"], key: value}}
            assert missing(checked(proof.statement, json.dumps(other), tables(plan, team))), key


def edited_team(team, rng):
    """A team with some numbers of a robot's flight changed."""
    name = rng.choice(list(team))
    path = team[name]
    times, values = path.durations.copy(), path.coefficients.copy()
    piece, kind = rng.randrange(len(times)), rng.randrange(4)
    if kind == 0:
        times[piece] *= rng.choice([0.5, 0.9, 0.999, 1.001, 1.1, 2.0])
    elif kind == 1:
        times *= rng.choice([0.4, 0.6, 0.8, 1.2])
    elif kind == 2:
        values[:, rng.randrange(3), 0] += rng.choice([1e-4, 0.01, 0.03, 0.08, -0.02, -0.05])
    else:
        values[piece, rng.randrange(4), rng.randrange(8)] += rng.gauss(0, 1) * 10.0 ** rng.randrange(-6, 1)
    single = [np.float32(a).astype(np.float64) for a in (times, values)]
    return {**team, name: Trajectory(*single, cycle=path.cycle, cuts=path.cuts)}


@pytest.mark.parametrize("name", MISSIONS)
@few_of(1, "edits", [2, 4])
def test_edited_flights_are_checked_no_further_than_they_are_judged(proved, name, edits):
    plan, team, _certificate, proof = proved(name)
    rng, counted = random.Random(name), 0
    for _ in range(edits):
        other = edited_team(team, rng)
        try:
            certificate = judge(plan, other, largest=False)
        except LtlplanError:
            continue  # laps that do not end together
        anew = prove(plan, other, certificate)
        for evidence in (proof.evidence, anew.evidence, edited_text(anew.evidence, rng)):
            try:
                claims = checked(anew.statement, evidence, tables(plan, other))
            except Refused:
                continue
            assert untrue(claims, certificate) == []
            counted += sum(not claim.missing for claim in claims)
    assert counted > 30


def test_edited_proofs_are_refused_or_true(proved):
    rng = random.Random(5)
    plan, team, _certificate, proof = proved("firefighting")
    files = tables(plan, team)
    false = changed(proof.statement, margin=0.3, separation=2.0, clock_error=1.0, robots__quad0__limits__speed=0.1)
    for _ in range(20):
        with suppress(Refused):
            claims = checked(false, edited_text(proof.evidence, rng), files)
            assert {"visits", "separation", "limits.speed"} <= missing(claims)


def test_edited_statements_are_refused_or_read(lap):
    rng = random.Random(6)
    plan, team, proof = lap
    files, refused = tables(plan, team), 0
    for _ in range(60):
        try:
            checked(edited_text(proof.statement, rng), proof.evidence, files)
        except Refused:
            refused += 1
    assert refused > 10


def test_clocks_that_differ_by_more_than_a_lap_are_refused(lap):
    plan, team, proof = lap
    assert (
        missing(checked(changed(proof.statement, clock_error=1e3), proof.evidence, tables(plan, team))) == set()
    )  # one clock alone


def test_a_statement_says_what_the_certificate_says(proved):
    plan, _team, certificate, proof = proved("firefighting")
    assert statement_of(plan, certificate) == proof.statement
    table = json.loads(statement_of(plan, replace(certificate, margin=0.01)))
    assert table["margin"] == 0.01
