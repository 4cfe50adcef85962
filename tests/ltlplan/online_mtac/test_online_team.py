"""Online MTAC-E, flown without dynamics: every robot is at once where it should be."""

import math

import numpy as np
import pytest

import ltlplan
from ltlplan.mtac.optimality_gap import straight_cost
from ltlplan.online.checked_events import falls_on, in_order
from ltlplan.online.simulated_online_flight import fly_online
from ltlplan.online_mtac.cross_entropy import OnlineSettings
from ltlplan.online_mtac.online_team import OnlineTeam
from ltlplan.online_mtac.team_in_flight import PERIOD
from ltlplan.search.exact import assign
from tests.helpers.few import few_of
from tests.helpers.missions.random_missions import random_mission
from verify import check_team
from verify.data import BadInput, Mission, Unsatisfiable, parse_mission
from verify.data.events import HoopMoves, NewFormula, RobotJoins, RobotLeaves, changed
from verify.data.sections import Agent


@pytest.fixture(scope="module")
def fire():
    return ltlplan.load_mission("firefighting")


class Flight:
    """A team that follows its desired states exactly; remembers words, speeds and the least distance."""

    def __init__(self, mission, seed=0, events=()):
        self.team = OnlineTeam(mission, rng=np.random.default_rng(seed))
        self.events = sorted(events, key=lambda event: event.time)
        self.positions = {name: agent.start for name, agent in mission.agents.items()}
        self.words = {name: [self.team.belief.held[name]] for name in mission.agents}
        self.nearest = math.inf
        self.jump = 0.0
        self.said = []

    def fly(self, seconds):
        for step in range(int(seconds / PERIOD)):
            now = step * PERIOD
            while self.events and self.events[0].time <= now:
                event = self.events.pop(0)
                self.team.change(event, now)
                if isinstance(event, RobotJoins):
                    self.positions[event.robot] = event.agent.start
                    self.words[event.robot] = [self.team.belief.held[event.robot]]
            desired = self.team.step(now, {name: self.positions[name] for name in self.team.pilots})
            for j, name in enumerate(self.team.pilots):
                place = tuple(float(x) for x in desired.flat[0, :3, j])
                self.jump = max(self.jump, math.dist(place, self.positions[name]))
                self.positions[name] = place
                if self.words[name][-1] != self.team.belief.held[name]:
                    self.words[name].append(self.team.belief.held[name])
            places = np.array([self.positions[name] for name in self.team.pilots])
            if len(places) > 1:
                apart = np.linalg.norm(places[:, None] - places, axis=-1) + np.eye(len(places)) * 9
                self.nearest = min(self.nearest, float(apart.min()))
            self.said += desired.switched
            if desired.holding and desired.holding not in self.said:
                self.said.append(desired.holding)
            if desired.finished and not self.events:
                return now
        return None


def sequence(flight, robot):
    return [sorted(letter) for letter in flight.words[robot]]


def test_firefighting_is_flown_and_satisfied(fire):
    flight = Flight(fire)
    took_off_with = flight.team.cost
    ended = flight.fly(40)
    assert ended is not None
    assert ended < 20
    assert sequence(flight, "quad0") == [
        [], ["water"], ["carrying", "water"], ["carrying"], ["carrying", "smoke"], ["carrying"], ["carrying", "loc2"], ["carrying"],
    ]  # fmt: skip
    assert sequence(flight, "quad2") == [[], ["loc1"], []]
    assert sequence(flight, "quad1") == [[]]
    assert flight.team.belief.accepts()
    assert check_team(fire.formula, flight.words).sequential
    assert flight.nearest >= fire.separation
    assert flight.jump < 1.5 * fire.effective_limits.speed * PERIOD
    assert flight.team.cost < took_off_with


@pytest.mark.slow
def test_the_same_seed_flies_the_same_bytes(fire):
    first, again, other = Flight(fire, seed=3), Flight(fire, seed=3), Flight(fire, seed=4)
    for flight in (first, again, other):
        flight.fly(1.5)
    assert first.positions == again.positions
    assert first.positions != other.positions


