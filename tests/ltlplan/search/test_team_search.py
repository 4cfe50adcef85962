"""The team's graph, its short cuts and its lower bounds, held against plain walks over everything."""

from __future__ import annotations

import heapq
import itertools
import math
from random import Random

import networkx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ltlplan.logic.budget import DEFAULT_BUDGET, Budget
from ltlplan.logic.conjunction import Conjunction, conjunct_automata, conjuncts
from ltlplan.search.exact import assign
from ltlplan.search.joint.conjuncts import JointConjunct, WordEffects
from ltlplan.search.joint.reading import JointTask
from ltlplan.search.own.reading import OwnTask
from ltlplan.search.sequential_reading import Objective
from ltlplan.search.team_planning import least_in_one_order, plan_team
from ltlplan.search.team_reading import TeamReading, is_complete
from ltlplan.systems.transition_systems import TransitionSystem
from tests.helpers.few import few_of, given_few
from tests.helpers.missions.worlds import world
from tests.helpers.words.graphs import simple_words, systems, tasks
from tests.helpers.words.team_automaton import TeamAutomaton
from tests.strategies import formulas
from verify import check_team
from verify.data import Formula, Mission, Word, parse_formula
from verify.logic.semantics import satisfies


def own_task_of(each: list[TransitionSystem], formula: Formula) -> OwnTask:
    return OwnTask(each, conjunct_automata(formula, "finite"))


def cheapest_by_plain_walk(each: list[TransitionSystem], formula: Formula) -> float:
    """The shortest path of the whole team automaton, written down, by networkx."""
    automaton = Conjunction(conjunct_automata(formula, "finite"))
    graph = TeamAutomaton(each, automaton, switches="anywhere").to_networkx()
    starts = [node for node, data in graph.nodes(data=True) if data["initial"]]
    if not starts:
        return math.inf
    lengths = networkx.single_source_dijkstra_path_length(graph, starts[0], weight="cost")
    return min((cost for node, cost in lengths.items() if graph.nodes[node]["accepting"]), default=math.inf)


@given_few(13, 80, st.lists(systems(), min_size=1, max_size=3), tasks(with_next=True))
def test_short_cuts_keep_the_smallest_cost(each: list[TransitionSystem], formula: Formula) -> None:
    run = least_in_one_order(own_task_of(each, formula), DEFAULT_BUDGET)
    best = cheapest_by_plain_walk(each, formula)
    assert (math.inf if run is None else run.cost) == pytest.approx(best, abs=1e-6)
    if run is None:
        return
    for system, path in zip(each, run.paths, strict=True):  # the path is one of the system, from its start to where it may end
        assert path[0] == system.initial
        assert all(after in dict(system.edges[node]) for node, after in itertools.pairwise(path))
        assert system.final is None or path[-1] in system.final
    words = [tuple(system.labels[node] for node in path) for system, path in zip(each, run.paths, strict=True)]
    assert satisfies(formula, Word(tuple(itertools.chain(*words))))


@given_few(10, 60, st.lists(systems(5), min_size=2, max_size=3), tasks(with_next=False))
def test_plans_of_any_graphs_hold_in_every_order(each: list[TransitionSystem], formula: Formula) -> None:
    found = plan_team(own_task_of(each, formula), Budget(candidates=200, states=20_000))
    words = [simple_words(system, 3) for system in each]
    best = min(
        (
            sum(cost for cost, _ in choice)
            for choice in itertools.product(*words)
            if check_team(formula, {f"r{i}": word for i, (_, word) in enumerate(choice)}).sequential
        ),
        default=math.inf,
    )
    if found.run is None:
        assert best == math.inf
        return
    assert found.run.cost <= best + 1e-6
    shown = {f"r{i}": Word(tuple(each[i].labels[node] for node in path)) for i, path in enumerate(found.run.paths)}
    assert check_team(formula, shown).sequential
    if all(len(path) <= 3 for path in found.run.paths):
        assert found.run.cost == pytest.approx(best, abs=1e-6)


def assert_lower_bounds(reading: TeamReading) -> None:
    """No estimate is more than what the cheapest plan that holds in every order of the robots still costs from there."""
    begin = reading.begin()
    waiting = [] if begin is None else [begin]
    seen = set(waiting)
    before: dict[int, list[tuple[float, int]]] = {}
    left: dict[int, float] = {}
    for state in waiting:  # grows while it is walked
        for after, step, _ in reading.steps(state):
            if is_complete(after):
                if reading.holds(state):
                    left[state] = step
                continue
            before.setdefault(after, []).append((step, state))
            if after not in seen and len(seen) < 3000:
                seen.add(after)
                waiting.append(after)
    queue = [(cost, state) for state, cost in left.items()]
    heapq.heapify(queue)
    while queue:
        cost, state = heapq.heappop(queue)
        if cost > left[state]:
            continue
        for step, earlier in before.get(state, ()):
            if cost + step < left.get(earlier, math.inf):
                left[earlier] = cost + step
                heapq.heappush(queue, (cost + step, earlier))
    for state, cost in left.items():
        assert reading.left(state) <= cost + 1e-9


