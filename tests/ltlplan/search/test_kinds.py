"""Who does what in a team of several kinds: by each robot's own costs and speeds, held against every way to share the work."""

import itertools
import math
import re
from pathlib import Path

import numpy as np
import pytest

from ltlplan.mtac.optimality_gap import straight_cost
from ltlplan.planner import make_plan
from ltlplan.search.exact import assign
from tests.helpers.few import few_of
from tests.helpers.missions.kinds import mixed, mixed_text
from verify.data import Infeasible, Mission, Unsatisfiable, parse_mission

SPEEDS = {"quick": 1.0, "slow": 0.25}


def world(rng: np.random.Generator, objective: str, cost: str, only: dict[str, str], robots: tuple[str, ...]) -> Mission:
    """Return a mission with four places to visit, some of them closed to a kind, and robots of two kinds in free flight."""
    points = rng.uniform([-4, -4, 1], [4, 4, 1.0001], (40, 3))
    chosen: list[np.ndarray] = []
    for point in points:
        if all(np.linalg.norm(point - other) > 1.2 for other in chosen):
            chosen.append(point)
    shut = [f", only: [{only[f'p{i}']}]" if f"p{i}" in only else "" for i in range(4)]
    places = "\n".join(
        f"  p{i}: {{center: {point.tolist()}, radii: [0.2, 0.2, 0.2]{shut[i]}}}" for i, point in enumerate(chosen[:4])
    )
    agents = "\n".join(
        f"  r{i}: {{start: {point.tolist()}, robot: {kind}, limits: {{speed: {SPEEDS[kind]}}}}}"
        for i, (kind, point) in enumerate(zip(robots, chosen[4:], strict=False))
    )
    kinds = "\n".join(f"  {kind}: {{initial: idle, states: {{idle: []}}}}" for kind in sorted(set(robots)))
    return parse_mission(
        f"""
format: 1
name: shared
spec: {{formula: "F p0 & F p1 & F p2 & F p3"}}
regions:
{places}
robots:
{kinds}
agents:
{agents}
vehicle: crazyflie-2.1
workspace: {{min: [-5, -5, 0.2], max: [5, 5, 2.0]}}
planner: {{objective: {objective}, cost: {cost}, speed: 2.0}}
""".replace("[-5, -5, 0.2]", "[-5.0, -5.0, 0.2]").replace("[5, 5, 2.0]", "[5.0, 5.0, 2.0]")
    )


def cheapest(mission: Mission, flight: float = math.inf) -> float:
    """Return the least objective over all partitions of the places and all orders; infinite where there is none.

    Args:
        mission: Whose places are to be visited.
        flight: s that each robot may fly at most.
    """
    names, robots = list(mission.regions), list(mission.agents)

    def cost(robot: str, order: tuple[str, ...]) -> float:
        agent = mission.agents[robot]
        weights = mission.planner.cost
        speed = mission.planner.pace * agent.limits.speed
        metre = weights.get("length", 0.0) + weights.get("time", 0.0) / speed
        points = [agent.start, *(mission.regions[name].center for name in order)]
        if any(mission.regions[n].only is not None and agent.robot not in mission.regions[n].only for n in order):
            return math.inf
        length = sum(math.dist(a, b) for a, b in itertools.pairwise(points))
        return metre * length if length <= flight * speed else math.inf

    best = math.inf
    for owners in itertools.product(robots, repeat=len(names)):
        own = [[n for n, owner in zip(names, owners, strict=True) if owner == robot] for robot in robots]
        costs = [min(cost(r, order) for order in itertools.permutations(part)) for r, part in zip(robots, own, strict=True)]
        best = min(best, max(costs) if mission.planner.objective == "longest" else sum(costs))
    return best


@pytest.mark.parametrize("objective", ["sum", "longest"])
@few_of(1, "cost", ["{time: 1.0}", "{length: 1.0, time: 0.5}"])
def test_the_exact_search_finds_what_trying_everything_finds(objective, cost):
    rng = np.random.default_rng(7)
    shared = 0
    for k in range(6):
        only = {f"p{i}": str(rng.choice(["quick", "slow"])) for i in range(4) if rng.random() < 0.3}
        robots = ("quick", "slow") if k % 2 else ("slow", "quick", "slow")
        mission = world(rng, objective, cost, only, robots)
        found = assign(mission)
        assert found.complete
        assert found.cost == pytest.approx(cheapest(mission), abs=1e-6)
        shared += sum(bool(robot.visits) for robot in found.robots.values()) > 1
        for name, robot in found.robots.items():
            assert all(mission.may_enter(name, visit.region) for visit in robot.visits)
    assert shared