DEFAULT = {("quad0", 1), ("quad1", 8)}
SECONDS = [
    pytest.param(robot, second, marks=() if (robot, second) in DEFAULT else pytest.mark.slow)
    for robot in ("quad0", "quad1", "quad2")
    for second in range(11)  # the flight takes 10.5 s
]


@pytest.mark.slow
@few_of(1, ("robot", "second"), SECONDS)
def test_a_robot_that_fails_at_any_second_leaves_a_mission_that_the_others_finish_or_that_is_refused(fire, robot, second):
    flight = Flight(fire, events=[RobotLeaves(time=float(second), robot=robot)])
    ended = flight.fly(40)
    assert robot not in flight.team.pilots
    if ended is None:
        assert "cannot be satisfied" in flight.team.holding
    else:
        assert flight.team.belief.accepts()
        assert check_team(fire.formula, flight.words).sequential


def test_a_failure_that_nobody_can_make_good_is_refused_with_the_reason_and_the_others_hold(fire):
    # nobody may come to the water once somebody has left it with some: who has it fails, and nobody can come through the smoke any more
    spec = fire.spec.model_copy(update={"formula": "F loc2 & G(smoke -> carrying) & G((carrying & !water) -> G !water)"})
    flight = Flight(changed(fire, spec=spec), events=[RobotLeaves(time=5.0, robot="quad0")])
    assert ["carrying", "water"] not in sequence(flight, "quad0")
    assert flight.fly(12) is None
    assert ["carrying", "water"] in sequence(flight, "quad0")
    assert "cannot be satisfied by quad1, quad2" in flight.team.holding
    before = dict(flight.positions)
    flight.team.step(12.0, {name: flight.positions[name] for name in flight.team.pilots})
    assert flight.positions == before


def test_all_robots_gone_is_said(fire):
    flight = Flight(fire, events=[RobotLeaves(time=1.0, robot=robot) for robot in fire.agents])
    assert flight.fly(3) is None
    assert flight.team.holding == "No robot is left in the air."


@pytest.mark.slow
def test_a_hoop_that_moves_is_flown_to_where_it_is(fire):
    flight = Flight(fire, events=[HoopMoves(time=2.0, region="loc2", center=(-1.1, 0.1, 1.1))])
    assert flight.fly(40) is not None
    assert flight.team.belief.accepts()
    assert np.linalg.norm(np.array(flight.positions["quad0"]) - (-1.1, 0.1, 1.1)) < 0.7


@pytest.mark.slow
def test_progress_is_kept_when_a_formula_arrives(fire):
    wanted = "F loc1 & F loc2 & G(smoke -> carrying) & F water"
    flight = Flight(fire, events=[NewFormula(time=4.0, formula=wanted)])
    assert flight.fly(40) is not None
    # water was visited before the new formula asked for it; nobody goes there again
    assert sum(word.count(frozenset({"water"})) for word in flight.words.values()) == 1


def test_a_formula_that_became_impossible_is_said_and_robots_hold(fire):
    flight = Flight(fire, events=[NewFormula(time=3.5, formula="F loc2 & G !water")])
    assert flight.fly(8) is None
    assert "cannot be satisfied" in flight.team.holding
    before = dict(flight.positions)
    flight.team.step(8.0, flight.positions)
    assert flight.positions == before


def test_a_robot_that_joins_takes_part(fire):
    alone = fire.model_copy(update={"agents": {"quad0": fire.agents["quad0"]}})
    near = RobotJoins(time=0.5, robot="quad7", agent=Agent(start=(0.9, 0.75, 1.0)))
    flight = Flight(alone, events=[near])
    assert flight.fly(40) is not None
    assert ["loc1"] in sequence(flight, "quad7")
    assert check_team(fire.formula, flight.words).sequential


