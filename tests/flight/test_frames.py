"""The laboratory's frame: what is exported, flown over links and recorded lies there; what is certified in the mission's."""

from __future__ import annotations

import csv
import dataclasses
import json
import math

import numpy as np
import pytest

import flight
import ltlplan
from flight.frames import in_laboratory
from flight.link.framed import FramedLink
from flight.link.live_executive import fly_live
from flight.link.simulated import SimulatedLink
from flight.logs.placed import in_mission
from ltlplan.live_phases import stages
from ltlplan.pipeline import certified_team
from ltlplan.recorded import judge_flight
from tests.helpers.few import few_of
from tests.helpers.live.live_missions import pair
from tests.helpers.motion.stand_ins import minimum_snap
from tests.verify.test_run_folder import write_folder
from verify import certify
from verify.data import BadInput, DoesNotFit
from verify.data.frame import Frame
from verify.recordings.alignment import given

MISSION = pair("[-1.0, 0.4, 1.0]", "[1.0, 0.4, 1.0]", floor=0.2, more="frame: {rotation_deg: 90.0, offset: [3.0, -1.0, 0.1]}")
PLACES = {"one": (-1.0, -0.5, 0.0), "two": (1.0, -0.5, 0.0)}
GROUNDS = dict.fromkeys(PLACES, 0.0)


@pytest.fixture(scope="module")
def certified():
    mission = ltlplan.parse_mission(MISSION)
    return mission, certified_team(ltlplan.plan(mission, pace="nominal"))


def places_there(frame: Frame) -> dict[str, tuple[float, float, float]]:
    return {name: tuple(frame.to_laboratory(place).tolist()) for name, place in PLACES.items()}


def link_there(mission, frame: Frame, yaw_deg: float | None = None) -> SimulatedLink:
    """Vehicles that stand right in a laboratory with this frame."""
    turned = frame.rotation_deg if yaw_deg is None else yaw_deg
    agents = {name: agent.model_copy(update={"yaw_deg": turned}) for name, agent in mission.agents.items()}
    return SimulatedLink(mission.model_copy(update={"agents": agents}), places_there(frame))


def test_places_turn_and_move_there_and_back() -> None:
    frame = Frame(rotation_deg=90.0, offset=(3.0, -1.0, 0.1))
    assert frame.to_laboratory([1.0, 0.0, 0.5]).tolist() == [3.0, 0.0, 0.6]
    other = Frame(rotation_deg=-200.5, offset=(0.3, 0.7, -0.2))
    points = np.random.default_rng(0).normal(size=(50, 3))
    assert np.allclose(other.to_mission(other.to_laboratory(points)), points, atol=1e-14)
    turned = other.to_laboratory([1.0, 0.0, 0.0]) - np.array(other.offset)
    assert math.degrees(math.atan2(turned[1], turned[0])) == pytest.approx(159.5)


def test_a_flight_in_the_laboratory_is_the_certified_one_but_for_what_it_says() -> None:
    path, frame = (
        minimum_snap([(0, 0, 1), (1, 0.5, 1.2), (-1, 0.2, 1)], [2.0, 3.0]),
        Frame(rotation_deg=33.0, offset=(5.0, 2.0, 0.0)),
    )
    there, off = in_laboratory(frame, path)
    times = np.linspace(0.0, path.duration, 500)
    assert there.is_float32
    apart = np.linalg.norm(there.evaluate(times)[:, :3] - frame.to_laboratory(path.evaluate(times)[:, :3]), axis=1).max()
    assert apart <= off + 1e-12
    assert off < 1e-5
    assert there.evaluate(0.0)[3] == pytest.approx(path.evaluate(0.0)[3] + math.radians(33.0))
    with pytest.raises(DoesNotFit, match="bring the laboratory's origin nearer"):
        in_laboratory(Frame(offset=(1e6 + 0.3, 0.0, 0.0)), path)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("{rotation: 90}", r"frame\.rotation: unknown key\. Did you mean 'rotation_deg'\? Known here: rotation_deg, offset\."),
        ("{offset: [1, 2]}", r"frame\.offset"),
        ("{rotation_deg: .nan}", r"frame\.rotation_deg"),
    ],
)
def test_frames_that_make_no_sense_are_refused(text, says) -> None:
    with pytest.raises(BadInput, match=says):
        ltlplan.parse_mission(MISSION.replace("{rotation_deg: 90.0, offset: [3.0, -1.0, 0.1]}", text))


def test_exports_lie_in_the_laboratory_and_say_so(certified, tmp_path) -> None:
    mission, done = certified
    made = flight.export(done.team, done.certificate, tmp_path / "out", format="crazyswarm2", force=True)
    rows = list(csv.reader((tmp_path / "out" / "one.csv").read_text().splitlines()))
    first = np.array([float(value) for value in rows[1]])
    assert first[[1, 9, 17]] == pytest.approx(mission.frame.to_laboratory(mission.agents["one"].start), abs=1e-6)
    assert first[25] == pytest.approx(math.pi / 2)
    assert any("turned by 90 degrees about z and moved by (3, -1, 0.1) m" in note for note in made.notes)


