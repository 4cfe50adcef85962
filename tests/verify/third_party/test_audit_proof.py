"""Proofs of audits: the kernel checks what holds, and nothing that does not; what it says is what the audit says."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

import ltlplan
import verify
from tests.helpers.fleets import csv_text, show_of, trajectory_of, write_show
from tests.helpers.flights import small_mission
from tests.verify.third_party.test_audit import HOP, hop
from verify.checked_claims import checked_files
from verify.third_party import audit_proof

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
    assert (found.checked, found.kernel) == (4, 1)
    assert sorted(found.files) == ["check.pyz", "proof.json", "r0.csv", "r1.csv", "statement.json"]
    place = tmp_path / "proof"
    place.mkdir()
    for name, content in found.files.items():
        (place / name).write_bytes(content)
    done = subprocess.run([sys.executable, "-I", place / "check.pyz", place], capture_output=True, text=True, check=False)
    assert "checked: separation: The paths of r0 and r1 stay 0.4000 m apart" in done.stdout
    data = json.loads(found.to_json())
    assert data["kernel"] == 1
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
        (tmp_path / f"{name}.csv").write_text(verify.data.files.trajectory_csv.write_csv(path))
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


def test_no_proof_is_written_of_shows_odd_names_and_too_many_drones(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(found: verify.Audit, why: str) -> None:
        assert (found.kernel, found.files) == (None, {})
        assert any(note.startswith("No proof is written: ") and why in note for note in found.notes), found.notes

    points = [[0, [0, 0, 0], []], [10, [0, 0, 5], []]]
    show = write_show(tmp_path / "show.skyc", show_of([("d0", trajectory_of(points))]))
    refused(verify.audit(show, limits=verify.AuditLimits(speed=2.0), proof=True), "the show's curves")
    monkeypatch.setattr(audit_proof, "MOST_WORK", 1)
    refused(verify.audit(folder, limits=LIMITS, proof=True), "too many for the kernel")
    (folder / "r1.csv").rename(folder / "ré.csv")
    refused(verify.audit([folder / "r0.csv", folder / "ré.csv"], limits=LIMITS, proof=True), "no file named")
