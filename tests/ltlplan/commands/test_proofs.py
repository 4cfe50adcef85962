"""`certify` and `recheck` on folders that were written by hand: margins below the mission's, tables of positions, hostile files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from flight.storage.single_files import replace_listed
from ltlplan.cli import app
from tests.helpers.few import few_of
from tests.helpers.live.recordings import gates
from tests.helpers.motion.flights import legs, plan_of, small_mission
from tests.verify.test_run_folder import write_folder
from verify import certify, recheck
from verify.certificate import Certificate
from verify.data import BadInput, NotCertified, Plan, Trajectory
from verify.data.files.trajectory_csv import load_csv
from verify.data.plan import Visit
from verify.data.sections import Action
from verify.kernel import VERSION
from verify.run_folder import read_folder

runner = CliRunner()
TANK = "robot: {initial: dry, states: {dry: [], wet: [wet]}, actions: [{from: dry, to: wet, at: a}]}"


@pytest.fixture(scope="module")
def made() -> tuple[Plan, dict[str, Trajectory], Certificate]:
    mission = small_mission("F a & F wet", margin=0.02, extra=TANK)
    fill = Action.model_validate({"from": "dry", "to": "wet", "at": "a"})
    plan, team = plan_of(mission, {"r0": [Visit(region="a", actions=(fill,))]}), {"r0": legs([[0, 0, 1], [1, 0, 1]])}
    return plan, team, certify(plan, team)


@pytest.fixture
def folder(made: tuple[Plan, dict[str, Trajectory], Certificate], tmp_path: Path) -> Path:
    return write_folder(tmp_path / "out", *made)


def test_certify_replaces_its_own_certificate_and_no_other(folder: Path) -> None:
    path = folder / "certificate.json"
    first = path.read_text()
    with pytest.raises(BadInput, match=r"certificate\.json is yours, or was changed since ltlplan wrote it"):
        ok("certify", str(folder), "--margin", "0.01")
    assert path.read_text() == first
    path.unlink()
    for margin in ("0.01", "0.015"):
        ok("certify", str(folder), "--margin", margin)
        assert json.loads(path.read_text())["margin"] == float(margin)
    written = path.read_bytes()
    ok("certify", str(folder), "--margin", "0.015")
    assert path.read_bytes() == written
    assert sorted(entry.name for entry in folder.iterdir()) == [
        path.name,
        "check.pyz",
        "manifest.json",
        "mission.yaml",
        "plan.json",
        "proof.json",
        "r0.csv",
        "statement.json",
    ]


def ok(*arguments: str) -> str:
    done = runner.invoke(app, list(arguments), catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.output


def test_every_claim_says_whether_the_kernel_checked_it(folder: Path) -> None:
    path = folder / "certificate.json"
    judged = json.loads(path.read_text())
    assert judged["kernel"] is None
    assert {claim["proof"] for claim in judged["claims"]} == {"judged"}
    assert "all claims are judged: there is no proof for the kernel" in ok("recheck", str(folder))
    path.unlink()
    printed, count = ok("certify", str(folder)), len(judged["claims"])
    assert printed.splitlines()[-1] == f"{count} of {count} claims checked by the kernel"
    checked = json.loads(path.read_text())
    assert checked["kernel"] == VERSION
    assert {claim["proof"] for claim in checked["claims"]} == {"checked"}
    assert checked["digest"] == judged["digest"], "the kernel's words are no part of what is claimed"
    rows = printed.splitlines()
    begins = next(k for k, row in enumerate(rows) if row.split()[:4] == ["claim", "robot", "verdict", "proof"])
    assert all("holds" in row and "checked" in row for row in rows[begins + 1 : begins + 1 + count])
    assert ok("recheck", str(folder)).splitlines()[-1] == f"{folder}: {count} of {count} claims checked by the kernel"
    assert recheck(folder).checked == count
    earlier = {key: value for key, value in checked.items() if key != "kernel"}
    earlier["claims"] = [{key: value for key, value in claim.items() if key != "proof"} for claim in checked["claims"]]
    path.write_text(json.dumps(earlier))  # as it was written before there were such words
    assert recheck(folder).checked == count


def test_words_of_the_kernel_are_believed_of_nobody_else(folder: Path) -> None:
    path = folder / "certificate.json"
    data = json.loads(path.read_text())
    data["claims"][2]["proof"] = "checked"
    path.write_text(json.dumps(data))
    assert recheck(folder).checked == 0, "there is no proof beside it"
    assert "all claims are judged: there is no proof for the kernel" in ok("recheck", str(folder))
    path.unlink()
    ok("certify", str(folder))
    data = json.loads(path.read_text())
    data["claims"][0]["proof"] = "sworn"
    path.write_text(json.dumps(data))
    with pytest.raises(NotCertified, match=r"its 'proof' must be one of checked, judged, not covered"):
        recheck(folder)


def test_a_proof_that_lost_some_evidence_does_not_bear_its_certificate_out(folder: Path) -> None:
    path, proof = folder / "certificate.json", folder / "proof.json"
    path.unlink()
    ok("certify", str(folder))
    data = json.loads(proof.read_text())
    del data["evidence"]["workspace/r0"]
    proof.write_text(json.dumps(data))
    with pytest.raises(NotCertified, match=r"\(workspace\): its 'proof' is 'checked', and the kernel does not check it: "):
        recheck(folder)
    certificate = json.loads(path.read_text())
    for claim in certificate["claims"]:
        claim.update({"proof": "judged", "missing": "so"} if claim["name"] == "workspace" else {})
    path.write_text(json.dumps(certificate))
    lines = ok("recheck", str(folder)).splitlines()
    count = len(certificate["claims"])
    assert lines[-1].endswith(f"{count - 1} of {count} claims checked by the kernel")
    assert any("workspace of r0: judged, not checked: " in line for line in lines)
    (row,) = (line for line in lines if line.startswith("workspace "))
    assert row.split()[:4] == ["workspace", "r0", "holds", "judged"]


@pytest.mark.slow
def test_a_margin_below_the_missions_is_said_aloud(folder: Path) -> None:
    assert "the mission asks" not in ok("recheck", str(folder))
    (folder / "certificate.json").unlink()
    assert "certified at margin 0.01 m (the mission asks for 0.02 m)" in ok("certify", str(folder), "--margin", "0.01")
    assert "at margin 0.01 m (the mission asks for 0.02 m), from the files alone" in ok("recheck", str(folder))
    assert "the mission asks" not in ok("certify", str(folder), "--margin", "0.03")


@pytest.mark.parametrize("option", ["--margin", "--clock-error"])
@few_of(1, "value", ["nan", "inf", "1e300"])
def test_numbers_that_are_none_are_bad_input(folder: Path, option: str, value: str) -> None:
    done = runner.invoke(app, ["certify", str(folder), option, value])
    assert isinstance(done.exception, BadInput) or done.exit_code == BadInput.exit_code


def table(folder: Path) -> Path:
    """Write the planned flight as a table of positions at 50 Hz."""
    times = np.arange(0, 2.5, 0.02)
    places = legs([[0, 0, 1], [1, 0, 1]]).evaluate(times)[:, :3]
    rows = [f"{t:.3f},r0,{x:.6f},{y:.6f},{z:.6f}" for t, (x, y, z) in zip(times, places.tolist(), strict=True)]
    path = folder / "capture.csv"
    path.write_text("time,body,x,y,z\n" + "\n".join(rows) + "\n")
    return path


def test_states_that_a_table_does_not_show_are_the_planned_ones_and_that_is_said(folder: Path) -> None:
    text = ok("certify", str(folder), "--flight", str(table(folder)), "--max-speed", "1.2")
    assert "satisfied" in text
    assert "Internal states are those of the certificate's planned actions" in text


@few_of(
    2,
    "actions", [[{}], [{"robot": "r0"}], [{"robot": "r9", "visit": 0, "time": 1.0, "source": "dry", "target": "wet"}],
                [{"robot": "r0", "visit": 0, "time": 1.0, "source": "dry", "target": "steam"}], [1], "none"],
)  # fmt: skip
def test_a_hand_edited_certificate_gives_no_states(folder: Path, actions: object) -> None:
    path = folder / "certificate.json"
    data = json.loads(path.read_text())
    data["actions"] = actions
    path.write_text(json.dumps(data))
    with pytest.raises((BadInput, NotCertified), match="action"):
        ok("certify", str(folder), "--flight", str(table(folder)), "--max-speed", "1.2")


@pytest.mark.slow
def test_certifying_again_keeps_the_clock_error(folder: Path) -> None:
    path = folder / "certificate.json"
    path.unlink()
    ok("certify", str(folder), "--clock-error", "0.05")
    assert "clocks up to 0.05 s apart" in ok("certify", str(folder))
    assert json.loads(path.read_text())["clock_error"] == 0.05
    ok("certify", str(folder), "--clock-error", "0")
    assert json.loads(path.read_text())["clock_error"] == 0.0


def test_a_folder_of_an_earlier_format_is_certified_again_with_its_clock_error(folder: Path) -> None:
    path = folder / "certificate.json"
    path.unlink()
    ok("certify", str(folder), "--clock-error", "0.05")
    path.unlink()
    earlier = {**certify(*read_folder(folder), clock_error=0.05).to_dict(), "format": 1}
    replace_listed(folder, path.name, json.dumps(earlier))
    done = runner.invoke(app, ["recheck", str(folder)])
    assert isinstance(done.exception, BadInput)
    assert "certify the folder again" in str(done.exception)
    assert "clocks up to 0.05 s apart" in ok("certify", str(folder))
    assert json.loads(path.read_text())["format"] == 2
    ok("recheck", str(folder))


@few_of(1, "form", ["crazyswarm2", "crazyflie-compressed"])
def test_what_an_export_certifies_anew_keeps_margin_and_clock_error(tmp_path: Path, form: str) -> None:
    """One piece: crazyswarm2's loader needs a second one, which is judged as well."""
    mission = small_mission("F G a", margin=0.02)
    plan, team = plan_of(mission, {"r0": [Visit(region="a")]}), {"r0": legs([[0, 0, 1], [1, 0, 1]])}
    out = write_folder(tmp_path / "out", plan, team, certify(plan, team, margin=0.01, clock_error=0.05))
    refused = runner.invoke(app, ["export", str(out), "--format", form, "--out", str(tmp_path / "export")])
    assert isinstance(refused.exception, NotCertified)
    assert "r0, flown by 'mellinger', strayed" in str(refused.exception)
    assert not (tmp_path / "export").exists()
    assert "not rehearsed with this vehicle's controller" in ok(
        "export", str(out), "--format", form, "--force", "--out", str(tmp_path / "export")
    )
    made = recheck(tmp_path / "export")
    assert (made.margin, made.clock_error) == (0.01, 0.05)
    assert made.checked == len(made.claims), "by the export's own proof"
    flown = load_csv(tmp_path / "export" / "r0.csv")
    assert made.trajectories["r0"] == flown.digest() != team["r0"].digest()
    assert len(flown) >= 2
    table = tmp_path / "export" / "proof" / "r0.csv"
    table.write_text(table.read_text().replace("\n", "\n ", 1))
    with pytest.raises(NotCertified, match=r"proof/r0\.csv was changed"):
        recheck(tmp_path / "export")


