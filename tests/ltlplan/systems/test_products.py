from __future__ import annotations

import pytest

from ltlplan.logic.budget import TooLarge
from ltlplan.logic.translation import translate
from ltlplan.missions import load_mission
from ltlplan.search.exact import assign
from ltlplan.systems.products import PlanningAutomaton
from ltlplan.systems.robot_systems import Systems
from tests.helpers.missions.worlds import world
from tests.helpers.words.team_automaton import TeamAutomaton, full_product, full_product_size
from verify.data import Mission


def systems_of(mission: Mission) -> list:  # type: ignore[type-arg]
    systems = Systems(mission)
    return [systems.of(name) for name in mission.agents]


def cheapest(graph: object) -> float:
    import networkx

    starts = [n for n, data in graph.nodes(data=True) if data["initial"]]  # type: ignore[attr-defined]
    ends = {n for n, data in graph.nodes(data=True) if data["accepting"]}  # type: ignore[attr-defined]
    lengths = networkx.single_source_dijkstra_path_length(graph, starts[0], weight="cost")
    return min(cost for node, cost in lengths.items() if node in ends)


def test_a_shortest_path_of_p_is_the_plan_of_one_robot() -> None:
    mission = world("F a & F b & (!b U c)")
    (system,) = systems_of(mission)
    graph = PlanningAutomaton(system, translate(mission.formula)).to_networkx()
    assert cheapest(graph) == pytest.approx(assign(mission).cost)


def test_a_shortest_path_of_t_is_the_plan_of_the_team() -> None:
    mission = load_mission("firefighting")
    automaton = translate(mission.formula)
    team = TeamAutomaton(systems_of(mission), automaton)
    assert cheapest(team.to_networkx()) == pytest.approx(assign(mission).cost)


def test_t_grows_with_the_team_and_the_product_explodes() -> None:
    mission = load_mission("firefighting")
    automaton = translate(mission.formula)
    systems = systems_of(mission)
    one, three = TeamAutomaton(systems[:1], automaton).size(), TeamAutomaton(systems, automaton).size()
    assert one <= 40  # four states of the automaton times ten of the robot
    assert three <= 3 * 40
    assert full_product_size(systems, automaton) == 4 * len(systems[0].labels) ** 3
    assert one <= full_product(systems[:1], automaton) <= full_product_size(systems[:1], automaton)
    assert full_product(systems[:2], automaton) > 5 * one
    with pytest.raises(TooLarge):
        full_product(systems, automaton, limit=1000)


def test_the_order_of_the_robots_matters_where_switches_are_few() -> None:
    mission = world("F a & F b & (!c W a)", robots=2, starts=((-0.5, 0.0), (2.5, 0.0)))
    automaton, systems = translate(mission.formula), systems_of(mission)
    in_turn = cheapest(TeamAutomaton(systems, automaton).to_networkx())
    swapped = cheapest(TeamAutomaton(systems, automaton, (1, 0)).to_networkx())
    anywhere = cheapest(TeamAutomaton(systems, automaton, switches="anywhere").to_networkx())
    assert swapped == pytest.approx(1.0)
    assert in_turn > swapped
    assert anywhere == pytest.approx(swapped) == assign(mission).cost


def test_switches_begin_with_the_next_robot_s_first_letter() -> None:
    mission = world("F a & G !b", robots=2, starts=((-1.0, 0.0), (2.0, 0.0)))  # quad1 stands in b
    team = TeamAutomaton(systems_of(mission), translate(mission.formula), switches="anywhere")
    assert not any(data["accepting"] for _, data in team.to_networkx().nodes(data=True))


def test_buchi_products_have_every_way() -> None:
    mission = load_mission("hoops-ltl")
    (system,) = systems_of(mission)
    graph = PlanningAutomaton(system, translate(mission.formula, "infinite")).to_networkx()
    assert any(data["accepting"] for _, data in graph.nodes(data=True))
    assert graph.graph["robot"] == "quad0"
