from __future__ import annotations

import pytest
from hypothesis import strategies as st

from ltlplan.missions import load_mission
from ltlplan.planner import make_plan
from ltlplan.search.exact import assign
from ltlplan.systems.region_labels import Layout, apart
from ltlplan.systems.robot_systems import Systems
from ltlplan.systems.transition_systems import TransitionSystem, environment_of, robot_graph
from ltlplan.systems.visit_words import word_of
from tests.helpers.few import given_few
from tests.helpers.missions.worlds import world
from verify.data import BadInput, Mission, Visit, parse_mission
from verify.data.shapes.region import Region


def visits(*regions: str) -> list[Visit]:
    return [Visit(region=region) for region in regions]


def test_the_agent_of_the_fire_fighting_mission_is_the_paper_s() -> None:
    mission = load_mission("firefighting")
    system = Systems(mission).of("quad0")
    inside = {(n.place, n.internal) for n in system.nodes if not n.flying}
    assert len(inside) == 8  # four regions, with water and without; the start is in free flight
    graph = system.to_networkx()
    gains = [(system.nodes[a], system.nodes[b]) for a, b in graph.edges if system.nodes[a].internal != system.nodes[b].internal]
    assert [(a.place, a.internal, b.internal) for a, b in gains] == [("water", "no_water", "carrying")]
    assert system.labels[system.initial] == frozenset()
    assert graph.nodes[system.initial]["initial"]
    assert sorted(environment_of(mission).to_networkx().successors("robot")) == ["loc1", "smoke", "water"]
    assert list(robot_graph(mission).edges(data="at")) == [("no_water", "carrying", "water")]


def test_free_flight_is_between_any_two_regions() -> None:
    system = Systems(world("true")).of("quad0")
    for source, edges in enumerate(system.edges):
        for target, _ in edges:
            regions = system.nodes[source].regions | system.nodes[target].regions
            assert len(regions) <= 1


def test_words_of_visits() -> None:
    mission = load_mission("firefighting")
    action = mission.robot.actions[0]
    path = [Visit(region="water", actions=(action,)), Visit(region="smoke")]
    assert str(word_of(mission, "quad0", path)) == "{} {water} {carrying, water} {carrying} {carrying, smoke} {carrying}"
    assert str(word_of(mission, "quad0", path, stays=True)).endswith("{carrying} {carrying, smoke}")
    assert str(word_of(mission, "quad0", [])) == "{}"
    plain = world("true")
    assert str(word_of(plain, "quad0", visits("a", "b"))) == "{} {a} {} {b}"
    assert str(word_of(plain, "quad0", visits("a", "a"), stays=False)) == "{} {a} {} {a} {}"


def test_words_of_lassos() -> None:
    mission = world("true")
    assert str(word_of(mission, "quad0", visits("a", "b", "c"), 1)) == "{} {a} {} ({b} {} {c} {})^w"
    assert str(word_of(mission, "quad0", visits("a"), 0)) == "{} ({a} {})^w"
    assert str(word_of(mission, "quad0", visits("a"), 1)) == "{} ({a})^w"
    assert str(word_of(mission, "quad0", visits("a"), 1, stays=False)) == "{} {a} ({})^w"
    assert str(word_of(mission, "quad0", [], 0)) == "({})^w"


def test_a_start_inside_a_region_is_listed_first() -> None:
    mission = world("true", starts=((0.0, 0.0),))
    assert str(word_of(mission, "quad0", visits("a", "b"))) == "{a} {} {b}"
    with pytest.raises(BadInput, match="starts inside a"):
        word_of(mission, "quad0", visits("b"))
    with pytest.raises(BadInput, match="starts inside a"):
        word_of(mission, "quad0", [])


