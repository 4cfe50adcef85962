"""Certified online flight through changes of the world, held against readings that share nothing with the proofs.

What is held: references sampled densely (limits, separation, rims), the log of the flight in simulation (inside the margin, and
its letters as a team word), and verify's checker of recorded flights.
"""

import itertools
import math
from fractions import Fraction

import numpy as np
import pytest

import ltlplan
from ltlplan.online.online_flight import NOT_ALL_CERTIFIED
from ltlplan.online.segments.braking import slow_down
from ltlplan.online.segments.certified_team import CertifiedTeam
from ltlplan.online.simulated_online_flight import fly_online
from tests.helpers.few import few_of
from tests.helpers.missions.own_places import own_places
from tests.helpers.missions.worlds import world
from tests.helpers.motion import dense_sampler
from verify import check_samples, check_word
from verify.data import BadInput, Trajectory, parse_mission
from verify.data.events import HoopMoves, NewFormula, ObstacleAppears, RobotJoins, RobotLeaves
from verify.data.sections import Agent
from verify.data.shapes.obstacle import Obstacle
from verify.flight_segments import judge_stop

WATER = "F loc1 & F loc2 & G(smoke -> carrying) & F water"


@pytest.fixture(scope="module")
def firefighting():
    return ltlplan.load_mission("firefighting")


def flown(mission, *events, seed=1):
    flight = fly_online(mission, seed=seed, events=events, certified=True, noise=0.001, max_seconds=60)
    held_against_samples(flight)
    return flight


def held_against_samples(flight):
    """Sample what the pieces say will be flown, each in its world, and compare the simulated flight with it."""
    log = flight.log
    for piece, until in zip(flight.pieces, [*(float(p.since) for p in flight.pieces[1:]), math.inf], strict=True):
        mission, resolved = piece.mission, piece.mission.resolved()
        end = min(until, float(piece.end), float(log.times[-1]))
        times = np.arange(float(piece.since), end, 0.005) - float(piece.start)
        if not len(times):
            continue
        paths = {name: sampled(track, times) for name, track in piece.team.items()}
        for i, (name, path) in enumerate(paths.items()):
            found = dense_sampler.quantities(resolved, dense_sampler.Flight(times, path))
            limits = mission.effective_limits
            assert found["speed"].max() <= limits.speed
            assert found["acceleration"].max() <= limits.acceleration
            assert found["tilt"].max() <= limits.tilt
            assert limits.thrust_min <= found["thrust"].min()
            assert found["thrust"].max() <= limits.thrust_max
            points = path[0, :, :3]
            for other in list(paths)[i + 1 :]:
                away = np.linalg.norm(points - paths[other][0, :, :3], axis=1).min()
                assert away >= mission.separation + 2 * mission.margin
            for hoop in mission.hoops.values():
                assert from_rim(points, hoop).min() > mission.vehicle.radius + mission.margin
            if not flight.certified:
                continue
            rows = np.flatnonzero((log.times >= piece.since) & (log.times < end))
            k = log.robots.index(name)
            wanted = sampled(piece.team[name], log.times[rows] - float(piece.start))[0, :, :3]
            assert np.linalg.norm(log.position[rows, k] - wanted, axis=1).max() < mission.margin

    pieces_meet(flight.pieces)


def pieces_meet(pieces):
    """What is handed to a robot begins where and as the robot then flies, heading included."""
    for before, after in itertools.pairwise(pieces):
        for name in before.team.keys() & after.team.keys():
            left, right = (
                sampled(piece.team[name], [float(after.since) - float(piece.start)])[:, 0] for piece in (before, after)
            )
            for order, allowed in enumerate((1e-4, 1e-3, 1e-2, 1e-1)):
                assert np.abs(left[order] - right[order]).max() < allowed, (name, float(after.since), order)


def sampled(track: Trajectory, times):
    """Derivatives 0 to 4 of a trajectory by numpy's own polynomials; it hovers after its end. Shape (5, n, 4)."""
    times = np.asarray(times, dtype=float)
    result = np.zeros((5, len(times), 4))
    starts = np.concatenate([[0.0], np.cumsum(track.durations)])
    pieces = np.clip(np.searchsorted(starts, times, side="right") - 1, 0, len(track) - 1)
    for piece in np.unique(pieces):
        rows = pieces == piece
        local = np.minimum(times[rows] - starts[piece], track.durations[piece])
        for axis in range(4):
            curve = np.polynomial.Polynomial(track.coefficients[piece, axis])
            for order in range(5):
                result[order, rows, axis] = curve(local)
                curve = curve.deriv()
    result[1:, times > starts[-1]] = 0.0
    return result


