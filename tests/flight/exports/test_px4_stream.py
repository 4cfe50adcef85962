"""The script that streams setpoints to PX4, held against vehicles that keep PX4's rules over a local socket."""

from __future__ import annotations

import contextlib
import json
import re
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import flight
from tests.helpers.motion.stand_ins import flight as made_flight
from tests.helpers.motion.stand_ins import rest_to_rest, stand_in
from tests.helpers.vehicles.px4_peer import HOLD, LAND, OFFBOARD, POSITION, Manner, Px4Peer, free_port

pytest.importorskip("pymavlink", reason="pymavlink is not installed")

RATE = 50.0


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    plan, team = made_flight()
    short = {
        name: rest_to_rest([path.evaluate(0.0)[:3], path.evaluate(0.0)[:3] + np.array([0.1, 0.2, 0.1])], [0.6])
        for name, path in team.items()
    }
    folder = tmp_path_factory.mktemp("px4")
    flight.export(short, stand_in(plan, short), folder, format="px4", rate=RATE, force=True)
    return folder, short


@contextlib.contextmanager
def vehicles_and_script(
    exported, manner: Manner | None = None, swapped: bool = False, unchecked: tuple[str, ...] = ("battery",)
):
    """Run the exported script against one vehicle a robot; `manner` is the last robot's."""
    folder, team = exported
    vehicles, addresses = {}, []
    for system, (name, path) in enumerate(team.items(), start=1):
        x, y, z = path.evaluate(0.0)[:3]
        port = free_port()
        vehicles[name] = Px4Peer(system, port, (y, x, -z), manner if system == len(team) else None)
        addresses.append(f"{name}=udpin:127.0.0.1:{port}")
    if swapped:
        one, other = vehicles.values()
        one.place, other.place = other.place, one.place
    for vehicle in vehicles.values():
        vehicle.start()
    script = subprocess.Popen(
        [sys.executable, "-u", folder / "stream_setpoints.py", *addresses, *(f"--unchecked={name}" for name in unchecked)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        yield vehicles, script
    finally:
        script.kill()
        script.wait()
        for vehicle in vehicles.values():
            vehicle.ended.set()
            vehicle.join()


def fly(
    exported, manner: Manner | None = None, *, swapped: bool = False, unchecked=("battery",)
) -> tuple[int, str, dict[str, Px4Peer]]:
    for _ in range(5):
        with vehicles_and_script(exported, manner, swapped, unchecked) as (vehicles, script):
            said, _ = script.communicate(timeout=60)
        if " late" not in said:  # a busy computer may not keep time, and the script is right to stop then
            break
    return script.returncode, said, vehicles


def test_every_vehicle_gets_its_setpoints_in_time_and_holds_at_the_end(exported) -> None:
    code, said, vehicles = fly(exported)
    assert code == 0, said
    assert "flown; every robot holds: land them" in said
    assert "1 s after its last setpoint each robot lands where it is, by itself" in said
    assert all(vehicle.parameters == {"COM_OF_LOSS_T": 1.0, "COM_OBL_RC_ACT": 4} for vehicle in vehicles.values())
    folder = sorted(exported[0].glob("flown-*"))[-1]
    data = json.loads((folder / "live.json").read_text())
    assert data["reason"] == ""
    assert data["ends"]["flight"] - data["starts"]["flight"] == pytest.approx(0.6)
    rows = [line.split(",") for line in (folder / "live.csv").read_text().splitlines()[1:]]
    for name, path in exported[1].items():
        own = np.array([[row[0], *row[2:]] for row in rows if row[1] == name], dtype=float)
        assert len(own) > 15
        away = [
            np.linalg.norm(path.evaluate(np.clip(t - np.linspace(0, 0.06, 20), 0, 0.6))[:, :3] - place, axis=1).min()
            for t, *place in own
        ]
        assert max(away) < 5e-3, "what is written are the laboratory's places, in time"
    for name, path in exported[1].items():
        vehicle = vehicles[name]
        assert vehicle.before >= RATE, "PX4 wants a second of setpoints before it changes to offboard flight"
        begin = next(i for i, (time_ms, *_) in enumerate(vehicle.flown) if time_ms > 0) - 1
        end = next(i for i, (time_ms, *_) in enumerate(vehicle.flown) if time_ms >= 600) + 1
        times = np.array([row[0] for row in vehicle.flown[begin:end]]) / 1000.0
        assert np.allclose(times, np.arange(len(times)) / RATE, atol=1e-3)
        assert all(row[0] == 600 for row in vehicle.flown[end:]), "it stays at the end until it holds"
        x, y, z = path.evaluate(times)[:, :3].T
        assert np.allclose([row[1:] for row in vehicle.flown[begin:end]], np.stack([y, x, -z], axis=1), atol=1e-5)
        assert vehicle.mode == HOLD
        assert vehicle.failsafes == 0


@pytest.mark.parametrize(
    ("manner", "says", "flies"),
    [
        pytest.param(Manner(restless=0.06), "quad1's place wanders by 0.1", False, marks=pytest.mark.slow),
        pytest.param(
            Manner(deaf_to_parameters=("COM_OBL_RC_ACT",)),
            "quad1 does not take COM_OF_LOSS_T = 1, COM_OBL_RC_ACT = 4",
            False,
            marks=pytest.mark.slow,
        ),
        pytest.param(Manner(other_system=7), "quad1 is system 2, and system 7 answers", False, marks=pytest.mark.slow),
        pytest.param(Manner(drifts=0.25), "m from its plan; the margin is 0.05 m", True, marks=pytest.mark.slow),
        pytest.param(Manner(leaves_after=10), "left offboard flight", True, marks=pytest.mark.slow),
        pytest.param(Manner(falls_silent_after=20), "confirmed neither hold nor land", True, marks=pytest.mark.slow),
    ],
)
def test_it_does_not_begin_or_go_on_where_it_must_not(exported, manner, says, flies) -> None:
    code, said, vehicles = fly(exported, manner)
    assert code == 1, said
    assert says in said
    assert "flown;" not in said
    moved = [max((row[0] for row in vehicle.flown), default=0) for vehicle in vehicles.values()]
    if manner.falls_silent_after is None:
        assert max(moved) < 600, "no vehicle was flown to the end"
    assert all(vehicle.mode != OFFBOARD for vehicle in vehicles.values()), "all hold, or never left their mode"
    assert flies or max(moved) == 0
    if manner.leaves_after is not None:
        assert vehicles[list(vehicles)[-1]].mode == POSITION, "what a pilot takes over is left to them"


@pytest.mark.slow  # what is looked at before is one core, which test_crazyswarm_preflight holds
def test_all_that_is_wrong_is_said_at_once_and_nothing_is_asked_of_anybody(exported) -> None:
    code, said, vehicles = fly(exported, Manner(off=0.2, armed=False, turned=0.5, estimator=1, battery=0))
    assert code == 1
    for sentence in (
        "quad1 is 0.200 m from its start; 0.025 m are allowed: put it at (1.200, 0.900, 0.800)",
        "quad1 is not armed: bring it to a hover at its start first",
        "quad1's heading is 29 degrees off: turn it to 0 degrees",
        "quad1's estimator has not settled",
        "quad1's battery lasts 0 s of the 1 s needed",
    ):
        assert sentence in said
    assert "not checked: whether quad0's battery lasts for 1 s: its charge is not reported" in said
    assert not any(vehicle.asked or vehicle.before for vehicle in vehicles.values())


@pytest.mark.slow
def test_robots_that_hover_the_wrong_way_round_do_not_begin(exported) -> None:
    code, said, vehicles = fly(exported, swapped=True)
    assert code == 1
    assert "quad0 is 1.800 m from its start, and is where quad1 belongs" in said
    assert not any(vehicle.asked for vehicle in vehicles.values())


@pytest.mark.slow
def test_robots_too_near_to_each_other_hold(exported, tmp_path) -> None:
    folder = shutil.copytree(exported[0], tmp_path / "out")
    data = json.loads((folder / "flight.json").read_text())
    data["separation"] = [["quad0", "quad1", 1.81]]
    (folder / "flight.json").write_text(json.dumps(data))
    code, said, vehicles = fly((folder, exported[1]))
    assert code == 1
    assert re.search(r"(quad0 and quad1|quad1 and quad0) are 1\.\d+ m apart, and 1\.810 m are asked", said)
    assert all(vehicle.mode == HOLD for vehicle in vehicles.values())


@pytest.mark.slow
def test_commands_that_are_lost_are_sent_again(exported) -> None:
    code, said, vehicles = fly(exported, Manner(loses_commands=2))
    assert code == 0, said
    assert all(vehicle.mode == HOLD for vehicle in vehicles.values())


@pytest.mark.slow
def test_a_robot_that_does_not_take_hold_is_told_to_land(exported) -> None:
    code, said, vehicles = fly(exported, Manner(deaf_to=(HOLD,)))
    last = list(vehicles.values())[-1]
    assert code == 1, said
    assert "quad1 does not answer to hold" in said
    assert "neither" not in said
    assert last.mode == LAND
    assert last.failsafes == 0, "setpoints went on until it was on its way down"


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_all_hold_where_the_script_is_interrupted(exported, number) -> None:
    with vehicles_and_script(exported) as (vehicles, script):
        deadline = time.monotonic() + 30
        while not all(vehicle.mode == OFFBOARD for vehicle in vehicles.values()) and time.monotonic() < deadline:
            time.sleep(0.01)
        script.send_signal(number)
        said, _ = script.communicate(timeout=60)
    assert script.returncode == 1, said
    assert "stopped: interrupted" in said
    assert all(vehicle.mode == HOLD and vehicle.failsafes == 0 for vehicle in vehicles.values())


@pytest.mark.slow
def test_where_the_script_is_killed_vehicles_land_by_themselves_and_what_was_written_is_whole(exported) -> None:
    with vehicles_and_script(exported) as (vehicles, script):
        deadline = time.monotonic() + 30
        while not all(vehicle.mode == OFFBOARD for vehicle in vehicles.values()) and time.monotonic() < deadline:
            time.sleep(0.01)
        time.sleep(0.3)
        script.kill()
        script.communicate()
        while not all(vehicle.mode == LAND for vehicle in vehicles.values()) and time.monotonic() < deadline:
            time.sleep(0.01)
    assert all(vehicle.failsafes == 1 for vehicle in vehicles.values())
    folder = sorted(exported[0].glob("flown-*"))[-1]
    assert json.loads((folder / "live.json").read_text())["reason"] == "it was not ended by the script itself"
    assert len((folder / "poses.csv").read_text().splitlines()) > 5


def test_each_robot_needs_an_address(exported) -> None:
    folder, _ = exported
    done = subprocess.run(
        [sys.executable, folder / "stream_setpoints.py", "quad0="], capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == 2
    assert "give an address for each of" in done.stderr


def test_two_robots_with_one_address_are_refused(exported) -> None:
    folder, team = exported
    same = [f"{name}=udpin:127.0.0.1:14540" for name in team]
    done = subprocess.run([sys.executable, folder / "stream_setpoints.py", *same], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "two robots have one address" in done.stderr


def test_where_pymavlink_is_not_one_sentence_says_so(exported) -> None:
    folder, team = exported
    addresses = [f"{name}=udpin:127.0.0.1:{free_port()}" for name in team]
    without = "import runpy, sys; sys.modules['pymavlink'] = None; sys.argv.pop(0); sys.path[0] = sys.argv[0].rpartition('/')[0]; runpy.run_path(sys.argv[0], run_name='__main__')"
    asked = [sys.executable, "-c", without, folder / "stream_setpoints.py", *addresses]
    done = subprocess.run(asked, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "stopped: pymavlink is not installed here: pip install pymavlink" in done.stdout


SILENT = Manner(reports_heading=False, estimator=None)


@pytest.mark.slow
def test_what_a_vehicle_does_not_report_is_not_checked_and_keeps_all_from_beginning(exported) -> None:
    code, said, vehicles = fly(exported, SILENT, unchecked=())
    assert code == 1
    assert "not checked: the heading of quad1: it is not reported" in said
    assert "not checked: whether quad1's estimator has settled: it does not report it (ESTIMATOR_STATUS)" in said
    assert "add --unchecked heading --unchecked estimator --unchecked battery to fly without that" in said
    assert not any(vehicle.asked or vehicle.before for vehicle in vehicles.values())


@pytest.mark.slow
def test_what_is_not_reported_may_be_accepted_by_name(exported) -> None:
    code, said, vehicles = fly(exported, SILENT, unchecked=("heading", "estimator", "battery"))
    assert code == 0, said
    assert "not checked: the heading of quad1" in said
    for vehicle in vehicles.values():
        assert max(np.diff(vehicle.beats)) < 1.5, "a ground station's heartbeat comes once a second"
