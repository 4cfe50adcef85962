"""Certificates that once were given and were false, and their kin: the kernel refuses each, with a proof by whatever finder claims it."""

from __future__ import annotations

import functools
import json
import subprocess
import sys
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.helpers.few import few_of
from tests.helpers.kernel.kernel_opinion import proofs
from tests.helpers.kernel.proofs import checked, missing, tables
from tests.helpers.motion.flights import legs, quantised
from tests.helpers.motion.small_flights import RING, A, B, Flight, cut, mission, planned, small_flight, split, to
from tests.mutation.sites import ROOT
from verify import judge
from verify.data.plan import Meeting, Precedence
from verify.data.trajectory import Trajectory
from verify.kernel.flights import read_team
from verify.kernel.statement import Refused, at_least, read_statement
from verify.kernel.team import Team
from verify.kernel.timelines import Course
from verify.kernel.trees import Evidence
from verify.proofs.finder import prove


def edited(name: str, **changes: Any) -> set[str]:
    """Return what the kernel refuses of a small flight whose statement is another one, by the proof that it has."""
    plan, team = small_flight(name)
    proof = prove(plan, team, judge(plan, team, largest=False))
    table = json.loads(proof.statement)
    for way, value in changes.items():
        *keys, last = way.split("__")
        at = table
        for key in keys:
            at = at[int(key)] if isinstance(at, list) else at[key]
        at[last] = value
    return missing(checked(json.dumps(table), proof.evidence, tables(plan, team)))


EDITS: list[tuple[str, dict[str, Any], str]] = [
    ("begins inside", {"robots__r0__closed": ["a"]}, "transitions"), ("begins inside", {"robots__r0__closed": ["b"]}, "transitions"),
    ("opening", {"robots__r0__edges__h": []}, "transitions"), ("opening", {"robots__r0__vertex": "nowhere"}, "transitions"),
    ("lap with actions", {"robots__r0__edges": {"home": ["a"], "a": ["b"]}}, "transitions"),
    ("opening", {"robots__r0__changes": []}, "formula"),
    ("fills and empties", {"robots__r0__changes__0__time": 2.7, "robots__r0__changes__1__time": 2.2}, "visits"), ("fills and empties", {"robots__r0__changes__1__visit": 1}, "visits"),
    ("fills and empties", {"robots__r0__changes__0__before": "wet"}, "visits"), ("one", {"margin": 0.21}, "visits"), ("one", {"margin": 0.2}, "visits"),
    ("closely", {"separation_z": 0.5}, "separation"), ("crossing", {"clock_error": 1.2}, "separation"), ("crossing", {"separation": 0.9}, "separation"),
    ("lap waits", {"clock_error": 2.1}, "precedences"), ("own waits", {"clock_error": 7.0}, "precedences"),
    ("steps", {"robots__r0__start": [0.0002, 0.0, 1.0]}, "continuity"), ("parts", {"robots__r1__cuts": []}, "parts"),
    ("parts", {"robots__r0__pieces": 0}, "parts"), ("lap", {"robots__r0__endurance": 30.0}, "limits.endurance"),
    ("legs", {"robots__r0__legs__b__speed": 0.5}, "limits.legs.speed"), ("end and turn", {"robots__r0__limits__yaw_rate": 1.0}, "limits.yaw_rate"),
    ("end and turn", {"robots__r0__limits__rotor_thrust_max": 0.0675}, "limits.rotor_thrust_max"),
    ("lap with actions", {"formula": ["G", ["F", ["&", ["name", "b"], ["name", "carrying"]]]]}, "formula"),
    ("laps, own", {"formula": ["G", ["F", ["&", ["name", "a"], ["name", "b"]]]]}, "formula"),
    ("laps, joint", {"formula": ["F", ["G", ["!", ["name", "a"]]]]}, "formula"),
    ("union", {"formula": ["U", ["!", ["name", "c"]], ["name", "room"]]}, "formula"),
    ("counted", {"formula": ["F", ["count", 3, ["|", ["name", "a"], ["name", "b"]]]]}, "formula"),
]  # fmt: skip


