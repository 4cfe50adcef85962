"""Laps of teams, planned: against all short lassos of small worlds, and what their words may not break in any order."""

from __future__ import annotations

import itertools
import math
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ltlplan.logic.budget import DEFAULT_BUDGET, Budget, TooLarge
from ltlplan.search.cycles.cheapest_cycles import cycles_below, least_of_all_cycles
from ltlplan.search.cycles.conjunct_assignment import parts_of, share_out
from ltlplan.search.cycles.team_cycles import Stage
from ltlplan.search.exact import assign
from ltlplan.systems.transition_systems import TransitionSystem
from tests.helpers.few import given_few
from tests.helpers.missions.worlds import world
from tests.helpers.words.timelines import mission
from verify.data import BadInput, Letter, Word
from verify.logic.semantics import satisfies

NAMES = ("a", "b", "c")


@st.composite
def systems(draw: st.DrawFn) -> TransitionSystem:
    """Two or three places, each with one letter, joined at random; one may wait anywhere."""
    size = draw(st.integers(2, 3))
    labels = tuple(frozenset(draw(st.sets(st.sampled_from(NAMES), max_size=1))) for _ in range(size))
    ways = [(i, j) for i in range(size) for j in range(size) if i != j]
    chosen = draw(st.sets(st.sampled_from(ways), min_size=1))
    edges = tuple(tuple((j, float(draw(st.integers(1, 3)))) for i, j in sorted(chosen) if i == k) for k in range(size))
    return TransitionSystem(labels, edges)


RECURRENCES = st.lists(
    st.sampled_from(["G F a", "G F b", "G F c", "F a", "F b", "G !c", "F G !a", "G F (a | b)", "!b U a"]),
    min_size=1,
    max_size=3,
).map(" & ".join)


def cheapest_by_hand(each: list[TransitionSystem], formula: str, longest: int = 5) -> float | None:
    """Try every prefix and every cycle of up to so many moves, one robot at a time, on what all robots show together."""
    asked = mission(formula, team="joint", robots=len(each), trace="infinite").formula
    best: float | None = None
    start = tuple(system.initial for system in each)

    def ways(begin: tuple[int, ...], most: int):
        stack = [((begin,), 0.0)]
        while stack:
            way, cost = stack.pop()
            yield way, cost
            if len(way) <= most:
                for robot, system in enumerate(each):
                    for target, price in system.edges[way[-1][robot]]:
                        nodes = (*way[-1][:robot], target, *way[-1][robot + 1 :])
                        stack.append(((*way, nodes), cost + price))

    def shown(nodes: tuple[int, ...]) -> Letter:
        return frozenset().union(*(s.labels[n] for s, n in zip(each, nodes, strict=True)))

    for prefix, there in ways(start, longest - 2):
        for cycle, lap in ways(prefix[-1], longest):
            if cycle[-1] != prefix[-1] or (best is not None and there + lap >= best):
                continue
            word = Word(tuple(map(shown, prefix)), tuple(map(shown, cycle[1:] or cycle)))
            if satisfies(asked, word):
                best = there + lap
    return best


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(st.one_of(st.tuples(systems(), systems()), st.tuples(systems(), systems(), systems())), RECURRENCES)
def test_laps_are_as_cheap_as_the_cheapest_of_all_short_ones(each, formula: str):
    asked = mission(formula, team="joint", robots=len(each), trace="infinite")
    found = cycles_below(asked, each, asked.formula, DEFAULT_BUDGET, math.inf).cycles
    by_hand = cheapest_by_hand(list(each), formula, 6 - len(each))
    if found is None:
        assert by_hand is None
    elif by_hand is not None:
        least = least_of_all_cycles(asked, each, asked.formula, DEFAULT_BUDGET, cost(each, found))
        assert least is None or least <= by_hand + 1e-6
        if found.exact:
            assert cost(each, found) <= by_hand + 1e-6


def cost(each, found) -> float:
    return sum(
        min(price for node, price in system.edges[a] if node == b)
        for system, prefix, lap in zip(each, found.prefixes, found.cycles, strict=True)
        for way in (prefix, lap)
        for a, b in itertools.pairwise(way)
    )


@given_few(
    6,
    40,
    st.tuples(systems(), systems()),
    st.one_of(RECURRENCES, st.sampled_from(["G(a -> F b)", "G(a -> !b U c)", "(!a U b) & G F c", "G F(a & F b)"])),
    st.sampled_from(["own", "joint"]),
    st.randoms(),
)
def test_every_order_within_a_stage_does_what_is_asked(each, formula: str, team: str, rng: Random):
    asked = mission(formula, team=team, robots=2, trace="infinite")
    try:
        found = cycles_below(asked, each, asked.formula, DEFAULT_BUDGET, math.inf).cycles
    except BadInput:  # the conjunct has to guess under `own`
        return
    if found is None or found.course is None:
        return
    for _ in range(8):
        at = list(found.course.begin)
        prefix = flown(each, at, found.course.prefix, team, rng, begins=True)
        cycle = flown(each, at, found.course.cycle, team, rng, begins=False)
        assert satisfies(asked.formula, Word(tuple(prefix), tuple(cycle))), (prefix, cycle)