def test_a_recording_that_only_the_formula_would_let_pass_is_refused(tmp_path: Path) -> None:
    """A sequence without a formula, and a robot that is parked on the floor: nothing of it was flown."""
    plan, team, certificate = gates()
    folder = write_folder(tmp_path / "out", plan, team, certificate)
    rows = ["t,robot,x,y,z", *(f"{0.01 * k:.2f},quad0,-0.8,0,0" for k in range(int(100 * certificate.duration) + 2))]
    (tmp_path / "parked.csv").write_text("\n".join(rows) + "\n")
    arguments = ["certify", str(folder), "--flight", str(tmp_path / "parked.csv"), "--max-speed", "1.2"]
    for more in ([], ["--start", "0"], ["--json"]):
        done = runner.invoke(app, arguments + more)
        assert done.exit_code == NotCertified.exit_code
        assert "the planned 'gate0F' does not happen" in done.output
    found = json.loads(runner.invoke(app, [*arguments, "--json"]).output)
    assert found["outcome"] == "fails"
    (passages,) = (claim for claim in found["claims"] if claim["name"] == "passages")
    assert (passages["outcome"], passages["says"], passages["region"]) == ("fails", "broken", "gate0")


def test_what_a_verdict_rests_on_is_said_in_both_forms(folder: Path) -> None:
    arguments = ["certify", str(folder), "--flight", str(table(folder)), "--max-speed", "1.2", "--error", "0.0001"]
    text, data = ok(*arguments), json.loads(ok(*arguments, "--json"))
    assert data["outcome"] == "holds"
    for sentence in data["assumptions"]:
        assert sentence in text
    for what in ("planned actions", "1.2 m/s", "lasts", "began"):
        assert any(what in sentence for sentence in data["assumptions"])


def test_states_of_a_folder_whose_plan_was_changed_are_not_taken_over(folder: Path) -> None:
    path = folder / "certificate.json"
    data = json.loads(path.read_text())
    data["actions"][0]["time"] = 1.9
    path.write_text(json.dumps(data))
    with pytest.raises(NotCertified, match="actions"):
        ok("certify", str(folder), "--flight", str(table(folder)), "--max-speed", "1.2")
