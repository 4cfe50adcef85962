"""Plans that hold under precedences, where none holds in every order of the robots."""

from __future__ import annotations

import pytest

import ltlplan
from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.logic.conjunction import conjunct_automata
from ltlplan.pipeline import certified_team
from ltlplan.search.counting.counting_propositions import Marks
from ltlplan.search.orders.planning import OrderedTeam
from ltlplan.systems.robot_systems import Systems
from tests.helpers.few import few_of
from tests.helpers.missions.own_places import own_places
from tests.helpers.missions.worlds import world
from verify import check_team
from verify.data import Plan, Unsatisfiable, parse_mission
from verify.trace_checking.planned_order import check_planned_order


def waits(plan: Plan) -> list[str]:
    return [each.sentence(plan.robots) for each in plan.precedences]


@few_of(
    1,
    ("formula", "may_enter", "own", "joint"),
    [
        (
            "F b & (!b U a)",
            {"quad0": "a", "quad1": "b"},
            ["quad1 enters b only when quad0 has left a"],
            ["quad1 enters b only when quad0 has entered a"],
        ),
        ("G(a -> F b) & F a", {"quad0": "a", "quad1": "b"}, ["quad1 enters b only when quad0 has left a"], []),
        (
            "(!(a | b) U c) & F a & F b",
            {"quad0": "a", "quad1": "bc"},
            ["quad0 enters a only when quad1 has left c"],
            ["quad0 enters a only when quad1 has left c"],
        ),
    ],
)
@pytest.mark.parametrize("team", ["own", "joint"])
def test_robots_wait_for_each_other_where_no_words_hold_in_every_order(
    formula: str, may_enter: dict[str, str], own: list[str], joint: list[str], team: str, pace: float | str
) -> None:
    plan = ltlplan.plan(own_places(formula, may_enter, team=team), pace=pace)
    expected = own if team == "own" else joint
    assert waits(plan) == expected
    sequential = check_team(plan.mission.formula, plan.words, plan.mission.spec.team).sequential
    assert (sequential.outcome == "holds") == (not expected)
    assert check_planned_order(plan).outcome == "holds" or not expected
    assert check_planned_order(plan.model_copy(update={"precedences": ()})).outcome == "fails" or not expected
    done = certified_team(plan)
    assert done.certificate.holds
    assert done.rounds == 1


def test_two_robots_change_partners_without_ever_being_alone(pace: float | str) -> None:
    mission = world("F(a & b) & F(b & c) & F(c & a)", robots=2, team="joint")
    plan = ltlplan.plan(mission, pace=pace)
    assert any("leaves" in wait for wait in waits(plan))
    assert check_planned_order(plan).outcome == "holds"
    assert certified_team(plan).certificate.holds


def test_words_that_hold_in_every_order_come_first() -> None:
    plan = ltlplan.plan(own_places("F b & (!b U a)", {"quad0": "a", "quad1": "ab"}))
    assert not plan.precedences


@pytest.mark.parametrize(
    ("formula", "team"), [("F(a & b)", "own"), ("a R b", "joint"), ("G !a & F a", "joint"), ("G(a -> b) & F a", "own")]
)
def test_what_no_precedences_mend_stays_impossible(formula: str, team: str) -> None:
    with pytest.raises(Unsatisfiable):
        ltlplan.plan(own_places(formula, {"quad0": "a", "quad1": "b"}, team=team))


def test_what_is_waited_for_is_said() -> None:
    plan = ltlplan.plan(own_places("F b & (!b U a)", {"quad0": "a", "quad1": "b"}))
    assert "Precedence: quad1 enters b only when quad0 has left a." in plan.notes


def test_the_letter_that_breaks_every_interleaving_is_said_and_joint_is_offered() -> None:
    starts = ((-0.5, 0.0), (2.0, 0.0))  # quad1 stands in b, and may be read there at once
    with pytest.raises(Unsatisfiable, match=r"A single interleaving satisfies it.*quad1's letter \{b\} breaks `!b W a`"):
        ltlplan.plan(world("F a & (!b W a)", robots=2, starts=starts))
    with pytest.raises(Unsatisfiable, match=r"quad0's letter \{\} breaks `F \(b & G b\)`.*Under `team: joint`.*a plan exists"):
        ltlplan.plan(own_places("F(b & G b)", {"quad0": "a", "quad1": "b"}))


