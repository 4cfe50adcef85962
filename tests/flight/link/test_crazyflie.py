"""The link to Crazyflies: real cflib to vehicles that answer and fly as the firmware does."""

from __future__ import annotations

import numpy as np
import pytest

from flight.exports.crazyflies.compressed import quantised
from flight.exports.crazyflies.memory import PIECE
from flight.link.link import LinkLost
from flight.link.live_executive import fly_live
from verify.data import BadInput, DoesNotFit, Trajectory, load_vehicle

pytest.importorskip("cflib", reason="cflib is not installed")

from flight.link.crazyflie.link import CrazyflieLink
from flight.link.crazyflie.memory import Memory
from tests.helpers.few import few_of
from tests.helpers.live.live_stages import parts_stages, patrol_stages, places_of
from tests.helpers.motion.flights import legs
from tests.helpers.vehicles.crazyflie_firmware import Manner
from tests.helpers.vehicles.crazyflie_peer import in_the_air
from tests.helpers.vehicles.crazyflie_radio import crazyradio
from tests.helpers.vehicles.crazyflie_stages import GROUNDS, PLACES, UNCHECKED, stage
from tests.helpers.vehicles.trajectory_bytes import compressed_trajectory


def test_parameters_are_set_and_read_back_and_health_is_reported(mission) -> None:
    with in_the_air(mission, PLACES, {"r1": Manner(battery=40.0)}) as (air, addresses):
        link = CrazyflieLink(mission, addresses, masses={"r0": 0.0312})
        told = link.parameters("r0")
        states = [link.health(name) for name in link.robots]
        poses = {name: link.pose(name) for name in link.robots}
        link.close()
    assert told == pytest.approx(
        {
            "stabilizer.estimator": 2, "stabilizer.controller": 2, "ctrlMel.mass": 0.0312, "ctrlMel.massThrust": 132000,
            "locSrv.extPosStdDev": 0.001, "locSrv.extQuatStdDev": 0.05,
        }
    )  # fmt: skip
    assert air.vehicles["r2"].parameters["ctrlMel.mass"] == pytest.approx(0.033)
    assert all(health.ready and health.settled for health in states)
    assert np.allclose([poses[name].position for name in PLACES], list(PLACES.values()), atol=1e-3)
    assert air.spinning == []


@few_of(
    1,
    ("manner", "says"),
    [
        (Manner(lacks=("ctrlMel.massThrust",)), r"r1's firmware has no parameter ctrlMel\.massThrust"),
        (Manner(keeps=("ctrlMel.mass",)), r"r1 does not take a parameter: ctrlMel\.mass is 0\.029, not 0\.033"),
        (Manner(lacks=("stateEstimate.z",)), r"r1's firmware has no log variable stateEstimate\.z"),
        (Manner(silent_since=0.0), "r1 at peer://r1 cannot be reached: Too many packets lost"),
        pytest.param(Manner(frozen_since=0.0), "r1 at peer://r1 does not answer", marks=pytest.mark.slow),
    ],
)
def test_vehicles_that_cannot_fly_are_named_before_anything_spins(mission, manner, says) -> None:
    with (
        in_the_air(mission, PLACES, {"r1": manner}) as (air, addresses),
        pytest.raises(LinkLost, match=says),
    ):
        CrazyflieLink(mission, addresses)
    assert air.spinning == []


@pytest.mark.parametrize(
    ("addresses", "says"),
    [
        ({"r1": "radio://0/80/2M/E7E7E7E702", "r2": "radio://0/80/2M/E7E7E7E703"}, "no address of r0; write r0=radio://"),
        ({"r0": "radio://0/80/2M/E7E7E7E701", "r1": "radio://1/80/2M/e7e7e7e701", "r2": "x"}, "r0 and r1 have one address"),
        ({"r0": "radio://0/80", "r1": "radio://0/80/2M/E7E7E7E7E7", "r2": "x"}, "r0 and r1 have one address"),
        ({"r0": "radio://0/080/2M/E7E7E7E7E7/", "r1": "radio://ABC/80/1M?rate_limit=100", "r2": "x"}, "r0 and r1 have one address"),
        ({"r0": "radio://0/80/2M/E7E7E7E70111", "r1": "x", "r2": "y"}, "radio://0/80/2M/E7E7E7E70111 is no address: write radio://"),
        ({"r0": "radio://0/126/2M/E7E7E7E701", "r1": "x", "r2": "y"}, "a channel of 0 to 125"),
        ({"r0": "radio://0/80/2m/E7E7E7E701", "r1": "x", "r2": "y"}, "a rate of 250K, 1M or 2M"),
        ({"r7": "radio://0/80/2M/E7E7E7E702"}, "r7"),
    ],
)  # fmt: skip
def test_addresses_that_cannot_be_are_refused_before_a_radio_is_opened(mission, addresses, says) -> None:
    with pytest.raises(BadInput, match=says):
        CrazyflieLink(mission, addresses)


