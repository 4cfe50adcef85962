"""Flights in pieces: cutting changes nothing that was proved, and what was shown counts to the end."""

import itertools
from fractions import Fraction

import numpy as np
import pytest

import ltlplan
from ltlplan.pipeline import certified_team, plan
from verify.data import Trajectory, parse_mission
from verify.data.errors import BadInput
from verify.pieces import SHIFT, Piece, cut, judge_pieces, judge_stop

TWO = """
format: 1
name: two
spec: {formula: F a & F b & G(b -> wet)}
regions: {a: {center: [0.6, 0, 1], radii: [0.25, 0.25, 0.25]}, b: {center: [0.6, 1.2, 1], radii: [0.25, 0.25, 0.25]}}
environment: {start: home, edges: [[home, a], [a, b]]}
robot: {initial: dry, states: {dry: [], wet: [wet]}, actions: [{from: dry, to: wet, at: a}]}
agents: {quad0: {start: [-0.3, 0, 1]}, quad1: {start: [-0.3, -1, 1]}}
vehicle: crazyflie-2.1
workspace: {min: [-2, -2, 0.2], max: [2, 2, 2]}
"""


@pytest.fixture(scope="module")
def flown():
    mission = parse_mission(TWO)
    done = certified_team(plan(mission))
    return mission, done.team, {name: line.actions for name, line in done.certificate.timelines.items()}


def whole(mission, team, actions, *times, worlds=None):
    """The flight cut at these times, each stretch in its world."""
    worlds = worlds or [mission] * (len(times) + 1)
    stretches = zip((0, *times), worlds, strict=True)
    pieces = [Piece(Fraction(0), Fraction(since), world, team, actions) for since, world in stretches]
    return judge_pieces(mission, pieces)


def moved(mission, region, center):
    there = mission.regions[region].model_copy(update={"center": center})
    return mission.model_copy(update={"regions": {**mission.regions, region: there}})


def asked(mission, formula):
    return mission.model_copy(update={"spec": mission.spec.model_copy(update={"formula": formula})})


@pytest.mark.parametrize("times", [(), (0.3,), (1.25, 2.5), (0.5, 0.5, 3.0, 400.0)])
def test_cutting_a_flight_changes_no_verdict(flown, times):
    mission, team, actions = flown
    assert all(whole(mission, team, actions, *times))
    verdict = whole(asked(mission, "F b & G !a"), team, actions, *times)[0]
    assert verdict.outcome == "fails"
    assert "G !a" in verdict.sentence


def test_actions_that_were_not_made_are_missed(flown):
    mission, team, actions = flown
    robot = next(name for name, made in actions.items() if made)
    verdicts = whole(mission, team, {**actions, robot: ()}, 1.0)
    assert verdicts[0].outcome == "fails"


def test_a_region_counts_where_it_was_at_the_time(flown):
    mission, team, actions = flown
    robot = next(name for name, made in actions.items() if made)
    away = moved(mission, "a", (0.6, -1.6, 1.0))
    late = float(max(change.time for change in actions[robot])) + 1.0
    # a robot has been there by then, and it is elsewhere afterwards
    assert whole(mission, team, actions, Fraction(round(late * 100), 100), worlds=[mission, away])[0]
    assert whole(mission, team, actions, Fraction(1, 10), worlds=[mission, away])[0].outcome == "fails"


def test_a_robot_that_has_landed_keeps_its_letter(flown):
    mission, team, actions = flown
    robot = next(name for name, made in actions.items() if made)
    mission = asked(mission, "F a")
    at = actions[robot][0].time
    rest = {name: track for name, track in team.items() if name != robot}
    left = mission.model_copy(update={"agents": {name: mission.agents[name] for name in rest}})
    pieces = [Piece(Fraction(0), Fraction(0), mission, team, actions), Piece(Fraction(0), at, left, rest)]
    assert judge_pieces(mission, pieces)[0]
    assert judge_pieces(asked(mission, "F a & F(!a & wet)"), pieces)[0].outcome == "fails"