@pytest.mark.slow
def test_robots_wait_where_letters_must_not_be_held_side_by_side():
    mission = parse_mission("""
format: 1
name: docks
spec: {formula: F dock_a & F dock_b & G !(dock_a & dock_b), team: joint}
regions: {dock_a: {center: [0, 1, 1], radii: [0.2, 0.2, 0.2]}, dock_b: {center: [0, -1, 1], radii: [0.2, 0.2, 0.2]}}
agents: {x: {start: [-1.2, 1, 1], end: [1, 1, 1]}, y: {start: [-1.2, -1, 1], end: [1, -1, 1]}}
vehicle: crazyflie-2.1
workspace: {min: [-2, -2, 0.2], max: [2, 2, 2]}
planner: {method: online-mtac-e, samples: 50, elite: 0.1}
""")
    flight = Flight(mission)
    both = []
    team = flight.team
    original = team.note

    def note(now, events):
        original(now, events)
        both.append(frozenset().union(*team.belief.held.values()))

    team.note = note
    flight.fly(40)
    assert team.belief.accepts()
    assert not any({"dock_a", "dock_b"} <= letter for letter in both)


@pytest.mark.parametrize("seed", [9, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 6, 12, 15))])
def test_random_missions_are_flown_to_their_end(seed):
    mission = random_mission(seed)
    flight = Flight(mission, seed=seed)
    assert flight.fly(90) is not None
    assert check_team(mission.formula, flight.words).sequential
    assert flight.nearest >= mission.separation


def test_what_cannot_be_is_refused_before_take_off(fire):
    with pytest.raises(BadInput, match="infinite"):
        OnlineTeam(ltlplan.load_mission("hoops-ltl"), rng=np.random.default_rng(0))
    with pytest.raises(BadInput, match="more than 1 / rho"):
        OnlineTeam(fire, rng=np.random.default_rng(0), settings=OnlineSettings(elite=0.05, trajectories=20))
    forbidden = fire.model_copy(update={"agents": {"quad0": Agent(start=fire.hoops["water"].center)}})
    spec = fire.spec.model_copy(update={"formula": "F loc1 & G !water"})
    with pytest.raises(Unsatisfiable):
        OnlineTeam(changed(forbidden, spec=spec), rng=np.random.default_rng(0))


@pytest.mark.parametrize(
    ("event", "words"),
    [
        (HoopMoves(time=1.0, region="wather", center=(0, 0, 1)), "Did you mean 'water'"),
        (HoopMoves(time=1.0, region="water", center=(9, 0, 1)), "outside the workspace"),
        (RobotLeaves(time=1.0, robot="quad9"), "not a robot in the air"),
        (RobotJoins(time=1.0, robot="quad0", agent=Agent(start=(0, 0, 1))), "another name"),
        (RobotJoins(time=1.0, robot="quad9", agent=Agent(start=(0, 0, 9))), "outside the workspace"),
        (NewFormula(time=1.0, formula="F nowhere"), "nowhere"),
        (NewFormula(time=1.0, formula="F X loc1"), "not allowed in a mission"),
        (NewFormula(time=-1.0, formula="F loc1"), "must be finite and not negative"),
        (NewFormula(time=math.nan, formula="F loc1"), "must be finite and not negative"),
    ],
)
def test_events_that_cannot_be_are_refused_before_take_off(fire, event, words):
    with pytest.raises(BadInput, match=words):
        in_order(fire, [event])


def test_events_in_a_room_that_is_low_for_its_margin_are_taken():
    mission = ltlplan.load_mission("wall-swap")
    assert mission.workspace.max[2] - mission.workspace.min[2] < 4 * mission.margin
    (event,) = in_order(mission, [NewFormula(time=1.0, formula="F south_east")])
    assert event.time == 1.0