def test_what_is_no_crazyflie_or_weighs_otherwise_is_refused(mission) -> None:
    addresses = {name: f"peer://{name}" for name in PLACES}
    with pytest.raises(DoesNotFit, match=r"r1 weighs 40\.0 g, and was certified as 33\.0 g"):
        CrazyflieLink(mission, addresses, masses={"r1": 0.040})
    racer = mission.model_copy(update={"vehicle": load_vehicle("split-s-racer")})
    with pytest.raises(DoesNotFit, match=r"r0 flies 'split-s-racer' .* which is no Crazyflie"):
        CrazyflieLink(racer, addresses)


def test_a_radio_that_is_not_there_and_an_address_that_nobody_knows(mission) -> None:
    wrong = {name: f"radio://7/80/2M/E7E7E7E70{i}" for i, name in enumerate(PLACES)}
    with pytest.raises(
        LinkLost, match=r"r0 at radio://7/80/2M/E7E7E7E700, r1 at .* cannot be reached: Cannot find a Crazyradio Dongle\."
    ):
        CrazyflieLink(mission, wrong)
    with pytest.raises(LinkLost, match=r"r0 at nowhere://0, .* cannot be reached: No driver found or malformed URI"):
        CrazyflieLink(mission, {name: f"nowhere://{i}" for i, name in enumerate(PLACES)})


@pytest.mark.slow
def test_what_keeps_a_team_on_the_ground_is_said(mission, flown) -> None:
    manners = {"r0": Manner(blocks=True), "r1": Manner(unsettled=True), "r2": Manner(off=0.1)}
    with in_the_air(mission, PLACES, manners) as (air, addresses):
        link = CrazyflieLink(mission, addresses)
        done = fly_live(link, flown, grounds=GROUNDS, unchecked=UNCHECKED)
        link.close()
    assert not done.flown
    for says in ("r0 is not ready: ", "r1's estimator has not settled", "r2 is 0.100 m from where the climb begins"):
        assert says in done.reason
    assert air.spinning == []
    assert all(vehicle.starts == [] for vehicle in air.vehicles.values())


def test_flights_lie_side_by_side_and_what_does_not_fit_waits() -> None:
    short, long = legs([[0, 0, 1], [1, 0, 1], [0, 0, 1]]), legs([[k % 2, 0, 1] for k in range(31)])
    memory = Memory()
    first, second = memory.take(0, "r0", short), memory.take(1, "r0", short)
    assert first is not None
    assert second is not None
    assert (first.offset, second.offset) == (0, len(first.data))
    assert memory.take(2, "r0", long) is None
    assert memory.missing(1) is None
    entry = memory.missing(2)
    assert entry is not None
    assert (entry.trajectory_id, entry.offset, entry.pieces) == (2, 0, 30)
    assert memory.missing(2) is None
    again = memory.missing(0)
    assert again is not None, "it was written over"
    with pytest.raises(
        DoesNotFit, match=r"r0's flight has 39 pieces.* `ltlplan export RUN --format crazyflie-compressed --out FOLDER`"
    ):
        memory.take(3, "r0", legs([[k % 2, 0, 1] for k in range(40)]))


def test_what_only_fits_compressed_is_stored_compressed(mission) -> None:
    rough = Trajectory(np.full(40, 0.5), np.repeat(legs([[0, 0, 1], [0, 0, 1]]).coefficients, 40, axis=0))
    path = quantised({"r0": rough})["r0"]
    assert len(path) > 31
    with in_the_air(mission, PLACES) as (air, addresses):
        link = CrazyflieLink(mission, addresses)
        link.upload("r0", 3, path)
        link.close()
    offset, pieces, kind = air.vehicles["r0"].defined[3]
    assert (offset, pieces, kind) == (0, len(path), 1)
    assert compressed_trajectory(bytes(air.vehicles["r0"].memory)) == path