def test_a_robot_that_takes_off_later_hovered_at_its_start():
    """It counts as being where it starts, and nowhere else, until a piece lets it fly."""
    mission = asked(parse_mission(TWO), "G a")
    at_a = mission.agents["quad0"].model_copy(update={"start": (0.6, 0.0, 1.0)})
    alone, nobody = (mission.model_copy(update={"agents": agents}) for agents in ({"quad0": at_a}, {}))
    still = np.zeros((1, 4, 8))
    still[0, :3, 0] = at_a.start
    moving = still.copy()
    moving[0, 1, 1] = 1.0
    for flown, wanted in ((still, "holds"), (moving, "fails")):
        team = {"quad0": Trajectory([1.0], flown)}
        pieces = [Piece(Fraction(0), Fraction(0), nobody, {}), Piece(Fraction(4), Fraction(4), alone, team)]
        assert judge_pieces(alone, pieces)[0].outcome == wanted
        assert judge_pieces(asked(alone, "F !a"), pieces)[0].outcome == {"holds": "fails", "fails": "holds"}[wanted]


def test_a_region_that_jumps_while_another_edge_is_near_leaves_the_order_open(flown):
    mission, _, _ = flown
    # hovering at the edge of b, inside a larger a that goes away
    large = mission.regions["a"].model_copy(update={"center": (0.0, 0.0, 1.0), "radii": (0.8, 0.8, 0.8), "matrix": None})
    near = mission.regions["b"].model_copy(update={"center": (-0.3, 0.27, 1.0)})
    before = parse_mission(TWO).model_copy(update={"regions": {"a": type(large).model_validate(large.model_dump()), "b": near}})
    after = moved(before, "a", (1.5, 1.5, 1.0))
    still = np.zeros((1, 4, 8))
    still[0, :3, 0] = (-0.3, 0.0, 1.0)
    other = still.copy()
    other[0, :3, 0] = (-0.3, -1.0, 1.0)
    team = {"quad0": Trajectory([3.0], still), "quad1": Trajectory([3.0], other)}
    verdicts = whole(before, team, {}, 1.0, worlds=[before, after])
    assert verdicts[0].outcome == "undecided"
    assert "a jumps" in verdicts[0].sentence


@pytest.mark.parametrize("seed", range(5))
def test_a_cut_trajectory_is_the_rest_of_it(seed):
    rng = np.random.default_rng(seed)
    track = Trajectory(rng.uniform(0.3, 2, 4).astype(np.float32), rng.normal(0, 0.3, (4, 4, 8)).astype(np.float32))
    at = Fraction(int(rng.integers(0, int(track.duration * 50))), 50)
    rest = cut(track, at)
    times = np.linspace(0, float(track.duration) - float(at), 200)
    # jumps between random pieces: away from the knots, where both readings round their times
    clear = np.abs((times + float(at))[:, None] - track.knots).min(axis=1) > 1e-6
    assert np.abs(rest.evaluate(times) - track.evaluate(times + float(at)))[clear].max() < 2 * SHIFT
    assert np.allclose(cut(track, Fraction(100)).evaluate(0.5), track.evaluate(100.0), atol=1e-12)


def test_a_trajectory_that_is_cut_at_its_end_is_the_hover_there():
    track = Trajectory([0.75, 1.5], np.random.default_rng(3).normal(0, 0.3, (2, 4, 8)).astype(np.float32))
    for late in (Fraction(0), Fraction(1, 2**40), Fraction(7)):
        rest = cut(track, Fraction(9, 4) + late)
        assert len(rest) == 1
        assert np.abs(rest.evaluate([0.0, 0.5, 99.0]) - track.evaluate(2.25)).max() < 1e-12


def at_exactly(track, time):
    """The position at an exact time, without any rounding; at a joint that of the later piece."""
    knots = [Fraction(0), *itertools.accumulate(map(Fraction, track.durations.tolist()))]
    piece = max(i for i in range(len(track.durations)) if knots[i] <= time)
    local = min(time, knots[-1]) - knots[piece]
    return [sum(Fraction(c) * local**k for k, c in enumerate(row)) for row in track.coefficients[piece, :3].tolist()]


@pytest.mark.parametrize("size", [1e2, 1e5, 1e6, 1e7, 1e9])
@pytest.mark.parametrize("length", [0.25, 8.0])
def test_a_cut_is_refused_where_rounding_would_move_the_rest_too_far(length, size):
    """Terms c_k T^k of some size, rounded to 2^-53 of themselves: at 1e7 m that is a nanometre, at 1e2 m it never is."""
    rng = np.random.default_rng(int(size))
    refused = 0
    for _ in range(20):
        terms = rng.normal(size=(2, 4, 8)) * size
        track = Trajectory([length, length], terms / length ** np.arange(8))
        at = Fraction(float(rng.uniform(0, length)))
        try:
            rest = cut(track, at)
        except BadInput:
            refused += 1
            continue
        left = Fraction(length) - at
        for share in (0, Fraction(1, 3), Fraction(7, 8), 1 - Fraction(1, 2**30)):
            moved_to, was = at_exactly(rest, left * share), at_exactly(track, at + left * share)
            assert sum((a - b) ** 2 for a, b in zip(moved_to, was, strict=True)) <= Fraction(SHIFT) ** 2
    assert refused == {1e2: 0, 1e9: 20}.get(size, refused)