def flown(each, at: list[int], stages: tuple[Stage, ...], team: str, rng: Random, *, begins: bool) -> list[Letter]:
    """Fly stages in a random order of each one's moves; read everybody at the end, and whoever is about to change."""
    read: list[Letter] = []

    def reading(robots: list[int]) -> None:
        if team == "joint":
            read.append(frozenset().union(*(s.labels[n] for s, n in zip(each, at, strict=True))))
        else:
            read.extend(each[robot].labels[at[robot]] for robot in robots)

    everyone = list(range(len(each)))
    if begins:
        reading(rng.sample(everyone, len(everyone)))
    for stage in stages:
        left = {r: [node for move in stage if move.robot == r for node in move.way[1:]] for r in everyone}
        while any(left.values()):
            robot = rng.choice([r for r in everyone if left[r]])
            reading([robot, *(r for r in everyone if rng.random() < 0.3)])
            at[robot] = left[robot].pop(0)
            if team == "joint":
                reading([])
    reading(rng.sample(everyone, len(everyone)))
    return read


TWO_PLACES = TransitionSystem((frozenset({"a"}), frozenset({"b"})), (((1, 1.0),), ((0, 1.0),)))


def test_robots_wait_only_for_what_the_formula_asks():
    asked = mission("G F q0.b & G F q0.a & G F q1.b & G(!q0.b | !q1.b)", team="joint", robots=2, trace="infinite")
    found = cycles_below(asked, (TWO_PLACES, TWO_PLACES), asked.formula, DEFAULT_BUDGET, math.inf).cycles
    assert found is not None
    assert found.course is not None
    assert len(found.course.cycle) > 1
    free = mission("G F q0.b & G F q0.a & G F q1.b", team="joint", robots=2, trace="infinite")
    found = cycles_below(free, (TWO_PLACES, TWO_PLACES), free.formula, DEFAULT_BUDGET, math.inf).cycles
    assert found is not None
    assert found.course is not None
    assert len(found.course.cycle) == 1


def test_laps_that_nobody_can_fly_are_none():
    asked = mission("G F c", team="joint", robots=2, trace="infinite")
    assert cycles_below(asked, (TWO_PLACES, TWO_PLACES), asked.formula, DEFAULT_BUDGET, math.inf).cycles is None


def test_what_is_too_large_says_for_what_laps_are_planned():
    asked = mission("G F a & F b", robots=2, trace="infinite")
    with pytest.raises(TooLarge, match="product of all 2 robots"):
        cycles_below(asked, (TWO_PLACES, TWO_PLACES), asked.formula, Budget(lasso=3), math.inf)


def test_laps_of_few_robots_stand_where_the_product_of_all_is_too_large():
    asked = mission("G F q0.a & G F q0.b & G F q1.b", team="joint", robots=4, trace="infinite")
    each = (TWO_PLACES,) * 4
    whole = cycles_below(asked, each, asked.formula, DEFAULT_BUDGET, math.inf).cycles
    few = cycles_below(asked, each, asked.formula, Budget(lasso=8), math.inf).cycles
    assert whole is not None
    assert whole.exact
    assert few is not None
    assert not few.exact
    assert cost(each, few) == cost(each, whole)


PARTS = ("G F a", "G F b", "G F c", "F a", "F b")


@given_few(
    2, 25, st.tuples(systems(), systems()), st.lists(st.sampled_from(PARTS), min_size=1, max_size=3, unique=True), st.booleans()
)
def test_parts_are_shared_out_at_the_least_cost(each, parts: list[str], longest: bool):
    """Against every way to give the parts to the two, each robot's laps tried by hand."""
    asked = mission(" & ".join(parts), robots=2, trace="infinite")
    split = parts_of(asked, asked.formula)
    assert split is not None
    found = share_out(asked, each, split, DEFAULT_BUDGET, longest=longest)
    ways = []
    for chosen in itertools.product((0, 1), repeat=len(parts)):
        costs = [
            cheapest_by_hand([s], " & ".join(["true", *(p for p, who in zip(parts, chosen, strict=True) if who == robot)]), 5)
            for robot, s in enumerate(each)
        ]
        if None not in costs:
            ways.append(max(costs) if longest else sum(costs))
    if found is None:
        assert not ways
    elif ways and found.least is not None:
        assert found.least <= min(ways) + 1e-5
        priced = [
            sum(min(c for n, c in s.edges[a] if n == b) for way in (p, lap) for a, b in itertools.pairwise(way))
            for s, p, lap in zip(each, found.prefixes, found.cycles, strict=True)
        ]
        assert (max(priced) if longest else sum(priced)) <= min(ways) + 1e-5