def from_rim(points, hoop):
    normal = np.array(hoop.normal)
    offset = points - np.array(hoop.center)
    along = offset @ normal
    across = np.linalg.norm(offset - along[:, None] * normal, axis=1)
    radial = np.maximum.reduce([hoop.opening - across, across - hoop.opening - hoop.rim, np.zeros(len(points))])
    return np.hypot(radial, np.maximum(np.abs(along) - hoop.rim / 2, 0))


def a_team_word(flight, seed=0):
    """All letters of the log, the robots read in any order at each entry."""
    rng = np.random.default_rng(seed)
    return [row[k] for row in flight.log.letters for k in rng.permutation(len(row))]


def finished(flight):
    assert flight.certified
    assert flight.require().satisfied_at is not None
    assert check_word(flight.mission.formula, a_team_word(flight))
    return flight


@pytest.mark.slow
def test_robots_in_different_internal_states_go_on(firefighting):
    flight = finished(flown(firefighting, NewFormula(time=2.2, formula=WATER)))
    assert len(flight.certificates) == 2
    assert len(flight.pieces) == 3
    internals = {agent.internal for agent in flight.pieces[-1].mission.agents.values()}
    assert internals == {"carrying", "no_water"}
    assert flight.pieces[-1].mission.agents["quad0"].visited in ("water", "smoke")  # how far it comes hangs on the path
    # what is left is an ordinary mission file
    assert parse_mission(dump(flight.pieces[-1].mission)).spec.formula == flight.pieces[-1].mission.spec.formula
    # nobody has to take water a second time
    assert flight.words["quad0"].count(frozenset({"water", "carrying"})) == 1
    times, positions = flight.log.times, flight.log.position
    carried = {name: [row[k] & {"carrying"} for row in flight.log.letters] for k, name in enumerate(flight.log.robots)}
    verdict = check_samples(times, positions, flight.mission, max_speed=2.0, internal=carried)
    assert verdict.outcome == "holds", verdict.sentence


def dump(mission):
    from verify.data import mission_to_yaml

    return mission_to_yaml(mission)


TURNING = """
format: 1
name: turning
spec: {formula: F a}
regions: {a: {center: [0.8, 0, 1], radii: [0.2, 0.2, 0.2]}, b: {center: [0.2, 0.9, 1], radii: [0.2, 0.2, 0.2]}}
hoops: {ring: {center: [0, -1.2, 1], yaw_deg: 0, radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}}
agents: {quad0: {start: [-0.3, 0, 1], yaw_deg: 60, heading: path}}
vehicle: crazyflie-2.1
workspace: {min: [-2, -2, 0.2], max: [2, 2, 2]}
planner: {speed: 0.8}
"""


@pytest.fixture(scope="module")
def turning():
    return parse_mission(TURNING.replace("speed: 0.8", "speed: 0.8, pace: nominal"))


@pytest.mark.slow
def test_a_robot_that_looks_along_its_path_goes_on_from_the_heading_that_it_has(turning):
    # the second change comes while it flies what was planned after the first, from another heading than the mission's
    events = NewFormula(time=0.5, formula="F b"), NewFormula(time=2.0, formula="F a & F b")
    flight = finished(flown(turning, *events))
    assert len(flight.pieces) == 5
    begun = [piece.mission.agents["quad0"].yaw_deg for piece in flight.pieces]
    assert abs(begun[2] - 60) > 5
    assert begun[3] == pytest.approx(begun[2], abs=1e-4)
    assert abs(begun[4] - begun[3]) > 5


