"""Full-state set-points as they are sent, and what a Crazyflie's commanders make of streamed ones and their end."""

import math
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flight.control.flatness import feed_forward, lifted
from ltlplan.missions import load_mission
from verify.data import DoesNotFit

pytest.importorskip("cflib", reason="cflib is not installed")

from cflib.crazyflie.commander import Commander

from flight.link.crazyflie.setpoints import ROUNDING, full_state, require_near
from tests.helpers.vehicles.crazyflie_firmware import EBUSY, LANDS, Firmware
from tests.helpers.vehicles.crazyflie_setpoints import full_state as read

HALF = 0.5e-3
FLATS = st.tuples(
    st.lists(st.floats(-30.0, 30.0), min_size=3, max_size=3), st.floats(-math.pi, math.pi),
    st.lists(st.floats(-2.0, 2.0), min_size=4, max_size=4), st.lists(st.floats(-4.0, 4.0), min_size=3, max_size=3),
    st.lists(st.floats(-15.0, 15.0), min_size=3, max_size=3),
)  # fmt: skip


def flat_of(place, heading, velocity, acceleration, jerk) -> np.ndarray:
    flat = np.zeros((4, 4))
    flat[0], flat[1], flat[2, :3], flat[3, :3] = (*place, heading), velocity, acceleration, jerk
    return flat


@given(FLATS)
def test_what_arrives_is_what_was_meant_rounded(parts) -> None:
    flat = flat_of(*parts)
    data = full_state(flat)
    assert len(data) == 29
    got = read(data)
    assert np.abs(got[:3, :3] - flat[:3, :3]).max() <= ROUNDING + 1e-9
    tilt = math.acos(lifted(flat[2, :3, None])[2, 0] / np.linalg.norm(lifted(flat[2, :3, None])))
    assert abs(math.remainder(got[0, 3] - flat[0, 3], math.tau)) <= math.radians(0.2) / math.cos(tilt)
    leads = feed_forward(lifted(flat[2, :3, None]), flat[3, :3, None], np.zeros((3, 1)), flat[0, 3:], flat[1, 3:], np.zeros(1))
    _, *whole = struct.unpack("<B9hI3h", data)
    assert np.abs(np.array(whole[10:]) / 1000.0 - leads.rates[:, 0]).max() <= HALF + 1e-9


def test_the_packet_is_cflibs_own() -> None:
    sent = []

    class Cf:
        def send_packet(self, packet) -> None:
            sent.append(bytes(packet.data))

    flat = flat_of([1.25, -2.5, 0.75], 0.5, [0.25, -0.5, 0.125, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0])
    turn = [0.0, 0.0, math.sin(0.25), math.cos(0.25)]
    Commander(Cf()).send_full_state_setpoint([1.25, -2.5, 0.75], [0.25, -0.5, 0.125], [0.0] * 3, turn, 0.0, 0.0, 0.0)
    assert sent == [full_state(flat)]


@pytest.mark.parametrize(("row", "column", "value"), [(0, 0, 32.768), (1, 2, -40.0), (2, 1, 32.8), (0, 1, math.nan)])
def test_what_sixteen_bits_do_not_hold_is_not_sent(row, column, value) -> None:
    flat = flat_of([0.0, 0.0, 1.0], 0.0, [0.0] * 4, [0.0] * 3, [0.0] * 3)
    flat[row, column] = value
    with pytest.raises(DoesNotFit, match=r"exceeds .* 32\.767"):
        full_state(flat)


def test_a_workspace_that_reaches_too_far_is_refused() -> None:
    mission = load_mission("firefighting")
    require_near(mission)
    far = mission.model_copy(
        update={"workspace": mission.workspace.model_copy(update={"max": (33.0, *mission.workspace.max[1:])})}
    )
    with pytest.raises(DoesNotFit, match="reaches 33 m"):
        require_near(far)


class Told:
    """A vehicle whose clock stands until it is moved, hovering at a set-point."""

    def __init__(self) -> None:
        self.now = 0.0
        self.vehicle = Firmware("r", np.array([0.0, 0.0, 1.0, 0.0]), lambda: self.now)
        self.stream()

    def stream(self) -> None:
        self.vehicle.receive(7, 0, full_state(flat_of([0.0, 0.0, 1.0], 0.0, [0.5, 0.0, 0.0, 0.0], [0.0] * 3, [0.0] * 3)))

    def wait(self, seconds: float) -> None:
        self.now += seconds
        self.vehicle.tick()

    def go_to(self) -> int:
        ((_, _, answer),) = self.vehicle.receive(8, 0, struct.pack("<BBBB5f", 12, 0, 0, 0, 0.3, 0.0, 1.0, 0.0, 1.0))
        return answer[3]

    def land(self) -> int:
        ((_, _, answer),) = self.vehicle.receive(8, 0, struct.pack("<BBff?f", 8, 0, 0.05, 0.0, True, 2.0))
        return answer[3]

    def relax(self) -> None:
        self.vehicle.receive(7, 1, struct.pack("<BI", 0, 0))


def test_the_firmware_stops_motors_where_set_points_end_and_its_commander_has_nothing_to_fly() -> None:
    told = Told()
    told.relax()
    assert not told.vehicle.spinning
    assert told.vehicle.dropped


def test_the_firmware_follows_its_commander_only_once_set_points_have_ended() -> None:
    told = Told()
    assert told.go_to() == 0
    told.wait(0.3)
    assert told.vehicle.wanted(told.now)[1, 0] == 0.5, "the last set-point"
    told.relax()
    told.wait(2.0)
    assert told.vehicle.spinning
    assert not told.vehicle.locked
    assert np.allclose(told.vehicle.wanted(told.now)[0, :3], (0.3, 0.0, 1.0))


def test_a_set_point_that_comes_after_a_command_makes_the_firmware_forget_it() -> None:
    told = Told()
    assert told.go_to() == 0
    told.stream()
    told.relax()
    assert told.vehicle.dropped


def test_the_firmware_levels_out_and_then_stops_motors_without_set_points() -> None:
    told = Told()
    told.wait(0.49)
    assert told.vehicle.wanted(told.now)[1, 0] == 0.5
    told.vehicle.measured[0], told.vehicle.velocity = 0.2, np.array([0.4, 0.0, 0.0])
    told.wait(0.02)
    level = told.vehicle.wanted(told.now)
    assert (level[0, 0], level[0, 2], level[1, 0]) == (0.2, 1.0, 0.4)
    told.wait(1.4)
    assert told.vehicle.spinning
    told.wait(0.1)
    assert told.vehicle.locked
    assert not told.vehicle.spinning
    assert told.go_to() == EBUSY


def test_the_firmware_refuses_a_landing_while_it_lands() -> None:
    told = Told()
    assert told.land() == 0
    told.relax()
    told.wait(0.5)
    assert told.land() == LANDS
    told.wait(2.0)
    assert not told.vehicle.spinning
    assert not told.vehicle.dropped
