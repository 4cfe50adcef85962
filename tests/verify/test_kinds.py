"""The judge takes each robot by its own vehicle, limits, internal states and what is closed to it."""

import pytest

from tests.helpers.motion.flights import legs, plan_of, small_mission
from verify import judge
from verify.data import Mission, Trajectory, Visit
from verify.data.sections import Action, Edge, Environment, Limits, Robot

PLACES = """a: {center: [1.0, 0.0, 1.0], radii: [0.3, 0.3, 0.3]}
b: {center: [1.0, 2.0, 1.0], radii: [0.3, 0.3, 0.3]}"""
LOADS = Robot(initial="no", states={"no": (), "yes": ("loaded",)}, actions=(Action(source="no", target="yes", at="a"),))
VISITS = {"r0": [Visit(region="a")], "r1": [Visit(region="b")]}
TEAM = {"r0": legs([[0, 0, 1], [1, 0, 1]]), "r1": legs([[0, 2, 1], [1, 2, 1]])}


def pair(first: dict[str, object] | None = None, second: dict[str, object] | None = None, **fields: object) -> Mission:
    """Return a mission of two robots, each with what is its own, beside each other; r0 goes to a and r1 to b."""
    mission = small_mission(regions=PLACES, starts=[[0, 0, 1], [0, 2, 1]])
    own = [first or {}, second or {}]
    agents = {name: agent.model_copy(update=own[i]) for i, (name, agent) in enumerate(mission.agents.items())}
    return mission.model_copy(update={"agents": agents, "robots": {"carrier": LOADS}, **fields})


def refused(mission: Mission, visits: dict[str, list[Visit]] = VISITS, team: dict[str, Trajectory] = TEAM):
    certificate = judge(plan_of(mission, visits), team, largest=False)
    return [(claim.name, claim.robot) for claim in certificate.claims if claim.outcome != "holds"]


def test_limits_are_each_robots_own():
    slow = Limits(speed=0.3)
    assert refused(pair()) == []
    assert refused(pair({"limits": slow})) == [("limits.speed", "r0")]
    assert refused(pair(None, {"limits": slow})) == [("limits.speed", "r1")]
    assert refused(pair(limits=slow)) == [("limits.speed", "r0"), ("limits.speed", "r1")]


def test_ways_to_a_region_are_limited_for_the_robots_that_say_so():
    own = Limits.model_validate({"legs": {"b": {"speed": 0.2}}})
    assert refused(pair({"limits": own})) == []
    assert refused(pair(None, {"limits": own})) == [("limits.legs.speed", "r1")]


def test_thrusts_and_rotors_are_those_of_each_robots_vehicle():
    mission = pair()
    light = mission.vehicle
    strong = light.changed(name="strong", mass=10 * light.mass, rotor_thrust_max=10.0, thrust_max=40.0, thrust_min=0.1)
    certificate = judge(plan_of(pair(None, {"vehicle": strong}), VISITS), TEAM, largest=False)
    alone = judge(plan_of(mission, VISITS), TEAM, largest=False)
    heavy = judge(plan_of(pair(vehicle=strong), VISITS), TEAM, largest=False)
    for one, robot in ((alone, "r0"), (heavy, "r1")):  # as in a team of its own kind, to the last bit
        expected = {
            c.name: (c.outcome, c.bound, c.limit) for c in one.claims if c.robot == robot and c.name.startswith("limits")
        }
        found = {c.name: (c.outcome, c.bound, c.limit) for c in certificate.claims if c.robot == robot and c.name in expected}
        assert found == expected
        assert len(expected) == 9


def test_actions_are_those_of_each_robots_table():
    loading = {"r0": [Visit(region="a", actions=LOADS.actions)], "r1": [Visit(region="b")]}
    carrier = {"robot": "carrier"}
    assert refused(pair(carrier), loading) == []
    assert ("visits", "r0") in refused(pair(), loading)
    assert ("visits", "r0") in refused(pair(None, carrier), loading)


def test_a_region_that_is_closed_to_a_kind_is_not_entered():
    mission = pair({"robot": "carrier"})
    shut = {name: region.model_copy(update={"only": ("carrier",)}) for name, region in mission.regions.items()}
    assert refused(mission.model_copy(update={"regions": {**mission.regions, "a": shut["a"]}})) == []
    closed = mission.model_copy(update={"regions": {**mission.regions, "b": shut["b"]}})
    assert refused(closed) == [("transitions", "r1")]
    said = [c.sentence for c in judge(plan_of(closed, VISITS), TEAM, largest=False).claims if c.outcome == "fails"]
    assert said[0].startswith("r1 can enter b, which is open to carrier only")


