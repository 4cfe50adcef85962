"""Proofs of audits: the kernel checks what holds, and nothing that does not; what it says is what the audit says."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ltlplan
import verify
from tests.helpers.motion.fleets import csv_text, exported_show, sampled, show_of, trajectory_of, wandering, write_show
from tests.helpers.motion.flights import small_mission
from tests.verify.third_party.test_audit import HOP, hop
from verify.checked_claims import checked_files
from verify.data.files.trajectory_csv import write_csv
from verify.kernel import VERSION
from verify.third_party import audit_proof
from verify.third_party.rounded_paths import rounded_paths

LIMITS = verify.AuditLimits(separation=0.4, workspace=(-1, -1, 0, 3, 3, 2), speed=1.0, min_height=0.9)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder of two robots that fly side by side, 0.5 m apart, at 1 m/s."""
    (tmp_path / "r0.csv").write_text(hop(0.0, 0.0))
    (tmp_path / "r1.csv").write_text(hop(0.0, 0.5))
    return tmp_path


def words(found: verify.Audit) -> dict[str, set[str]]:
    said: dict[str, set[str]] = {}
    for claim in found.claims:
        said.setdefault(claim.name, set()).add(claim.proof)
    return said


def test_what_holds_is_checked_by_the_kernel_alone(folder: Path, tmp_path: Path) -> None:
    found = verify.audit(folder, limits=LIMITS, proof=True)
    assert found
    held = {"workspace", "height", "limits.speed", "separation"}
    assert {name for name, said in words(found).items() if said == {"checked"}} == held
    assert (found.checked, found.kernel) == (4, VERSION)
    assert sorted(found.files) == ["check.pyz", "proof.json", "r0.csv", "r1.csv", "statement.json"]
    place = tmp_path / "proof"
    place.mkdir()
    for name, content in found.files.items():
        (place / name).write_bytes(content)
    done = subprocess.run([sys.executable, "-I", place / "check.pyz", place], capture_output=True, text=True, check=False)
    assert "checked: separation: The paths of r0 and r1 stay 0.4000 m apart" in done.stdout
    data = json.loads(found.to_json())
    assert data["kernel"] == VERSION
    assert [claim["proof"] for claim in data["claims"]] == [claim.proof for claim in found.claims]
    without = verify.audit(folder, limits=LIMITS)
    assert (without.kernel, words(without)["separation"], without.files) == (None, {"judged"}, {})
    assert data["digest"] == without.to_dict()["digest"], "the kernel's words are no part of what is claimed"


@pytest.mark.parametrize(
    ("change", "lost"),
    [
        ({"separation": 0.51}, "separation"),
        ({"low": [-1, -1, 1.01]}, "workspace"),
        ({"high": [1.99, 3, 2]}, "workspace"),
        ({"margin": 0.06}, "separation"),
        ({"robots": {"r0": {"limits": {"speed": 0.99}}}}, "limits.speed"),
    ],
)
def test_a_statement_of_more_is_not_checked(folder: Path, change: Mapping[str, Any], lost: str) -> None:
    files = dict(verify.audit(folder, limits=LIMITS, proof=True).files)

    def changed(table: Any, more: Any) -> Any:
        return {**table, **{k: changed(table[k], v) if isinstance(v, dict) else v for k, v in more.items()}}

    files["statement.json"] = json.dumps(changed(json.loads(files["statement.json"]), change)).encode()
    assert lost in {claim.name for claim in checked_files(files).claims if claim.missing}


def test_what_does_not_hold_is_not_stated_and_keeps_nothing_else_from_being_checked(folder: Path) -> None:
    limits = verify.AuditLimits(separation=0.6, workspace=(-1, -1, 0, 1.5, 3, 2), speed=1.0, min_height=0.9)
    found = verify.audit(folder, limits=limits, proof=True)
    assert not found
    said = {claim.name: (claim.outcome, claim.proof) for claim in found.claims}
    assert said["separation"] == said["workspace"] == ("fails", "judged")
    assert said["height"] == said["limits.speed"] == ("holds", "checked")
    assert "workspace" in {claim.name for claim in found.broken}


@pytest.mark.parametrize(
    ("limits", "name"),
    [
        (verify.AuditLimits(separation=0.4, separation_above=0.5), "separation"),
        (verify.AuditLimits(acceleration=2.0, velocity_jump=1e-9), "continuity"),
    ],
)
def test_what_the_kernel_cannot_say_is_not_covered(tmp_path: Path, limits: verify.AuditLimits, name: str) -> None:
    for k in range(2):
        (tmp_path / f"r{k}.csv").write_text(csv_text([(2.0, {"x": (0.0,), "y": (0.5 * k,), "z": (1.0,)})]))
    found = verify.audit(tmp_path, limits=limits, proof=True)
    assert found
    assert words(found)[name] == {"not covered"}
    assert verify.audit(tmp_path, limits=verify.AuditLimits(separation=0.4), proof=True).checked == 2, "drones at rest join"


@pytest.mark.parametrize(
    ("formula", "word"), [("F a & F b", "checked"), ("G (a -> F !a)", "checked"), ("F a & G !b", "judged")]
)
def test_formulas_and_obstacles_of_a_mission(folder: Path, formula: str, word: str) -> None:
    post = "obstacles: {post: {center: [1.2, 0.25, 1.0], size: [0.1, 0.1, 2.0]}}"
    mission = small_mission(formula, regions=HOP, starts=((0.0, 0.0, 1.0), (0.0, 0.5, 1.0)), margin=0.02, extra=post)
    found = verify.audit(folder, mission, verify.AuditLimits(velocity_jump=1.01), proof=True)
    assert words(found)["formula"] == {word}
    assert words(found)["obstacles"] == {"checked"}