def test_what_takes_too_many_states_is_not_called_impossible() -> None:
    mission = own_places("F b & (!b U a)", {"quad0": "a", "quad1": "b"})
    systems = Systems(mission)
    with pytest.raises(TooLarge, match="precedences"):
        OrderedTeam(
            [systems.of(name) for name in mission.agents], Marks(conjunct_automata(mission.formula, "finite"), {}), joint=False
        ).cheapest(Budget(states=5))


@few_of(1, "team", ["own", "joint"])
def test_what_counterexamples_cannot_mend_goes_back_to_planning(team: str) -> None:
    """Under `joint` the robot that is waited for never leaves, so no wait that a counterexample names helps."""
    plan = ltlplan.plan(own_places("F a & (!a U b)", {"quad0": "a", "quad1": "b"}, team=team))
    done = certified_team(plan.model_copy(update={"precedences": ()}))
    assert done.rounds == 2
    assert done.plan.precedences == plan.precedences


@pytest.mark.slow
def test_words_that_only_whole_words_in_turn_keep_are_given_up_for_others() -> None:
    """Each order of the robots does it; but b may be read late, so no flight of these words does unless quad0 leaves b."""
    asked = "F a & F c & G(a -> (!c U b)) & G(c -> (!a U d)) & F b & F d"
    mission = own_places(asked, {"quad0": "ab", "quad1": "cd"}, starts=((0.0, 0.0), (3.0, 3.0)))
    plan = ltlplan.plan(mission)
    assert not plan.precedences
    done = certified_team(plan)
    assert done.rounds == 2
    assert waits(done.plan) == ["quad1 enters c only when quad0 has left b"]
    assert any("given up" in note for note in done.plan.notes)
    assert done.plan.method == plan.method


ACTING = """
format: 1
name: acts
spec: {{formula: "{formula}", team: joint}}
regions:
  water: {{center: [-1.0, 0, 1.0], radii: [0.3, 0.3, 0.3], only: [tanker]}}
  b: {{center: [1.0, 0, 1.0], radii: [0.3, 0.3, 0.3], only: [scout]}}
robots:
  tanker: {{initial: empty, states: {{empty: [], full: [carrying]}}, actions: [{{from: empty, to: full, at: water}}]}}
  scout: {{initial: idle, states: {{idle: []}}}}
agents:
  slow: {{start: [-1.9, 0.8, 1.0], robot: tanker}}
  fast: {{start: [1.9, 0.8, 1.0], robot: scout}}
vehicle: crazyflie-2.1
workspace: {{min: [-3, -3, 0.2], max: [3, 3, 2.0]}}
margin: 0.05
planner: {{pace: nominal}}
"""


@few_of(
    1,
    ("formula", "wait"),
    [
        ("F carrying & (!carrying U b)", "slow acts in water only when fast has entered b"),
        ("F b & (!b U carrying)", "fast enters b only when slow has left water"),  # an action of a last visit has no early end
    ],
)
def test_robots_wait_for_actions_and_with_them(formula: str, wait: str) -> None:
    plan = ltlplan.plan(parse_mission(ACTING.format(formula=formula)))
    assert waits(plan) == [wait]
    assert check_planned_order(plan).outcome == "holds"
    assert certified_team(plan).certificate.holds


def test_costs_say_what_they_are_where_robots_wait() -> None:
    may_enter = {"quad0": "a", "quad1": "b"}
    by_effort = ltlplan.plan(own_places("F b & (!b U a)", may_enter, extra="planner: {cost: {effort: 1.0}}"))
    assert by_effort.precedences
    assert by_effort.lower_bound is not None
    assert 0.0 < by_effort.lower_bound < by_effort.cost
    assert "Minimised: the robots' sum, 1 effort." in by_effort.notes
    longest = ltlplan.plan(own_places("F b & (!b U a)", may_enter, extra="planner: {objective: longest}"))
    assert longest.lower_bound is not None
    assert longest.lower_bound <= longest.cost
    assert longest.complete


def test_tasks_that_are_shared_in_flight_wait_for_nobody() -> None:
    mission = own_places("F b & (!b U a)", {"quad0": "a", "quad1": "b"}, extra="planner: {method: online-mtac-e}")
    with pytest.raises(Unsatisfiable, match="planned before the flight"):
        ltlplan.plan(mission)
