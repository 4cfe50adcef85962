"""A patrol's end: laps that are flown through, and the proved braking behind the last one."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

import flight
from flight.exports.braking import AtMost, braked, ends_in_flight
from flight.exports.crazyflies.crazyflie import upload
from tests.helpers.motion.flights import legs, small_mission
from tests.helpers.motion.patrols import EAST, NORTH, circle, hermite, patrol
from tests.helpers.vehicles.trajectory_bytes import compressed_trajectory, poly4d_trajectory
from verify import certify
from verify.data import Trajectory
from verify.data.files.trajectory_csv import read_csv
from verify.flight_segments import judge_braking


@pytest.fixture(scope="module")
def certified():
    plan, path = patrol()
    return plan, path, certify(plan, {"r0": path})


def test_a_patrol_brakes_to_rest_behind_its_last_lap(certified, tmp_path) -> None:
    _, path, cert = certified
    flight.export({"r0": path}, cert, tmp_path, force=True)
    flown = read_csv((tmp_path / "r0.csv").read_text())
    laps = path.flattened(2)
    assert flown.part(0, len(laps)) == laps
    assert np.linalg.norm(laps.evaluate(laps.duration, 1)[:3]) == pytest.approx(1.0, abs=1e-3)
    for order in (1, 2, 3):
        assert np.abs(flown.evaluate(flown.duration, order)).max() < 1e-4
    note = (tmp_path / "README.txt").read_text()
    assert "Behind its last lap r0 brakes" in note


@pytest.mark.parametrize("target", ["crazyflie", "crazyflie-compressed"])
def test_every_format_of_a_crazyflie_ends_at_rest(certified, target, tmp_path) -> None:
    plan, path, cert = certified
    team = {"r0": path}
    if target != "crazyflie":
        team = flight.quantised(team)
        cert = certify(plan, team)
    flight.export(team, cert, tmp_path, format=target, force=True)
    (item,) = upload(tmp_path, {"r0": "radio://0/80/2M"}, dry_run=True)
    read = poly4d_trajectory if target == "crazyflie" else compressed_trajectory
    flown, laps = read(item.data), team["r0"].flattened(2)
    assert flown.part(0, len(laps)) == laps
    assert np.abs(flown.evaluate(flown.duration, 1)).max() < 1e-3


def test_a_heading_that_turns_around_once_a_lap_begins_anew_with_each_and_not_where_it_brakes() -> None:
    plan, path = patrol(repeat=3, ahead=True)
    found = braked(plan.mission, "r0", path, AtMost())
    assert found is not None
    claims = judge_braking(plan.mission, "r0", path, found.flown, Fraction(found.since))
    assert {claim.outcome for claim in claims} == {"holds"}
    turned = found.flown.coefficients.copy()
    turned[2, 3, 0] += 2 * np.pi
    refused = judge_braking(plan.mission, "r0", path, Trajectory(found.flown.durations, turned), Fraction(found.since))
    assert {claim.name for claim in refused if claim.outcome != "holds"} == {"laps", "continuity"}


def test_it_stops_before_it_shows_what_its_laps_do_not(certified) -> None:
    """Another lap comes to the north first: braking there is as its laps, braking towards a wall or another place is not."""
    plan, path, _ = certified
    found = braked(plan.mission, "r0", path, AtMost())
    assert found is not None
    since = sum(map(Fraction, path.flattened(2).durations.tolist()), Fraction(0))
    good = judge_braking(plan.mission, "r0", path, found.flown, since)
    assert {claim.outcome for claim in good} == {"holds"}
    wrong = f"{EAST}\n{NORTH}\nwrong: {{center: [0.3, 0.3, 1.0], radii: [0.2, 0.2, 0.2]}}"
    mission = small_mission("G F east", regions=wrong, starts=[(1.4, -0.2, 1.0)], margin=0.05, trace="infinite")
    mission = mission.model_copy(update={"spec": mission.spec.model_copy(update={"repeat": 2})})
    inside, laps = circle(0.0, 0.0), path.flattened(2)
    inside[0, :2] = 0.3
    last = Trajectory([2.0], hermite(circle(np.pi / 4, 1.0), inside, 2.0)[None].astype(np.float32))
    astray = AtMost()("r0", laps, last)
    assert astray is not None
    refused = {claim.name for claim in judge_braking(mission, "r0", path, astray, since) if claim.outcome != "holds"}
    assert refused == {"formula"}
    assert {claim.outcome for claim in judge_braking(mission, "r0", path, found.flown, since)} == {"holds"}


def test_other_laps_than_the_certified_ones_are_refused(certified) -> None:
    plan, path, _ = certified
    found = braked(plan.mission, "r0", path, AtMost())
    since = sum(map(Fraction, path.flattened(2).durations.tolist()), Fraction(0))
    moved = found.flown.coefficients.copy()
    moved[2, 0, 4] += 1e-5
    claims = judge_braking(plan.mission, "r0", path, Trajectory(found.flown.durations, moved), since)
    assert [claim.name for claim in claims if claim.outcome != "holds"][:1] == ["laps"]
    claims = judge_braking(plan.mission, "r0", path, found.flown, since + Fraction(1, 100))
    assert "laps" in {claim.name for claim in claims if claim.outcome != "holds"}


def test_it_needs_room_for_one_more_piece() -> None:
    plan, path = patrol(repeat=7)
    hover = legs([(1.4, -0.2, 1.0)], hold=1.0).coefficients[:1]
    more = Trajectory(np.concatenate([[1.0, 1.0], path.durations]), np.concatenate([hover, hover, path.coefficients]), cycle=3)
    assert len(more.flattened(7)) == 31
    assert braked(plan.mission, "r0", more, AtMost()) is None
    assert braked(plan.mission, "r0", path, AtMost(None)) is not None


def test_it_needs_room_by_the_missions_own_pieces(certified, tmp_path) -> None:
    plan, path, _ = certified
    laps = len(path.flattened(2))
    small = plan.mission.model_copy(update={"limits": plan.mission.limits.model_copy(update={"pieces": laps})})
    said = flight.export({"r0": path}, certify(plan.changed(mission=small), {"r0": path}), tmp_path, force=True).notes
    assert any("no braking behind it was proved that fits" in note for note in said)


def test_laps_that_rest_where_they_begin_need_none() -> None:
    assert not ends_in_flight(legs([(0, 0, 1), (1, 0, 1), (0, 0, 1)], cycle=0))
    assert not ends_in_flight(legs([(0, 0, 1), (1, 0, 1)]))
    assert ends_in_flight(patrol()[1])


def test_it_rests_in_front_of_a_hoop_and_not_in_its_opening(certified) -> None:
    plan, path, _ = certified
    before = braked(plan.mission, "r0", path, AtMost())
    assert before is not None
    x, y, z = before.flown.evaluate(before.flown.duration)[:3].tolist()
    heading = np.degrees(np.arctan2(y, x)) + 90.0
    gate = f"gate: {{center: [{x}, {y}, {z}], yaw_deg: {heading}, radii: [0.12, 0.12, 0.12], opening: 0.4, rim: 0.02}}"
    mission = small_mission("G F gate", regions=EAST, hoops=gate, starts=[(1.4, -0.2, 1.0)], margin=0.05, trace="infinite")
    mission = mission.model_copy(update={"spec": mission.spec.model_copy(update={"repeat": 2})})
    since = sum(map(Fraction, path.flattened(2).durations.tolist()), Fraction(0))
    assert {claim.outcome for claim in judge_braking(mission, "r0", path, before.flown, since)} == {"holds"}
    found = braked(mission, "r0", path, AtMost(None))
    assert found is not None
    there = found.flown.evaluate(found.flown.duration)[:3]
    normal = np.array(mission.hoops["gate"].normal)
    along = float((there - (x, y, z)) @ normal)
    across = float(np.linalg.norm(there - (x, y, z) - along * normal))
    assert np.hypot(max(across - 0.4, 0.0), along) >= 0.05
