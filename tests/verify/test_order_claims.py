"""The claims `ordered` and `precedences`: words under the plan's precedences, and a flight that keeps each of them."""

from __future__ import annotations

import json
import re
from random import Random

import numpy as np
import pytest

import ltlplan
from tests.helpers.few import few_of
from tests.helpers.missions.worlds import world
from tests.helpers.motion.flights import legs, plan_of, small_mission
from tests.helpers.words.linearisations import broken
from verify import certify, judge, recheck
from verify.certificate import Certificate, payload_digest
from verify.data import BadInput, LtlplanError, NotCertified, Plan, Trajectory, Word
from verify.data.files.mission_file import mission_to_yaml
from verify.data.files.trajectory_csv import write_csv
from verify.data.plan import Meeting, Precedence, Visit
from verify.trace_checking.planned_order import check_planned_order

REGIONS = "a: {center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}\nb: {center: [1.0, 2.0, 1.0], radii: [0.2, 0.2, 0.2]}"
TASK = """
robot:
  initial: idle
  states: {idle: [], busy: [busy]}
  actions: [{at: a, from: idle, to: busy}]
"""
A_LEFT = Precedence(first=("r0", 0), then=("r1", 0))
FLIGHTS = {
    "r0": legs([[0, 0, 1], [1, 0, 1], [2, 0, 1]]),
    "r1": legs([[0, 2, 1], [1, 2, 1]], hold=7.0),
}


def flown(formula: str = "!b U a", team: str = "own", *waits: Precedence | Meeting, acts: bool = False) -> Plan:
    """Return the plan of r0, which flies through a, and r1, which comes to b later."""
    mission = small_mission(formula, regions=REGIONS, starts=((0, 0, 1), (0, 2, 1)), margin=0.01, extra=TASK if acts else "")
    mission = mission.changed(spec=mission.spec.model_copy(update={"team": team}))
    action = mission.robot.actions if acts else ()
    visits = {"r0": [Visit(region="a", actions=action)], "r1": [Visit(region="b")]}
    after = [["a"], ["a", "busy"], ["busy"]] if acts else [["a"], []]
    plan = plan_of(mission, visits, {"r0": Word.of([[], *after]), "r1": Word.of([[], ["b"]])})
    return plan.changed(
        precedences=tuple(wait for wait in waits if isinstance(wait, Precedence)),
        meetings=tuple(wait for wait in waits if isinstance(wait, Meeting)),
    )


def claims(certificate: Certificate, name: str) -> list:
    return [claim for claim in certificate.claims if claim.name == name]


def inside(path: Trajectory, centre: tuple[float, float, float], margin: float) -> tuple[float, float]:
    """Return the first and the last sampled time at which a path is within a ball of radius 0.2 m that is so much larger."""
    times = np.arange(0.0, path.duration, 1e-3)
    distance = np.array([np.linalg.norm(path.evaluate(t)[:3] - centre) for t in times])
    within = times[distance <= 0.2 + margin]
    return float(within[0]), float(within[-1])


def test_a_flight_keeps_its_precedence_by_as_much_as_is_claimed() -> None:
    plan = flown("!b U a", "own", A_LEFT)
    certificate = certify(plan, FLIGHTS)
    (words,), (kept,) = claims(certificate, "ordered"), claims(certificate, "precedences")
    assert words.sentence == "Every team word that keeps the stated precedences satisfies `!b U a`."
    assert (kept.robot, kept.other, kept.unit, kept.limit) == ("r1", "r0", "s", certificate.clock_error)
    _, left = inside(FLIGHTS["r0"], (1, 0, 1), 0.01)
    entered, _ = inside(FLIGHTS["r1"], (1, 2, 1), 0.01)
    assert kept.bound == pytest.approx(entered - left, abs=3e-3)
    written = re.fullmatch(
        r"In flight r1 enters b only when r0 has left a, by at least (\S+) s, of which clocks that differ may take (\S+) s\.",
        kept.sentence,
    )
    assert written
    assert 0 <= kept.bound - float(written[1]) < 1e-4
    assert float(written[2]) == pytest.approx(certificate.clock_error, abs=1e-6)
    assert kept.time == pytest.approx(entered, abs=2e-3)


