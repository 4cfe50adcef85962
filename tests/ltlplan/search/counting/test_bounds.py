"""Lower bounds of the search over counts: held against the least costs of all states of small random teams."""

from __future__ import annotations

import heapq
from random import Random

import pytest

from ltlplan.logic.conjunction import conjunct_automata
from ltlplan.search.bounds import own_progress
from ltlplan.search.bounds.goal_cover import CountedLandmarks, GoalCover
from ltlplan.search.counting.classes import Classes, ClassMove
from ltlplan.search.counting.counting_propositions import Marks
from ltlplan.search.counting.planning import CourseSearch
from tests.helpers.few import few_of
from tests.helpers.words.random_counts import random_counting_formula
from verify.data import parse_formula
from verify.data.language.counting import atoms, written_out

NAMES = ("quad0", "quad1", "quad2")
SLACK = 1e-6


def random_team(rng: Random, formula, robots: int) -> Classes:
    """Return some classes of places in which robots show whatever a formula may see, and moves between them."""
    asked = written_out(formula, NAMES[:robots])
    marks = Marks(conjunct_automata(asked, "finite"), atoms(asked))
    letters = [marks.of(who, frozenset(n for n in "ab" if rng.random() < 0.5)) for who in NAMES[:robots] for _ in range(3)]
    count = rng.randint(2, 4)
    resting = [rng.choice(letters) for _ in range(count)]
    moves = [
        [
            ClassMove(place, to, (*rng.choices(letters, k=rng.randint(0, 2)), resting[to]), rng.choice((0.5, 1.0, 2.5)), key)
            for key in range(rng.randint(1, 3))
            for to in [rng.randrange(count)]
        ]
        for place in range(count)
    ]
    begin = [0] * count
    for _ in range(robots):
        begin[rng.randrange(count)] += 1
    ends = [rng.random() < 0.8 for _ in range(count)]
    return Classes(marks, tuple(resting), tuple(ends), tuple(map(tuple, moves)), tuple(begin), ("",) * count)


def random_named_team(rng: Random, formula, robots: int) -> Classes:
    """Return classes of places of which each robot has some that nobody else comes to."""
    asked = written_out(formula, NAMES[:robots])
    marks = Marks(conjunct_automata(asked, "finite"), atoms(asked))
    resting, moves, begin, owners = [], [], [], []
    for who in NAMES[:robots]:
        first, count = len(resting), rng.randint(2, 3)
        letters = [marks.of(who, frozenset(n for n in "ab" if rng.random() < 0.5)) for _ in range(3)]
        resting += [rng.choice(letters) for _ in range(count)]
        for place in range(first, first + count):
            ways = [(to, (*rng.choices(letters, k=rng.randint(0, 2)), resting[to])) for to in range(first, first + count)]
            moves.append([ClassMove(place, to, way, rng.choice((0.5, 1.0, 2.5)), to) for to, way in ways])
        begin += [1, *(0 for _ in range(1, count))]
        owners += [who if who in marks.named else ""] * count
    ends = [rng.random() < 0.8 for _ in resting]
    return Classes(marks, tuple(resting), tuple(ends), tuple(map(tuple, moves)), tuple(begin), tuple(owners))


def least_costs(classes: Classes):
    """Return what is left from each state that can be reached, by a search backwards without any bound."""
    marks, first = classes.marks, (classes.marks.read(classes.marks.initial, classes.sums(classes.begin)), classes.begin)
    if first[0] is None:
        return {}
    back: dict[object, list[tuple[object, float]]] = {}
    order, known = [first], {first}
    for states, numbers in order:
        for place, moves in enumerate(classes.moves):
            for move in moves if numbers[place] else ():
                others = list(numbers)
                others[place] -= 1
                held, after = classes.sums(tuple(others)), states
                for own in move.marks:
                    after = None if after is None else marks.read(after, tuple(h + o for h, o in zip(held, own, strict=True)))
                if after is None:
                    continue
                others[move.target] += 1
                target = after, tuple(others)
                back.setdefault(target, []).append(((states, numbers), move.cost))
                if target not in known:
                    known.add(target)
                    order.append(target)
    ended = [(s, n) for s, n in order if marks.accepting(s) and all(e or not c for e, c in zip(classes.ends, n, strict=True))]
    left = dict.fromkeys(order, float("inf")) | dict.fromkeys(ended, 0.0)
    heap = [(0.0, number, key) for number, key in enumerate(ended)]
    while heap:
        cost, _, key = heapq.heappop(heap)
        for before, step in back.get(key, ()) if cost <= left[key] else ():
            if cost + step < left[before]:
                left[before] = cost + step
                heapq.heappush(heap, (cost + step, len(heap) + len(order), before))
    return left


def check(rng: Random) -> float:
    """Hold all bounds of a random team against the costs, and the search against the least; return that."""
    robots = rng.randint(1, 3)
    made = rng.choice((random_team, random_named_team))
    classes = made(rng, random_counting_formula(rng, rng.randint(1, 7), NAMES[:robots]), robots)
    left = least_costs(classes)
    cover = GoalCover(classes)
    for (states, numbers), cost in left.items():
        sums = classes.sums(numbers)
        assert cover(states, sums, numbers) <= cost + SLACK
    least = next(iter(left.values()), float("inf"))
    found = CourseSearch(classes).cheapest(100_000)
    assert (found.course is None) == (least == float("inf"))
    assert CourseSearch(classes).may_exist(100_000) == (found.course is not None)
    assert found.course is None or CourseSearch(classes).may_exist(1), "what is not known is possible"
    if found.course is not None:
        assert found.course.cost == pytest.approx(least)
        assert found.bound == found.course.cost
    return least