@few_of(9, ("name", "changes", "claim"), EDITS)
def test_statements_that_are_false(name: str, changes: dict[str, Any], claim: str) -> None:
    assert claim in edited(name, **changes)


F, R = ["h", "F"], ["h", "R"]


@few_of(4,
    ("prefix", "cycle", "is_so"),
    [([F], [R, F], True), ([F, R], [F, R], True), ([F], [R, F, R, F], True), ([], [F, R], True), ([F], [R], False), ([F], [F], False),
     ([F, R], [F], False), ([F, R, F], None, False), ([F], [R, F, F], False), ([], [R, F], False), ([F], [F, R], False)],
)  # fmt: skip
def test_sequences_with_a_cycle(prefix: Any, cycle: Any, is_so: bool) -> None:
    """`AF (BF)*` for a flight that repeats `(AF BF)*`, or passes each of them once."""
    assert ("passages" in edited("lap through hoop", sequence=[prefix, cycle])) != is_so


@pytest.mark.parametrize("visit", [1, 2])
def test_laps_that_begin_with_another_visit(visit: int) -> None:
    """Limits of legs hung on where the plan said that the lap begins."""
    assert "visits" in edited("lap with actions", robots__r0__cycle_visit=visit)


def test_an_end_that_laps_never_come_to() -> None:
    with pytest.raises(Refused, match="never end"):
        edited("lap", robots__r0__end=[2.0, 2.0, 1.0])


def test_laps_that_differ_by_an_ulp() -> None:
    plan, team = small_flight("lap")
    proof = prove(plan, team, judge(plan, team, largest=False))
    files = tables(plan, team)
    lines = files["r0"].splitlines()
    for line in range(1, len(lines)):
        cells = lines[line].split(",")
        cells[1] = repr(float(np.nextafter(np.float32(cells[1]), np.float32(9))))
        other = "\n".join([*lines[:line], ",".join(cells), *lines[line + 1 :]])
        if line == 1:  # before the laps
            assert checked(proof.statement, proof.evidence, {"r0": other})
        else:
            with pytest.raises(Refused, match="not alike"):
                checked(proof.statement, proof.evidence, {"r0": other})


def nested(limit: str, value: float) -> Flight:
    """A visit of a region within the one before, which lasts past the entry."""
    rooms = "room: {center: [1, 0, 1], size: [1.6, 1.6, 1.0]}, a: {center: [1, 0, 1], radii: [0.2, 0.2, 0.2]}"
    of = mission("F a", [0, 0, 1], regions=rooms, limits=f"legs: {{a: {{{limit}: {value}}}}}")
    return planned(of, {"r0": to("room", "a")}), {"r0": legs([[0, 0, 1], [1, 0, 1]])}


def excursion() -> Flight:
    """Out of the region and back within the margin, too fast."""
    of = mission(
        "F a",
        [0, 0, 1],
        regions="a: {center: [1, 0, 1], size: [0.5, 0.5, 0.5]}",
        limits="legs: {a: {acceleration: 2.0}}",
        margin="0.03",
    )
    points = [[0, 0, 1], [1.15, 0, 1], [1.265, 0, 1], [1.15, 0, 1]]
    slow = legs(points[:2], speed=0.2)
    fast = legs(points[1:], speed=0.46)
    path = Trajectory([*slow.durations, *fast.durations], np.concatenate([slow.coefficients, fast.coefficients]))
    return planned(of, {"r0": to("a")}), {"r0": quantised(path)}


def swapped() -> Flight:
    of = mission("F a & F b", [0, 0, 1], regions=f"{A}, {B}")
    return planned(of, {"r0": to("b", "a")}), {"r0": legs([[0, 0, 1], [1, 0, 1], [1, 2, 1]])}


def met_too_late() -> Flight:
    plan, team = small_flight("counted")
    return plan, {**team, "r1": legs([[0, 0.6, 1], [1, 0.6, 1]], hold=1.0)}