def test_a_stage_that_no_memory_holds_is_refused_before_anything_spins(mission, flown) -> None:
    high = {name: [x, y, 0.5] for name, (x, y, _) in PLACES.items()}
    long = stage("flight", {name: [[x + 0.005 * (k % 2), y, z] for k in range(34)] for name, (x, y, z) in high.items()})
    with in_the_air(mission, PLACES) as (air, addresses):
        link = CrazyflieLink(mission, addresses)
        with pytest.raises(DoesNotFit, match="r0's flight has 33 pieces, and its trajectory memory of 4096 bytes holds 31"):
            link.require_room(long.paths)
        link.require_room(flown[1].paths)
        with pytest.raises(DoesNotFit, match="r0's flight has 33 pieces"):
            fly_live(link, (flown[0], long), grounds=GROUNDS, unchecked=UNCHECKED)
        link.close()
        assert all(vehicle.starts == [] for vehicle in air.vehicles.values())


@pytest.mark.slow
@pytest.mark.parametrize("trouble", [0.0, 0.03])
def test_a_team_climbs_flies_and_lands(mission, flown, trouble) -> None:
    with in_the_air(mission, PLACES, loss=trouble, disorder=trouble) as (air, addresses):
        link = CrazyflieLink(mission, addresses)
        done = fly_live(link, flown, grounds=GROUNDS, unchecked=UNCHECKED)
        link.close()
        spinning = air.spinning
    assert done.flown, done.reason
    assert done.unsafe == ()
    assert spinning == []
    for vehicle in air.vehicles.values():
        assert [number for _, number in vehicle.starts][-1] == len(flown) - 1
        assert vehicle.stopped_at < 0.1
        assert not vehicle.locked, "nobody stopped it in an emergency"
        assert not vehicle.dropped
    for number in range(len(flown)):
        last = [max(when for when, which in vehicle.starts if which == number) for vehicle in air.vehicles.values()]
        assert max(last) - min(last) < 0.05


@pytest.fixture
def small_memory(monkeypatch) -> None:
    """Vehicles of which each holds two pieces at once."""
    monkeypatch.setattr("flight.link.crazyflie.link.Memory", lambda _room: Memory(2 * PIECE))


def flown_from_above(stages):
    """Fly stages to their end, from where their first begins; return how that ended, and the vehicles."""
    mission, places = stages[1].plan.mission, places_of(stages)
    with in_the_air(mission, places) as (air, addresses):
        link = CrazyflieLink(mission, addresses, accuracy=0.005)
        done = fly_live(link, stages, grounds=dict.fromkeys(places, 0.0), unchecked=UNCHECKED)
        link.close()
        spinning = air.spinning
    assert done.flown, done.reason
    assert spinning == []
    return done, air


@pytest.mark.slow
@pytest.mark.usefixtures("small_memory")
def test_parts_are_written_when_their_turn_comes_and_begun_in_common() -> None:
    stages = parts_stages()
    done, air = flown_from_above(stages)
    begun = done.record.parts["flight"]
    assert len(begun) == 3
    assert all(pause > 1.0 for pause in done.record.pauses("flight"))
    times = sorted({row[0] for row in done.record.poses if begun[0][0] < row[0] < begun[-1][1]})
    assert max(np.diff(times)) < 0.5, "they are watched while a part is written"
    for vehicle in air.vehicles.values():
        assert vehicle.defined[1][0] == PIECE
        assert all(vehicle.defined[number][0] == 0 for number in (2, 3)), "written over what was flown before"
        assert list(dict.fromkeys(number for _, number in vehicle.starts)) == [0, 1, 2, 3, 4]
        assert not vehicle.dropped
    for number in range(5):
        last = [max(when for when, which in vehicle.starts if which == number) for vehicle in air.vehicles.values()]
        assert max(last) - min(last) < 0.05


@pytest.mark.slow
@pytest.mark.usefixtures("small_memory")
@pytest.mark.parametrize("after", [1, 6])
def test_who_is_interrupted_while_a_part_is_written_lands(after) -> None:
    stages = parts_stages()
    mission, places, left = stages[1].plan.mission, places_of(stages), [after]
    with in_the_air(mission, places) as (air, addresses):
        link = CrazyflieLink(mission, addresses, accuracy=0.005)
        bring = link.bring

        def interrupted(number: int, meanwhile) -> None:
            def waiting() -> None:
                meanwhile()
                left[0] -= 1
                if left[0] == 0:
                    raise KeyboardInterrupt

            bring(number, waiting)

        link.bring = interrupted
        done = fly_live(link, stages, grounds=dict.fromkeys(places, 0.0), unchecked=UNCHECKED)
        link.close()
        spinning = air.spinning
    assert done.reason == "interrupted"
    assert done.unsafe == ()
    assert spinning == []
    assert "flight" in done.record.starts
    assert "landing" not in done.record.starts
    assert not any(vehicle.dropped for vehicle in air.vehicles.values())


