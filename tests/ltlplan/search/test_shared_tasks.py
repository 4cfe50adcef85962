"""Tasks shared in tours so that the robot with the highest cost pays little, held against exact searches on any graphs and against what many alike robots need."""

from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import strategies as st

from ltlplan.logic.budget import DEFAULT_BUDGET, Budget
from ltlplan.logic.conjunction import conjunct_automata
from ltlplan.search.exact import assign
from ltlplan.search.own.reading import OwnTask
from ltlplan.search.sequential_reading import Objective
from ltlplan.search.team_planning import MANY, plan_team
from ltlplan.systems.transition_systems import TransitionSystem
from tests.helpers.few import given_few
from tests.helpers.words.graphs import systems, tasks
from verify import check_team
from verify.data import Formula, Mission, Word, parse_formula, parse_mission


def shared(each: list[TransitionSystem], formula: Formula, *, most: float = math.inf):
    task = OwnTask(each, conjunct_automata(formula, "finite"))
    return task.shared_out(Objective(longest=True, most=[most] * len(each)))


def costs(each: list[TransitionSystem], paths: tuple[tuple[int, ...], ...]) -> list[float]:
    found: list[float] = []
    for system, path in zip(each, paths, strict=True):
        steps = [min(c for node, c in system.edges[a] if node == b) for a, b in itertools.pairwise(path)]
        found.append(sum(steps) + (0.0 if system.final is None else system.final[path[-1]]))
    return found


VISITS = st.sampled_from(
    ["F a", "F b & F c", "F a & F b & F c", "F(a & F b) & F c", "F a & G !(a & b)", "F(a | b) & F c & G !(b & c)"]
)


@given_few(10, 60, st.lists(systems(), min_size=1, max_size=3), st.one_of(VISITS.map(parse_formula), tasks(with_next=False)))
def test_its_paths_do_the_tasks_and_its_bound_is_one(each: list[TransitionSystem], formula: Formula) -> None:
    found = shared(each, formula)
    if found is None or found.run is None:
        return
    run, bound = found.run, found.bound
    assert [path[0] for path in run.paths] == [system.initial for system in each]
    assert run.cost == pytest.approx(max(costs(each, run.paths)), abs=1e-6)
    task = OwnTask(each, conjunct_automata(formula, "finite"))
    best = plan_team(task, DEFAULT_BUDGET, Objective(longest=True))
    words = {f"r{i}": Word(tuple(each[i].labels[node] for node in path)) for i, path in enumerate(run.paths)}
    assert check_team(formula, words).sequential
    if best.stopped is None:
        assert best.run is not None
        assert bound <= best.bound + 1e-6 <= run.cost + 2e-6


def test_one_robot_for_each_of_two_visits_that_it_alone_can_make() -> None:
    free, a, b = frozenset[str](), frozenset({"a"}), frozenset({"b"})
    left = TransitionSystem(labels=(free, a, b), edges=(((1, 1.0), (2, 5.0)), ((0, 1.0),), ((0, 5.0),)), initial=0)
    right = TransitionSystem(labels=(free, a, b), edges=(((1, 5.0), (2, 2.0)), ((0, 5.0),), ((0, 2.0),)), initial=0)
    found = shared([left, right], parse_formula("F a & F b"))
    assert found is not None
    assert found.run is not None
    assert costs([left, right], found.run.paths) == pytest.approx([1.0, 2.0], abs=1e-6)
    assert found.bound == pytest.approx(2.0, abs=1e-5)
    assert shared([left, right], parse_formula("F a & F b"), most=1.5) is None
    assert shared([left, right], parse_formula("!a U b")) is None  # nothing that any robot can do at any time


def grid(robots: int, *, goals: int | None = None, extra: str = "") -> Mission:
    """Robots in rows of 1.5 m, each with a goal as far ahead as everyone's rows are deep."""
    side = math.ceil(math.sqrt(robots))
    places = [(i % side * 1.5, i // side * 1.5) for i in range(robots)]
    formula = " & ".join(f"F g{i}" for i in range(robots if goals is None else goals)) + extra
    lines = [f"format: 1\nname: grid\nspec: {{formula: {formula!r}}}\nregions:"]
    lines += [f"  g{i}: {{center: [{x}, {y + side * 1.5 + 2}, 1], radii: [0.2, 0.2, 0.2]}}" for i, (x, y) in enumerate(places)]
    lines += ["agents:", *(f"  q{i}: {{start: [{x}, {y}, 1]}}" for i, (x, y) in enumerate(places))]
    lines += [f"vehicle: crazyflie-2.1\nworkspace: {{min: [-3, -3, 0.2], max: [{side * 1.5 + 3}, {side * 3 + 6}, 4]}}"]
    return parse_mission("\n".join([*lines, "planner: {objective: longest}\n"]))


@pytest.mark.parametrize("robots", [MANY, 30])
def test_many_alike_robots_each_take_one_goal_and_none_can_take_less(robots: int) -> None:
    found = assign(grid(robots))
    assert found.complete
    assert [len(does.visits) for does in found.robots.values()] == [1] * robots
    assert len({does.visits[0].region for does in found.robots.values()}) == robots
    ahead = math.ceil(math.sqrt(robots)) * 1.5 + 2
    assert found.cost == pytest.approx(ahead, abs=1e-4)
    assert found.lower_bound == pytest.approx(ahead, abs=1e-4)


@pytest.mark.slow
def test_more_tasks_than_robots_are_shared_within_the_bound_that_is_told() -> None:
    mission = grid(16)
    few = dict(list(mission.agents.items())[:10])
    found = assign(mission.model_copy(update={"agents": few}), budget=Budget(states=20_000))
    words = {name: does.word for name, does in found.robots.items()}
    assert check_team(mission.formula, words).sequential
    assert found.lower_bound is not None
    assert 8.0 - 1e-4 <= found.lower_bound <= found.cost <= 1.3 * found.lower_bound


def test_visits_that_must_not_meet_are_kept_apart_by_whoever_makes_them() -> None:
    mission = grid(12, extra=" & G(g0 -> !F g1)")
    found = assign(mission, budget=Budget(states=20_000))
    assert check_team(mission.formula, {name: does.word for name, does in found.robots.items()}).sequential