def test_compressed_flights_are_refused_where_the_frame_leads_off_their_grid(certified, tmp_path) -> None:
    mission, done = certified
    plan, team = done.plan.changed(mission=mission.changed(frame=Frame(rotation_deg=30.0))), flight.quantised(done.team)
    says = r"grid of millimetres, off which the mission's `frame` leads \(the mission turned by 30 degrees"
    with pytest.raises(DoesNotFit, match=says):
        flight.export(team, certify(plan, team), tmp_path / "out", format="crazyflie-compressed", force=True)


@pytest.mark.slow
def test_a_flight_over_a_link_is_flown_there_and_its_record_judged_here(certified, tmp_path) -> None:
    mission, done = certified
    flown = stages(done.plan, done.team, done.certificate, PLACES)
    inner = link_there(mission, mission.frame)
    result = fly_live(FramedLink(inner, mission.frame), flown, grounds=GROUNDS)
    assert result.flown, result.reason
    assert not inner.spinning
    for name, text in result.record.files(mission.frame).items():
        (tmp_path / name).write_text(text)
    first = (tmp_path / "poses.csv").read_text().splitlines()[1].split(",")
    assert [float(x) for x in first[2:]] == pytest.approx(places_there(mission.frame)[first[1]], abs=0.02)
    assert json.loads((tmp_path / "live.json").read_text())["starts"]
    ltlplan.run(mission, tmp_path / "run")
    judged = judge_flight(tmp_path / "run", tmp_path / "live.csv", max_speed=1.5, start=0.0)
    claims = {claim.name: claim.outcome for claim in judged.verdict.claims}
    assert claims["formula"] == "holds"
    assert any("frame is the laboratory's" in note for note in judged.samples.notes)


def test_a_wrong_frame_is_told_in_one_sentence_before_anything_spins(certified) -> None:
    mission, done = certified
    flown = stages(done.plan, done.team, done.certificate, PLACES)
    inner = link_there(mission, Frame(rotation_deg=60.0, offset=(3.0, -1.2, 0.1)))
    result = fly_live(FramedLink(inner, mission.frame), flown, grounds=GROUNDS)
    assert not result.flown
    assert result.reason.startswith(
        "the robots are measured where the mission has them, but turned by -30.0 degrees about z and moved by"
    )
    assert ";" not in result.reason
    assert not inner.spinning
    swapped = FramedLink(link_there(mission, Frame(rotation_deg=270.0, offset=(3.0, -1.0, 0.1)), yaw_deg=90.0), mission.frame)
    assert "put it at" in fly_live(swapped, flown, grounds=GROUNDS).reason


# -- recordings ------------------------------------------------------------------------------------------------------


def recording_there(done, off: float = 0.0) -> flight.Recording:
    """The certified flight as the laboratory's cameras saw it, `off` m beside its plan."""
    frame, team = done.plan.mission.frame, done.team
    times = np.arange(0.0, max(path.duration for path in team.values()) + 0.005, 0.01)
    seen = [frame.to_laboratory(path.evaluate(np.minimum(times, path.duration))[:, :3] + [0, 0, off]) for path in team.values()]
    return flight.Recording(tuple(team), times, np.stack(seen, axis=1), begins=(0.0, 0.0))


def our_log(done, off: float = 0.0) -> flight.FlightLog:
    """The same flight as we log it: in the mission's frame."""
    found = in_mission(recording_there(done, off), done.plan.mission)
    zeros = np.zeros_like(found.position)
    letters = ((frozenset[str](),) * len(found.robots),) * len(found.times)
    flat = zeros[..., 0]
    return flight.FlightLog("pair", found.robots, found.times, found.position, zeros, zeros, flat, zeros, flat, letters)


@few_of(1, "ending", [".csv", ".parquet", ".mcap"])
def test_a_log_of_ours_is_judged_in_the_missions_frame_from_its_own_start(certified, tmp_path, ending) -> None:
    pytest.importorskip({".parquet": "pyarrow", ".mcap": "mcap"}.get(ending, "numpy"))
    mission, done = certified
    write_folder(tmp_path / "run", done.plan, done.team, done.certificate)
    for off, outcome in ((0.0, "holds"), (1.12, "fails")):
        path = flight.write_log(our_log(done, off), tmp_path / f"flight{off:g}{ending}")
        judged = judge_flight(tmp_path / "run", path, max_speed=1.5)
        assert {claim.outcome for claim in judged.verdict.claims if claim.name == "tube"} == {outcome}
        assert judged.verdict.alignment == given(0.0, 0.0)
        with pytest.raises(BadInput, match="for it only one start may be given"):
            judge_flight(tmp_path / "run", path, max_speed=1.5, told=flight.RecordingOptions(axes="y,-x,z"))
        read = flight.read_flown(path, tuple(mission.agents), flight.RecordingOptions())
        assert flight.compare(read, done.certificate, done.team).covered == (outcome == "holds")


def test_comparing_takes_a_recording_to_the_missions_frame(certified) -> None:
    mission, done = certified
    there = recording_there(done)
    for found in (there, in_mission(there, mission), our_log(done)):
        assert flight.compare(found, done.certificate, done.team, plan=done.plan).covered
    here = dataclasses.replace(
        in_mission(there, mission), frame="laboratory"
    )  # places in the mission's numbers, so that all are elsewhere
    for found in (here, recording_there(done, 0.2), our_log(done, 0.2)):
        assert flight.compare(found, done.certificate, done.team, plan=done.plan).tube == "outside"