@pytest.mark.slow
def test_slowing_down_keeps_the_limits_of_the_leg_that_it_ends():
    mission = parse_mission(TURNING + "limits: {legs: {a: {speed: 0.4, acceleration: 1.0}}}\n")
    flight = finished(flown(mission, NewFormula(time=1.0, formula="F b")))
    before, stop = (piece.team["quad0"] for piece in flight.pieces[:2])
    begin = sum(map(Fraction, stop.durations[:-1].tolist()))

    def hardest(track):
        braking = sampled(track, np.linspace(track.knots[-2], track.duration, 400))
        return np.linalg.norm(braking[2, :, :3], axis=1).max()

    assert hardest(stop) < 1.0
    # as soon and as hard as the flight's own limits allow would break the leg's, and the judge says so
    hard = slow_down(before, float(begin), 0.5)
    assert 1.0 < hardest(hard) < mission.effective_limits.acceleration
    world = flight.pieces[0].mission
    assert all(claim.outcome == "holds" for claim in judge_stop(world, {"quad0": hard}, Fraction(1)))
    said = judge_stop(world, {"quad0": hard}, Fraction(1), {"quad0": (begin, "a")})
    assert [claim.name for claim in said if claim.outcome != "holds"] == ["limits.legs.acceleration"]
    assert all(claim.outcome == "holds" for claim in judge_stop(world, {"quad0": stop}, Fraction(1), {"quad0": (begin, "a")}))


@pytest.mark.slow
def test_where_coming_to_rest_cannot_be_proved_the_team_holds_for_good(turning):
    # a ring drops across the way of quad0, a moment ahead of it
    ahead = CertifiedTeam(turning, seed=1).present.team["quad0"].evaluate(0.9)[:3]
    center = (float(ahead[0]), float(ahead[1]), float(ahead[2]) + 0.26)
    flight = fly_online(turning, seed=1, certified=True, events=[HoopMoves(time=0.6, region="ring", center=center)])
    assert not flight.certified
    assert len(flight.certificates) == 1
    assert flight.log.notes[0].startswith(NOT_ALL_CERTIFIED)
    assert "rim" in flight.log.notes[0]
    assert any("No certified pieces for what is left" in event.sentence for event in flight.log.events)
    assert np.abs(flight.log.velocity[-1]).max() < 0.05
    assert not flight.verdict


def test_a_formula_that_became_impossible_is_said_and_nobody_moves_again(turning):
    flight = flown(turning, NewFormula(time=0.5, formula="a & F b"))
    assert not flight.verdict
    assert any("No certified pieces for what is left" in event.sentence for event in flight.log.events)
    assert np.abs(flight.log.velocity[-1]).max() < 0.05


@pytest.mark.slow
def test_what_was_flown_is_taken_off_the_endurance():
    later = NewFormula(time=1.0, formula="F b")
    assert finished(flown(parse_mission(TURNING + "limits: {endurance: 14.5}\n"), later)).log.times[-1] > 3.0
    short = flown(parse_mission(TURNING + "limits: {endurance: 14.0}\n"), later)
    assert not short.verdict
    assert any("its endurance is" in event.sentence or "endurance in the team" in event.sentence for event in short.log.events)


@few_of(1, ("region", "said"), [("b", "inside it at once"), ("ring", "The rim of ring moves onto quad0")])
def test_a_hoop_that_moves_onto_a_robot_is_said_at_once_and_the_robot_holds(turning, region, said):
    at = CertifiedTeam(turning, seed=1).present.team["quad0"].evaluate(0.8)[:3]
    center = (float(at[0]), float(at[1]), float(at[2]) + (0.26 if region == "ring" else 0.0))
    flight = fly_online(turning, seed=1, certified=True, events=[HoopMoves(time=0.8, region=region, center=center)])
    assert [event.time for event in flight.log.events if said in event.sentence] == pytest.approx([0.8])
    assert not flight.verdict
    assert np.abs(flight.log.velocity[-1]).max() < 0.05
    assert np.linalg.norm(flight.log.position[-1, 0] - at) < 0.5


def test_a_robot_pushed_out_of_its_tube_is_not_called_certified(turning):
    flight = fly_online(turning, seed=1, certified=True, wind=6.0, max_seconds=2)
    assert flight.log.worst_error() > turning.margin
    assert not flight.certified
    assert "more than the margin" in flight.summary()


def test_a_sequence_is_not_flown_online(firefighting):
    with pytest.raises(BadInput, match="sequence"):
        fly_online(firefighting.model_copy(update={"sequence": "waterF"}))


