import math
from fractions import Fraction

import numpy as np
import pytest

from tests.helpers.few import few_of
from tests.helpers.motion.flights import legs, plan_of, small_mission, wandering
from verify import judge
from verify.data.errors import BadInput
from verify.data.trajectory import Trajectory
from verify.motion.continuity import JUMPS, jumps
from verify.motion.paths import read_team
from verify.motion.separation import minimum_distances, pairwise_distances, walls

TWO_STARTS = [[0.0, 0.0, 1.0], [0.0, 1.0, 1.0]]


def still(point, duration=1.0):
    coefficients = np.zeros((1, 4, 8))
    coefficients[0, :3, 0] = point
    return Trajectory([duration], coefficients)


def pair_mission(starts=TWO_STARTS, radius=None, **options):
    mission = small_mission(regions="", starts=starts, **options)
    return mission if radius is None else mission.model_copy(update={"vehicle": mission.vehicle.changed(radius=radius)})


def claims(mission, team, **options):
    certificate = judge(plan_of(mission, {}), team, largest=False, **options)
    return {(c.name, c.robot): c for c in certificate.claims}


def started(mission, team):
    agents = {
        name: agent.model_copy(update={"start": tuple(float(x) for x in team[name].coefficients[0, :3, 0])})
        for name, agent in mission.agents.items()
    }
    return mission.model_copy(update={"agents": agents})


def test_distances_against_samples():
    rng = np.random.default_rng(0)
    for k in range(15):
        team = {f"r{i}": wandering(rng, pieces=int(rng.integers(1, 5))) for i in range(3)}
        heights = [None, 0.5, 0.2][k % 3]
        mission = started(pair_mission([[i, 0, 1] for i in range(3)]), team).model_copy(update={"separation_z": heights})
        weight = 1.0 if heights is None else 0.3 / heights
        end = max(t.duration for t in team.values())
        at = np.linspace(0, end, 4001)
        samples = {name: t.evaluate(at)[:, :3] for name, t in team.items()}
        for found in minimum_distances(pairwise_distances(read_team(mission, team))):
            gap = (samples[found.robot] - samples[found.other]) * np.array([1, 1, weight])
            least = float(np.linalg.norm(gap, axis=1).min())
            assert found.low <= least + 1e-9
            assert found.high >= found.low
            assert found.low >= least - 0.02
            a, b = (team[n].evaluate(float(found.time))[:3] for n in (found.robot, found.other))
            assert float(np.linalg.norm((a - b) * np.array([1, 1, weight]))) == pytest.approx(found.high, abs=1e-5)


def test_walls_against_samples():
    rng = np.random.default_rng(1)
    for _ in range(15):
        team = {"r0": wandering(rng, pieces=3)}
        mission = started(small_mission(regions=""), team)
        (found,) = walls(read_team(mission, team))
        samples = team["r0"].evaluate(np.linspace(0, team["r0"].duration, 4001))[:, :3]
        least = min((samples + 5.0).min(), (5.0 - samples).min())
        assert found.low <= least + 1e-9
        assert found.low >= least - 1e-2


def test_exact_ties_keep_their_separation():
    # binary fractions: 0.5 m apart is exactly 0.5 m; with margin 0.125 exactly 0.75 m are asked
    mission = pair_mission([[0.0, 0.0, 1.0], [0.0, 0.75, 1.0]], extra="separation: 0.5").model_copy(update={"margin": 0.125})
    team = {"r0": still([0.0, 0.0, 1.0]), "r1": still([0.0, 0.75, 1.0], 2.0)}
    assert claims(mission, team)["separation", "r0"].outcome == "holds"
    assert claims(mission, team, margin=0.1250001)["separation", "r0"].outcome == "fails"
    assert claims(mission, team, clock_error=0.5)["separation", "r0"].outcome == "holds"  # nobody moves


def test_an_exact_touch_of_the_wall_is_inside():
    mission = small_mission(regions="", starts=[[4.75, 0.0, 1.0]]).model_copy(update={"margin": 0.25})
    team = {"r0": still([4.75, 0.0, 1.0])}
    assert claims(mission, team)["workspace", "r0"].outcome == "holds"
    found = claims(mission, team, margin=0.2500001)["workspace", "r0"]
    assert found.outcome == "fails"
    assert "x max" in found.sentence


def test_the_tube_counts_twice_for_separation_and_once_for_the_walls():
    mission = pair_mission([[0.0, 0.0, 1.0], [0.0, 0.5, 1.0]], extra="separation: 0.3")
    team = {"r0": still([0.0, 0.0, 1.0]), "r1": still([0.0, 0.5, 1.0])}
    assert claims(mission, team, margin=0.0999)["separation", "r0"].outcome == "holds"
    refused = claims(mission, team, margin=0.1001)["separation", "r0"]
    assert refused.outcome == "fails"
    assert (refused.witness.robot, refused.witness.other) == ("r0", "r1")


