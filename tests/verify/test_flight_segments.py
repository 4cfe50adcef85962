"""Flights in pieces: cutting changes nothing that was proved, and what was shown counts to the end."""

from fractions import Fraction

import numpy as np
import pytest

import ltlplan
from ltlplan.pipeline import certified_team, plan
from tests.helpers.few import few_of
from verify.data import Trajectory, parse_mission
from verify.flight_segments import Piece, judge_pieces, judge_stop

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


@few_of(1, "times", [(1.25, 2.5), (), (0.3,), (0.5, 0.5, 3.0, 400.0)])
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
    assert "at 1.000 s" in verdicts[0].sentence


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
    assert [claim.sentence for claim in refused] == [f"{name} can enter b, which is open to carrier only." for name in there]
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
