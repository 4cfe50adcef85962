"""Flights in parts: the judge proves that a team can pause where they are cut, and refuses parts that were tampered with."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import flight
from tests.helpers.motion.flights import legs, plan_of, small_mission
from tests.verify.test_run_folder import write_folder
from verify import Certificate, certify, judge, recheck
from verify.certificate import payload_digest
from verify.data import BadInput, NotCertified, Plan, Trajectory
from verify.data.files.trajectory_csv import load_csv, write_csv
from verify.data.plan import Visit
from verify.run_folder import read_folder

BALLS = "a: {center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}\nb: {center: [0.0, 1.0, 1.0], radii: [0.2, 0.2, 0.2]}"
POINTS = [[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]


def cut(path: Trajectory, *cuts: int) -> Trajectory:
    return Trajectory(path.durations, path.coefficients, cycle=path.cycle, cuts=cuts)


def part_outcomes(certificate: Certificate) -> list[tuple[str, str]]:
    return [(claim.outcome, claim.sentence) for claim in certificate.claims if claim.name == "parts"]


@pytest.fixture(scope="module")
def made() -> Plan:
    return plan_of(small_mission("F a & F b", regions=BALLS, margin=0.01), {"r0": [Visit(region="a"), Visit(region="b")]})


def test_a_flight_is_cut_where_it_rests(made: Plan) -> None:
    whole = legs(POINTS)
    assert part_outcomes(certify(made, {"r0": whole})) == []
    parts = certify(made, {"r0": cut(whole, 1, 2)})
    ((outcome, sentence),) = part_outcomes(parts)
    assert outcome == "holds"
    assert "3 parts of at most 1 pieces (its vehicle holds 31)" in sentence
    assert not parts.covers({"r0": whole}), "parts are what was certified, not the whole"


def test_a_cut_in_full_flight_is_refused(made: Plan) -> None:
    first, *others = legs(POINTS).coefficients
    half = float(legs(POINTS).durations[0]) / 2
    shift = np.array([[float(np.polynomial.polynomial.polyval(half, np.polynomial.polynomial.polyder(row, k))) / np.prod(np.arange(1, k + 1)) for k in range(8)] for row in first])  # fmt: skip
    moving = Trajectory([half, half, *legs(POINTS).durations[1:]], np.stack([first, shift, *others]))
    assert judge(made, {"r0": moving}, largest=False).holds
    ((outcome, sentence),) = part_outcomes(judge(made, {"r0": cut(moving, 1)}, largest=False))
    assert outcome == "fails"
    assert "does not rest at the cut at 1.1111 s: its velocity is" in sentence


def test_a_gap_and_another_order_of_parts_are_refused(made: Plan) -> None:
    whole = legs(POINTS)
    moved = whole.coefficients.copy()
    moved[1, 0, 0] += 0.002
    ((outcome, sentence),) = part_outcomes(judge(made, {"r0": cut(Trajectory(whole.durations, moved), 1, 2)}, largest=False))
    assert (outcome, "0.002 m from where it rests" in sentence) == ("fails", True)
    order = [1, 0, 2]
    swapped = cut(Trajectory(whole.durations[order], whole.coefficients[order]), 1, 2)
    assert [outcome for outcome, _ in part_outcomes(judge(made, {"r0": swapped}, largest=False))] == ["fails"]


def test_a_part_holds_no_more_pieces_than_the_vehicle(made: Plan) -> None:
    small = made.mission.model_copy(update={"vehicle": made.mission.vehicle.changed(pieces=2)})
    plan = made.model_copy(update={"mission": small})
    assert certify(plan, {"r0": cut(legs(POINTS), 1)}).holds
    longer = legs([*POINTS, [0, 1, 1.2], [0, 1, 1]])
    ((outcome, sentence),) = part_outcomes(judge(plan, {"r0": cut(longer, 1, 3)}, largest=False))
    assert outcome == "holds"
    ((outcome, sentence),) = part_outcomes(judge(plan, {"r0": cut(longer, 1)}, largest=False))
    assert (outcome, sentence) == ("fails", "r0: part 2 has 4 pieces, and its vehicle holds 2.")


def test_pauses_count_in_an_endurance(made: Plan) -> None:
    vehicle = made.mission.vehicle.changed(endurance=80.0)
    plan = made.model_copy(update={"mission": made.mission.model_copy(update={"vehicle": vehicle})})
    assert judge(plan, {"r0": legs(POINTS)}, largest=False).holds
    (claim,) = (c for c in judge(plan, {"r0": cut(legs(POINTS), 2)}, largest=False).claims if c.name == "limits.endurance")
    assert claim.outcome == "holds"
    (claim,) = (c for c in judge(plan, {"r0": cut(legs(POINTS), 1, 2)}, largest=False).claims if c.name == "limits.endurance")
    assert claim.outcome == "fails"
    assert "2 pauses between parts count 60 s each" in claim.sentence


def test_a_team_is_cut_at_one_instant() -> None:
    mission = small_mission("F a & F b", regions=BALLS, margin=0.01, starts=((0.0, 0.0, 1.0), (0.0, -1.0, 1.0)))
    plan = plan_of(mission, {"r0": [Visit(region="a"), Visit(region="b")]})
    first, durations = cut(legs(POINTS), 2), legs(POINTS).durations
    other = legs([[0, -1, 1], [1, -1, 1]])
    hover = np.zeros((2, 4, 8))
    hover[:, :3, 0] = [1.0, -1.0, 1.0]

    def waiting(pause: float) -> Trajectory:
        return cut(Trajectory([*other.durations, pause, 1.0], np.concatenate([other.coefficients, hover])), 2)

    together = durations[0] + durations[1] - other.durations[0]
    assert judge(plan, {"r0": first, "r1": waiting(together)}, largest=False).holds
    late = judge(plan, {"r0": first, "r1": waiting(together + 2.0**-20)}, largest=False)
    assert [outcome for outcome, _ in part_outcomes(late)] == ["holds", "fails"]
    assert "a team is cut at one instant" in part_outcomes(late)[1][1]
    without = judge(plan, {"r0": first, "r1": other}, largest=False)
    assert "r1: it has 0 cuts and r0 has 1" in part_outcomes(without)[1][1]


def test_laps_that_begin_with_a_part_begin_at_rest() -> None:
    mission = small_mission("G F a", regions=BALLS, margin=0.01, trace="infinite")
    plan = plan_of(mission, {"r0": [Visit(region="a")]})
    robot = plan.robots["r0"].model_copy(update={"cycle_visit": 0, "cycle_waypoint": 0})
    plan = plan.model_copy(update={"robots": {"r0": robot}})
    lap = legs([[0, 0, 1], [1, 0, 1], [0, 0, 1]], cycle=0)
    assert certify(plan, {"r0": cut(lap, 0)}).holds
    assert certify(plan, {"r0": cut(lap, 0, 1)}).holds
    with pytest.raises(BadInput, match="the lap begins with piece 0"):
        cut(lap, 1)


def test_a_folder_of_parts_is_proved_again_and_tampered_ones_are_refused(tmp_path, made: Plan) -> None:
    team = {"r0": cut(legs(POINTS), 2)}
    certificate = certify(made, team)
    folder = write_folder(tmp_path / "out", made, team, certificate)
    assert recheck(folder).covers(team)
    assert read_folder(folder)[1] == team
    written = json.loads((folder / "certificate.json").read_text())
    for forged in ([1], [1, 2], [], [9], [2, 1]):
        entry = {**written["trajectories"]["r0"], "cuts": forged}
        body = {**written, "trajectories": {"r0": entry}}
        body["digest"] = payload_digest({key: value for key, value in body.items() if key != "digest"})
        (folder / "certificate.json").write_text(json.dumps(body))
        with pytest.raises(NotCertified, match="was changed"):
            recheck(folder)
    moving = replace(certificate, cuts={"r0": (1,)})
    assert moving.digest() != certificate.digest()


def test_a_folder_of_an_earlier_format_is_cut_as_it_was(tmp_path, made: Plan) -> None:
    team = {"r0": cut(legs(POINTS), 2)}
    folder = write_folder(tmp_path / "out", made, team, certify(made, team))
    written = json.loads((folder / "certificate.json").read_text())
    (folder / "certificate.json").write_text(json.dumps({**written, "format": 1}))
    assert read_folder(folder)[1] == team


def test_files_of_parts_beside_a_run_are_those_of_its_flight(tmp_path, made: Plan) -> None:
    team = {"r0": cut(legs(POINTS), 2)}
    certificate = certify(made, team)
    folder = write_folder(tmp_path / "out", made, team, certificate)
    parts = flight.export(team, certificate, folder / "crazyswarm2", force=True).folder
    assert recheck(folder).covers(team)
    first, second = (parts / f"r0-part{number}.csv" for number in (1, 2))
    kept = {file: file.read_text() for file in (first, second)}
    first.write_text(kept[second])
    second.write_text(kept[first])
    with pytest.raises(NotCertified, match=r"r0-part1.csv was changed: it is not this part"):
        recheck(folder)
    for file, text in kept.items():
        file.write_text(text)
    moved = load_csv(second).coefficients.copy()
    moved[1, 0, 0] += 0.01  # the hover behind a single piece
    second.write_text(write_csv(Trajectory(load_csv(second).durations, moved.astype(np.float32))))
    with pytest.raises(NotCertified, match=r"r0-part2.csv was changed"):
        recheck(folder)
    second.unlink()
    with pytest.raises(NotCertified, match=r"r0-part2.csv is missing"):
        recheck(folder)


@pytest.mark.parametrize("cuts", [(0,), (3,), (2, 1), (1, 1), (True,), (1.5,), (-1,)])
def test_cuts_are_at_pieces_and_in_order(cuts) -> None:
    with pytest.raises(BadInput, match="cuts must be indices of pieces"):
        cut(legs(POINTS), *cuts)


def test_what_is_flown_of_parts() -> None:
    lap = cut(legs([*POINTS, POINTS[1]], cycle=1), 1, 3)
    assert lap.parts == ((0, 1), (1, 3), (3, 4))
    assert lap.flown_parts(2) == (0, 1, 2, 1, 2)
    assert lap.flattened(2).cuts == (1, 3, 4, 6)
    assert cut(legs(POINTS), 2).flown_parts(1) == (0, 1)
    assert legs(POINTS).parts == ((0, 3),)
