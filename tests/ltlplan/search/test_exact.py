from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import pytest
from hypothesis import strategies as st

from ltlplan.allocation import Allocation
from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.missions import load_mission
from ltlplan.reproduction.published_missions import office_grid
from ltlplan.search.exact import assign
from ltlplan.search.explanations.unsatisfiable_cores import NoPlan
from ltlplan.systems.visit_words import word_of
from tests.helpers.few import few_of, given_few
from tests.helpers.missions.worlds import world
from tests.strategies import formulas
from verify import check_team, check_word
from verify.data import BadInput, Formula, Mission, Unsatisfiable, Visit, mission_to_yaml, parse_mission

SMALL = {"a": (0.0, 0.0), "b": (2.0, 0.0), "c": (2.0, 1.5)}
BESIDE = ((0.5, -1.0), (3.0, 0.8))
"""Starts from which no straight leg passes a region of SMALL, so that none is longer for what the formula forbids (`test_routes`)."""


def visited(plan: Allocation) -> dict[str, list[str]]:
    return {name: [visit.region for visit in robot.visits] for name, robot in plan.robots.items()}


def assert_sound(mission: Mission, plan: Allocation) -> None:
    """The words are what the visits show, the judge accepts them, and the costs add up."""
    for name, robot in plan.robots.items():
        stays = bool(robot.visits) and robot.visits[-1].region in robot.word.letters[-1]
        assert robot.word == word_of(mission, name, robot.visits, robot.cycle_visit, stays=stays)
    assert list(plan.robots) == list(mission.agents)
    if mission.spec.trace == "infinite":
        (robot,) = plan.robots.values()
        assert check_word(mission.formula, robot.word)
    else:
        words = {name: robot.word for name, robot in plan.robots.items()}
        assert check_team(mission.formula, words, team=mission.spec.team).sequential
    costs = [robot.cost for robot in plan.robots.values()]
    assert plan.cost == pytest.approx(max(costs) if mission.planner.objective == "longest" else sum(costs))


def test_fire_fighting_with_three_robots() -> None:
    mission = load_mission("firefighting")
    plan = assign(mission)
    assert_sound(mission, plan)
    assert visited(plan)["quad0"] == ["water", "smoke", "loc2"]
    assert [v for v in visited(plan).values() if v == ["loc1"]] == [["loc1"]]
    assert plan.complete
    assert plan.tried == 1
    assert plan.lower_bound == plan.cost
    assert [a.target for a in plan.robots["quad0"].visits[0].actions] == ["carrying"]
    assert str(plan.robots["quad0"].word) == (
        "{} {water} {carrying, water} {carrying} {carrying, smoke} {carrying} {carrying, loc2} {carrying}"
    )


@pytest.mark.parametrize("robots", [1, 2, 4, 5])
def test_fire_fighting_with_other_teams(robots: int) -> None:
    mission = load_mission("firefighting")
    agents = {
        f"quad{i}": mission.agents["quad0"].model_copy(update={"start": (1.0, -1.2 + 0.4 * i, 0.8)}) for i in range(robots)
    }
    mission = mission.model_copy(update={"agents": agents})
    assert_sound(mission, assign(mission))


def test_the_patrol() -> None:
    mission = load_mission("hoops-ltl")
    plan = assign(mission)
    assert_sound(mission, plan)
    (robot,) = plan.robots.values()
    assert robot.cycle_visit == 0
    assert visited(plan)["quad0"] == ["hoop0", "hoop2", "hoop1"]
    assert str(robot.word) == "{} ({hoop0} {} {hoop2} {} {hoop1} {})^w"


def test_the_published_formula_is_cheapest_by_staying() -> None:
    plan = assign(load_mission("hoops-published"))
    (robot,) = plan.robots.values()
    assert str(robot.word) == "({})^w"
    assert (robot.visits, robot.cycle_visit, robot.cost) == ((), 0, 0.0)


def test_a_start_inside_a_region_is_its_first_visit() -> None:
    mission = world("F a & F b", regions=SMALL, starts=((0.05, 0.0),))
    plan = assign(mission)
    assert visited(plan) == {"quad0": ["a", "b"]}
    assert str(plan.robots["quad0"].word) == "{a} {} {b}"
    assert plan.cost == pytest.approx(1.95)
    idle = assign(world("F a", regions=SMALL, robots=2, starts=((0.0, 0.0), (5.0, 5.0))))
    assert visited(idle) == {"quad0": ["a"], "quad1": []}
    assert idle.cost == 0


def test_an_idle_robot_shows_where_it_stands() -> None:
    mission = world("F b & G !a", regions=SMALL, robots=2, starts=((3.0, 3.0), (0.0, 0.0)))
    with pytest.raises(NoPlan, match="quad1 starts inside a"):
        assign(mission)


