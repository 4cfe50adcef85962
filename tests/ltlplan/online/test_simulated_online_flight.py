"""Online flights with dynamics, motion capture and the checker's verdict: short here, the long ones are slow tests."""

import numpy as np
import pytest

import ltlplan
from ltlplan.online.online_flight import NOT_CERTIFIED
from ltlplan.online.simulated_online_flight import fly_online
from ltlplan.report.online import online_html
from tests.helpers.few import few_of
from tests.helpers.pages import bars_of, data_of
from verify.data import BadInput, NotCertified, Unsatisfiable, parse_mission
from verify.data.events import HoopMoves, NewFormula, RobotLeaves

ONE = """
format: 1
name: one
spec: {formula: F a & G !b}
regions: {a: {center: [0.5, 0, 1], radii: [0.2, 0.2, 0.2]}, b: {center: [0.5, 1, 1], radii: [0.2, 0.2, 0.2]}}
agents: {quad0: {start: [-0.2, 0, 1]}}
vehicle: crazyflie-2.1
workspace: {min: [-2, -2, 0.2], max: [2, 2, 2]}
planner: {method: online-mtac-e, samples: 50, elite: 0.1}
"""


@pytest.fixture(scope="module")
def one():
    return parse_mission(ONE)


def test_a_short_flight_holds_and_says_that_it_was_not_certified(one):
    flight = fly_online(one, seed=2, noise=0.001)
    assert flight.require() is flight
    assert flight.words["quad0"] == (frozenset(), frozenset({"a"}))
    assert flight.satisfied_at is not None
    assert flight.satisfied_at < flight.duration < 10
    assert not flight.certified
    assert flight.log.notes == (NOT_CERTIFIED,)
    assert flight.log.certificate is None
    assert "simulation only" in NOT_CERTIFIED
    assert flight.log.satisfied is True
    assert "not" in NOT_CERTIFIED
    assert "127 s" not in flight.summary(), "the figure of another mission's experiment"
    assert flight.log.worst_error() < 0.1
    assert flight.log.position.shape == (len(flight.log.times), 1, 3)


def test_the_page_says_what_the_flight_is_not_and_draws_what_was_flown(one):
    flight = fly_online(one, seed=2, noise=0.001, events=[NewFormula(time=0.5, formula="F a & G !b & F !a")])
    page = online_html(flight)
    assert page == online_html(flight)
    header = page[page.index("<header>") : page.index("</header>")]
    assert header.index(NOT_CERTIFIED) < header.index("Verdict on the flown words: ")
    assert "0.50 s: the formula is now F a &amp; G !b &amp; F !a." in header
    data = data_of(page)
    seen = [time for time, row in zip(flight.log.times, flight.log.letters, strict=True) if "a" in row[0]]
    rows, bars = bars_of(page, "labels")
    assert rows == ["quad0 a"]
    assert bars[0].start * flight.log.times[-1] == pytest.approx(seen[0], abs=1e-3)
    assert sum(bar.length for bar in bars) * flight.log.times[-1] == pytest.approx(0.01 * len(seen), abs=0.011)
    (line,) = [
        trace for trace in data["figures"]["scene"]["data"] if trace.get("mode") == "lines" and trace.get("name") == "quad0"
    ]
    assert [line[axis][-1] for axis in "xyz"] == pytest.approx(flight.log.position[::5, 0][-1].tolist(), abs=1e-3)
    assert "F a" in bars_of(page, "truth")[0]


def test_the_page_plays_and_shows_hoops_where_they_were_at_the_time(one):
    moves = [
        HoopMoves(time=0.4, region="b", center=(0.5, -1.0, 1.2)),
        HoopMoves(time=0.9, region="b", center=(-1.0, -1.0, 1.2)),
    ]
    flight = fly_online(one, seed=2, events=moves)
    data = data_of(online_html(flight))
    player = data["player"]
    assert player["robots"] == ["quad0"]
    assert player["paths"][0] == pytest.approx(flight.log.position[::5, 0].round(4))
    assert player["step"] == pytest.approx(0.05)
    assert [row[1] for row in player["letters"][0]] == ["{} (in no region)", "{a}"]
    assert {tuple(part) for part in player["todo"][-1][1]} == {("F a", "done"), ("G !b", "kept so far")}
    assert [time for time, sentence in player["happened"] if "moves" in sentence][:1] == [0.4]
    bodies = [trace for trace in data["figures"]["scene"]["data"] if trace["type"] == "mesh3d" and trace["name"] == "b"]
    places = [[round((max(body[axis]) + min(body[axis])) / 2, 3) for axis in "xyz"] for body in bodies]
    assert places == [[0.5, 1.0, 1.0], [0.5, -1.0, 1.2], [-1.0, -1.0, 1.2]]
    assert [body["meta"] for body in bodies] == [{"since": 0.0, "until": 0.4}, {"since": 0.4, "until": 0.9}, {"since": 0.9}]
    assert [body["visible"] for body in bodies] == [False, False, True]
    (still,) = [trace for trace in data["figures"]["scene"]["data"] if trace["type"] == "mesh3d" and trace["name"] == "a"]
    assert "meta" not in still