def sets_out_too_early() -> Flight:
    """It stands still on its way until the other one is there."""
    plan, team = small_flight("counted")
    stops = [[0, 0.6, 1], *[[0.3, 0.6, 1]] * 14, [1, 0.6, 1]]
    return plan, {**team, "r1": legs(stops)}


def leaves_by_the_edge() -> Flight:
    """It may be out of its region, by the margin, before the other one is there; it comes back, and stays."""
    of = mission("F a & F b", [0, 0, 1], [0, 2, 1], regions=f"{A}, {B}")
    wait = Precedence(first=("r0", 0), then=("r1", 0), done="entered", due="leaves")
    team = {"r0": legs([[0, 0, 1], [1, 0, 1]], hold=5.0), "r1": legs([[0, 2, 1], [1, 2, 1], [1.2, 2, 1], [1, 2, 1]])}
    return planned(of, {"r0": to("a"), "r1": to("b")}, precedences=(wait,)), team


def waits_for_a_circle() -> Flight:
    plan, team = small_flight("counted")
    both = (Meeting(first=("r0", 0), then=("r1", 0)), Meeting(first=("r1", 0), then=("r0", 0)))
    return plan.changed(meetings=both), team


def bound_of_two() -> Flight:
    """An obstacle by inequalities whose bound is not 1: it is the larger, not the farther away."""
    part = "[{quadratic: [[4, 0, 0], [0, 4, 0], [0, 0, 4]], bound: 2}]"
    of = mission(
        "F a",
        [0, 1, 1],
        regions="a: {center: [1, 1, 1], radii: [0.2, 0.2, 0.2]}",
        obstacles=f"body: {{center: [0.5, 0, 1], parts: [{part}]}}",
    )
    return planned(of, {"r0": to("a")}), {"r0": legs([[0, 1, 1], [0.5, 0.75, 1], [1, 1, 1]])}


def u_turn(x: float) -> Flight:
    """Into the opening, or near it, and out where it came from."""
    of = mission("F h", [-1, 0, 1], hoops=RING)
    return planned(of, {"r0": to("h.F")}), {"r0": legs([[-1, 0, 1], [x, 0, 1], [-1, 0, 1]])}


def cut_in_flight() -> Flight:
    of = mission("F a", [0, 0, 1], regions=A)
    return planned(of, {"r0": to("a")}), {"r0": cut(split(legs([[0, 0, 1], [1, 0, 1]]), 0), 1)}


def too_near_by_an_ulp() -> Flight:
    of = mission("true", [0, 0, 1], [0.5, 0, 1], margin="0.0625", separation="0.25")
    near = float(np.nextafter(np.float32(0.375), np.float32(0)))
    return planned(of, {}), {"r0": legs([[0, 0, 1]]), "r1": legs([[0.5, 0, 1], [near, 0, 1], [near, 0, 1]], speed=0.1)}


def out_by_an_ulp() -> Flight:
    of = mission("true", [0, 0, 1], margin="0.0625", workspace="min: [-1, -1, 0.5], max: [1, 1, 1.5]")
    return planned(of, {}), {"r0": legs([[0, 0, 1], [0, 0, float(np.nextafter(np.float32(1.4375), np.float32(2)))]])}


def order_within_clocks() -> Flight:
    """In order by one clock, not by two: r0 is in a before r1 comes to b."""
    regions = f"{A}, b: {{center: [1.1, -0.5, 1.2], radii: [0.2, 0.2, 0.2]}}"
    of = mission("F (a & !b)", [0, 0, 1], [0.2, -0.5, 1.3], regions=regions, clock_error="0.4", spec="team: joint")
    return planned(of, {"r0": to("a"), "r1": to("b")}), {
        "r0": legs([[0, 0, 1], [1, 0, 1]]),
        "r1": legs([[0.2, -0.5, 1.3], [1.1, -0.5, 1.2]], hold=0.3),
    }