@few_of(1, "count", [48, 120])
def test_no_bound_exceeds_what_is_left(count: int):
    rng = Random(11)
    costs = [check(rng) for _ in range(count)]
    assert count / 6 < sum(0 < cost < float("inf") for cost in costs) < count * 11 / 12


@pytest.mark.slow
def test_no_bound_of_many_teams_exceeds_what_is_left():
    rng = Random(12)
    for _ in range(5_000):
        check(rng)


def test_bounds_hold_where_robots_have_more_positions_than_are_told_apart(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(own_progress, "MOST_POSITIONS", 3)
    rng = Random(15)
    assert sum(0 < check(rng) < float("inf") for _ in range(60)) > 5


def least_dearest(classes: Classes, begin: list[int], most: float) -> float:
    """Return what the dearest robot pays at the least, by a search without any bound; infinite where it is more than `most`."""
    first = classes.marks.read(classes.marks.initial, classes.sums(classes.begin))
    heap = [] if first is None else [(0.0, first, tuple((place, 0.0) for place in begin))]
    seen = set()
    while heap:
        dearest, states, team = heapq.heappop(heap)
        if (states, tuple(sorted(team))) in seen:
            continue
        seen.add((states, tuple(sorted(team))))
        if classes.marks.accepting(states) and all(classes.ends[place] for place, _ in team):
            return dearest
        for robot, (place, paid) in enumerate(team):
            others = [at for other, (at, _) in enumerate(team) if other != robot]
            held = classes.sums(tuple(others.count(at) for at in range(len(classes.moves))))
            for move in classes.moves[place]:
                after = states
                for own in move.marks:
                    after = (
                        None
                        if after is None
                        else classes.marks.read(after, tuple(h + o for h, o in zip(held, own, strict=True)))
                    )
                if after is not None and paid + move.cost <= most:
                    further = (*team[:robot], (move.target, paid + move.cost), *team[robot + 1 :])
                    heapq.heappush(heap, (max(dearest, paid + move.cost), after, further))
    return float("inf")


def check_dearest(rng: Random) -> bool:
    """Hold the search for the cheapest dearest robot of a random team against one without bounds."""
    made = rng.choice((random_team, random_named_team))
    classes = made(rng, random_counting_formula(rng, rng.randint(1, 6), NAMES[:2]), 2)
    begin = [place for place, count in enumerate(classes.begin) for _ in range(count)]
    found = CourseSearch(classes).least_highest(tuple(begin), 6.0, 100_000)
    least = least_dearest(classes, begin, 5.5)
    assert found.bound == pytest.approx(min(least, 6.0))
    assert (found.course is None) == (least > 5.5)
    if found.course is None:
        return False
    paid = [0.0, 0.0]
    for robot, move in zip(found.course.robots, found.course.moves, strict=True):
        assert begin[robot] == move.source
        begin[robot] = move.target
        paid[robot] += move.cost
    assert max(paid) == found.course.cost == pytest.approx(least)
    return least > 0.0


def test_the_dearest_robot_costs_as_little_as_possible():
    rng = Random(13)
    assert sum(check_dearest(rng) for _ in range(120)) > 15


@pytest.mark.slow
def test_the_dearest_of_many_teams_costs_as_little_as_possible():
    rng = Random(14)
    assert sum(check_dearest(rng) for _ in range(4_000)) > 500


def two_places(formula: str, robots: int) -> Classes:
    """Return robots at a start from which `a` is 3 away, `b` 4, and each from the other 2."""
    asked = written_out(parse_formula(formula), NAMES[:robots])
    marks = Marks(conjunct_automata(asked, "finite"), atoms(asked))
    shown = [marks.of("", frozenset(names)) for names in ("", "a", "b")]
    ways = {(0, 1): 3.0, (0, 2): 4.0, (1, 2): 2.0, (2, 1): 2.0}
    moves = [tuple(ClassMove(a, b, (shown[b],), cost, b) for (a, b), cost in ways.items() if a == at) for at in range(3)]
    return Classes(marks, tuple(shown), (True,) * 3, tuple(moves), (robots, 0, 0), ("",) * 3)


@pytest.mark.parametrize(
    ("formula", "robots", "cost"),
    [
        ("F(count(a) >= 1) & F(count(b) >= 1)", 3, 5.0),  # one goes to both
        ("F(count(a) >= 2) & F(count(b) >= 1)", 3, 8.0),  # two to a, and one of them on
        ("F(count(a) >= 3) & F(count(b) >= 2)", 3, 13.0),
        ("F(count(!(a | b)) <= 1)", 3, 6.0),
    ],
)
def test_the_cover_says_how_robots_share_goals(formula: str, robots: int, cost: float):
    classes = two_places(formula, robots)
    sums = classes.sums(classes.begin)
    states = classes.marks.read(classes.marks.initial, sums)
    assert states is not None
    assert GoalCover(classes)(states, sums, classes.begin) == pytest.approx(cost, abs=1e-5)
    assert CourseSearch(classes).cheapest(1_000).course.cost == cost


def test_landmarks_say_of_how_many_robots_more_something_is_needed():
    classes = two_places("F(count(a) >= 2) & F all(b)", 3)
    landmarks = CountedLandmarks(classes.marks)
    sums = classes.sums((1, 1, 1))
    states = classes.marks.read(classes.marks.initial, sums)
    assert states is not None
    missing = dict(zip(landmarks.goals, landmarks(states, sums), strict=True))
    assert sorted((goal.made, more) for goal, more in missing.items()) == [(False, 2), (True, 1)]
