"""The exact method against trying everything: random formulas and teams on small worlds, with counts, precedences and soft parts.

What is refused has no words among all short tours, what is planned keeps its formula in every order (or under its precedences, or in
its stages), costs no more than the cheapest of these tours, and says so truly.
"""

from __future__ import annotations

import itertools
import math
from functools import cache
from random import Random

import pytest

from ltlplan.allocation import Allocation
from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.search.exact import assign
from ltlplan.search.explanations.unsatisfiable_cores import NoPlan
from tests.helpers.missions.random_teams import random_formula
from tests.helpers.missions.worlds import world
from tests.helpers.words.brute_force import Event, Held, Together, Vectors, for_ever, outcomes
from tests.helpers.words.brute_plans import Tour, keeps, teams, words_of, worth
from tests.helpers.words.random_counts import random_counting_formula
from verify.data import BadInput, Formula, Infeasible, Letter, Mission, parse_formula

CLOSE = 1e-6
PLACES = {"a": (0.0, 0.0), "b": (2.4, 0.0)}
WIDE = 0.9
"""Radius in m of regions that hold three robots."""
STARTS = ((1.0, -1.4), (1.3, 1.5), (1.1, 2.6))
"""Where robots start: no straight leg passes a region, so that none is longer for what the formula forbids (`test_routes`)."""


@cache
def small_world(robots: int, team: str, radius: float) -> Mission:
    radii = dict.fromkeys(PLACES, radius)
    return world("true", regions=PLACES, robots=robots, team=team, radii=radii, starts=STARTS)


@cache
def choices(robots: int, radius: float, most: int) -> list[tuple[float, dict[str, Tour]]]:
    return teams(small_world(robots, "own", radius), PLACES, radius, most)


def asked(rng: Random, size: int) -> Formula:
    return parse_formula(str(random_formula(rng, rng.randint(1, size))).replace("water", "a").replace("c", "b"))


def planned(mission: Mission, formula: Formula) -> Allocation | NoPlan:
    try:
        return assign(mission.asking(str(formula)), budget=Budget(states=20_000))
    except NoPlan as refusal:
        return refusal


def the_core_is_true(mission: Mission, core: tuple[str, ...], most: int) -> None:
    """The parts that are named have no words together, and without any one of them there are some."""
    formula = parse_formula(" & ".join(f"({part})" for part in core))
    vectors = Vectors(formula, tuple(mission.agents))
    short = choices(len(mission.agents), 0.2, most)
    assert not any(keeps(words_of(chosen), mission.spec.team, vectors) for _, chosen in short), core
    for i in range(len(core)):
        others = [f"({part})" for part in (*core[:i], *core[i + 1 :])]
        assert not others or isinstance(planned(mission, parse_formula(" & ".join(others))), Allocation), core


def words_agree(rng: Random) -> bool:
    robots, team = rng.choice([1, 2, 2, 3]), rng.choice(["own", "joint"])
    formula, most = asked(rng, 8), 3 if robots < 3 else 1
    mission = small_world(robots, team, 0.2)
    vectors = Vectors(formula, tuple(mission.agents))
    best = next((cost for cost, chosen in choices(robots, 0.2, most) if keeps(words_of(chosen), team, vectors)), None)
    plan = planned(mission, formula)
    case = str(formula), robots, team, best
    if isinstance(plan, NoPlan):
        assert best is None, case
        the_core_is_true(mission, plan.core, most)
        return False
    words = {name: robot.word.prefix for name, robot in plan.robots.items()}
    if plan.precedences:
        assert best is None, case  # what holds in every order is looked for first
        assert outcomes(formula, tuple(words), Together(words, team, events(plan))) == {True}, (case, words, plan.precedences)
        return True
    assert keeps(words, team, vectors), (case, words)
    short = all(len(robot.visits) <= most for robot in plan.robots.values())
    _is_cheapest(plan, best, short=short, case=case)
    return True


def _is_cheapest(plan: Allocation, best: float | None, *, short: bool, case: object) -> None:
    assert best is not None or not short, (case, plan.robots)
    if best is None:
        return
    if plan.complete:
        assert plan.cost <= best + CLOSE, (case, plan.cost, plan.robots)
    assert plan.lower_bound is None or plan.lower_bound <= best + 1e-5, (case, plan.lower_bound)
    assert not short or plan.cost >= best - CLOSE, (case, plan.cost, plan.robots)