def test_where_a_robot_must_end() -> None:
    mission = world("F a", regions=SMALL)
    ending = mission.model_copy(
        update={"agents": {"quad0": mission.agents["quad0"].model_copy(update={"end": (5.0, 0.0, 1.0)})}}
    )
    plan = assign(ending)
    assert str(plan.robots["quad0"].word) == "{} {a} {}"
    assert plan.cost == pytest.approx(math.sqrt(2) + 5)
    inside = mission.model_copy(
        update={"agents": {"quad0": mission.agents["quad0"].model_copy(update={"end": (2.05, 0.0, 1.0)})}}
    )
    plan = assign(inside)
    assert visited(plan) == {"quad0": ["a", "b"]}
    assert str(plan.robots["quad0"].word) == "{} {a} {} {b}"
    assert plan.cost == pytest.approx(math.sqrt(2) + 2.05)


def test_hoops_are_flown_through_unless_the_formula_wants_to_stay() -> None:
    text = mission_to_yaml(load_mission("hoops-published")).replace("trace: infinite, repeat: 2", "trace: finite")
    lines = [
        line for line in text.splitlines() if not line.startswith("sequence") and "formula" not in line and "trace" not in line
    ]
    lines = [line for line in lines if "repeat" not in line and "team:" not in line and line != "spec:"]

    def word(formula: str) -> str:
        return str(assign(parse_mission("\n".join([*lines, f"spec: {{formula: '{formula}'}}"]))).robots["quad0"].word)

    assert word("F hoop1") == "{} {hoop1} {}"
    assert word("F G hoop1") == "{} {hoop1}"


def test_plain_regions_are_stayed_in_unless_the_formula_wants_to_leave() -> None:
    assert str(assign(world("F a")).robots["quad0"].word) == "{} {a}"
    assert str(assign(world("F(a & F free)")).robots["quad0"].word) == "{} {a} {}"
    assert str(assign(world("F(a & F(!a & F a))")).robots["quad0"].word) == "{} {a} {} {a}"


def test_a_region_inside_another_shows_both() -> None:
    places = {"room": (0.0, 0.0), "desk": (0.8, 0.0), "c": (4.0, 0.0)}
    radii = {"room": 2.0}
    mission = world("F desk & F c", regions=places, radii=radii, starts=((-4.0, 0.0),))
    plan = assign(mission)
    assert str(plan.robots["quad0"].word) == "{} {room} {desk, room} {room} {} {c}"
    assert visited(plan) == {"quad0": ["room", "desk", "c"]}
    assert_sound_words(mission, plan)
    with pytest.raises(NoPlan):
        assign(world("F desk & G !room", regions=places, radii=radii, starts=((-4.0, 0.0),)))


def assert_sound_words(mission: Mission, plan: Allocation) -> None:
    words = {name: robot.word for name, robot in plan.robots.items()}
    assert check_team(mission.formula, words).sequential


def test_overlapping_regions_are_crossed_in_their_order() -> None:
    places = {"a": (0.0, 0.0), "b": (1.5, 0.0)}
    plan = assign(world("F(a & !b & F b)", regions=places, radii={"a": 1.0, "b": 1.0}, starts=((-3.0, 0.0),)))
    assert str(plan.robots["quad0"].word) == "{} {a} {a, b} {b}"
    assert visited(plan) == {"quad0": ["a", "b"]}


def test_the_edges_of_the_environment_bind() -> None:
    mission = world("F c", regions=SMALL, extra="environment: {start: home, edges: [[home, a], [a, b], [b, c]]}")
    assert visited(assign(mission)) == {"quad0": ["a", "b", "c"]}
    one_way = world("F(c & F a)", regions=SMALL, extra="environment: {start: home, edges: [[home, c], [a, c]], directed: true}")
    with pytest.raises(NoPlan, match=r"edge c -> a|edges"):
        assign(one_way)


def test_several_actions_in_one_visit() -> None:
    robot = (
        "robot: {initial: empty, states: {empty: [], half: [half], full: [full]}, "
        "actions: [{from: empty, to: half, at: a}, {from: half, to: full, at: a}]}"
    )
    plan = assign(world("F(b & full)", regions=SMALL, extra=robot))
    assert str(plan.robots["quad0"].word) == "{} {a} {a, half} {a, full} {full} {b, full}"
    assert [action.target for action in plan.robots["quad0"].visits[0].actions] == ["half", "full"]


def test_costs_are_handed_in() -> None:
    mission = world("F a | F b", regions=SMALL)
    dear = assign(mission, cost=lambda robot, start, region: 10.0 if region == "a" else 7.0)
    assert visited(dear) == {"quad0": ["b"]}
    assert dear.cost == 7.0
    with pytest.raises(BadInput, match="must be a number"):
        assign(mission, cost=lambda robot, start, region: -1.0)
    with pytest.raises(BadInput, match="must be a number"):
        assign(mission, cost=lambda robot, start, region: math.nan)