@given_few(10, 60, st.lists(systems(), min_size=1, max_size=3), tasks(with_next=True))
def test_estimates_are_lower_bounds(each: list[TransitionSystem], formula: Formula) -> None:
    task = own_task_of(each, formula)
    assert_lower_bounds(task.reading(range(len(task.task.parts))))


@given_few(10, 60, st.lists(systems(5), min_size=2, max_size=3), tasks(with_next=False))
def test_joint_estimates_are_lower_bounds(each: list[TransitionSystem], formula: Formula) -> None:
    joint = JointTask(each, conjunct_automata(formula, "finite"))
    assert_lower_bounds(joint.reading(range(len(joint.parts))))


def test_a_step_that_several_conjuncts_need_counts_once_under_joint() -> None:
    """All robots start where they show `c`, so that a step to `a` and `b` is also one away from `c`."""
    system = TransitionSystem((frozenset("c"), frozenset("ab")), (((1, 1.0),), ((0, 1.0),)))
    joint = JointTask([system], conjunct_automata(parse_formula("F a & F b & F !c"), "finite"))
    reading = joint.reading()
    begin = reading.begin()
    assert begin is not None
    assert reading.left(begin) == pytest.approx(1.0)


def test_what_can_be_shown_wherever_others_are_makes_no_bound_smaller() -> None:
    labels = tuple(map(frozenset, ("", "a", "ac", "b", "bc")))
    edges = (((1, 5.0),), ((2, 0.0), (3, 4.0)), ((1, 0.0), (4, 4.0)), ((4, 0.0), (1, 4.0)), ((3, 0.0), (2, 4.0)))
    joint = JointTask([TransitionSystem(labels, edges)], conjunct_automata(parse_formula("F a & F b & F c"), "finite"))
    reading = joint.reading()
    begin = reading.begin()
    assert begin is not None
    assert reading.left(begin) == pytest.approx(9.0)