def events(plan: Allocation) -> list[tuple[Event, Event]]:
    """Return precedences as events: a visit's letter has odd index, as no robot acts and all start in free flight."""
    return [
        (
            (wait.first[0], 2 * wait.first[1] + (2 if wait.done == "left" else 1)),
            (wait.then[0], 2 * wait.then[1] + (2 if wait.due == "leaves" else 1)),
        )
        for wait in plan.precedences
    ]


def orders_agree(rng: Random) -> bool | None:
    """Where no words hold in every order: words hold under precedences if and only if they do under some order of all events."""
    team, formula = rng.choice(["own", "joint"]), asked(rng, 8)
    mission = small_world(2, team, 0.2)
    vectors = Vectors(formula, tuple(mission.agents))
    if any(keeps(words_of(chosen), team, vectors) for _, chosen in choices(2, 0.2, 2)):
        return None
    plan = planned(mission, formula)
    best = next((cost for cost, chosen in choices(2, 0.2, 1) if _in_some_order(formula, words_of(chosen), team)), None)
    if isinstance(plan, NoPlan):
        assert best is None, (str(formula), team, best)
        return False
    if plan.precedences:
        words = {name: robot.word.prefix for name, robot in plan.robots.items()}
        assert outcomes(formula, tuple(words), Together(words, team, events(plan))) == {True}, (str(formula), team, words)
        short = all(len(robot.visits) <= 1 for robot in plan.robots.values())
        _is_cheapest(plan, best, short=short, case=(str(formula), team, best))
    return True


def _in_some_order(formula: Formula, words: dict[str, tuple[Letter, ...]], team: str) -> bool:
    (one, first), (other, second) = words.items()
    number = len(first) + len(second) - 2
    for places in itertools.combinations(range(number), len(first) - 1):
        mine, its = iter(range(1, len(first))), iter(range(1, len(second)))
        order = [(one, next(mine)) if i in places else (other, next(its)) for i in range(number)]
        before = [(e, f) for e, f in itertools.combinations(order, 2) if e[0] != f[0]]
        if outcomes(formula, tuple(words), Together(words, team, before)) == {True}:
            return True
    return False


@cache
def courses(robots: int, most: int, *, hovering: bool) -> list[tuple[float, list[Held]]]:
    """Words of robots that move one at a time through free flight, with their costs, the cheapest first.

    Each move is to a region, or at last just out of one; `hovering`: or out of one while others go on.
    """
    names = tuple(small_world(robots, "joint", WIDE).agents)
    starts = {name: agent.start[:2] for name, agent in small_world(robots, "joint", WIDE).agents.items()}
    found: list[tuple[float, list[Held]]] = []

    def go(at: dict[str, str], word: list[Held], cost: float, left: int) -> None:
        found.append((cost, word))
        held = word[-1]
        for name in names:
            out = [*word, {**held, name: frozenset()}] if held[name] else word
            if held[name]:
                found.append((cost, out))
                if hovering:
                    go(at, out, cost, left)
            for place in PLACES if left else ():
                here = PLACES[at[name]] if name in at else starts[name]
                step = 2 * WIDE if at.get(name) == place else math.dist(here, PLACES[place])
                go({**at, name: place}, [*out, {**held, name: frozenset({place})}], cost + step, left - 1)

    go({}, [dict.fromkeys(names, frozenset())], 0.0, most)
    return sorted(found, key=lambda pair: pair[0])