def test_a_precedence_is_kept_by_more_than_clocks_may_be_off() -> None:
    plan = flown("!b U a", "own", A_LEFT)
    (gap,) = (claim.bound for claim in claims(judge(plan, FLIGHTS, largest=False), "precedences"))
    for error, expected in ((gap - 1e-6, "holds"), (gap + 1e-6, "undecided"), (gap + 2.0, "fails")):
        (kept,) = claims(judge(plan, FLIGHTS, clock_error=error, largest=False), "precedences")
        assert kept.outcome == expected
        assert kept.limit == error
        assert (kept.witness is None) == (expected == "holds")


def test_a_plan_without_precedences_claims_nothing_of_order() -> None:
    certificate = certify(flown("F a & F b"), FLIGHTS)
    assert not claims(certificate, "ordered") + claims(certificate, "precedences")


def test_waits_of_words_that_hold_in_every_order_are_kept_and_no_order_is_claimed() -> None:
    plan = flown("F a & G(b -> F !a)", "own", Precedence(first=("r0", 0), then=("r1", 0), done="entered"))
    assert check_planned_order(plan).outcome == "holds"
    plan = flown("F(a & F b) | F(b & F a)", "own", Precedence(first=("r0", 0), then=("r1", 0), done="entered"))
    certificate = certify(plan, FLIGHTS)
    assert len(claims(certificate, "precedences")) == 1


@few_of(
    4,
    ("wait", "holds"),
    [
        (Precedence(first=("r0", 0), then=("r1", 0), done="entered"), True),
        (Precedence(first=("r0", 0), then=("r1", 0), done="acted"), True),
        (Precedence(first=("r1", 0), then=("r0", 0), done="entered"), False),
        (Precedence(first=("r1", 0), then=("r0", 0), done="entered", due="leaves"), False),
        (Precedence(first=("r1", 0), then=("r0", 0), done="entered", due="acts"), False),
        (Precedence(first=("r1", 0), then=("r0", 0), done="left"), False),  # it stays in b
        (Precedence(first=("r0", 0), then=("r1", 0), done="left", due="leaves"), True),  # it never does
        (Meeting(first=("r0", 0), then=("r1", 0)), True),
        (Meeting(first=("r1", 0), then=("r0", 0)), False),
    ],
)
def test_every_kind_of_event_has_its_time(wait: Precedence | Meeting, holds: bool) -> None:
    certificate = judge(flown("F a", "joint", wait, acts=True), FLIGHTS, largest=False)
    (kept,) = claims(certificate, "precedences")
    assert kept.outcome == ("holds" if holds else "fails"), kept.sentence
    assert certificate.holds == holds


def test_a_robot_that_goes_to_and_fro_at_a_boundary_leaves_at_once() -> None:
    to_and_fro = legs([[0, 0, 1], [1, 0, 1], [1.2, 0, 1], [1, 0, 1], [2, 0, 1]])
    leaves = Precedence(first=("r1", 0), then=("r0", 0), done="entered", due="leaves")
    team = {"r0": to_and_fro, "r1": legs([[0, 2, 1], [1, 2, 1]], hold=2.0)}
    certificate = judge(flown("F a", "joint", leaves), team, largest=False)
    (kept,) = claims(certificate, "precedences")
    assert kept.outcome == "undecided"
    sooner = judge(flown("F a", "joint", leaves), {**team, "r1": legs([[0, 2, 1], [1, 2, 1]], speed=0.6)}, largest=False)
    assert [claim.outcome for claim in claims(sooner, "precedences")] == ["holds"]


TWO = (A_LEFT, Precedence(first=("r0", 0), then=("r1", 0), done="entered"))