def with_endurance(mission: Mission, seconds: float) -> Mission:
    """Return the mission whose first robot can stay in the air for some time only, and with it the whole team."""
    name, agent = next(iter(mission.agents.items()))
    limits = agent.limits.model_copy(update={"endurance": seconds})
    return mission.model_copy(update={"agents": {**mission.agents, name: agent.model_copy(update={"limits": limits})}})


@few_of(1, ("objective", "team"), [("sum", "own"), ("longest", "own"), ("sum", "joint")])
def test_endurance_is_kept_as_trying_everything_keeps_it(objective, team):
    """To show places for the whole team (`joint`) is the same as to show each by itself, so the same plans are best."""
    rng = np.random.default_rng(11)
    shared = infeasible = 0
    for k in range(8):
        mission = world(rng, objective, "{length: 1.0}", {}, ("quick", "slow", "slow") if k % 2 else ("quick", "quick"))
        mission = mission.model_copy(update={"spec": mission.spec.model_copy(update={"team": team})})
        free = assign(mission)
        longest = max(
            does.cost / (mission.planner.pace * mission.agents[name].limits.speed) for name, does in free.robots.items()
        )
        flight = longest * float(rng.choice([0.5, 0.8, 1.01]))
        best = cheapest(mission, flight)
        limited = with_endurance(mission, flight + 11.0)
        if best == math.inf:
            infeasible += 1
            with pytest.raises(Infeasible, match=r"endurance of .* s leaves .* s for the flight"):
                assign(limited)
            continue
        found = assign(limited)
        assert found.complete
        assert found.cost == pytest.approx(best, abs=1e-6)
        shared += found.cost > free.cost + 1e-6
    assert infeasible
    assert shared or objective == "longest"


@few_of(1, ("method", "team"), [("exact", "own"), ("exact", "joint"), ("mtac-e", "own")])
def test_endurance_makes_robots_share(method, team):
    """Alone one of them would do it all for less."""
    text = (
        mixed_text("F smoke & F desk", method=method, planner=", pace: nominal")
        .replace("spec: {", f"spec: {{team: {team}, ")
        .replace("start: [-1.9, 0.8, 1.0]", "start: [-0.9, 1.3, 1.0]")
    )
    alone = make_plan(parse_mission(text))
    assert [len(robot.visits) for robot in alone.robots.values()] == [2, 0]
    shared = make_plan(parse_mission(text.replace("limits: {speed: 1.0}", "limits: {speed: 1.0, endurance: 16.0}")))
    assert [len(robot.visits) for robot in shared.robots.values()] == [1, 1]
    assert all(robot.times[-1] <= 7.0 for robot in shared.robots.values())
    with pytest.raises(Infeasible, match="endurance of 13 s leaves 2 s for the flight"):
        make_plan(parse_mission(text.replace("limits: {speed: 1.0}", "limits: {speed: 1.0, endurance: 13.0}")))


@pytest.mark.slow
@pytest.mark.parametrize("objective", ["sum", "longest"])
def test_mtac_e_is_never_better_than_the_exact_search_and_near_it(objective):
    rng = np.random.default_rng(5)
    gaps: list[float] = []
    for k in range(4):
        only = {"p0": "quick"} if k % 2 else {}
        mission = world(rng, objective, "{time: 1.0}", only, ("quick", "slow"))
        planner = mission.planner.model_copy(update={"method": "mtac-e", "iterations": 1, "samples": 20})
        exact = assign(mission).cost
        assert exact == pytest.approx(cheapest(mission), abs=1e-6)
        plan = make_plan(mission.model_copy(update={"planner": planner}))
        ours = straight_cost(mission, {name: robot.visits for name, robot in plan.robots.items()})
        assert ours >= exact - 1e-6
        gaps.append(ours / exact - 1.0)
        assert all(mission.may_enter(name, v.region) for name, robot in plan.robots.items() for v in robot.visits)
    assert np.median(gaps) < 0.2
    assert max(gaps) < 0.5