def counts_agree(rng: Random) -> bool | None:
    robots = rng.choice([1, 2, 2, 3])
    most = 4 if robots < 3 else 3
    mission = small_world(robots, "joint", WIDE)
    formula = random_counting_formula(rng, rng.randint(1, 7), tuple(mission.agents))
    vectors = Vectors(formula, tuple(mission.agents))

    def cheapest(*, hovering: bool) -> float | None:
        found = courses(robots, most, hovering=hovering)
        return next((cost for cost, word in found if vectors.is_true(worth(word, vectors))), None)

    best = cheapest(hovering=False)
    try:
        plan = planned(mission, formula)
    except TooLarge:
        return None
    except BadInput as refusal:
        if "hovers outside all regions" not in str(refusal):
            raise
        return None
    case = str(formula), robots, best
    if isinstance(plan, NoPlan):
        assert best is None, case
        return False
    _is_cheapest(plan, best, short=False, case=case)
    short = plan.complete and sum(len(robot.visits) for robot in plan.robots.values()) <= most
    if short and (best is None or plan.cost < best - CLOSE):  # several leave at the end
        _is_cheapest(plan, cheapest(hovering=True), short=True, case=case)
    return True


@pytest.mark.parametrize(("seed", "number"), [(1, 12), *(pytest.param(s, 1500, marks=pytest.mark.slow) for s in (2, 3))])
def test_words_that_hold_in_every_order(seed: int, number: int) -> None:
    rng = Random(seed)
    assert {words_agree(rng) for _ in range(number)} == {True, False}


@pytest.mark.parametrize(("seed", "number"), [(1, 12), *(pytest.param(s, 1500, marks=pytest.mark.slow) for s in (2, 3))])
def test_words_that_hold_under_precedences(seed: int, number: int) -> None:
    rng = Random(seed)
    assert {orders_agree(rng) for _ in range(number)} >= {False, None}


@pytest.mark.parametrize(("seed", "number"), [(1, 12), *(pytest.param(s, 1500, marks=pytest.mark.slow) for s in (2, 3))])
def test_plans_that_count(seed: int, number: int) -> None:
    rng = Random(seed)
    assert {counts_agree(rng) for _ in range(number)} >= {True, False}


def patrols_are_answered(rng: Random) -> bool | None:
    """Every formula for ever is planned or refused in words; one robot's word keeps it."""
    robots, team = rng.choice([1, 1, 2, 2, 3]), rng.choice(["own", "joint"])
    mission = small_world(robots, team, WIDE)
    names = tuple(mission.agents)
    counted = team == "joint" and rng.random() < 0.5
    formula = random_counting_formula(rng, rng.randint(1, 6), names) if counted else asked(rng, 7)
    spec = mission.spec.model_copy(update={"formula": str(formula), "trace": "infinite"})
    try:
        plan = assign(mission.model_copy(update={"spec": spec}), budget=Budget(states=20_000))
    except NoPlan:
        return False
    except (BadInput, Infeasible):
        return None
    if robots == 1:
        word = plan.robots["quad0"].word
        held = [[{"quad0": letter} for letter in part] for part in (word.prefix, word.cycle or ())]
        assert for_ever(formula, names, *held), (str(formula), word)
    return True


@pytest.mark.parametrize(("seed", "number"), [(1, 12), *(pytest.param(s, 600, marks=pytest.mark.slow) for s in (2, 3))])
def test_patrols(seed: int, number: int) -> None:
    rng = Random(seed)
    assert {patrols_are_answered(rng) for _ in range(number)} >= {True, False}


@pytest.mark.parametrize(("formula", "robots"), [("F (quad1.a -> count(b) > 3) -> b", 2), ("quad1.b & G F quad2.a", 3)])
def test_a_patrol_that_cannot_be_and_names_a_robot_is_refused_in_words(formula: str, robots: int) -> None:
    mission = small_world(robots, "joint", WIDE)
    spec = mission.spec.model_copy(update={"formula": formula, "trace": "infinite"})
    with pytest.raises(NoPlan, match="No plan satisfies the formula"):
        assign(mission.model_copy(update={"spec": spec}))


@pytest.mark.parametrize("radius", [WIDE, 0.2])  # in small regions, who leaves hovers outside, where nobody is in its way
def test_ending_outside_a_region_is_cheaper_than_flying_on(radius: float) -> None:
    plan = assign(small_world(2, "joint", radius).asking("F(count(a) >= 1 & F all(!a))"))
    assert [robot.visits[-1].region for robot in plan.robots.values() if robot.visits] == ["a"]
    assert plan.complete
    assert plan.cost == pytest.approx(math.dist(STARTS[0], PLACES["a"]))