@few_of(
    2,
    ("waits", "names"),
    [
        ((Precedence(first=("r1", 0), then=("r0", 0), done="entered"),), {"ordered", "precedences"}),  # reversed
        ((*TWO, Precedence(first=("r1", 0), then=("r0", 0), done="left")), {"ordered", "precedences"}),  # invented
        ((TWO[1],), {"ordered"}),  # removed, and what is left does not suffice
        ((), set()),  # removed: nothing of order is claimed any more
    ],
)
def test_precedences_that_are_changed_in_a_folder_are_refused(tmp_path, waits: tuple[Precedence, ...], names: set[str]) -> None:
    plan = flown("!b U a", "own", *TWO)
    certificate = certify(plan, FLIGHTS)
    forged = plan.changed(precedences=waits)
    data = {**certificate.to_dict(), "plan": forged.digest()}
    del data["digest"]
    (tmp_path / "mission.yaml").write_text(mission_to_yaml(plan.mission))
    (tmp_path / "plan.json").write_text(forged.to_json())
    (tmp_path / "certificate.json").write_text(json.dumps({**data, "digest": payload_digest(data)}))
    for robot, path in FLIGHTS.items():
        (tmp_path / f"{robot}.csv").write_text(write_csv(path))
    with pytest.raises(NotCertified, match="the claim is not proved" if names else "claims; the files give") as caught:
        recheck(tmp_path)
    assert {witness.claim for witness in caught.value.witnesses} == names
    (tmp_path / "plan.json").write_text(plan.to_json())
    (tmp_path / "certificate.json").write_text(certificate.to_json())
    assert recheck(tmp_path).digest() == certificate.digest()


TEMPLATES = (
    "F(count({0}) >= 2)", "F(all({0}))", "G(count({0}) <= 1)", "F(count({0}) >= 2 & F all({1}))",
    "F(count({0}) == 1 & F(count({1}) >= 2))", "(count({0}) < 2) U quad0.{1}", "F(quad0.{0} & quad1.{1})",
    "G(count({0}) <= 1 | count({1}) == 0)", "F(some({0}) & all({1} | {0}))", "quad0.{0} R !quad1.{1}",
    "F(count({0} | {1}) >= 2 & count({1}) == 1)",
)  # fmt: skip
ROOMS = {"a": (0.0, 0.0), "b": (4.0, 0.0), "c": (0.0, 4.0)}
AT_THE_SAME_INSTANT = "F(count(a) == 1 & F(count(c) >= 2)) & F(count(c) == 1 & F(count(b) >= 2))"


def meeting_events(plan: Plan) -> list:
    """Return a plan's meetings as pairs of letters: coming to the region, and leaving the one before or, from none, coming."""
    regions = frozenset(plan.mission.all_regions)
    stays: dict[str, list[tuple[int, int | None]]] = {}
    for name, robot in plan.robots.items():
        word = robot.word.letters
        at = [index for index, letter in enumerate(word) if letter & regions]
        assert all(len(letter & regions) < 2 for letter in word)
        ends = [next((i for i in range(index, len(word)) if word[i] != word[index]), None) for index in at]
        stays[name] = [pair for pair in zip(at, ends, strict=True) if len(at) == len(robot.visits) or pair[0] > 0]
        assert len(stays[name]) == len(robot.visits)
    pairs = []
    for meeting in plan.meetings:
        (first, i), (then, j) = meeting.first, meeting.then
        begun, left = stays[first][i][0], stays[then][j - 1][1] if j else stays[then][j][0]
        pairs += [((first, begun), (then, left))] if begun else []
    return pairs


def check_meetings(formula: str, robots: int) -> str:
    """Plan, judge the meetings, and hold the answer against all orders of events, written out."""
    try:
        plan = ltlplan.plan(world(formula, robots=robots, regions=ROOMS, radii=dict.fromkeys(ROOMS, 1.5), team="joint"))
    except LtlplanError:
        return "refused"
    if not plan.meetings:
        return "none"
    assert check_planned_order(plan).outcome == "holds", formula
    words = {name: robot.word.letters for name, robot in plan.robots.items()}
    if sum(map(len, words.values())) > 14:
        return "long"
    assert broken(plan.mission.written, words, meeting_events(plan), "joint", 14) is None, formula
    return "judged"


def test_meetings_are_judged_as_all_orders_of_their_events_are() -> None:
    assert check_meetings(AT_THE_SAME_INSTANT, 2) == "judged"
    assert check_meetings("F(count(a) >= 2) & F(count(b) >= 2)", 2) == "judged"


@pytest.mark.slow
def test_many_meetings_are_judged_as_all_orders_of_their_events_are() -> None:
    rng, found = Random(4), set[str]()
    for _ in range(200):
        chosen = [rng.choice(TEMPLATES).format(*rng.sample("abc", 2)) for _ in range(rng.randint(2, 3))]
        found.add(check_meetings(" & ".join(chosen), rng.choice((2, 3))))
    assert found >= {"refused", "none", "judged"}


