"""`ltlplan audit` from a fresh folder: what it prints, writes and ends with."""

from __future__ import annotations

import json
from pathlib import Path

from typer import Typer
from typer.testing import CliRunner

from ltlplan.commands import audit
from tests.helpers.motion.fleets import csv_text

app = Typer()
app.command("audit")(audit.command)


def run(folder: Path, *arguments: str):
    shows = folder / "show"
    shows.mkdir(exist_ok=True)
    for name, y in (("cf1", 0.0), ("cf2", 0.5)):
        (shows / f"{name}.csv").write_text(csv_text([(2.0, {"x": (0.0, 0.5), "y": (y,), "z": (1.0,)})]))
    return CliRunner().invoke(app, [str(shows), *arguments])


def test_a_sound_folder(tmp_path: Path) -> None:
    done = run(tmp_path, "--separation", "0.4", "--speed", "0.5", "--workspace=-1,-1,0,2,2,2", "--min-height", "0.5")
    assert done.exit_code == 0, done.output
    assert "separation: holds, judged. All 2 drones stay 0.5000 m apart at all times" in done.output
    assert "every claim holds, for all times from 0 to 2.000 s\n" in done.output
    assert done.output.endswith("all claims are judged: there is no proof for the kernel\n")


def test_a_breach_ends_with_5_and_the_whole_audit_is_written_once(tmp_path: Path) -> None:
    out = tmp_path / "audit.json"
    done = run(tmp_path, "--separation", "0.6", "--out", str(out))
    assert done.exit_code == 5
    assert "separation: fails. cf1 and cf2 are nearer than 0.6000 m from 0.0000 s to 2.0000 s" in done.output
    written = json.loads(out.read_text())
    assert not written["holds"]
    assert written["claims"][-1]["other"] == "cf2"
    out.write_text("mine")
    assert run(tmp_path, "--separation", "0.6", "--out", str(out)).exit_code != 5
    assert out.read_text() == "mine"


def test_a_page_is_written_and_a_page_of_the_user_s_is_kept(tmp_path: Path) -> None:
    page, mine = tmp_path / "audit.html", tmp_path / "mine.html"
    mine.write_text("mine")
    done = run(tmp_path, "--separation", "0.6", "--report", str(page))
    assert done.exit_code == 5
    assert done.output.endswith(f"wrote {page}\n")
    assert "cf1 and cf2 are nearer than 0.6000 m" in page.read_text()
    assert run(tmp_path, "--separation", "0.6", "--report", str(mine)).exit_code == 1
    assert mine.read_text() == "mine"


def test_a_proof_is_written_beside_the_audit_and_said_in_every_place(tmp_path: Path) -> None:
    place, page = tmp_path / "proof", tmp_path / "audit.html"
    asked = ("--separation", "0.4", "--workspace=-1,-1,0,2,2,2", "--proof", str(place), "--report", str(page))
    done = run(tmp_path, *asked)
    assert done.exit_code == 0, done.output
    assert "separation: holds, checked. All 2 drones" in done.output
    assert "\n2 of 3 claims checked by the kernel\n" in done.output
    assert f"wrote {place}\n" in done.output
    names = {path.name for path in place.iterdir()}
    assert names == {"audit.json", "cf1.csv", "cf2.csv", "check.pyz", "manifest.json", "proof.json", "statement.json"}
    claims = {claim["name"]: claim["proof"] for claim in json.loads((place / "audit.json").read_text())["claims"]}
    assert claims == {"continuity": "judged", "workspace": "checked", "separation": "checked"}
    assert "2 of 3 checked" in page.read_text()
    assert page.read_text().count("<td>checked</td>") == 2
    (place / "statement.json").write_text("mine")
    assert run(tmp_path, *asked).exit_code == 1
    assert (place / "statement.json").read_text() == "mine"


def test_json(tmp_path: Path) -> None:
    done = run(tmp_path, "--separation", "0.4", "--json")
    assert done.exit_code == 0
    assert json.loads(done.stdout)["drones"] == 2


def test_a_formula_over_a_mission_s_regions(tmp_path: Path) -> None:
    mission = tmp_path / "hall.yaml"
    mission.write_text(
        "format: 1\nname: hall\nregions: {a: {center: [0.5, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}}\n"
        "agents: {cf1: {start: [0.0, 0.0, 1.0]}, cf2: {start: [0.0, 0.5, 1.0]}}\n"
        "vehicle: crazyflie-2.1\nworkspace: {min: [-1, -1, 0], max: [2, 2, 2]}\nspec: {formula: F a}\nmargin: 0.01\n"
    )
    asked = ("--mission", str(mission), "--acceleration", "9")
    held, broken = run(tmp_path, *asked), run(tmp_path, *asked, "--formula", "G !a")
    assert "formula: holds, judged." in held.output
    assert "formula: fails." in broken.output
    assert "--mission" in str(run(tmp_path, "--formula", "F a").exception)


def test_drones_that_only_rest_are_told_as_that_and_missing_files_as_missing(tmp_path: Path) -> None:
    (tmp_path / "cf1.csv").write_text(csv_text([(2.0, {"x": (0.0,), "y": (0.0,), "z": (1.0,)})]))
    rests = CliRunner().invoke(app, [str(tmp_path / "cf1.csv"), "--acceleration", "1"])
    assert "nearest to the limit of limits.acceleration: cf1 0 at " in rests.output
    missing = CliRunner().invoke(app, [str(tmp_path / "cf2.csv"), "--speed", "1"])
    assert "There is no file or folder" in str(missing.exception)
    assert "cf2.csv" in str(missing.exception)
