"""Laps: what a certificate takes of a plan's cycle is held against the cycle that is flown."""

from __future__ import annotations

import itertools
import json

import numpy as np
import pytest

from tests.helpers.few import few_of
from tests.helpers.kernel.witnesses import Right, assert_refused, judged
from tests.helpers.motion.flights import legs, plan_of, small_mission
from verify import certify, judge
from verify.certificate import Certificate, payload_digest
from verify.data.errors import BadInput, NotCertified
from verify.data.files.mission_file import mission_to_yaml, parse_mission
from verify.data.files.trajectory_csv import write_csv
from verify.data.language.sequence import Sequence, parse_sequence
from verify.data.mission import Mission
from verify.data.plan import Plan, Visit
from verify.data.trajectory import Trajectory
from verify.data.validation.faults import MissionError
from verify.run_folder import recheck

HOOPS = """a: {center: [0.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2], opening: 0.3, rim: 0.02}
b: {center: [0.0, 2.0, 1.0], radii: [0.2, 0.2, 0.2], opening: 0.3, rim: 0.02}"""
PLACES = {"a": 0.0, "b": 2.0}
HOME = (0.5, 1.0, 2.0)
"""Where the robot starts and where laps begin and end: high above the hoops."""


def ring_mission(sequence: str) -> Mission:
    return small_mission(
        regions="", hoops=HOOPS, starts=[HOME], margin=0.05, trace="infinite", extra=f"sequence: {sequence}"
    )  # fmt: skip


def points_through(passages: list[str]) -> list[tuple[float, float, float]]:
    """Return points from HOME through hoops and back; from hoop to hoop the way leads over their rims."""
    points = [HOME]
    for passage in passages:
        y, side = PLACES[passage[0]], -0.5 if passage[1] == "F" else 0.5
        points += [(points[-1][0], points[-1][1], 2.0), (side, y, 2.0), (side, y, 1.0), (-side, y, 1.0)]
    return [*points, (points[-1][0], points[-1][1], 2.0), HOME]


def flown(prefix: list[str], lap: list[str]) -> Trajectory:
    """Fly prefix and one lap of passages; a lap without any is a hover."""
    first = _moving(points_through(prefix)) if prefix else [HOME]
    last = _moving(points_through(lap))[1:] if lap else [HOME]
    return legs([*first, *last], cycle=len(first) - 1)


def _moving(points: list[tuple[float, float, float]]) -> list[tuple[float, float, float]]:
    return [points[0], *(b for a, b in itertools.pairwise(points) if a != b)]


def lap_plan(mission: Mission, visits: list[Visit], cycle_visit: int) -> Plan:
    plan = plan_of(mission, {"r0": visits})
    robot = plan.robots["r0"].model_copy(update={"cycle_visit": cycle_visit, "cycle_waypoint": 0})
    return plan.model_copy(update={"robots": {"r0": robot}})


def passing(passages: list[str]) -> list[Visit]:
    return [Visit(region=passage[0], direction=passage[1]) for passage in passages]


def sequenced(sequence: str, prefix: list[str], lap: list[str], cycle_visit: int | None = None) -> Certificate:
    cycle = len(prefix) if cycle_visit is None else cycle_visit
    plan = lap_plan(ring_mission(sequence), passing([*prefix, *lap]), cycle)
    return judged(plan, {"r0": flown(prefix, lap)})


# Sequences with a cycle.


@pytest.mark.parametrize(
    ("sequence", "prefix", "lap"),
    [
        ("aF (bF)*", "aF bF", ""),  # passes both once and hovers for ever
        ("aF (bF)*", "", "aF bF"),
        ("(aF bF)*", "aF", "bF"),
        ("(aF bF)*", "aF bF", ""),
        ("aF (bF)*", "aF bF", "bR"),
        ("aF bF (aF)*", "aF", "bF aF"),
    ],
)
def test_a_sequence_is_the_one_that_is_flown_for_ever(sequence, prefix, lap):
    found = sequenced(sequence, prefix.split(), lap.split())
    (claim,) = assert_refused(found, Right("passages", "r0", says=f"not the mission's sequence `{sequence}`"))
    assert all(other.outcome == "holds" for other in found.claims if other is not claim)


def test_a_cycle_may_be_unrolled():
    for prefix, lap in (("aF", "bF"), ("aF bF", "bF"), ("aF", "bF bF"), ("aF bF bF", "bF bF bF")):
        assert sequenced("aF (bF)*", prefix.split(), lap.split()).holds
    for prefix, lap in (("", "aF bF"), ("aF", "bF aF"), ("aF bF", "aF bF aF bF")):
        assert sequenced("(aF bF)*", prefix.split(), lap.split()).holds