def test_a_robot_that_others_would_touch_is_refused_before_take_off(fire):
    near = changed(fire, separation=2.1 * fire.vehicle.radius)
    large = fire.vehicle.model_copy(update={"radius": 1.2 * fire.vehicle.radius})
    event = RobotJoins(time=1.0, robot="quad9", agent=Agent(start=(1.0, -1.0, 0.6), vehicle=large))
    with pytest.raises(BadInput, match=r"lets robots touch: .*quad9"):
        in_order(near, [event])
    assert in_order(fire, [event]) == (event,)
    everybody = [RobotLeaves(time=0.5, robot=name) for name in fire.agents]
    assert in_order(near, [*everybody, event]) == (*everybody, event)


def test_a_robot_cannot_leave_twice_but_events_may_follow_each_other(fire):
    gone = RobotLeaves(time=2.0, robot="quad1")
    with pytest.raises(BadInput, match="not a robot in the air"):
        in_order(fire, [gone, RobotLeaves(time=3.0, robot="quad1")])
    joins = RobotJoins(time=1.0, robot="quad4", agent=Agent(start=(1.0, -1.0, 0.6)))
    ordered = in_order(fire, [RobotLeaves(time=5.0, robot="quad4"), joins])
    assert [event.time for event in ordered] == [1.0, 5.0]


def test_a_hoop_that_moves_onto_a_robot_is_noticed(fire):
    event = HoopMoves(time=1.0, region="loc1", center=(0.5, 0.0, 1.0))
    assert "inside it at once" in falls_on(fire, event, {"quad1": (0.5, 0.1, 1.0)})
    rim = (0.5, 0.26, 1.0)
    assert "rim" in falls_on(fire, event, {"quad1": rim})
    assert falls_on(fire, event, {"quad1": (1.4, 0.0, 1.0)}) is None
    assert falls_on(fire, RobotLeaves(time=0.0, robot="quad1"), {"quad1": rim}) is None


def row_of(robots: int, formula: str, team: str = "own") -> Mission:
    """Robots in a row, and as many regions in a row opposite them."""
    regions = ", ".join(f"r{i}: {{center: [{1.2 * i:.1f}, 1.5, 1.0], radii: [0.2, 0.2, 0.2]}}" for i in range(robots))
    agents = ", ".join(f"q{i}: {{start: [{1.2 * i:.1f}, 0, 1.0]}}" for i in range(robots))
    return parse_mission(
        f"""
format: 1
name: row
spec: {{formula: "{formula}", team: {team}}}
regions: {{{regions}}}
agents: {{{agents}}}
vehicle: crazyflie-2.1
workspace: {{min: [-2, -2, 0.2], max: [{1.2 * robots + 1:.1f}, 4, 1.8]}}
"""
    )


@pytest.mark.slow
def test_a_team_of_eight_is_shared_out_by_the_cheapest_search_and_takes_off():
    mission = row_of(8, " & ".join(f"F r{i}" for i in range(8)))
    team = OnlineTeam(mission, rng=np.random.default_rng(0))
    assert team.complete
    shared = {move.visit.region for pilot in team.pilots.values() for move in pilot.moves}
    assert shared == set(mission.regions)
    exact = assign(mission).cost
    straight = sum(
        straight_cost(mission, {name: pilot.way.course.plan.visits}) for name, pilot in team.pilots.items() if pilot.moves
    )
    assert straight == pytest.approx(exact, abs=1e-6)
    positions = {name: agent.start for name, agent in mission.agents.items()}
    for step in range(150):
        desired = team.step(step * PERIOD, positions)
        positions = {name: tuple(desired.flat[0, :3, j]) for j, name in enumerate(team.pilots)}
    assert max(math.dist(positions[name], agent.start) for name, agent in mission.agents.items()) > 0.1


@pytest.mark.slow
def test_two_places_that_are_to_be_held_at_once_are_shared_out():
    """No walk of one robot after another leads to acceptance: neither letter alone is what is asked."""
    mission = row_of(2, "F(r0 & r1)", "joint")
    team = OnlineTeam(mission, rng=np.random.default_rng(0))
    assert team.complete
    assert sorted(move.visit.region for pilot in team.pilots.values() for move in pilot.moves) == ["r0", "r1"]
    flight = fly_online(mission, seed=0, max_seconds=40)
    assert flight.verdict