@given_few(
    2, 25, st.tuples(systems(), systems()), st.lists(st.sampled_from((*PARTS, "G !c", "G F (a | b)")), min_size=1, max_size=3)
)
def test_what_some_robot_shows_or_none_is_shared_out_under_joint_too(each, parts: list[str]):
    asked = mission(" & ".join(parts), robots=2, trace="infinite", team="joint")
    split = parts_of(asked, asked.formula)
    assert split is not None
    found = share_out(asked, each, split, DEFAULT_BUDGET, longest=False)
    by_hand = cheapest_by_hand(each, " & ".join(parts), 5)
    assert by_hand is None or found is not None
    if found is not None and found.least is not None:
        paid = sum(
            min(c for n, c in s.edges[a] if n == b)
            for s, p, lap in zip(each, found.prefixes, found.cycles, strict=True)
            for way in (p, lap)
            for a, b in itertools.pairwise(way)
        )
        assert by_hand is None or paid <= by_hand + 1e-5
        assert found.least <= paid + 1e-5


def test_laps_of_bare_graphs_are_shared_out():
    still = TransitionSystem((frozenset(), frozenset()), (((1, 1.0),), ()))
    turning = TransitionSystem((frozenset("a"), frozenset("b"), frozenset()), (((1, 1.0), (2, 1.0)), ((0, 1.0),), ()))
    asked = mission("G F a & G F b", robots=2, trace="infinite", team="joint")
    split = parts_of(asked, asked.formula)
    assert split is not None
    found = share_out(asked, [still, turning], split, DEFAULT_BUDGET, longest=False)
    assert found is not None
    assert {*found.cycles[1]} == {0, 1}


@pytest.mark.parametrize(
    "formula", ["G F (a & b)", "G F count(a) >= 2", "F G a", "G a", "G F !a", "G F free", "G F (q0.a & b)"]
)
def test_what_robots_show_together_is_not_shared_out(formula: str):
    asked = mission(formula, robots=2, trace="infinite", team="joint")
    assert parts_of(asked, asked.formula) is None


def test_laps_of_robots_that_are_named_are_each_robots_own():
    places, starts = {f"p{i}": (3.0 * i - 11.0, 0.0) for i in range(8)}, tuple((6.0 * i - 11.0, 1.5) for i in range(4))
    named = " & ".join(f"G F quad{i}.p{2 * i} & G F quad{i}.p{2 * i + 1}" for i in range(4))
    found = assign(world(named, robots=4, regions=places, starts=starts, team="joint", trace="infinite"))
    assert found.cost == pytest.approx(4 * 7.5, abs=1e-5)
    assert found.complete


def test_the_dearest_robot_of_laps_that_are_planned_together_pays_less_where_that_is_asked():
    places, starts = {"a": (0.0, 0.0), "b": (2.0, 0.0), "c": (0.0, 2.5)}, ((-1.0, 0.3), (-1.5, 2.5))
    by_sum, longest = (
        assign(
            world(
                "G F(count(a) >= 2) & G F some(b) & G F some(c)",
                robots=2, regions=places, radii={"a": 0.6}, starts=starts, team="joint", trace="infinite", objective=what,
            )
        )
        for what in ("sum", "longest")
    )  # fmt: skip
    assert longest.cost == max(robot.cost for robot in longest.robots.values())
    assert longest.cost < max(robot.cost for robot in by_sum.robots.values()) - 1.0
    assert longest.lower_bound is not None
    assert by_sum.lower_bound / 2 - 1e-3 <= longest.lower_bound <= longest.cost
    assert longest.complete or any("may exist" in note for note in longest.notes)


def test_a_lap_that_begins_at_once_is_no_dearer_than_its_bound():
    """The robot that ends the lap made no step before it, and the product counts its first step twice."""
    still, to_and_fro = (
        TransitionSystem(labels=labels, edges=edges, initial=0, final=None, nodes=(), robot="", actions=(), walls={})
        for labels, edges in (
            ((frozenset[str](), frozenset[str]()), (((1, 1.0),), ())),
            ((frozenset("a"), frozenset("b")), (((1, 1.0),), ((0, 1.0),))),
        )
    )
    asked = mission("G F a & G F b", team="joint", robots=2, trace="infinite")
    found = cycles_below(asked, (still, to_and_fro), asked.formula, DEFAULT_BUDGET, math.inf).cycles
    assert cost((still, to_and_fro), found) == pytest.approx(2.0)
    least = least_of_all_cycles(asked, (still, to_and_fro), asked.formula, DEFAULT_BUDGET, 2.0)
    assert least == pytest.approx(2.0, abs=1e-5)
    assert found.exact