FLIGHTS: list[tuple[Callable[[], Flight], str]] = [
    (lambda: nested("speed", 0.5), "limits.legs.speed"), (lambda: nested("acceleration", 0.5), "limits.legs.acceleration"),
    (excursion, "limits.legs.acceleration"), (swapped, "visits"), (met_too_late, "precedences"), (sets_out_too_early, "precedences"), (leaves_by_the_edge, "precedences"), (waits_for_a_circle, "precedences"),
    (bound_of_two, "obstacles"), (cut_in_flight, "parts"), (too_near_by_an_ulp, "separation"), (out_by_an_ulp, "workspace"),
    (order_within_clocks, "formula"), (lambda: u_turn(0.02), "passages"), (lambda: u_turn(-0.04), "passages"), (lambda: u_turn(0.3), "passages"),
]  # fmt: skip


@few_of(4, ("flight", "claim"), FLIGHTS, ids=lambda value: value if isinstance(value, str) else getattr(value, "__name__", ""))
def test_flights_that_break_a_claim(flight: Callable[[], Flight], claim: str) -> None:
    plan, team = flight()
    certificate = judge(plan, team, largest=False)
    assert claim in {one.name for one in certificate.claims if one.outcome != "holds"}
    for proof, files in proofs(plan, team, certificate):
        assert claim in missing(checked(proof.statement, proof.evidence, files))


@pytest.mark.parametrize("more", [0, 1])
def test_robots_that_there_are_not_are_not_read(more: int) -> None:
    """A configuration in which a further robot was read may never end, and covers all others."""
    plan, team = small_flight("own waits")
    other = plan.changed(mission=plan.mission.changed(spec=plan.mission.spec.model_copy(update={"formula": "F (a & b)"})))
    certificate = judge(other, team, largest=False)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Team, "may_end", lambda self, state: False)
        proof = prove(other, team, certificate)
    table = json.loads(proof.evidence)
    followed, _, _, _, sets, _ = table["evidence"]["formula/0"]
    for row in (row for rows in sets for row in rows):
        row[2] += more << len(followed)
    assert sets != [[]]
    assert "formula" in missing(checked(proof.statement, json.dumps(table), tables(other, team)))


def there_and_back(brushes: bool) -> Flight:
    """One visit is planned: of two, or of a brush by the region at the margin and a jump into it."""
    of = mission("F a", [0, 0, 1], regions=A)
    if not brushes:
        return planned(of, {"r0": to("a")}), {"r0": legs([[0, 0, 1], [1, 0, 1], [0, 0, 1], [1, 0, 1]])}
    path = legs([[0, 0, 1], [0.77, 0, 1], [0.5, 0, 1], [0.9, 0, 1], [1, 0, 1]])
    kept = [0, 1, 3]
    return planned(of, {"r0": to("a")}), {"r0": quantised(Trajectory(path.durations[kept], path.coefficients[kept]))}


@functools.cache
def read_there_and_back(brushes: bool) -> tuple[Any, Any, str]:
    """Return the statement, the path and the marks of the proof of a flight that visits its region too often."""
    plan, team = there_and_back(brushes)
    certificate = judge(plan, team, largest=False)
    assert "visits" in {one.name for one in certificate.claims if one.outcome == "fails"}
    proof = prove(plan, team, certificate)
    marks = "".join(Evidence(json.loads(proof.evidence)["evidence"]).marks("inside/r0/a"))
    statement = read_statement(proof.statement)
    return statement, read_team(statement, tables(plan, team)).paths["r0"], marks


@pytest.mark.parametrize("brushes", [False, True])
@few_of(1, "forged", ["n?", "ny", "ni", "no", "i?", "o?", "io", "iy", "oi"])
def test_visits_that_are_not_told_apart(brushes: bool, forged: str) -> None:
    """To leave a region for sure and to come back is another visit, whatever a proof leaves open."""
    statement, path, marks = read_there_and_back(brushes)
    for first in range(len(marks)):
        forgery = Evidence({"inside/r0/a": marks[:first] + marks[first:].replace(forged[0], forged[1])})
        with pytest.raises(Refused):
            Course(statement, path, forgery).stays  # noqa: B018  # which are sought


def printed(folder: Path, texts: dict[str, str]) -> subprocess.CompletedProcess[str]:
    """Return what the kernel prints of files, to a terminal that knows ASCII alone."""
    for name, text in texts.items():
        (folder / name).write_bytes(text.encode())
    command = [sys.executable, "-m", "verify.kernel", str(folder)]
    environment = {"PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "ascii"}
    return subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False, timeout=60)