@few_of(6, "seed", range(20))
def test_slowing_down_ends_at_rest_and_begins_as_the_flight_did(seed):
    rng = np.random.default_rng(seed)
    track = Trajectory(rng.uniform(0.5, 2, 3).astype(np.float32), rng.normal(0, 0.3, (3, 4, 8)).astype(np.float32))
    slowed = slow_down(track, rng.uniform(0.1, 1.4), rng.uniform(0.4, 2))
    if slowed is None:  # too near to a knot
        return
    assert slowed.is_float32
    kept = len(slowed) - 1
    assert np.array_equal(slowed.coefficients[:kept], track.coefficients[:kept])
    begin = slowed.knots[-2]
    for order in range(4):
        last = sampled(Trajectory(slowed.durations[-1:], slowed.coefficients[-1:]), [0.0, slowed.durations[-1]])[order]
        before = sampled(Trajectory(slowed.durations[:kept], slowed.coefficients[:kept]), [begin])[order, 0]
        assert np.allclose(last[0], before, atol=1e-4 * (1 + np.abs(before).max()))
        if order:
            assert np.abs(last[1]).max() < 1e-3 * (1 + np.abs(last[0]).max())


EVENTS = ("moves", "fails", "leaves", "joins", "formula")


def an_event(kind, rng):
    time = round(float(rng.uniform(0.1, 8.0)), 2)
    if kind == "moves":
        region, center = [("loc2", (-1.15, 0.45, 1.0)), ("loc1", (0.2, 0.75, 1.0)), ("smoke", (-0.45, -0.15, 0.9))][
            rng.integers(3)
        ]
        to = np.array(center) + rng.uniform(-0.15, 0.15, 3)
        return HoopMoves(time=time, region=region, center=tuple(float(x) for x in to))
    if kind == "joins":
        return RobotJoins(time=time, robot="quad3", agent=Agent(start=(1.3, 1.0, 0.8)))
    if kind == "formula":
        text = [WATER, "F loc1 & F loc2 & F water", "F loc2 & G(smoke -> carrying)", "F(water & F loc1) & G(smoke -> carrying)"]
        return NewFormula(time=time, formula=text[rng.integers(4)])
    return RobotLeaves(time=time, robot=f"quad{rng.integers(3)}", fails=kind == "fails")


def through(mission, kind, seed):
    """Fly through one change at a random second: satisfied, or held with the reason said."""
    flight = flown(mission, an_event(kind, np.random.default_rng([seed, EVENTS.index(kind)])), seed=seed)
    if flight.verdict:
        assert check_word(flight.mission.formula, a_team_word(flight, seed))
    else:
        assert any(
            "No certified pieces" in event.sentence or "hold their positions" in event.sentence for event in flight.log.events
        )
        flying = [k for k, name in enumerate(flight.log.robots) if name in flight.pieces[-1].team]
        assert np.abs(flight.log.velocity[-1][flying]).max() < 0.05
    return flight


@pytest.mark.slow
def test_a_region_that_moves_is_reached_where_it_is_then(turning):
    flight = finished(flown(turning, HoopMoves(time=0.5, region="a", center=(0.3, 0.6, 1.1))))
    assert len(flight.pieces) == 3
    where = flight.log.position[[row[0] == {"a"} for row in flight.log.letters], 0]
    assert np.linalg.norm(where - np.array([0.3, 0.6, 1.1]), axis=1).max() <= 0.2


@pytest.mark.slow
@pytest.mark.parametrize("kind", EVENTS)
@pytest.mark.parametrize("seed", range(9))
def test_changes_at_random_seconds(firefighting, kind, seed):
    assert through(firefighting, kind, seed).duration > 3


@pytest.mark.slow
@pytest.mark.parametrize("second", range(9))
@pytest.mark.parametrize("robot", ["quad0", "quad2"])
def test_a_robot_may_fail_at_any_second(firefighting, robot, second):
    flight = flown(firefighting, RobotLeaves(time=float(second), robot=robot))
    if flight.verdict:
        assert check_word(flight.mission.formula, a_team_word(flight))
    else:
        assert any("No certified pieces" in event.sentence for event in flight.log.events)


