"""The script that streams setpoints to PX4, held against vehicles that speak MAVLink over a local socket."""

from __future__ import annotations

import socket
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import flight
from tests.helpers.stand_ins import flight as made_flight
from tests.helpers.stand_ins import rest_to_rest, stand_in

pytest.importorskip("pymavlink", reason="pymavlink is not installed")

OFFBOARD, HOLD, POSITION = 6 << 16, 4 << 16 | 3 << 24, 3 << 16
RATE = 50.0


class Vehicle(threading.Thread):
    """An autopilot that hovers where it is until it is in offboard flight, and then is where its setpoints say."""

    def __init__(self, system: int, port: int, place, *, armed: bool = True, leaves_after: int | None = None) -> None:
        super().__init__(daemon=True)
        from pymavlink import mavutil

        self.link = mavutil.mavlink_connection(
            f"udpout:127.0.0.1:{port}", source_system=system, source_component=1, dialect="common"
        )
        self.place, self.armed, self.leaves_after = tuple(place), armed, leaves_after
        self.mode, self.before, self.flown, self.ended = POSITION, 0, [], threading.Event()

    def run(self) -> None:
        mavlink = self.link.mav
        while not self.ended.is_set():
            mavlink.heartbeat_send(2, 12, 1 | (128 if self.armed else 0), self.mode, 4)
            mavlink.local_position_ned_send(0, *self.place, 0.0, 0.0, 0.0)
            end = time.monotonic() + 0.02
            while time.monotonic() < end:
                message = self.link.recv_match(blocking=True, timeout=0.005)
                if message is not None:
                    self.take(message)
        self.link.close()

    def take(self, message) -> None:
        if message.get_type() == "COMMAND_LONG" and message.command == 176:
            self.mode = int(message.param2) << 16 | int(message.param3) << 24
        elif message.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
            if self.mode != OFFBOARD:
                self.before += 1
                return
            self.flown.append((message.time_boot_ms, message.x, message.y, message.z))
            self.place = (message.x, message.y, message.z)
            if self.leaves_after is not None and len(self.flown) > self.leaves_after:
                self.mode = POSITION


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as made:
        made.bind(("127.0.0.1", 0))
        return made.getsockname()[1]


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    plan, team = made_flight()
    short = {
        name: rest_to_rest([path.evaluate(0.0)[:3], path.evaluate(0.0)[:3] + np.array([0.1, 0.2, 0.1])], [0.6])
        for name, path in team.items()
    }
    folder = tmp_path_factory.mktemp("px4")
    flight.export(short, stand_in(plan, short), folder, format="px4", rate=RATE)
    return folder, short


def fly(exported, **changes) -> tuple[subprocess.CompletedProcess[str], dict[str, Vehicle]]:
    """Run the exported script against one vehicle a robot; `changes` are of the last robot's vehicle."""
    for _ in range(5):
        done, vehicles = fly_once(exported, **changes)
        if "late" not in done.stdout:  # a busy computer may not keep time, and the script is right to stop then
            break
    return done, vehicles


def fly_once(exported, **changes) -> tuple[subprocess.CompletedProcess[str], dict[str, Vehicle]]:
    folder, team = exported
    vehicles, addresses = {}, []
    for system, (name, path) in enumerate(team.items(), start=1):
        x, y, z = path.evaluate(0.0)[:3]
        port = free_port()
        mine = changes if system == len(team) else {}
        place = np.array([y, x, -z]) + mine.get("off", 0.0)
        vehicles[name] = Vehicle(system, port, place, **{k: v for k, v in mine.items() if k != "off"})
        addresses.append(f"{name}=udpin:127.0.0.1:{port}")
    for vehicle in vehicles.values():
        vehicle.start()
    try:
        done = subprocess.run(
            [sys.executable, folder / "stream_setpoints.py", *addresses],
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
        time.sleep(0.1)  # the last command is still on its way
    finally:
        for vehicle in vehicles.values():
            vehicle.ended.set()
            vehicle.join()
    return done, vehicles


def test_every_vehicle_gets_its_setpoints_in_time_and_holds_at_the_end(exported) -> None:
    done, vehicles = fly(exported)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "every robot is told to hold" in done.stdout
    for name, path in exported[1].items():
        vehicle = vehicles[name]
        assert vehicle.before >= RATE, "PX4 wants a second of setpoints before it changes to offboard flight"
        begin = next(i for i, (time_ms, *_) in enumerate(vehicle.flown) if time_ms > 0) - 1
        times = np.array([row[0] for row in vehicle.flown[begin:]]) / 1000.0
        assert np.allclose(times, np.minimum(np.arange(len(times)) / RATE, times[-1]), atol=1e-3)
        assert times[-1] == pytest.approx(0.6, abs=1e-3)
        x, y, z = path.evaluate(times)[:, :3].T
        assert np.allclose([row[1:] for row in vehicle.flown[begin:]], np.stack([y, x, -z], axis=1), atol=1e-5)
        assert vehicle.mode == HOLD


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"off": 0.2}, "too far from the start"),
        ({"armed": False}, "is not armed"),
        ({"leaves_after": 10}, "left offboard flight"),
    ],
)
def test_it_does_not_begin_or_go_on_where_it_must_not(exported, changes, says) -> None:
    done, vehicles = fly(exported, **changes)
    assert done.returncode == 1, done.stdout + done.stderr
    assert says in done.stdout
    moved = [max((row[0] for row in vehicle.flown), default=0) for vehicle in vehicles.values()]
    assert max(moved) < 600, "no vehicle was flown to the end"
    assert all(vehicle.mode != OFFBOARD for vehicle in vehicles.values()), "all hold, or never left their mode"
    if "leaves_after" not in changes:
        assert max(moved) == 0


def test_each_robot_needs_an_address(exported) -> None:
    folder, _ = exported
    done = subprocess.run(
        [sys.executable, folder / "stream_setpoints.py", "quad0="], capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == 2
    assert "give an address for each of" in done.stderr