@pytest.mark.parametrize(
    "name", ["x\n\n1 of 1 claims checked by the kernel", "\x1b[2Jx", "\ud800", "\u202ekciuq", "große Räume"]
)
def test_names_print_no_lines_of_their_own(name: str, tmp_path: Path) -> None:
    """Whoever writes a statement could write what is said of it, or stop the printing."""
    plan, team = small_flight("one")
    proof = prove(plan, team, judge(plan, team, largest=False))
    table = json.loads(proof.statement)
    table["name"] = name
    table["regions"][name] = table["regions"]["a"]
    files = {f"{one}.csv": text for one, text in tables(plan, team).items()}
    done = printed(tmp_path, {"statement.json": json.dumps(table), "proof.json": proof.evidence, **files})
    assert done.returncode == 1
    assert done.stderr == ""
    lines = done.stdout.split("\n")
    assert not any(line.startswith("1 of 1") for line in lines)
    assert all(line.isascii() and line.isprintable() for line in lines)


def test_formulas_that_cannot_be_shown(tmp_path: Path) -> None:
    plan, team = small_flight("one")
    proof = prove(plan, team, judge(plan, team, largest=False))
    table = {**json.loads(proof.statement), "formula": ["next", ["name", "a"]]}
    files = {f"{one}.csv": text for one, text in tables(plan, team).items()}
    done = printed(tmp_path, {"statement.json": json.dumps(table), "proof.json": proof.evidence, **files})
    assert done.returncode == 2
    assert "not covered by the kernel" in done.stdout


def test_lines_that_only_some_readers_tell_apart() -> None:
    plan, team = small_flight("legs")
    proof = prove(plan, team, judge(plan, team, largest=False))
    for end in ("\x0c", "\x1c", "\x85", "\u2028", "\r"):
        with pytest.raises(Refused):
            checked(proof.statement, proof.evidence, {one: text.replace("\n", end) for one, text in tables(plan, team).items()})
    assert checked(
        proof.statement, proof.evidence, {one: text.replace("\n", "\r\n") for one, text in tables(plan, team).items()}
    )


def test_what_is_no_file_is_not_read(tmp_path: Path) -> None:
    (tmp_path / "statement.json").symlink_to("/dev/zero")
    done = printed(tmp_path, {})
    assert done.returncode == 2
    assert "is no file" in done.stdout


REFUSALS = ("refused_limits", "refused_paths", "refused_visits", "leg_windows", "passages", "separation", "region_relations")


@pytest.mark.slow
def test_what_the_tests_of_the_judge_refuse_the_kernel_refuses() -> None:
    """Every flight of the judge's own tests of refusals, with the proofs of `kernel_opinion`."""
    files = [
        *(f"tests/verify/motion/test_{name}.py" for name in REFUSALS),
        "tests/verify/test_parts.py",
        "tests/verify/test_order_claims.py",
    ]
    command = [sys.executable, "-m", "pytest", "-n", "0", "-q", "-p", "tests.helpers.kernel.kernel_opinion", *files]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    (line,) = (line for line in done.stdout.splitlines() if line.startswith("kernel: "))
    assert done.returncode == 0, done.stdout[-5000:]
    assert json.loads(line.removeprefix("kernel: "))["flights"] > 100


def test_no_sentence_says_more_than_was_checked() -> None:
    """Distances were rounded to the nearest, waits took no clocks off, and metres in z counted as all others."""
    plan, team = small_flight("counted")
    proof = prove(plan, team, judge(plan, team, largest=False))
    says = {claim.name: claim.sentence for claim in checked(proof.statement, proof.evidence, tables(plan, team))}
    assert at_least(Fraction(0.4) - Fraction(1, 10**9)) == "0.3999"
    assert "a metre in z counted as 0.5" in says["separation"]
    wait = edited("counted", clock_error=float(says["precedences"].split()[-2]) + 0.0201)
    assert "precedences" in wait