@pytest.mark.slow
def test_a_patrol_brakes_behind_its_laps_and_lands() -> None:
    stages = patrol_stages()
    done, air = flown_from_above(stages)
    assert list(done.record.starts) == ["climb", "flight", "braking", "landing"]
    assert [number for _, number in air.vehicles["r0"].starts][-1] == 2, "what brakes lies on board with the laps"
    assert not air.vehicles["r0"].dropped


@pytest.mark.slow
def test_one_broadcast_a_channel_starts_everybody_by_radio(mission, flown, monkeypatch) -> None:
    from cflib.crtp import radiodriver

    where = {"r0": (80, "E7E7E7E701"), "r1": (80, "E7E7E7E702"), "r2": (90, "E7E7E7E701")}
    with in_the_air(mission, PLACES) as (air, _):
        radio = crazyradio(air, where)
        monkeypatch.setattr(radiodriver, "Crazyradio", radio)
        monkeypatch.setattr(radiodriver.RadioManager, "_radios", [])
        link = CrazyflieLink(mission, {name: f"radio://0/{channel}/2M/{address}" for name, (channel, address) in where.items()})
        done = fly_live(link, flown, grounds=GROUNDS, unchecked=UNCHECKED)
        link.close()
        assert done.flown, done.reason
        assert air.spinning == []
        assert {channel for channel, *_ in radio.broadcasts} == {80, 90}
        assert len(radio.broadcasts) == 3 * 2 * len(flown)
        assert all(header >> 4 == 8 and content[0] == 13 for _, header, content in radio.broadcasts)
        for number in range(len(flown)):
            first = [min(when for when, which in vehicle.starts if which == number) for vehicle in air.vehicles.values()]
            assert max(first) - min(first) < 0.02

        lost = {
            name: f"radio://0/{channel}/2M/{address}"
            for name, (channel, address) in {**where, "r1": (80, "E7E7E7E7FF")}.items()
        }
        with pytest.raises(LinkLost, match="r1 at radio://0/80/2M/E7E7E7E7FF cannot be reached: Too many packets lost"):
            CrazyflieLink(mission, lost)


@pytest.mark.slow
def test_brushless_vehicles_begin_once_their_motors_have_spun_up(mission, flown) -> None:
    with in_the_air(mission, PLACES, {name: Manner(needs_arming=True) for name in PLACES}) as (air, addresses):
        link = CrazyflieLink(mission, addresses)
        done = fly_live(link, flown, grounds=GROUNDS, unchecked=UNCHECKED)
        link.close()
        spinning = air.spinning
    assert done.flown, done.reason
    assert spinning == []
    for vehicle in air.vehicles.values():
        assert vehicle.busy == [], "a start while motors spin up is answered EBUSY"
        assert vehicle.supervisor.said.index("arming") < vehicle.supervisor.said.index("ready")


@pytest.mark.slow
def test_motors_that_do_not_spin_up_are_named_before_anything_flies(mission, flown) -> None:
    with in_the_air(mission, PLACES, {"r1": Manner(needs_arming=True, spin_up=np.inf)}) as (air, addresses):
        link = CrazyflieLink(mission, addresses)
        done = fly_live(link, flown, grounds=GROUNDS, unchecked=UNCHECKED)
        link.close()
    assert "r1 at peer://r1 armed, but cannot fly (its motors did not spin up" in done.reason
    assert all(vehicle.starts == [] for vehicle in air.vehicles.values())


@pytest.mark.slow
def test_motors_stop_where_vehicles_stand_and_not_above(mission, flown) -> None:
    """The firmware ends a landing itself, and says 2 s later that it does not fly any more."""
    with in_the_air(mission, PLACES) as (air, addresses):
        link = CrazyflieLink(mission, addresses)
        done = fly_live(link, flown, grounds=GROUNDS, unchecked=UNCHECKED)
        link.close()
    assert done.flown, done.reason
    for vehicle in air.vehicles.values():
        assert vehicle.stopped_in
        assert not vehicle.locked
        assert "flying" not in vehicle.stopped_in
    assert all(vehicle.impact < 1.2 for vehicle in air.vehicles.values())