WALLED = """
format: 1
name: walled
spec: {formula: F a & F b}
regions:
  a: {center: [1.2, 0.0, 1.0], size: [0.4, 0.4, 0.4]}
  b: {center: [-1.2, 0.0, 1.0], size: [0.4, 0.4, 0.4]}
obstacles:
  pillar: {center: [0.0, 1.0, 1.0], size: [0.3, 0.3, 1.8]}
agents: {quad0: {start: [-0.6, -0.6, 1.0]}}
vehicle: crazyflie-2.1
limits: {speed: 0.6}
workspace: {min: [-1.8, -1.4, 0.1], max: [1.8, 1.6, 1.9]}
"""
CRATE = Obstacle.model_validate({"center": (0.0, -0.1, 1.0), "size": (0.3, 1.0, 1.8)})


@pytest.mark.slow
def test_what_appears_or_moves_in_the_way_is_flown_around() -> None:
    mission = parse_mission(WALLED)
    events = [
        ObstacleAppears(time=1.5, name="crate", obstacle=CRATE),
        HoopMoves(time=2.0, region="pillar", center=(0.4, 0.9, 1.0)),
    ]
    flight = fly_online(mission, seed=0, certified=True, events=events)
    flight.require()
    assert flight.certified
    now = flight.log.times > 6.0
    last = flight.earlier[-1][1].changed(
        obstacles={"crate": CRATE, "pillar": mission.obstacles["pillar"].changed(center=(0.4, 0.9, 1.0))}
    )
    for obstacle in last.obstacles.values():
        away = obstacle.measures.depths(flight.log.position[now, 0] - np.array(obstacle.center))
        assert away.max() < -mission.vehicle.radius


@pytest.mark.slow
def test_what_appears_on_a_robot_ends_the_flight_in_a_hover() -> None:
    box = Obstacle.model_validate({"center": (-0.6, -0.6, 1.0), "size": (0.3, 0.3, 0.3)})
    flight = fly_online(
        parse_mission(WALLED),
        seed=0,
        certified=True,
        events=[ObstacleAppears(time=0.0, name="box", obstacle=box)],
        max_seconds=20,
    )
    assert any("0.000 m from quad0, which needs 0.120 m" in event.sentence for event in flight.log.events)


def test_courses_that_know_no_obstacles_are_refused() -> None:
    with pytest.raises(BadInput, match="--certified"):
        fly_online(parse_mission(WALLED), seed=0)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["exact", "mtac-e"])
def test_formulas_that_count_robots_and_name_them_are_flown_in_certified_pieces(method):
    places = {"a": (0.0, 0.0), "b": (2.0, 0.0), "c": (0.0, 2.5), "d": (5.0, 0.0)}
    mission = world(
        "F(count(a) >= 2) & G(count(b) <= 1) & F c", robots=3, regions=places, radii=dict.fromkeys(places, 0.7), team="joint",
        extra="margin: 0.05",
    )  # fmt: skip
    mission = mission.model_copy(update={"planner": mission.planner.model_copy(update={"method": method})})
    asked = "F(count(a) >= 2) & F(quad0.d & count(a) >= 1) & F c & G(count(b) <= 1)"
    flight = flown(mission, NewFormula(time=6.0, formula=asked))
    assert flight.verdict.outcome == "holds"
    assert len(flight.pieces) > 1
    with pytest.raises(BadInput, match="'quad7' is not a robot"):
        fly_online(mission, seed=1, events=(NewFormula(time=1.0, formula="F quad7.d"),), certified=True)


@pytest.mark.slow
def test_robots_that_wait_for_each_other_are_flown_in_certified_pieces():
    mission = own_places("F a & F b", {"quad0": "a", "quad1": "b"})
    flight = flown(mission, NewFormula(time=1.0, formula="F b & (!b U a)"))
    assert flight.verdict.outcome == "holds"
    names = list(flight.log.robots)
    when = {
        place: next(i for i, letters in enumerate(flight.log.letters) if place in letters[names.index(name)])
        for name, place in (("quad0", "a"), ("quad1", "b"))
    }
    assert when["a"] < when["b"]


@pytest.mark.slow
def test_a_team_that_is_counted_and_loses_a_robot_holds_its_position():
    places = {"a": (0.0, 0.0), "c": (0.0, 2.5)}
    mission = world("F(count(a) >= 2) & F c", robots=3, regions=places, radii=dict.fromkeys(places, 0.7), team="joint")
    flight = fly_online(mission, seed=1, events=(RobotLeaves(time=4.0, robot="quad1"),), certified=True, max_seconds=20)
    assert flight.verdict.outcome == "fails"
    assert any("the team is not the one that took off" in str(event) for event in flight.log.events)