def test_downwash_asks_for_more_above():
    stacked = {"r0": still([0.0, 0.0, 1.0]), "r1": still([0.0, 0.0, 1.5])}
    beside = {"r0": still([0.0, 0.0, 1.0]), "r1": still([0.0, 0.5, 1.0])}
    for team, extra, verdict in (
        (stacked, "separation: 0.3", "holds"),
        (stacked, "separation: 0.3\nseparation_z: 0.6", "fails"),
        (beside, "separation: 0.3\nseparation_z: 0.6", "holds"),
        (stacked, "separation: 0.3\nseparation_z: 0.4", "holds"),
    ):
        mission = started(pair_mission(extra=extra), team)
        assert claims(mission, team, margin=0.01)["separation", "r0"].outcome == verdict
    flat = started(pair_mission(), stacked).model_copy(update={"separation_z": 0.0})
    with pytest.raises(BadInput, match="separation_z"):
        claims(flat, stacked)


def test_a_near_miss_of_clocks():
    # both cross the origin, 1.5 s apart; clocks that differ by as much may let them meet, others bring them nearer
    first = legs([[-1, 0, 1], [1, 0, 1]], speed=1.0)
    second = legs([[0, -1, 1], [0, 1, 1]], speed=1.0, hold=1.5)
    team = {"r0": first, "r1": second}
    mission = started(pair_mission(extra="limits: {}"), team)
    assert claims(mission, team)["separation", "r0"].outcome == "holds"
    assert claims(mission, team, clock_error=1.5)["separation", "r0"].outcome == "fails"
    nearer = claims(mission, team, clock_error=1.0)["separation", "r0"]
    assert nearer.outcome == "holds"
    assert nearer.bound == pytest.approx(least_gap(mission, team, 1.0, 0.0), abs=1e-4)


def test_a_robot_that_has_finished_keeps_its_distance():
    team = {"r0": legs([[0, 0, 1], [1, 0, 1]], speed=1.0), "r1": legs([[0, 2, 1], [1, 2, 1], [1, 0.1, 1]], speed=0.5)}
    mission = started(pair_mission(), team)
    found = claims(mission, team)["separation", "r0"]
    assert found.outcome == "fails"
    assert found.time > team["r0"].duration


def test_jumps_are_bounded_in_every_derivative():
    smooth = legs([[0, 0, 1], [1, 0, 1], [1, 1, 1]])
    mission = small_mission(regions="")
    (found,) = jumps(read_team(mission, {"r0": smooth}))
    assert found.share < 0.2
    for order in range(4):
        coefficients = smooth.coefficients.copy()
        coefficients[1, 2, order] += 2 * JUMPS[order] / [1, 1, 2, 6][order]
        claim = claims(mission, {"r0": Trajectory(smooth.durations, coefficients)})["continuity", "r0"]
        assert claim.outcome == "fails"
    with_yaw = smooth.coefficients.copy()
    with_yaw[1, 3, 0] += 2e-4
    assert "heading" in claims(mission, {"r0": Trajectory(smooth.durations, with_yaw)})["continuity", "r0"].sentence


def test_a_flight_begins_at_its_start_at_rest_and_ends_at_its_end_at_rest():
    mission = small_mission(regions="")
    moved = claims(mission, {"r0": legs([[0.001, 0, 1], [1, 0, 1]])})["continuity", "r0"]
    assert moved.outcome == "fails"
    assert "at the start" in moved.sentence
    half = legs([[0, 0, 1], [1, 0, 1]])
    cut = Trajectory(half.durations / 2, half.coefficients)
    stopped = claims(mission, {"r0": cut})["continuity", "r0"]
    assert stopped.outcome == "fails"
    assert "at the end" in stopped.sentence
    agents = {"r0": mission.agents["r0"].model_copy(update={"end": (1.0, 0.0, 1.001)})}
    elsewhere = claims(mission.model_copy(update={"agents": agents}), {"r0": half})["continuity", "r0"]
    assert elsewhere.outcome == "fails"


def test_teams_must_be_the_missions():
    mission = pair_mission()
    team = {"r0": still([0, 0, 1]), "r1": still([0, 1, 1])}
    with pytest.raises(BadInput, match="r1"):
        read_team(mission, {"r0": team["r0"]})
    with pytest.raises(BadInput, match="finite"):
        read_team(mission, {"r0": team["r0"], "r1": Trajectory([1.0], np.zeros((1, 4, 8)), cycle=0)})
    with pytest.raises(BadInput, match="cycle"):
        read_team(small_mission(regions="", trace="infinite"), {"r0": team["r0"]})
    with pytest.raises(BadInput, match="Trajectory"):
        read_team(mission, {"r0": team["r0"], "r1": "no"})  # type: ignore[dict-item]
    assert read_team(mission, team).end == Fraction(1)


@few_of(1, "size", [1e150, 1e300])
def test_absurd_paths_of_two_robots_are_refused_without_a_traceback(size):
    mission = pair_mission()
    wild = still([0, 0, 1]).coefficients.copy()
    wild[0, :3, 3] = size
    found = claims(mission, {"r0": Trajectory([1.0], wild), "r1": still([0, 1, 1])})
    assert found["workspace", "r0"].outcome == "fails"
    assert not math.isfinite(found["workspace", "r0"].bound) or found["workspace", "r0"].bound < 0