def test_impossible_visits_are_refused() -> None:
    mission = load_mission("firefighting")
    action = mission.robot.actions[0]
    with pytest.raises(BadInput, match="'lake' is not a region"):
        word_of(mission, "quad0", visits("lake"))
    with pytest.raises(BadInput, match="not possible in smoke"):
        word_of(mission, "quad0", [Visit(region="smoke", actions=(action,))])
    with pytest.raises(BadInput, match="not possible in water"):
        word_of(mission, "quad0", [Visit(region="water", actions=(action, action))])


def ball(x: float, y: float, *radii: float) -> Region:
    return Region(center=(x, y, 1.0), radii=radii if len(radii) == 3 else (radii[0], radii[0], radii[0]))  # type: ignore[arg-type]


def test_which_regions_lie_apart() -> None:
    assert apart(ball(0, 0, 1.0), ball(2.01, 0, 1.0))
    assert not apart(ball(0, 0, 1.0), ball(1.99, 0, 1.0))
    assert not apart(ball(0, 0, 1.0), ball(0.1, 0, 0.2))
    assert apart(ball(0, 0, 2.0, 0.1, 0.1), ball(0, 1, 2.0, 0.1, 0.1))  # long and thin, side by side
    assert not apart(ball(0, 0, 2.0, 0.1, 0.1), ball(0, 0.15, 2.0, 0.1, 0.1))


@given_few(8, 50, st.floats(-2, 2), st.floats(-2, 2), st.floats(0.2, 1.5), st.floats(0.2, 1.5), st.floats(0, 180))
def test_regions_that_lie_apart_share_no_sampled_point(x: float, y: float, a: float, b: float, yaw: float) -> None:
    import numpy as np

    one = ball(0.0, 0.0, 1.0, 0.5, 0.5)
    other = Region(center=(x, y, 1.0), radii=(a, b, 0.5), yaw_deg=yaw)
    points = np.random.default_rng(0).uniform(-1, 1, (4000, 3)) * [1.0, 0.5, 0.5] + [0, 0, 1]
    shared = np.any((one.level(points) <= 1) & (other.level(points) <= 1))
    assert apart(one, other) == apart(other, one)
    assert not (shared and apart(one, other))


def test_ways_past_borders() -> None:
    places = {"room": (0.0, 0.0), "desk": (0.8, 0.0), "c": (4.0, 0.0)}
    layout = Layout(world("true", regions=places, radii={"room": 2.0}))
    middles = layout.middles
    assert middles["desk"].inside == ("room", "desk")
    assert layout.around("desk") == ("room",)
    assert layout.around("c") == ()
    assert layout.around("room") is None  # its middle is clear, but a desk is in the way of a plain leaving
    way = layout.way(middles["desk"], middles["c"])
    assert way == ({"room", "desk"}, {"room"}, frozenset(), {"c"})


def test_borders_too_near_each_other_are_not_planned_over() -> None:
    places = {"a": (0.0, 0.0), "b": (0.0, 0.0), "c": (4.0, 0.0)}
    layout = Layout(world("true", regions=places, radii={"a": 1.0, "b": 1.02}))
    assert layout.way(layout.middles["a"], layout.middles["c"]) is None


def test_a_region_whose_middle_is_on_a_border_is_not_visited() -> None:
    places = {"a": (0.0, 0.0), "b": (1.0, 0.0)}
    systems = Systems(world("true", regions=places, radii={"a": 1.0, "b": 0.2}))
    assert systems.unclear() == (
        "The middle of 'b' lies on the border of 'a', and more than the margin, 0.05 m, is needed to visit it for sure: "
        "move `regions.b` farther than 0.05 m from the border of 'a'.",
    )
    assert all(node.place != "b" for node in systems.of("quad0").nodes)


