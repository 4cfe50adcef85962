"""`ltlplan online --link`: what is refused, events that are told while it flies, and a flight as a person makes one."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.helpers.few import few_of
from tests.helpers.live.live_missions import PAIR
from tests.ltlplan.commands.test_interruptions import heed_interrupts

ROOT = Path(__file__).parents[3]


@few_of(
    4,
    ("options", "said"),
    [
        (["--link", "simulated"], "add --certified"),
        (["--link", "crazyflie", "--certified"], "no address of one, two; write one=radio://"),
        (["--inventory", "lab.yaml"], "--inventory, --unchecked, --follow and --standby go with --link"),
        (
            ["--link", "simulated", "--certified", "--inventory", "lab.yaml"],
            "--inventory goes with --link crazyflie and mavlink",
        ),
        (["--follow", "-"], "go with --link"),
        (["--link", "simulated", "--certified", "--follow", "nothing"], "make it before"),
        (["--link", "simulated", "--certified", "--event", "1 three fails"], "'three' is not a robot"),
        (["--link", "simulated", "--certified", "--event", "1 two joins 0,0,1"], "'two' is a robot of this mission already"),
        (["--link", "simulated", "--certified", "--standby", "one=0,0,0"], "one is a robot of the mission"),
        (["--link", "simulated", "--certified", "--standby", "three"], "write NAME=x,y,z in m, such as three="),
        (
            ["--link", "simulated", "--certified", "--standby", "three=0,0,0.2"],
            "where others may fly: `workspace` begins at z = 0.3 m",
        ),
        (["--link", "mavlink", "--certified", "--standby", "three=0,0,0"], "no address of one, two, three"),
        (["--link", "mavlink", "--certified", "--noise", "0.001"], "mavlink is real"),
    ],
)
def test_what_cannot_be_is_refused_before_anything_spins(ltlplan, tmp_path, options, said):
    (tmp_path / "pair.yaml").write_text(PAIR)
    done = ltlplan("online", "pair.yaml", *options, cwd=tmp_path)
    assert done.returncode == 2
    assert said in done.stderr


def begun(folder, *options):
    """Begin a flight in real time that is told events through a named pipe, and return both once it flies."""
    (folder / "pair.yaml").write_text(PAIR)
    os.mkfifo(folder / "pipe")
    command = [sys.executable, "-m", "ltlplan", "online", "pair.yaml", "--certified", "--link", "simulated", "--noise", "0.001"]
    process = subprocess.Popen(
        [*command, "--follow", "pipe", "--out", "out", *options], cwd=folder, env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, preexec_fn=heed_interrupts,
    )  # fmt: skip
    assert process.stdout is not None
    for line in process.stdout:
        if line.startswith("flight"):
            return process
    raise AssertionError("it never flew")


def tell(folder, line):
    with (folder / "pipe").open("w") as file:
        file.write(f"{line}\n")


@pytest.mark.slow
def test_a_flight_that_is_told_another_formula_is_judged_to_the_same_verdict(ltlplan, tmp_path):
    process = begun(tmp_path)
    tell(tmp_path, "formula F left & F right & F(left & F right)")
    printed, _ = process.communicate(timeout=120)
    assert process.returncode == 0, printed
    live = json.loads((tmp_path / "out" / "live.json").read_text())
    (answer,) = live["answers"]
    assert 0 < answer["stop"] < answer["proved"] < answer["begun"]
    judged = ltlplan(
        "certify", "out", "--flight", "out/flight.csv", "--max-speed", "1.5", "--error", "0.006", "--start", "0", cwd=tmp_path
    )
    assert judged.returncode == 0, judged.stdout
    assert "satisfied" in judged.stdout
    page = (tmp_path / "out" / "report.html").read_text()
    assert "over a link" in page


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_lands_the_team_and_keeps_what_was_flown(tmp_path, number):
    process = begun(tmp_path)
    tell(tmp_path, "formula F left & F right & F(left & F right)")
    time.sleep(0.5)
    process.send_signal(number)
    printed, _ = process.communicate(timeout=120)
    assert process.returncode == 128 + number, printed
    assert "The flight was ended: interrupted" in printed
    assert "all robots land." in printed
    assert "the motors of one, two are stopped." in printed
    assert (tmp_path / "out" / "poses.csv").exists()


def told_online(folder, *more):
    """Begin a flight of simulated Crazyflies, whose masses are the inventory's, and return it once it flies."""
    pytest.importorskip("cflib", reason="cflib is not installed")
    (folder / "pair.yaml").write_text(PAIR)
    command = [
        sys.executable,
        "-m",
        "tests.helpers.vehicles.crazyflie_process",
        str(folder / "pair.yaml"),
        str(folder / "out"),
        *more,
    ]
    process = subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, preexec_fn=heed_interrupts
    )
    assert process.stdout is not None
    for line in process.stdout:
        if line.startswith("flight"):
            return process
    raise AssertionError("it never flew")


@pytest.mark.slow
def test_crazyflies_are_told_another_formula(tmp_path):
    process = told_online(tmp_path, "--event", "1 formula F left & F right & F(left & F right)")
    printed, _ = process.communicate(timeout=120)
    assert process.returncode == 0, printed
    ended = json.loads(printed.strip().splitlines()[-1])
    assert not any(ended["spinning"])
    assert not any(ended["locked"])
    assert not ended["dropped"]
    assert ended["starts"] == [0, 0], "nothing lies on board"
    assert min(ended["streamed"]) > 200
    assert ended["masses"] == pytest.approx([0.0325, 0.0325])
    assert "On board when the link is gone: 0.5 s after its last set-point a Crazyflie levels out" in printed
    (answer,) = json.loads((tmp_path / "out" / "live.json").read_text())["answers"]
    assert 0 < answer["stop"] < answer["proved"] < answer["begun"]


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_lands_crazyflies(tmp_path, number):
    process = told_online(tmp_path)
    time.sleep(0.5)
    process.send_signal(number)
    printed, _ = process.communicate(timeout=120)
    assert process.returncode == 128 + number, printed
    ended = json.loads(printed.strip().splitlines()[-1])
    assert not any(ended["spinning"])
    assert not any(ended["locked"])
    assert not ended["dropped"]
    assert max(ended["heights"]) < 0.2
    assert "The flight was ended: interrupted" in printed
