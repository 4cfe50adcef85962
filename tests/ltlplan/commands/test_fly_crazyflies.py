"""`ltlplan fly RUN --link crazyflie` as a user types it, against simulated vehicles, and without any."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from typer.testing import CliRunner

import ltlplan
from ltlplan.cli import app
from tests.helpers.commands import ROOT
from verify.data import BadInput
from verify.data.errors import LtlplanError

pytest.importorskip("cflib", reason="cflib is not installed")

MISSION = """
format: 1
name: pair
spec: {formula: F ahead}
regions:
  ahead: {center: [0.4, -0.5, 0.4], radii: [0.2, 0.2, 0.2]}
agents:
  one: {start: [0.0, -0.5, 0.4]}
  two: {start: [0.0, 0.5, 0.4]}
vehicle: crazyflie-2.1
workspace: {min: [-2.0, -2.0, 0.2], max: [2.0, 2.0, 2.0]}
margin: 0.09
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("crazyflies") / "run"
    ltlplan.run(ltlplan.parse_mission(MISSION), folder)
    return folder


def started(run: Path, out: Path) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "tests.helpers.vehicles.crazyflie_process", str(run), str(out)]
    return subprocess.Popen(command, cwd=ROOT, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


@pytest.fixture
def unproved(tmp_path: Path) -> Path:
    """A folder with a mission and nothing that proves it: what is refused of it is refused before anything is proved."""
    folder = tmp_path / "unproved"
    folder.mkdir()
    (folder / "mission.yaml").write_text(MISSION)
    (folder / "twice.yaml").write_text("robots: {one: {id: 4}, two: {id: 4}}\n")
    (folder / "half.yaml").write_text("robots: {one: {uri: 'udpin:127.0.0.1:1'}}\n")
    (folder / "seen.yaml").write_text("robots: {one: {id: 4}}\nmotion_capture: {type: vicon}\n")
    return folder


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ("crazyflie", "no address of one, two; write one=radio://"),
        ("mavlink", "no address of one, two; write one=udpin:"),
        ("mavlink --address one=udpin:127.0.0.1:1 --address one=udpin:127.0.0.1:2", "--address names one twice"),
        ("mavlink --address one=udpin:127.0.0.1:1 --address two=udpin:127.0.0.1:1", "one and two have one address"),
        ("mavlink --address onr=udpin:127.0.0.1:1", "'onr' is not a robot of the mission. Did you mean 'one'?"),
        ("mavlink --address one=/no/such --address two=udpin:127.0.0.1:1", "one cannot be reached at /no/such"),
        ("crazyflie --address one=radio://0/80/2M/E7E7E7E701 --address two=radio://0/80/2M/E7E7E7E7013", "is no address"),
        (
            "crazyflie --address one=radio://0/80/2M/E7E7E7E701 --address two=radio://0/80/2M/E7E7E7E702",
            "Cannot find a Crazyradio",
        ),
        ("crazyflie --inventory nowhere.yaml", "nowhere.yaml"),
        ("mavlink --inventory unproved/twice.yaml", "one and two are both MAVLink system 4"),
        ("mavlink --inventory unproved/half.yaml", "no address of two; write two=udpin:"),
        ("mavlink --inventory unproved/seen.yaml", "motion_capture goes with --link crazyflie"),
        ("mavlink --place one=1,2", "write NAME=x,y,z in m"),
        ("simulated --place one=nan,0,0", "a place is finite"),
        ("simulated --place one=0,0,0 --place one=0,0,0", "--place names one twice"),
        ("simulated --place three=0,0,0", "'three' is not a robot of the mission"),
    ],
)
def test_what_cannot_be_reached_is_said_before_anything_is_proved(unproved: Path, arguments, says) -> None:
    within = arguments.replace("unproved/", f"{unproved}/").split()
    with pytest.raises(LtlplanError, match=re.escape(says)) as refused:
        CliRunner().invoke(app, ["fly", str(unproved), "--link", *within], catch_exceptions=False)
    assert refused.value.exit_code == 2


@pytest.mark.slow
def test_a_run_is_flown_and_its_recording_judged(run: Path, tmp_path: Path) -> None:
    flying = started(run, tmp_path / "live")
    said, errors = flying.communicate(timeout=120)
    assert flying.returncode == 0, said + errors
    ended = json.loads(said.splitlines()[-1])
    assert ended["spinning"] == []
    assert not ended["dropped"]
    assert max(ended["heights"]) < 0.1
    assert ended["masses"] == pytest.approx([0.0325, 0.0325])
    record = json.loads((tmp_path / "live" / "live.json").read_text())
    assert record["parameters"]["one"]["ctrlMel.mass"] == pytest.approx(0.0325)
    assert list(record["starts"]) == ["climb", "way", "flight", "landing"]
    judged = ltlplan.judge_flight(run, tmp_path / "live" / "live.csv", start=0.0, error=0.005, max_speed=1.5)
    assert {claim["name"]: claim["outcome"] for claim in judged.verdict.to_dict()["claims"]}["formula"] == "holds"


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_in_flight_lands_the_team(run: Path, tmp_path: Path, number: signal.Signals) -> None:
    flying = started(run, tmp_path / "live")
    assert flying.stdout is not None
    for line in flying.stdout:
        if line.startswith("flight"):
            break
    time.sleep(0.3)
    flying.send_signal(number)
    said, errors = flying.communicate(timeout=60)
    assert flying.returncode == 128 + number, said + errors
    ended = json.loads(said.splitlines()[-1])
    assert ended["spinning"] == []
    assert not ended["dropped"]
    assert max(ended["heights"]) < 0.2
    assert "interrupted" in errors


@pytest.mark.slow
def test_without_a_radio_one_sentence_says_so(run: Path, tmp_path: Path) -> None:
    inventory = tmp_path / "lab.yaml"
    inventory.write_text("robots: {one: {uri: 'radio://0/80/2M/E7E7E7E701'}, two: {uri: 'radio://0/80/2M/E7E7E7E702'}}\n")
    command = [sys.executable, "-m", "ltlplan", "fly", str(run), "--link", "crazyflie", "--inventory", str(inventory)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 2
    assert (
        "one at radio://0/80/2M/E7E7E7E701, two at radio://0/80/2M/E7E7E7E702 cannot be reached: Cannot find a Crazyradio Dongle."
        in done.stderr
    )
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (
            ("--link", "simulated", "--inventory", "lab.yaml"),
            "--inventory goes with --link crazyflie and mavlink, not simulated",
        ),
        (("--link", "simulated", "--address", "one=radio://0/80"), "--address goes with --link crazyflie and mavlink"),
        (("--link", "crazyflie", "--real-time"), "--real-time goes with --link simulated"),
        (("--link", "crazyflie", "--wind", "0.2"), r"--wind, .* go with simulated robots; crazyflie is real"),
        (("--link", "mavlink", "--noise", "0.001"), r"--wind, .* go with simulated robots; mavlink is real"),
        (("--inventory", "lab.yaml"), "go with --link"),
    ],
)
def test_options_of_other_links_are_refused(arguments, says) -> None:
    with pytest.raises(BadInput, match=says):
        CliRunner().invoke(app, ["fly", "run", *arguments], catch_exceptions=False)