@few_of(1, "count", [12, 30])
def test_random_sequences_certify_just_their_own_words(count):
    rng = np.random.default_rng(5)
    certified = 0
    for _ in range(count):
        pick = [str(p) for p in rng.choice(["aF", "bF"], size=int(rng.integers(1, 4)))]
        split = int(rng.integers(0, len(pick) + 1))
        prefix, lap = pick[:split], pick[split:]
        asked = [str(p) for p in rng.choice(["aF", "bF"], size=int(rng.integers(1, 4)))] if rng.random() < 0.5 else pick
        cut = int(rng.integers(0, len(asked)))
        sequence = " ".join([*asked[:cut], "(" + " ".join(asked[cut:]) + ")*"])
        cycle_visit = split if rng.random() < 0.6 else int(rng.integers(0, len(pick) + 1))
        words = [list(itertools.islice(itertools.chain(p, itertools.cycle(c)), 40)) for p, c in
                 ((prefix, lap), (asked[:cut], asked[cut:]))]  # fmt: skip
        right = words[0] == words[1] and cycle_visit == split
        assert sequenced(sequence, prefix, lap, cycle_visit).holds == right, (sequence, prefix, lap, cycle_visit)
        certified += right
    assert 5 * count <= 30 * certified <= 20 * count


def test_words_that_repeat_are_compared_for_ever():
    rng = np.random.default_rng(2)
    seen = set()
    for _ in range(600):
        texts = [
            "".join(str(p) + " " for p in rng.choice(["aF", "aR"], size=int(rng.integers(0, 4))))
            + "(" + " ".join(str(p) for p in rng.choice(["aF", "aR"], size=int(rng.integers(1, 5)))) + ")*"
            for _ in range(2)
        ]  # fmt: skip
        one, other = (parse_sequence(text, ["a"]) for text in texts)
        letters = [list(itertools.islice(itertools.chain(s.prefix, itertools.cycle(s.cycle or ())), 60)) for s in (one, other)]
        assert one.same_passages(other) == other.same_passages(one) == (letters[0] == letters[1])
        seen.add(letters[0] == letters[1])
        assert not one.same_passages(Sequence(one.prefix))
        assert Sequence(one.prefix).same_passages(Sequence(one.prefix))
    assert seen == {True, False}


# Where the plan says that the cycle begins.

BALLS = """a: {center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}
b: {center: [0.0, 1.0, 1.0], radii: [0.2, 0.2, 0.2]}"""


def ball_mission(extra: str = "") -> Mission:
    return small_mission("G F a & G F b", regions=BALLS, trace="infinite", margin=0.03, extra=extra)


@few_of(
    2,
    ("points", "cycle", "visits", "right"),
    [
        ([[0, 0, 1], [1, 0, 1], [0, 1, 1], [0, 0, 1]], 0, "ab", 0),
        ([[0, 0, 1], [1, 0, 1], [0, 1, 1], [0, 0, 1], [1, 0, 1], [0, 1, 1], [0, 0, 1]], 3, "abab", 2),
        ([[0, 0, 1], [1, 0, 1], [0, 1, 1], [1, 0, 1]], 1, "aba", 1),  # laps begin in a
        ([[0, 0, 1], [1, 0, 1], [0.5, 0.5, 1], [0, 1, 1], [1, 0, 1], [0.5, 0.5, 1]], 2, "aba", 1),
    ],
)
def test_only_the_visit_with_which_a_lap_begins_certifies(points, cycle, visits, right):
    team = {"r0": legs(points, cycle=cycle)}
    for cycle_visit in range(len(visits) + 1):
        plan = lap_plan(ball_mission(), [Visit(region=region) for region in visits], cycle_visit)
        certificate = judged(plan, team)
        if cycle_visit == right:
            assert certificate.holds
            continue
        (claim,) = assert_refused(certificate, Right("visits", "r0", says="planned is"))
        assert all(other.outcome == "holds" for other in certificate.claims if other is not claim)


def test_a_lap_that_hovers_begins_with_no_visit():
    mission = small_mission("F G a", regions=BALLS, trace="infinite", margin=0.03)
    team = {"r0": legs([[0, 0, 1], [0, 1, 1], [1, 0, 1], [1, 0, 1]], cycle=2)}
    for cycle_visit in range(3):
        plan = lap_plan(mission, [Visit(region="b"), Visit(region="a")], cycle_visit)
        assert judged(plan, team).holds == (cycle_visit == 2)


@pytest.mark.parametrize("hover", [1.0, 60.0])
def test_an_action_of_the_visit_in_which_a_lap_hovers_happens_before_the_lap(hover):
    tank = "robot: {initial: dry, states: {dry: [], wet: [wet]}, actions: [{from: dry, to: wet, at: a}]}"
    mission = small_mission("F G (a & wet)", regions=BALLS, trace="infinite", margin=0.03, extra=tank)
    fill = mission.robot.actions[0]
    way, still = legs([[0, 0, 1], [1, 0, 1]]), legs([[1, 0, 1]], hold=hover)
    durations, coefficients = (np.concatenate([getattr(p, k) for p in (way, still)]) for k in ("durations", "coefficients"))
    team = {"r0": Trajectory(durations, coefficients, cycle=1)}
    certificate = judged(lap_plan(mission, [Visit(region="a", actions=(fill,))], 1), team)
    assert certificate.holds
    assert 0 < certificate.actions[0].time < way.duration