@pytest.mark.parametrize("size", [2.0**10, 2.0**28])
@pytest.mark.parametrize("moving", [0, 1])
@pytest.mark.parametrize("power", [1, 2])
def test_a_cut_whose_rounded_length_moves_what_follows_is_refused(moving, size, power):
    """7 2/3 s are no float: a piece that moves quickly, first or after it, is elsewhere by what its speed makes of the rest."""
    terms = np.zeros((2, 4, 8))
    terms[moving, 0, power] = 9 * size  # a multiple of 9, so that cutting it at 1/3 s is exact
    if moving == 0:
        terms[1, 0, 0] = 9 * size * 8.0**power
    track, at = Trajectory([8.0, 8.0], terms), Fraction(1, 3)
    left = 8 - at
    assert Fraction(float(left)) != left
    try:
        rest = cut(track, at)
    except BadInput:
        assert size > 2**20
        return
    assert size < 2**20
    for time in (left, (left + Fraction(float(left))) / 2, Fraction(float(left)), left + 1, left + Fraction(31, 4)):
        was, moved_to = at_exactly(track, at + time), at_exactly(rest, time)
        assert abs(was[0] - moved_to[0]) <= Fraction(SHIFT)


def test_a_hover_far_away_is_refused_where_rounding_would_move_it():
    far = np.zeros((1, 4, 8))
    far[0, :3, 0:2] = [[2.0**40, 1 / 3], [0.0, 0.0], [1.0, 0.0]]
    near = far.copy()
    near[0, 0, 0] = 1.0
    assert at_exactly(cut(Trajectory([1.0], near), Fraction(2)), Fraction(0))[0] == pytest.approx(4 / 3, abs=SHIFT)
    with pytest.raises(BadInput, match="too large"):
        cut(Trajectory([1.0], far), Fraction(2))


def test_coming_to_rest_is_judged(flown):
    mission, team, _ = flown
    assert all(claim.outcome == "holds" for claim in judge_stop(mission, team, Fraction(1, 2)))
    # hovering where a region's edge comes
    robot = next(iter(team))
    x, y, z = (float(v) for v in team[robot].evaluate(1e6)[:3])
    near = moved(mission, "b", (x, y + 0.27, z))
    refused = [claim for claim in judge_stop(near, team, Fraction(1, 2)) if claim.outcome != "holds"]
    assert [(claim.name, claim.robot) for claim in refused] == [("rest", robot)]


def test_no_stop_leads_into_a_region_that_is_closed_to_the_robot(flown):
    mission, team, _ = flown
    closed = mission.regions["b"].model_copy(update={"only": ("carrier",)})
    shut = mission.model_copy(update={"regions": {**mission.regions, "b": closed}})
    refused = [claim for claim in judge_stop(shut, team, Fraction(1, 2)) if claim.outcome != "holds"]
    there = [name for name in team if closed.level(team[name].evaluate(team[name].duration)[:3]) <= 1]
    assert [(claim.name, claim.robot) for claim in refused] == [("transitions", name) for name in there]
    assert there


def test_a_rim_that_moves_counts_from_now_on_only():
    mission = ltlplan.load_mission("firefighting")
    team = certified_team(plan(mission)).team
    robot = max(team, key=lambda name: team[name].duration)
    x, y, z = (float(v) for v in team[robot].evaluate(1.0)[:3])
    ring = mission.hoops["water"].model_copy(update={"center": (x, y, z + 0.26)})
    near = mission.model_copy(update={"hoops": {**mission.hoops, "water": ring}})
    assert {c.name for c in judge_stop(near, team, Fraction(0)) if c.outcome != "holds"} == {"rims"}
    late = Fraction(round(team[robot].duration * 50) - 10, 50)
    assert all(claim.outcome == "holds" for claim in judge_stop(near, team, late))