def test_a_robot_does_not_begin_in_a_region_that_is_closed_to_it():
    mission = pair({"robot": "carrier"})
    shut = mission.regions["b"].model_copy(update={"only": ("carrier",), "center": (0.32, 2.0, 1.0)})
    inside = mission.model_copy(update={"regions": {**mission.regions, "b": shut}, "margin": 0.03})
    still = {**TEAM, "r1": legs([[0, 2, 1]])}
    assert ("transitions", "r1") in refused(inside, {**VISITS, "r1": []}, still)
    assert refused(inside.model_copy(update={"margin": 0.01}), {**VISITS, "r1": []}, still) == []


def test_an_edge_that_is_closed_to_a_kind_is_not_taken():
    edges = (("robot", "a"), Edge(between=("robot", "b"), only=("carrier",)))
    environment = Environment(edges=edges)
    assert refused(pair(None, {"robot": "carrier"}, environment=environment)) == []
    assert refused(pair({"robot": "carrier"}, environment=environment)) == [("transitions", "r1")]


@pytest.mark.parametrize(("spare", "broken"), [(0.01, []), (-0.01, [("limits.endurance", "r1")])])
def test_endurance_counts_the_whole_flight_with_climb_and_landing(spare, broken):
    still = {"r0": TEAM["r0"], "r1": legs([[0, 2, 1]])}  # who only hovers is in the air as long as the team
    duration = float(TEAM["r0"].duration)
    mission = pair(None, {"limits": Limits(endurance=duration + 11.0 + spare)})
    certificate = judge(plan_of(mission, {"r0": VISITS["r0"], "r1": []}), still, largest=False)
    assert [(c.name, c.robot) for c in certificate.claims if c.outcome != "holds"] == broken
    (claim,) = (c for c in certificate.claims if c.name == "limits.endurance")
    assert claim.bound == pytest.approx(duration + 11.0)


def test_endurance_counts_every_lap():
    lap = legs([[0, 0, 1], [1, 0, 1], [0, 0, 1]])
    path = Trajectory(lap.durations, lap.coefficients, cycle=0)
    mission = small_mission("G F a", regions=PLACES.splitlines()[0], trace="infinite")
    spec = mission.spec.model_copy(update={"repeat": 5})
    mission = mission.model_copy(update={"spec": spec, "limits": Limits(endurance=60.0)})
    plan = plan_of(mission, {"r0": [Visit(region="a")]})
    robots = {"r0": plan.robots["r0"].model_copy(update={"cycle_visit": 0})}
    certificate = judge(plan.model_copy(update={"robots": robots}), {"r0": path}, largest=False)
    (claim,) = (c for c in certificate.claims if c.name == "limits.endurance")
    assert claim.bound == pytest.approx(5 * path.duration + 11.0)


@pytest.mark.parametrize(("wide", "broken"), [(0.07, []), (0.16, [("passages", "r1"), ("rims", "r1")])])
def test_openings_and_rims_are_passed_with_each_robots_own_radius(wide, broken):
    """Both pass their hoops 0.12 m off the axis: room for a small vehicle, not for a wide one."""
    hoops = "\n".join(
        f"{name}: {{center: [0.0, {y}, 1.0], yaw_deg: 0, radii: [0.4, 0.4, 0.4], opening: 0.25, rim: 0.02}}"
        for name, y in (("near", 0.0), ("far", 3.0))
    )
    mission = small_mission(regions="", hoops=hoops, starts=[[-1.0, 0.12, 1.0], [-1.0, 3.12, 1.0]])
    own = mission.agents["r1"].model_copy(update={"vehicle": mission.vehicle.changed(radius=wide)})
    mission = mission.model_copy(update={"agents": {**mission.agents, "r1": own}})
    team = {"r0": legs([[-1.0, 0.12, 1.0], [1.0, 0.12, 1.0]]), "r1": legs([[-1.0, 3.12, 1.0], [1.0, 3.12, 1.0]])}
    visits = {"r0": [Visit(region="near", direction="F")], "r1": [Visit(region="far", direction="F")]}
    assert refused(mission, visits, team) == broken