def test_a_plan_needs_not_follow_the_robots_in_the_order_of_the_file() -> None:
    """Def. 4.7 with a fixed order misses quad0: a, quad1: b for `F a & F b & (!c W a)`."""
    mission = world("F a & F b & (!c W a)", regions=SMALL, robots=2, starts=((-0.5, 0.0), (2.5, 0.0)))
    plan = assign(mission)
    assert visited(plan) == {"quad0": ["a"], "quad1": ["b"]}
    assert_sound(mission, plan)


def test_pairwise_decomposition_is_not_enough_for_three() -> None:
    mission = world("F a & F b & (F a U b)", regions=SMALL, robots=3, starts=((-0.5, 0.0), (2.5, -0.5), (2.0, 2.5)))
    assert_sound(mission, assign(mission))


def test_a_budget_ends_the_search() -> None:
    with pytest.raises(TooLarge, match="more than 5 states"):
        assign(load_mission("firefighting"), budget=Budget(states=5))
    with pytest.raises(TooLarge, match="more than 5 states"):
        assign(load_mission("hoops-ltl"), budget=Budget(states=5))


def test_plans_that_hold_in_some_orders_only_are_refused() -> None:
    mission = world("(F a -> F(a & F b)) & F a & G(b -> !c)", regions=SMALL, robots=2, starts=((-0.5, 0.0), (2.5, 0.0)))
    plan = assign(mission)
    assert_sound(mission, plan)
    assert plan.tried > 1
    assert "not in all" in plan.notes[0]


def test_joint_missions() -> None:
    meeting = world("F(a & b)", regions=SMALL, robots=2, team="joint")
    plan = assign(meeting)
    assert_sound(meeting, plan)
    assert sorted(itertools.chain(*visited(plan).values())) == ["a", "b"]
    with pytest.raises(NoPlan, match="lie apart"):
        assign(world("F(a & b)", regions=SMALL, robots=2))
    apart = world("F a & F b & G !(a & b)", regions=SMALL, robots=2, team="joint", starts=((-0.5, 0.0), (2.5, 0.0)))
    plan = assign(apart)
    assert_sound(apart, plan)
    assert all(len(v) == 1 for v in visited(plan).values())
    with pytest.raises(Unsatisfiable):
        assign(world("F a & G !a", regions=SMALL, robots=2, team="joint"))


def test_the_longest_robot() -> None:
    text = "F a & F b & F c & F d"
    mission = world(text, robots=2, objective="longest")
    plan = assign(mission)
    assert_sound(mission, plan)
    assert plan.complete
    assert plan.cost <= max(robot.cost for robot in assign(world(text, robots=2)).robots.values())
    best = min(max(length(mission, robots[0]), length(mission, robots[1])) for robots in shares(mission, ["a", "b", "c", "d"]))
    assert plan.cost == pytest.approx(best)


def length(mission: Mission, share: tuple[int, tuple[str, ...]]) -> float:
    robot, order = share
    points = [mission.agents[f"quad{robot}"].start, *(mission.regions[name].center for name in order)]
    return sum(math.dist(p, q) for p, q in itertools.pairwise(points))


def shares(mission: Mission, names: list[str]) -> Iterator[tuple[tuple[int, tuple[str, ...]], tuple[int, tuple[str, ...]]]]:
    for mask in range(2 ** len(names)):
        mine = [n for i, n in enumerate(names) if mask >> i & 1]
        yours = [n for n in names if n not in mine]
        for first in itertools.permutations(mine):
            for second in itertools.permutations(yours):
                yield (0, first), (1, second)


def tours(most: int) -> list[tuple[str, ...]]:
    """Sequences of visits to a, b, c without immediate repetitions."""
    return [
        t for n in range(most + 1) for t in itertools.product("abc", repeat=n) if all(x != y for x, y in itertools.pairwise(t))
    ]


def cheapest_by_brute_force(mission: Mission, most: int) -> float:
    best = math.inf
    robots = list(mission.agents)
    options: list[list[tuple[float, object]]] = []
    for index, name in enumerate(robots):
        found: list[tuple[float, object]] = []
        for tour in tours(most):
            visits = [Visit(region=r) for r in tour]
            for stays in (True, False) if tour else (False,):
                found.append((length(mission, (index, tour)), word_of(mission, name, visits, stays=stays)))
        options.append(found)
    for choice in itertools.product(*options):
        cost = sum(c for c, _ in choice)
        if cost < best - 1e-9:
            words = {name: word for name, (_, word) in zip(robots, choice, strict=True)}
            if check_team(mission.formula, words).sequential:
                best = cost
    return best