def test_our_own_exports_are_checked_in_every_claim(tmp_path: Path, shipped_run: Callable[[str], ltlplan.Result]) -> None:
    run = shipped_run("firefighting")
    for name, path in run.team.items():
        (tmp_path / f"{name}.csv").write_text(write_csv(path))
    mission = run.mission.asking("F loc1 & F loc2")
    found = verify.audit(tmp_path, mission, proof=True)
    assert found
    assert set().union(*words(found).values()) == {"checked"}
    assert {"formula", "rims", "continuity", "limits.acceleration"} <= set(words(found))


def test_distances_that_count_z_otherwise_are_stated_as_they_are_asked(folder: Path) -> None:
    mission = small_mission(
        "true", regions="", starts=((0.0, 0.0, 1.0), (0.0, 0.5, 1.0)), extra="separation: 0.3\nseparation_z: 0.6"
    )
    assert words(verify.audit(folder, mission, proof=True))["separation"] == {"checked"}
    other = verify.audit(folder, mission, verify.AuditLimits(separation=0.4), proof=True)
    assert words(other)["separation"] == {"not covered"}, "0.4 / 0.6 is another weight than the mission's"


@pytest.mark.parametrize(
    ("seed", "common"), [(0, True), (1, False), *(pytest.param(s, s % 2 == 0, marks=pytest.mark.slow) for s in range(2, 12))]
)
def test_no_drone_of_a_show_is_farther_from_its_rounded_path_than_is_said(seed: int, common: bool) -> None:
    rng = np.random.default_rng(seed)
    fleet = wandering(3, 6, rng, size=float(rng.choice([1.0, 30.0, 900.0])), common=common)
    rounded = rounded_paths(fleet)
    assert 0 < rounded.off < 1e-2
    worst = 0.0
    for drone, name in enumerate(fleet.names):
        path = rounded.paths[name]
        assert path.is_float32
        knots = [float(fleet.time(k)) for k in range(len(fleet.knots))]
        times = np.clip(np.concatenate([rng.uniform(0, float(fleet.end), 200), knots, path.knots]), 0.0, float(fleet.end))
        apart = sampled(fleet, drone, times) - path.evaluate(np.minimum(times, path.duration))[:, :3]
        worst = max(worst, float(np.linalg.norm(apart, axis=1).max()))
    assert worst <= float(rounded.off) + 1e-12
    assert worst > 0


def show(tmp_path: Path, *, high: float = 0.0) -> Path:
    """Return a show of two drones that fly side by side, 3 m apart, from a height to 5 m and back."""

    def hop(x: float) -> Any:
        up = [[x, 0.0, high + 1.3], [x + 0.3, 0.1, 5]]
        return trajectory_of([[0, [x, 0, high], []], [7.1, [x, 0.1, 5], up], [19.3, [x + 0.7, 0, high], []]])

    return write_show(tmp_path / "show.skyc", show_of([("drone 1", hop(0.1)), ("drone 2", hop(3.1))]))


def test_places_of_shows_are_checked_on_rounded_paths_at_a_larger_margin(tmp_path: Path) -> None:
    limits = verify.AuditLimits(separation=2.0, workspace=(-1, -1, -1, 9, 9, 9), min_height=-0.5, speed=9.0, margin=0.25)
    found = verify.audit(show(tmp_path), limits=limits, proof=True)
    assert found
    said = {claim.name: claim.proof for claim in found.claims}
    assert said == {
        "continuity": "not covered", "workspace": "checked", "height": "checked", "limits.speed": "not covered", "separation": "checked",
    }  # fmt: skip
    statement = json.loads(found.files["statement.json"])
    assert 0.25 < statement["margin"] < 0.2501
    assert any(note.startswith("The proof is of float32 paths that are within ") for note in found.notes)
    assert statement["robots"]["drone 1"]["limits"]["speed"] == 1e9


def test_what_columns_have_a_part_in_is_the_audit_s_alone(tmp_path: Path) -> None:
    limits = verify.AuditLimits(separation=2.0, workspace=(-1, -1, -1, 9, 9, 9))
    assert verify.audit(show(tmp_path), limits=limits).fleet.columns == ()
    points = {name: [[0, [x, 0, 1], []], [9, [x, 0, 5], []]] for name, x in (("d0", 0.0), ("d1", 3.0))}
    drones = {name: {"trajectory": trajectory_of(rows), "home": [rows[0][1][0], 0, 0]} for name, rows in points.items()}
    found = verify.audit(write_show(tmp_path / "show.skyc", exported_show(drones)), limits=limits, proof=True)
    assert found.fleet.columns
    assert words(found)["workspace"] == {"not covered"}
    assert {(claim.robot is None, claim.proof) for claim in found.claims if claim.name == "separation"} == {
        (True, "not covered"),
        (False, "checked"),
    }


def test_no_proof_is_written_of_odd_names_and_too_many_drones(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(found: verify.Audit, why: str) -> None:
        assert (found.kernel, found.files) == (None, {})
        assert any(note.startswith("No proof is written: ") and why in note for note in found.notes), found.notes

    monkeypatch.setattr(audit_proof, "MOST_WORK", 1)
    refused(verify.audit(folder, limits=LIMITS, proof=True), "too many for the kernel")
    (folder / "r1.csv").rename(folder / "ré.csv")
    refused(verify.audit([folder / "r0.csv", folder / "ré.csv"], limits=LIMITS, proof=True), "no file named")