def test_a_robot_that_landed_below_the_workspace_can_still_be_seen(one):
    flight = fly_online(one, seed=2, events=[RobotLeaves(time=0.3, robot="quad0")])
    lowest = flight.log.position[:, 0, 2].min()
    assert lowest < one.workspace.min[2]
    page = data_of(online_html(flight))["figures"]["scene"]["layout"]["scene"]
    ranges = {axis: page[f"{axis}axis"]["range"] for axis in "xyz"}
    assert ranges["z"] == pytest.approx([flight.log.position[::5, 0, 2].min(), one.workspace.max[2]])
    assert ranges["x"] == [one.workspace.min[0], one.workspace.max[0]]
    spans = [high - low for low, high in ranges.values()]
    assert [page["aspectratio"][axis] / page["aspectratio"]["x"] for axis in "xyz"] == pytest.approx(
        [s / spans[0] for s in spans]
    )


def test_the_same_seed_gives_the_same_log(one):
    first, again = (fly_online(one, seed=5, noise=0.001, max_seconds=1.0).log.to_csv() for _ in range(2))
    assert first == again


def test_a_flight_that_ends_too_early_fails_in_the_checker(one):
    flight = fly_online(one, seed=2, max_seconds=0.5)
    assert flight.verdict.outcome == "fails"
    assert flight.satisfied_at is None
    with pytest.raises(NotCertified, match="never happens"):
        flight.require()


def test_a_formula_that_became_impossible_ends_in_a_hover_and_a_refusal(one):
    flight = fly_online(one, seed=2, events=[NewFormula(time=0.3, formula="G !a & F b & G !b")])
    assert not flight.verdict
    assert any("cannot be satisfied" in event.sentence for event in flight.log.events)
    assert np.abs(flight.log.velocity[-1]).max() < 0.05


@few_of(1, "certified", [False, True])
def test_what_no_flight_can_complete_any_more_is_said_at_once(one, certified):
    flight = fly_online(one, seed=2, certified=certified, events=[NewFormula(time=1.5, formula="a & F b")])
    said = next(event for event in flight.log.events if "cannot be completed" in event.sentence)
    # still in flight, before it has come to rest
    assert said.time == pytest.approx(1.5)
    assert not flight.verdict
    assert np.abs(flight.log.velocity[-1]).max() < 0.05


def test_what_a_flight_can_still_complete_is_not_said_to_be_lost(one):
    calm = fly_online(one, seed=2, events=[NewFormula(time=1.5, formula="!a & F b")], max_seconds=1.6)
    assert not any("cannot be completed" in event.sentence for event in calm.log.events)


def test_a_region_that_moves_onto_the_robot_is_said_and_the_robot_holds(one):
    flight = fly_online(one, seed=2, events=[HoopMoves(time=0.4, region="b", center=(-0.2, 0.0, 1.0))])
    assert not flight.verdict
    assert any("inside it at once" in event.sentence for event in flight.log.events)


def test_a_robot_that_fails_at_once_leaves_nobody(one):
    flight = fly_online(one, seed=2, events=[RobotLeaves(time=0.0, robot="quad0")], max_seconds=10)
    assert flight.verdict.outcome == "fails"
    assert flight.words["quad0"] == (frozenset(),)