def least_gap(mission, team, clock_error, margin):
    """Least distance (z weighted) of robots whose clocks differ, pushed towards each other within the margin: by samples."""
    weight = np.array([1, 1, mission.separation / (mission.separation_z or mission.separation)])
    times = np.linspace(0, max(t.duration for t in team.values()), 2000)
    least = np.inf
    for ahead in np.linspace(-clock_error, clock_error, 9):
        gap = team["r0"].evaluate(np.clip(times + ahead, 0, None))[:, :3] - team["r1"].evaluate(times)[:, :3]
        push = gap * weight**2
        push /= np.maximum(np.linalg.norm(push, axis=1, keepdims=True), 1e-300)
        least = min(least, np.linalg.norm((gap - 2 * margin * push) * weight, axis=1).min())
    return least


def test_robots_above_each_other_with_clocks_that_differ():
    """Where distance in z counts more than 1, so do the drift of clocks and the steps between pieces."""
    first, second = legs([[0, 0, 1.0], [0, 0, 1.52]], speed=0.45), legs([[0, 0, 1.6], [0, 0, 2.6]], speed=0.45)
    team, kept = {"r0": first, "r1": second}, {}
    for clock_error in (0.0, 0.05, 0.1, 0.3, 0.6, 0.9):
        apart = {"separation": 0.5, "separation_z": 0.1}
        mission = started(pair_mission(radius=0.05).model_copy(update=apart), team)
        claim = claims(mission, team, clock_error=clock_error)["separation", "r0"]
        kept[clock_error] = claim.outcome == "holds"
        gap = least_gap(mission, team, clock_error, 0.0)
        assert (claim.outcome == "holds") == (gap >= 0.5)
        assert claim.margin <= gap - 0.5 + 1e-6
    assert kept[0.0]
    assert kept[0.3]  # though that is more than the slower one flies in the meantime
    assert not kept[0.9]


@pytest.mark.parametrize("count", [5, pytest.param(25, marks=pytest.mark.slow)])
def test_separation_with_weights_clocks_and_tubes_against_samples(count):
    rng = np.random.default_rng(3)
    held = 0
    for k in range(count):
        points = rng.uniform([-1, -1, 0.5], [1, 1, 2], (2, 3, 3))
        if k % 2:
            points[:, :, :2] = 0.0  # one above the other
        team = {f"r{i}": legs(p) for i, p in enumerate(points)}
        apart = {"separation": float(rng.choice([0.3, 0.5])), "separation_z": float(rng.choice([0.1, 0.2, 0.6]))}
        mission = started(pair_mission(radius=0.05).model_copy(update=apart), team)
        error, margin = float(rng.choice([0.0, 0.05, 0.3])), float(rng.choice([0.0, 0.02]))
        if claims(mission, team, clock_error=error, margin=margin)["separation", "r0"].outcome == "holds":
            held += 1
            assert least_gap(mission, team, error, margin * (1 - 1e-9)) >= mission.separation - 1e-7
    assert held >= count / 5


def test_robots_never_touch_whatever_separation_a_mission_asks():
    team = {"r0": still([0, 0, 1]), "r1": still([0, 0, 1])}
    mission = started(pair_mission().model_copy(update={"separation": 0.0}), team)
    claim = claims(mission, team)["separation", "r0"]
    assert (claim.outcome, claim.bound, claim.limit) == ("fails", 0.0, 0.14)


@pytest.mark.parametrize(("gap", "outcome"), [(0.2301, "holds"), (0.2299, "fails")])
@pytest.mark.parametrize("axis", [1, 2])
def test_the_radii_of_two_kinds_are_kept_apart(gap, outcome, axis):
    places = [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0]]
    places[1][axis] += gap
    team = {"r0": still(places[0]), "r1": still(places[1])}
    mission = started(pair_mission().model_copy(update={"separation": 0.14, "separation_z": 0.14}), team)
    wide = mission.agents["r1"].model_copy(update={"vehicle": mission.vehicle.changed(radius=0.16)})
    mission = mission.model_copy(update={"agents": {**mission.agents, "r1": wide}})
    claim = claims(mission, team)["separation", "r0"]
    assert claim.outcome == outcome
    assert claim.limit == pytest.approx(0.23)


def test_a_step_between_pieces_is_taken_off_the_distance_once():
    def still(*places):
        coefficients = np.zeros((len(places), 4, 8))
        coefficients[:, :3, 0] = places
        return Trajectory(np.ones(len(places)), coefficients)

    mission = small_mission(regions="", starts=((0, 0, 1), (2, 0, 1)))
    team = {"r0": still((0, 0, 1), (0.125, 0, 1)), "r1": still((2, 0, 1), (2, 0, 1))}
    (found,) = minimum_distances(pairwise_distances(read_team(mission, team)))
    assert found.high == pytest.approx(1.875, abs=1e-9)
    assert 1.75 - 1e-6 <= found.low <= 1.75