@few_of(2, "seed", range(4))
def test_one_robot_takes_the_shortest_way_through_many_goals(seed: int) -> None:
    """Against all orders, by the table of Held and Karp; on a grid many are as short."""
    draw = Random(seed)
    points = [
        (place % 4, place // 4) if seed % 2 else (draw.uniform(0, 9), draw.uniform(0, 9))
        for place in draw.sample(range(12), 12)
    ]
    far = [[math.dist(a, b) for b in points] for a in points]
    goals = range(1, 12)
    least = {(1 << goal, goal): far[0][goal] for goal in goals}
    for done in range(2, 1 << 12, 2):
        for last, goal in itertools.product(goals, goals):
            if (done, last) in least and not done >> goal & 1:
                key = done | 1 << goal, goal
                least[key] = min(least.get(key, math.inf), least[done, last] + far[last][goal])
    labels = tuple(frozenset({f"g{place}"} if place else ()) for place in range(12))
    edges = tuple(tuple((b, far[a][b]) for b in range(12) if a != b) for a in range(12))
    task = own_task_of([TransitionSystem(labels, edges)], parse_formula(" & ".join(f"F g{goal}" for goal in goals)))
    found = plan_team(task, DEFAULT_BUDGET)
    assert task.bounds.tree.one_way
    assert found.stopped is None
    assert found.run.cost == pytest.approx(min(least[(1 << 12) - 2, goal] for goal in goals), abs=1e-6)


@given_few(6, 40, st.lists(systems(5), min_size=2, max_size=3), tasks(with_next=False))
def test_the_longest_robot_of_any_graphs(each: list[TransitionSystem], formula: Formula) -> None:
    found = plan_team(own_task_of(each, formula), DEFAULT_BUDGET, Objective(longest=True))
    least = plan_team(own_task_of(each, formula), DEFAULT_BUDGET)
    assert (found.run is None) == (least.run is None)
    if found.run is not None and least.run is not None:
        dearest = [max(path_costs(each, run.paths)) for run in (found.run, least.run)]
        assert found.stopped is None
        assert found.bound <= dearest[0] + 1e-6
        assert dearest[0] <= dearest[1] + 1e-6


def path_costs(each: list[TransitionSystem], paths: tuple[tuple[int, ...], ...]) -> list[float]:
    return [
        sum(min(cost for node, cost in system.edges[source] if node == target) for source, target in itertools.pairwise(path))
        for system, path in zip(each, paths, strict=True)
    ]


@settings(max_examples=60, deadline=None)
@given(formulas(size=6), st.lists(st.integers(0, 7), min_size=1, max_size=4), st.integers(0, 7))
def test_joint_words_act_as_their_letters_do(formula: Formula, word: list[int], context: int) -> None:
    bit = {"a": 1, "b": 2, "c": 4}
    for part in conjuncts(formula):
        for automaton in conjunct_automata(part, "finite"):
            joint = JointConjunct(automaton, bit)
            words = WordEffects(joint, sorted({context & joint.mask, 0}))
            number, state = words.of(word), joint.initial
            for letter in word:
                state = joint.step(state, letter | context)
            assert words.apply(number, joint.initial, context & joint.mask) == state
            names = [frozenset(n for n, b in bit.items() if (letter | context) & b) for letter in word]
            assert joint.accepting(state) == satisfies(part, Word(tuple(names)))
            assert (words.first[number], words.last[number]) == (word[0] & joint.mask, word[-1] & joint.mask)


def test_a_nondeterministic_conjunct_under_joint() -> None:
    formula = parse_formula("F(a & X a & X X b)")
    automaton = conjunct_automata(formula, "finite")[0]
    nfa = type(automaton)(
        "finite", ("a",), (((1, 0), (automaton.diagrams.condition(automaton.propositions[0], 0, 1), 1)), ((1, 1),)),
        frozenset({1}), automaton.diagrams,
    )  # fmt: skip  # "some letter holds a", guessing which
    part = JointConjunct(nfa, {"a": 1, "b": 2})
    assert not part.deterministic
    assert not part.accepting(part.step(part.initial, 2))
    done = part.step(part.step(part.initial, 2), 1)
    assert part.accepting(done)
    assert part.finished(done)
    assert part.step(done, 0) == done
    words = WordEffects(part, [0, 1])
    assert words.apply(words.of([2, 2]), part.initial, 1) == done


def grid(formula: str, *, robots: int, width: int = 4, height: int = 3) -> Mission:
    """A grid in which robots move between neighbours, entered from below."""
    places = {f"n{x}_{y}": (float(x), float(y)) for x in range(width) for y in range(height)}
    edges = [f"[home, n{x}_0]" for x in range(width)]
    for x, y in itertools.product(range(width), range(height)):
        edges += [f"[n{x}_{y}, n{x + 1}_{y}]"] if x + 1 < width and (x, y) != (1, 1) else []
        edges += [f"[n{x}_{y}, n{x}_{y + 1}]"] if y + 1 < height and (x, y) != (2, 1) else []
    return world(
        formula, robots=robots, regions=places, starts=tuple((x + 0.3, -1.0) for x in range(robots)),
        extra=f"environment: {{start: home, edges: [{', '.join(edges)}]}}",
    )  # fmt: skip


@few_of(
    1,
    "formula",
    [
        "F n0_2 & F(n1_1 & F n2_2)",
        "F n3_2 & F(n0_2 & F n3_0) & (!n3_2 U n0_2)",
        "(F n2_2 -> F(n2_2 & F n0_2)) & F n2_2 & !F(n1_1 & F(!n1_1 & F n1_1))",
        "F n3_2 & F n1_1 & G !n1_0 & (!n1_1 W n3_2)",
    ],
)
def test_a_grid_against_brute_force(formula: str) -> None:
    """Every sequence of up to four goals a robot, by the shortest way past the other goals."""
    mission = grid(formula, robots=2)
    goals = sorted(parse_formula(formula).names())
    graph = networkx.Graph((f"n{x}_{y}", f"n{u}_{v}") for (x, y), (u, v) in neighbours(4, 3))
    options = []
    for agent in mission.agents.values():
        found = [(0.0, [frozenset[str]()])]
        for tour in itertools.chain.from_iterable(itertools.product(goals, repeat=n) for n in (1, 2, 3, 4)):
            cost = sum(1.0 if a == b else way(graph, goals, a, b) for a, b in itertools.pairwise(tour))
            if any(a == b for a, b in itertools.pairwise(tour)) or cost == math.inf:
                continue
            entry = min(
                math.dist(agent.start, mission.regions[f"n{x}_0"].center) + way(graph, goals, f"n{x}_0", tour[0])
                for x in range(4)
                if f"n{x}_0" not in goals or f"n{x}_0" == tour[0]
            )
            letters = [frozenset[str]()]
            for goal in tour:
                letters += [frozenset({goal}), frozenset()]
            found += [(entry + cost, letters), (entry + cost, letters[:-1])]
        options.append(found)
    choices = sorted(itertools.product(*options), key=lambda choice: sum(cost for cost, _ in choice))
    best = next(
        sum(cost for cost, _ in choice)
        for choice in choices
        if check_team(formula, dict(zip(mission.agents, [word for _, word in choice], strict=True))).sequential
    )
    plan = assign(mission)
    assert plan.complete
    assert plan.cost == pytest.approx(best)


def neighbours(width: int, height: int) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    found = []
    for x, y in itertools.product(range(width), range(height)):
        if x + 1 < width and (x, y) != (1, 1):
            found.append(((x, y), (x + 1, y)))
        if y + 1 < height and (x, y) != (2, 1):
            found.append(((x, y), (x, y + 1)))
    return found


def way(graph: networkx.Graph[str], goals: list[str], start: str, end: str) -> float:
    """The shortest way of steps of 1 m that shows no goal in between."""
    between = graph.subgraph([node for node in graph if node not in goals or node in (start, end)])
    if start not in between or not networkx.has_path(between, start, end):
        return math.inf
    return float(networkx.shortest_path_length(between, start, end))