def test_bad_input_is_refused_before_take_off(one):
    with pytest.raises(BadInput, match="max_seconds"):
        fly_online(one, max_seconds=0)
    with pytest.raises(BadInput, match="more than 1 / elite"):
        fly_online(parse_mission(ONE.replace("samples: 50, elite: 0.1", "samples: 20, elite: 0.05")))
    with pytest.raises(BadInput, match="agents"):
        parse_mission(ONE.replace("{quad0: {start: [-0.2, 0, 1]}}", "{}"))
    with pytest.raises(BadInput, match="nobody"):
        fly_online(one, events=[RobotLeaves(time=0.0, robot="nobody")])
    with pytest.raises(Unsatisfiable):
        fly_online(parse_mission(ONE.replace("F a & G !b", "F a & G !a")))
    with pytest.raises(Unsatisfiable):
        fly_online(parse_mission(ONE.replace("start: [-0.2, 0, 1]", "start: [0.5, 1, 1]")))


def test_certified_pieces_fly_the_mission(one):
    flight = fly_online(one, seed=1, certified=True, noise=0.001)
    assert flight.require().certified
    assert "certified" in flight.log.notes[0]
    assert flight.log.worst_error() < one.margin


@pytest.mark.slow
@pytest.mark.parametrize(
    "events",
    [
        (),
        (RobotLeaves(time=4.0, robot="quad0"),),
        (HoopMoves(time=1.5, region="loc2", center=(-1.15, 0.2, 1.1)),),
        (NewFormula(time=1.0, formula="F loc1 & F loc2 & G(smoke -> carrying) & F water"),),
    ],
)
@pytest.mark.parametrize("certified", [False, True])
def test_firefighting_in_simulation(events, certified):
    mission = ltlplan.load_mission("firefighting")
    flight = fly_online(mission, seed=1, events=events, certified=certified, noise=0.001, max_seconds=60)
    assert flight.require().duration < 30
    positions = flight.log.position
    nearest = min(np.linalg.norm(positions[:, i] - positions[:, j], axis=1).min() for i in range(3) for j in range(i))
    assert nearest > mission.separation


HELD_UP = """
format: 1
name: held up
spec: {formula: "F a"}
regions: {a: {center: [2.0, 0, 1.0], radii: [0.2, 0.2, 0.2]}}
agents: {quad0: {start: [0, 0, 1]}, quad1: {start: [1.0, 0, 1], cost: {length: 100.0}}}
vehicle: crazyflie-2.1
workspace: {min: [-1, -1.5, 0.2], max: [4, 1.5, 1.8]}
planner: {method: online-mtac-e, samples: 50, elite: 0.1}
"""

OCCUPIED = """
format: 1
name: occupied
spec: {formula: "F(carrying & a)"}
regions: {a: {center: [1.5, 0, 1.0], radii: [0.2, 0.2, 0.2]}, w: {center: [0, 0.9, 1.0], radii: [0.2, 0.2, 0.2]}}
robot:
  initial: none
  states: {none: [], some: [carrying]}
  actions: [{from: none, to: some, at: w}]
agents: {quad0: {start: [0, 0, 1]}, quad1: {start: [1.5, 0, 1]}}
vehicle: crazyflie-2.1
workspace: {min: [-1, -1.5, 0.2], max: [4, 1.5, 1.8]}
planner: {method: online-mtac-e, samples: 50, elite: 0.1}
"""


def least_distance(flight):
    positions = flight.log.position
    return float(np.linalg.norm(positions[:, 0] - positions[:, 1], axis=1).min())


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.slow
def test_a_robot_is_led_around_one_that_hovers_in_its_straight_way(seed):
    mission = parse_mission(HELD_UP)
    flight = fly_online(mission, seed=seed, max_seconds=40)
    assert flight.require() is flight
    assert flight.words == {"quad0": (frozenset(), frozenset({"a"})), "quad1": (frozenset(),)}
    assert least_distance(flight) >= mission.separation
    assert any("quad0 is led around quad1" in event.sentence for event in flight.log.events)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_an_idle_robot_steps_aside_where_another_one_is_to_go(seed):
    mission = parse_mission(OCCUPIED)
    flight = fly_online(mission, seed=seed, max_seconds=60)
    assert flight.require() is flight
    assert flight.words["quad0"][-1] == {"a", "carrying"}
    assert flight.words["quad1"] == (frozenset({"a"}), frozenset())
    assert least_distance(flight) >= mission.separation
    assert any("quad1 steps aside for quad0" in event.sentence for event in flight.log.events)