def test_a_robots_own_weights_count_where_they_differ():
    cheap = mixed("F smoke", slow=", cost: {length: 0.1}")
    assert [name for name, does in assign(cheap).robots.items() if does.visits] == ["slow"]
    dear = mixed("F smoke", slow=", cost: {length: 3.0}")
    assert [name for name, does in assign(dear).robots.items() if does.visits] == ["fast"]


@pytest.mark.parametrize("method", ["exact", "mtac-e"])
def test_carrying_is_given_to_the_one_that_can(method):
    plan = make_plan(mixed("F smoke & F desk & G(smoke -> carrying)", method=method))
    visits = {name: [visit.region for visit in robot.visits] for name, robot in plan.robots.items()}
    assert visits == {"fast": ["desk"], "slow": ["water", "smoke"]}


@pytest.mark.parametrize("method", ["exact", "mtac-e"])
def test_who_is_quicker_does_more_where_time_counts(method):
    by_length = make_plan(mixed("F water", method=method, slow=", limits: {speed: 0.1}", planner=", speed: 1.0"))
    by_time = make_plan(
        mixed("F water", method=method, slow=", limits: {speed: 0.1}", planner=", speed: 1.0", cost="{time: 1.0}")
    )
    assert [len(robot.visits) for robot in by_time.robots.values()] == [1, 0]
    assert sum(len(robot.visits) for robot in by_length.robots.values()) == 1


@pytest.mark.parametrize(
    ("parts", "says"),
    [
        (
            {"edges": "[[robot, water], {between: [robot, smoke], only: [scout]}, {between: [water, smoke], only: [scout]}, [robot, desk]]"},
            "`F smoke` needs carrying, only slow can show carrying, and slow cannot reach smoke. If",
        ),
        ({"formula": "F desk & G(desk -> carrying)", "desk": ", only: [scout]"}, "If desk were open to every robot it could hold."),
        ({"formula": "F(desk & carrying)", "desk": ", only: [scout]"}, "desk"),
    ],
)  # fmt: skip
def test_why_nobody_can_is_said_in_words(parts, says):
    formula = parts.pop("formula", "F smoke & G(smoke -> carrying)")
    with pytest.raises(Unsatisfiable) as refused:
        assign(mixed(formula, **parts))
    assert says in str(refused.value)


def test_a_hoop_too_narrow_for_one_is_left_to_the_other():
    text = "gate: {center: [0.9, 0.0, 1.0], radii: [0.3, 0.3, 0.3], opening: 0.2, rim: 0.02}"
    mission = mixed("F desk")
    hoops = parse_mission(f"format: 1\nname: h\nspec: {{formula: F gate}}\nhoops:\n  {text}\nagents: {{a: {{start: [0.0, 0.0, 1.0]}}}}\n"
                          "vehicle: crazyflie-2.1\nworkspace: {min: [-2.4, -1.6, 0.2], max: [1.8, 1.6, 2.0]}\n").hoops  # fmt: skip
    spec = mission.spec.model_copy(update={"formula": "F gate"})
    cheap = mission.agents["slow"].model_copy(update={"cost": {"length": 0.01}})
    there = mission.model_copy(
        update={"hoops": hoops, "spec": spec, "environment": None, "agents": {**mission.agents, "slow": cheap}}
    )
    assert [name for name, does in assign(there).robots.items() if does.visits] == ["fast"]


def test_the_worked_example_of_the_page_is_a_mission():
    page = (Path(__file__).parents[3] / "docs" / "missions.md").read_text()
    (example,) = re.findall(r"```\n(robots:\n.*?)```", page, re.DOTALL)
    places = "  water: {center: [-1.0, -0.8, 1.0], radii: [0.3, 0.3, 0.3]}\n  smoke: {center: [1.0, -0.8, 1.0], radii: [0.3, 0.3, 0.3]}\n"
    mission = parse_mission(
        example.replace("regions:\n", f"regions:\n{places}")
        + "format: 1\nname: example\nspec: {formula: F attic & F smoke & G(smoke -> carrying)}\nvehicle: crazyflie-2.1\n"
        + "workspace: {min: [-2.4, -1.6, 0.2], max: [1.8, 1.6, 2.0]}\n"
    )
    found = {name: [visit.region for visit in does.visits] for name, does in assign(mission).robots.items()}
    assert found == {"heavy": ["water", "smoke"], "quick": ["attic"]}