@pytest.mark.parametrize("cycle_visit", range(5))
def test_a_leg_over_the_seam_is_limited_whatever_the_plan_says(cycle_visit):
    """The last way back to where laps begin is flown at 1.75 m/s, and belongs to the way to a."""
    mission = ball_mission("limits: {legs: {a: {speed: 0.8}}}")
    parts = [legs([[0, 0, 1], *[[1, 0, 1], [0, 1, 1], [0, 0, 1]] * 2], speed=0.3), legs([[0, 1, 1], [0, 0, 1]], speed=0.8)]
    durations, coefficients = (
        np.concatenate([getattr(part, key) for part in (parts[0], parts[1])]) for key in ("durations", "coefficients")
    )
    kept = [0, 1, 2, 3, 4, 6]
    team = {"r0": Trajectory(durations[kept], coefficients[kept], cycle=0)}
    certificate = judged(lap_plan(mission, [Visit(region=region) for region in "abab"], cycle_visit), team)
    assert_refused(certificate, Right("limits.legs.speed", "r0", "a", 0, says="1.75 m/s"))
    refused = {claim.name for claim in certificate.claims if claim.outcome != "holds"}
    assert refused == {"limits.legs.speed"} | ({"visits"} if cycle_visit else set())


@pytest.mark.parametrize(
    ("cycle", "planned", "says"),
    [(2, 0, "a lap begins with visit 1, planned is visit 0"), (4, 1, "no visit begins in a lap, planned is visit 1")],
)
def test_a_lap_that_begins_elsewhere_is_told_with_the_visit_where_it_does(cycle, planned, says):
    team = {"r0": legs([[0, 0, 1], [1, 0, 1], [0, 0, 1], [0, 1, 1], [0, 0, 1], [0, 0, 1]], cycle=cycle)}
    plan = lap_plan(ball_mission(), [Visit(region="a"), Visit(region="b")], planned)
    (claim,) = (claim for claim in judge(plan, team).claims if claim.name == "visits")
    assert claim.outcome == "fails"
    assert says in claim.sentence
    assert (claim.witness.visit, claim.witness.region) == (1, "b")


def test_a_plan_with_another_cycle_is_refused_when_it_is_proved_again(tmp_path):
    team = {"r0": legs([[0, 0, 1], [1, 0, 1], [0, 1, 1], [0, 0, 1]], cycle=0)}
    visits = [Visit(region="a"), Visit(region="b")]
    right, wrong = (lap_plan(ball_mission(), visits, cycle_visit) for cycle_visit in (0, 1))
    certificate = certify(right, team)
    data = {**certificate.to_dict(), "plan": wrong.digest()}
    del data["digest"]
    for plan, written in ((right, certificate.to_dict()), (wrong, {**data, "digest": payload_digest(data)})):
        (tmp_path / "mission.yaml").write_text(mission_to_yaml(plan.mission))
        (tmp_path / "plan.json").write_text(plan.to_json())
        (tmp_path / "r0.csv").write_text(write_csv(team["r0"], 1))
        (tmp_path / "certificate.json").write_text(json.dumps(written))
        if plan is right:
            assert recheck(tmp_path).holds
            continue
        with pytest.raises(NotCertified, match="a lap begins with visit 0, planned is visit 1"):
            recheck(tmp_path)


# An end that a lap never comes to.

INFINITE = """format: 1
name: for ever
spec: {formula: "true", trace: infinite}
agents: {r0: {AGENT}}
vehicle: crazyflie-2.1
workspace: {min: [-5, -5, -5], max: [5, 5, 5]}
"""


def test_where_a_flight_never_ends_it_cannot_have_to_finish_somewhere():
    with pytest.raises(MissionError, match=r"agents\.r0\.end.*never ends"):
        parse_mission(INFINITE.replace("AGENT", "start: [0, 0, 1], end: [0, 0, 1]"))
    for finite in (INFINITE.replace("infinite", "finite"), INFINITE):
        point = ", end: [0, 0, 1]" if "infinite" not in finite else ""
        assert parse_mission(finite.replace("AGENT", "start: [0, 0, 1]" + point))


def test_the_judge_passes_no_end_that_a_lap_never_comes_to():
    """Missions that are made in memory go by no rules of files."""
    team = {"r0": legs([[0, 0, 1], [1, 0, 1], [0, 1, 1], [0, 0, 1]], cycle=0)}
    plan = lap_plan(ball_mission(), [Visit(region="a"), Visit(region="b")], 0)
    assert judged(plan, team).holds
    for end in ((0.0, 0.0, 1.0), (3.0, 3.0, 3.0)):
        agents = {"r0": plan.mission.agents["r0"].model_copy(update={"end": end})}
        with pytest.raises(BadInput, match="never ends"):
            judged(plan.model_copy(update={"mission": plan.mission.model_copy(update={"agents": agents})}), team)