def assert_cheapest(mission: Mission, most: int) -> None:
    """Fail unless the plan is as cheap as the cheapest of all with at most so many visits a robot; a cheaper one is longer."""
    best = cheapest_by_brute_force(mission, most)
    try:
        plan = assign(mission)
    except NoPlan:
        assert best == math.inf
        return
    assert_sound(mission, plan)
    assert plan.cost <= best + 1e-9
    if all(len(robot.visits) <= most for robot in plan.robots.values()) and not_again(plan):
        assert plan.cost == pytest.approx(best)


@given_few(3, 40, formulas(size=5))
def test_one_robot_against_brute_force(formula: Formula) -> None:
    assert_cheapest(world(str(formula), regions=SMALL, starts=BESIDE), 3)


@given_few(1, 4, formulas(size=5))
def test_two_robots_against_brute_force(formula: Formula) -> None:
    assert_cheapest(world(str(formula), regions=SMALL, robots=2, starts=BESIDE), 2)


def not_again(plan: Allocation) -> bool:
    return all(x != y for tour in visited(plan).values() for x, y in itertools.pairwise(tour))


@given_few(2, 25, formulas(size=5), st.sampled_from([1, 3]))
def test_lassos_against_brute_force(formula: Formula, laps: int) -> None:
    mission = world(str(formula), regions=SMALL, starts=BESIDE, trace="infinite", repeat=laps)
    best = math.inf
    for tour in tours(3):
        for cut in range(len(tour) + 1):
            visits = [Visit(region=r) for r in tour]
            prefix = length(mission, (0, tour[: cut + 1])) if cut < len(tour) else length(mission, (0, tour))
            lap = tour[cut:]
            if len(lap) == 1 or (lap and lap[0] == lap[-1]):
                continue
            cycle = sum(
                math.dist(mission.regions[p].center, mission.regions[q].center) for p, q in itertools.pairwise((*lap, *lap[:1]))
            )
            if prefix + laps * cycle < best:
                for stays in (True, False) if cut == len(tour) and tour else (False,):
                    if check_word(mission.formula, word_of(mission, "quad0", visits, cut, stays=stays)):
                        best = prefix + laps * cycle
    try:
        plan = assign(mission)
    except NoPlan:
        assert best == math.inf
        return
    assert_sound(mission, plan)
    if plan.complete:
        assert plan.cost <= best + 1e-9


@given_few(4, 25, formulas(size=5))
def test_joint_plans_pass_the_judge(formula: Formula) -> None:
    mission = world(str(formula), regions=SMALL, robots=2, team="joint")
    try:
        plan = assign(mission, budget=Budget(states=200_000, candidates=200))
    except (NoPlan, TooLarge):
        return
    assert_sound(mission, plan)


@given_few(4, 25, formulas(size=5))
def test_the_longest_robot_is_never_longer_than_with_the_smallest_sum(formula: Formula) -> None:
    try:
        least = assign(world(str(formula), regions=SMALL, robots=2))
    except NoPlan:
        with pytest.raises(NoPlan):
            assign(world(str(formula), regions=SMALL, robots=2, objective="longest"))
        return
    mission = world(str(formula), regions=SMALL, robots=2, objective="longest")
    plan = assign(mission)
    assert_sound(mission, plan)
    assert plan.cost <= max(robot.cost for robot in least.robots.values()) + 1e-7
    assert sum(robot.cost for robot in plan.robots.values()) >= least.cost - 1e-7


@pytest.mark.slow
@few_of(1, "more", [" & F(n3_3 & F n12_1) & (!n9_3 U n10_6)", ""])
def test_six_robots_on_an_office_grid(more: str) -> None:
    """As in the published office scenarios; the cheapest plans fail in some orders."""
    mission = office_grid("F n0_7 & F n5_5 & F n9_3 & F n13_7" + more)
    plan = assign(mission)
    assert_sound(mission, plan)
    assert plan.complete
    assert (plan.tried > 1) == bool(more)
    assert plan.lower_bound == plan.cost


@few_of(1, "team", ["own", "joint"])
def test_a_search_that_is_stopped_gives_no_dearer_plan_than_one_robot_alone(team: str) -> None:
    formula = "F(a & F(b & F c)) & F(c & F(a & F d)) & F(d & F(b & F a)) & F(b & F(d & F c))"
    alone = assign(world(formula, robots=1))
    found = assign(world(formula, robots=3, team=team), budget=Budget(states=600 if team == "own" else 4_000))
    assert not found.complete
    assert found.lower_bound is not None
    assert found.lower_bound <= found.cost <= alone.cost + 1e-6