DOOR = """
format: 1
name: door
spec: {{formula: F door}}
regions: {{{rooms}{region}}}
hoops: {{{hoop}}}
agents: {{quad0: {{start: [-1, 1, 1]}}}}
vehicle: crazyflie-2.1
workspace: {{min: [-4, -4, 0.2], max: [4, 4, 3]}}
margin: {margin}
"""
ROOMS = "west: {center: [-1, 0, 1], size: [2, 3, 1]}, east: {center: [1, 0, 1], size: [2, 3, 1]}, "
THIN = {
    "box": "door: {{center: [0.5, 0, 1], size: [{width}, 0.6, 0.6]}}",
    "turned box": "door: {{center: [0.5, 0, 1], yaw_deg: 30, size: [{width}, 0.6, 0.6]}}",
    "ellipsoid": "door: {{center: [0.5, 0, 1], radii: [{half}, 0.3, 0.3]}}",
    "hoop": "door: {{center: [0.5, 0, 1], radii: [{half}, 0.3, 0.3], opening: 0.3, rim: 0.02}}",
    "union": "door: {{union: [{{center: [0.5, 0, 1], size: [{width}, 0.6, 0.6]}}, {{center: [0.5, 0.6, 1], size: [{width}, 0.6, 0.6]}}]}}",
}


def door(shape: str, *, width: float = 0.08, margin: float = 0.05, rooms: str = ROOMS) -> Mission:
    text = THIN[shape].format(width=width, half=width / 2)
    region, hoop = ("", text) if shape == "hoop" else (text, "")
    return parse_mission(DOOR.format(rooms=rooms, region=region, hoop=hoop, margin=margin))


@pytest.mark.parametrize("rooms", [ROOMS, ""], ids=["between rooms", "alone"])
@pytest.mark.parametrize("shape", THIN)
def test_a_region_too_thin_for_the_margin_is_told_its_own_width(shape: str, rooms: str) -> None:
    table = "hoops" if shape == "hoop" else "regions"
    (said,) = Systems(door(shape, rooms=rooms)).unclear()
    assert said == (
        "The middle of 'door' lies 0.04 m inside its own border, and more than the margin, 0.05 m, is needed to visit it for sure: "
        f"make `{table}.door` wider than 0.102 m around its middle (0.08 m now), or `margin` smaller than 0.039 m."
    )
    assert Systems(door(shape, width=0.1021, rooms=rooms)).unclear() == ()
    assert Systems(door(shape, margin=0.0389, rooms=rooms)).unclear() == ()


def test_a_thin_door_on_a_wall_that_two_rooms_share_is_told_all_borders() -> None:
    rooms = "west: {center: [-0.5, 0, 1], size: [2, 3, 1]}, east: {center: [1.5, 0, 1], size: [2, 3, 1]}, "
    (said,) = Systems(door("box", rooms=rooms)).unclear()
    assert said == (
        "The middle of 'door' lies 0.04 m inside its own border and on the border of 'west' and on the border of 'east', and "
        "more than the margin, 0.05 m, is needed to visit it for sure: make `regions.door` wider than 0.102 m around its middle (0.08 m "
        "now), and move `regions.door` farther than 0.05 m from the border of 'west' and 'east'."
    )


@pytest.mark.parametrize("key", ["start", "end"])
def test_a_robot_on_a_border_is_told_whose(key: str) -> None:
    mission = world("true")
    moved = mission.agents["quad0"].model_copy(update={key: (0.23, 0.0, 1.0)})
    systems = Systems(mission.model_copy(update={"agents": {"quad0": moved}}))
    with pytest.raises(
        BadInput,
        match=r"quad0 (starts|should end) at least 0\.03 m from the border of 'a', and .* `margin` smaller than 0\.029 m",
    ):
        systems.of("quad0")


def test_no_border_is_said_to_be_nearer_than_it_is() -> None:
    import numpy as np

    long = Region(center=(0.0, 0.0, 1.0), radii=(2.0, 0.1, 0.1))
    mission = world("true", regions={"b": (1.5, 0.0)}, radii={"b": 0.2})
    (said,) = Systems(mission.model_copy(update={"regions": {**mission.regions, "a": long}})).unclear()
    assert "lies at least 0.025 m from the border of 'a'" in said
    angles = np.linspace(-1.0, 1.0, 20001) * np.pi
    nearest = np.min(np.hypot(2.0 * np.cos(angles) - 1.5, 0.1 * np.sin(angles)))
    assert nearest >= 0.05  # it is farther away than the margin, which is not known for sure