def test_meetings_that_are_taken_away_are_missed() -> None:
    plan = ltlplan.plan(world(AT_THE_SAME_INSTANT, robots=2, regions=ROOMS, radii=dict.fromkeys(ROOMS, 1.5), team="joint"))
    for number in range(len(plan.meetings)):
        fewer = plan.model_copy(update={"meetings": plan.meetings[:number] + plan.meetings[number + 1 :]})
        words = {name: robot.word.letters for name, robot in plan.robots.items()}
        expected = broken(plan.mission.written, words, meeting_events(fewer), "joint", 14) is None
        assert (check_planned_order(fewer).outcome == "holds") == expected


def test_a_plan_whose_visits_its_words_do_not_show_claims_no_order() -> None:
    plan = flown("F a", "joint", A_LEFT)
    silent = plan.changed(robots={**plan.robots, "r0": plan.robots["r0"].model_copy(update={"word": Word.of([[]])})})
    certificate = judge(silent, FLIGHTS, largest=False)
    assert not claims(certificate, "ordered")
    assert [claim.outcome for claim in claims(certificate, "precedences")] == ["holds"]
    with pytest.raises(BadInput, match="names visit 3 of r0"):
        plan.changed(precedences=(Precedence(first=("r0", 3), then=("r1", 0)),))


AFTER = Meeting(first=("r0", 0), then=("r1", 0))


@few_of(2, ("hold", "outcome"), [(0.5, "fails"), (1.0, "fails"), (7.0, "holds")])
def test_a_robot_sets_out_for_its_first_visit_when_it_first_moves(hold: float, outcome: str) -> None:
    slowly = legs([[0, 2, 1], [1, 2, 1]], speed=0.1, hold=hold)  # it comes to b long after r0 has come to a
    certificate = judge(flown("F a", "joint", AFTER), {**FLIGHTS, "r1": slowly}, largest=False)
    (kept,) = claims(certificate, "precedences")
    assert kept.outcome == outcome, kept.sentence
    entered, _ = inside(FLIGHTS["r0"], (1, 0, 1), -0.01)
    assert kept.time == hold
    assert kept.bound == pytest.approx(hold - entered, abs=3e-3)


def test_turning_in_place_is_not_setting_out() -> None:
    turning = legs([[0, 2, 1], [1, 2, 1]], hold=7.0)
    coefficients = turning.coefficients.copy()
    coefficients[0, 3, 4:] = np.float32(1e-3)
    turning = Trajectory(turning.durations, coefficients)
    (kept,) = claims(judge(flown("F a", "joint", AFTER), {**FLIGHTS, "r1": turning}, largest=False), "precedences")
    assert (kept.outcome, kept.time) == ("holds", 7.0)
    coefficients[0, 2, 7] = np.float32(1e-30)  # it climbs from its very start
    climbing = Trajectory(turning.durations, coefficients)
    (kept,) = claims(judge(flown("F a", "joint", AFTER), {**FLIGHTS, "r1": climbing}, largest=False), "precedences")
    assert (kept.outcome, kept.time) == ("fails", 0.0)


def test_a_robot_sets_out_for_a_later_visit_where_it_last_stands_still() -> None:
    mission = small_mission("F a", regions=REGIONS, starts=((0, 0, 1), (0, 2, 1)), margin=0.01)
    mission = mission.changed(spec=mission.spec.model_copy(update={"team": "joint"}))
    plan = plan_of(mission, {"r0": [Visit(region="a")], "r1": [Visit(region="b"), Visit(region="b")]})
    plan = plan.changed(meetings=(Meeting(first=("r0", 0), then=("r1", 1)),))
    first = legs([[0, 0, 1], [1, 0, 1]], speed=0.2)  # in a from about 4 s on
    entered, _ = inside(first, (1, 0, 1), -0.01)
    outcomes = {}
    for wait in (0.0, 6.0):
        path = legs([[0, 2, 1], *[[1, 2, 1]] * (1 + round(4 * wait)), [1.5, 2, 1], [1, 2, 1]], speed=0.5)
        (kept,) = claims(judge(plan, {"r0": first, "r1": path}, largest=False), "precedences")
        outcomes[wait] = kept.outcome
        assert kept.bound == pytest.approx(2.0 + wait - entered, abs=3e-3)
        assert "sets out for b for the second time" in kept.sentence
    assert outcomes == {0.0: "fails", 6.0: "holds"}