def test_nobody_is_told_to_start_clearly_inside_what_is_too_thin() -> None:
    text = DOOR.format(rooms="", region=THIN["box"].format(width=0.08), hoop="", margin=0.05).replace(
        "[-1, 1, 1]", "[0.5, 0, 1]"
    )
    with pytest.raises(BadInput, match=r"edge of 'door'; be clearly outside: its middle is only 0\.04 m inside"):
        parse_mission(text)


def test_a_system_needs_edges_for_its_labels() -> None:
    with pytest.raises(BadInput, match="one list of edges"):
        TransitionSystem((frozenset(),), ())
    with pytest.raises(BadInput, match="starts at 3"):
        TransitionSystem((frozenset(),), ((),), 3)


def test_visits_of_nested_regions_do_not_give_a_word() -> None:
    mission = world("true", regions={"room": (0.0, 0.0), "desk": (0.8, 0.0)}, radii={"room": 2.0}, starts=((-4.0, 0.0),))
    with pytest.raises(BadInput, match="'desk' also lies in room"):
        word_of(mission, "quad0", visits("room", "desk"))


TAKEN = """
environment: {start: home, edges: [[home, a], [a, b], [b, c]]}
robot: {initial: dry, states: {dry: [], wet: [water]}, actions: [{from: dry, to: wet, at: a}]}
"""


def test_an_agent_may_have_a_past_of_its_own() -> None:
    mission = world("F(c & water)", robots=2, extra=TAKEN)
    came = mission.agents["quad1"].model_copy(update={"internal": "wet", "visited": "b"})
    mission = mission.model_copy(update={"agents": {**mission.agents, "quad1": came}})
    systems = Systems(mission)
    first, second = (systems.of(name) for name in mission.agents)
    assert (first.labels[first.initial], second.labels[second.initial]) == (frozenset(), frozenset({"water"}))

    def next_regions(system: TransitionSystem) -> set[str]:
        return {name for target, _ in system.edges[system.initial] for name in system.nodes[target].regions}

    assert (next_regions(first), next_regions(second)) == ({"a"}, {"a", "b", "c"})
    assert word_of(mission, "quad1", visits("c")).prefix[-1] == frozenset({"c", "water"})
    robots = assign(mission).robots
    assert [visit.region for visit in robots["quad1"].visits] == ["c"]
    assert robots["quad0"].visits == ()
    plan = make_plan(mission.model_copy(update={"planner": mission.planner.model_copy(update={"method": "mtac-e"})}))
    assert [visit.region for visit in plan.robots["quad1"].visits] == ["c"]
    assert plan.robots["quad0"].visits == ()


@pytest.mark.parametrize(
    ("agent", "says"),
    [
        ("internal: wett", "Did you mean 'wet'"),
        ("visited: d", "'d' is not a region"),
        ("start: [0, 0, 1], visited: b", "starts inside a"),
    ],
)
def test_a_past_that_cannot_be_is_refused(agent: str, says: str) -> None:
    text = f"""
format: 1
name: past
spec: {{formula: F c}}
regions:
  a: {{center: [0, 0, 1], radii: [0.2, 0.2, 0.2]}}
  b: {{center: [2, 0, 1], radii: [0.2, 0.2, 0.2]}}
  c: {{center: [2, 1.5, 1], radii: [0.2, 0.2, 0.2]}}
agents: {{quad0: {{{agent if "start" in agent else "start: [-1, -1, 1], " + agent}}}}}
vehicle: crazyflie-2.1
workspace: {{min: [-20, -20, 0.2], max: [20, 20, 3]}}
{TAKEN}"""
    with pytest.raises(BadInput, match=says):
        parse_mission(text)
