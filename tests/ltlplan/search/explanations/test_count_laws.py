"""Counts that contradict each other are named, and said of teams of any size only where that is true; judged by brute force over teams."""

from __future__ import annotations

import itertools
import random

import pytest

from ltlplan import parse_mission
from ltlplan.logic.conjunction import conjuncts
from ltlplan.search.exact import assign
from ltlplan.search.explanations.count_laws import laws_of_counts, laws_of_turns, no_word, propositions_of
from ltlplan.search.explanations.unsatisfiable_cores import NoPlan
from verify.data import Formula, Mission, Word
from verify.data.language.counting import atoms, written_out
from verify.logic.semantics import satisfies

_WAITING = "each waits"
_ANY = "No team of any size can do this"


def mission(formula: str, robots: int = 2, *, trace: str = "finite") -> Mission:
    """Robots that start outside two regions that lie apart."""
    agents = ", ".join(f"{name}: {{start: [{0.6 * i - 0.6}, -0.9, 1]}}" for i, name in enumerate("abc"[:robots]))
    return parse_mission(f"""
format: 1
name: counts
spec: {{formula: "{formula}", team: joint, trace: {trace}}}
regions: {{left: {{center: [-1, 0.4, 1], size: [0.6, 0.6, 0.4]}}, right: {{center: [1, 0.4, 1], size: [0.6, 0.6, 0.4]}}}}
agents: {{{agents}}}
vehicle: crazyflie-2.1
workspace: {{min: [-1.6, -1.3, 0.2], max: [1.6, 1.3, 1.8]}}
""")


@pytest.mark.parametrize(
    ("formula", "robots", "core", "says"),
    [
        ("G(count(right) >= 1) & G(count(right) <= 0)", 2, ("G count(right) >= 1", "G count(right) <= 0"), _ANY),
        ("F left & F(count(right) >= 2) & G(count(right) <= 1)", 3, ("F count(right) >= 2", "G count(right) <= 1"), _ANY),
        ("F(count(right) >= 2 & count(right) <= 1)", 2, ("F (count(right) >= 2 & count(right) <= 1)",), _ANY),
        ("F(count(right & !left) >= 2) & G(count(right) <= 1)", 3, ("F count(right & !left) >= 2", "G count(right) <= 1"), _ANY),
        ("F(a.right & b.right) & G(count(right) <= 1)", 3, ("F (a.right & b.right)", "G count(right) <= 1"), _ANY),
        ("F all(right) & G !some(right)", 2, ("F all(right)", "G !some(right)"), _ANY),
        ("F all(right) & G(count(right) <= 1)", 2, ("F all(right)", "G count(right) <= 1"), "Whatever the 2 robots do"),
        ("ever(right) >= 1 & G !right", 2, ("ever(right) >= 1", "G !right"), "Whatever the 2 robots do"),
        ("F(count(right) >= 3)", 2, ("F count(right) >= 3",), "more robots than the mission has: 2."),
        ("F(count(right) >= 2)", 1, ("F count(right) >= 2",), "more robots than the mission has: 1."),
        ("F(count(left) >= 2 & count(right) >= 1)", 2, ("F (count(left) >= 2 & count(right) >= 1)",), "left and right lie apart"),
        ("G(count(right) >= 1)", 2, ("G count(right) >= 1",), "At the start no robot is inside right."),
        ("F left & G a.right", 2, ("G a.right",), "At the start a is not inside right."),
        ("F a.left & G(a.left <-> b.left)", 2, ("F a.left", "G (a.left <-> b.left)"), "`a.left` and `b.left` to change together"),
        ("F a.left & G(a.left <-> b.right)", 3, ("F a.left", "G (a.left <-> b.right)"), "such as `G (a.left -> F b.right)`"),
        ("F(count(left) >= 2) & G !(count(left) == 1)", 3, ("F count(left) >= 2", "G !(count(left) == 1)"), "at the very same instant"),
    ],
)  # fmt: skip
def test_parts_that_contradict_each_other_are_named(formula: str, robots: int, core: tuple[str, ...], says: str) -> None:
    with pytest.raises(NoPlan, match="No plan satisfies") as caught:
        assign(mission(formula, robots))
    assert caught.value.core == core
    assert says in str(caught.value)
    assert _WAITING not in str(caught.value)
    assert (_ANY in str(caught.value)) == (says == _ANY)


@pytest.mark.parametrize(
    ("formula", "says"),
    [
        ("G F(count(right) >= 3) & F G(count(right) <= 1)", _ANY),
        ("G F a.right & F G(count(right) <= 0)", _ANY),
        ("G F(count(right) >= 4)", "more robots than the mission has: 3."),
    ],
)
def test_counts_contradict_each_other_for_ever_too(formula: str, says: str) -> None:
    with pytest.raises(NoPlan, match=says):
        assign(mission(formula, 3, trace="infinite"))


def test_what_one_robot_cannot_do_and_two_can_is_not_said_of_any_team() -> None:
    formula = "F all(right) & F(!all(right) & right)"
    with pytest.raises(NoPlan, match="Whatever the robot does"):
        assign(mission(formula, 1))
    assert assign(mission(formula, 2)).robots


@pytest.mark.parametrize("seed", range(6))
def test_robots_that_move_one_after_another_keep_the_laws_of_turns(seed: int) -> None:
    """Every law holds of random words in which one robot's letter changes at a time; where two change at once some law is broken."""
    rng = random.Random(seed)
    parts = conjuncts(mission("F a.left & F b.right & F(count(left) >= 3) & F(count(left) >= 2) & F left", 3).formula)
    laws = [law for _, law in laws_of_turns(parts)]
    assert len(laws) == 4
    letters = [frozenset(some) for k in range(3) for some in itertools.combinations(("left", "right"), k)]
    team = tuple(rng.choice(letters) for _ in range(3))
    word = [team]
    for _ in range(12):
        mover = rng.randrange(3)
        team = tuple(rng.choice(letters) if k == mover else letter for k, letter in enumerate(team))
        word.append(team)
    known = propositions_of(parts)
    shown = [[atom.text for atom in known if holds(atom.formula, at)] for at in word]
    for law in laws:
        assert satisfies(law, Word.of(shown))
        assert not satisfies(law, Word.of([[], [atom.text for atom in known]]))


_PARTS = ("right", "left", "some(right)", "all(left)", "a.right", "!b.left", *(f"count({what}) {sign} {k}" for what in ("right", "!right", "left & !right") for sign in (">=", "<=") for k in (0, 1, 2)))  # fmt: skip


def holds(formula: Formula, team: tuple[frozenset[str], ...]) -> bool:
    """Tell whether a team's letters satisfy a formula without times, by its meaning."""
    match formula.operator:
        case "name":
            shown = [letter for name, letter in zip("abcd", team, strict=False) if formula.robot in ("", name)]
            return any(formula.name in letter for letter in shown)
        case "count":
            assert formula.bound is not None
            return sum(holds(formula.arguments[0], (letter,)) for letter in team) >= formula.bound[1]
        case "!":
            return not holds(formula.arguments[0], team)
        case "&" | "|" as operator:
            return (all if operator == "&" else any)(holds(part, team) for part in formula.arguments)
        case _:
            return formula.operator == "true"


def teams(robots: int) -> list[tuple[frozenset[str], ...]]:
    """Return all letters of a team."""
    letters = [frozenset(some) for k in range(3) for some in itertools.combinations(("left", "right"), k)]
    return list(itertools.product(letters, repeat=robots))


@pytest.mark.parametrize("seed", range(12))
def test_laws_hold_of_every_team_and_contradictions_are_brute_forces(seed: int) -> None:
    draw, robots = random.Random(seed), 2 + seed % 2
    asked = " & ".join(draw.sample(_PARTS, 3))
    made = mission(f"F({asked})", robots)
    inner = written_out(made.written.arguments[0], tuple("abc"[:robots]))
    for law in laws_of_counts(conjuncts(inner), robots):
        assert all(holds(law.arguments[0], team) for team in teams(robots)), str(law)
    assert all(atom.least <= robots for atom in atoms(inner).values())
    possible = any(holds(inner, team) for team in teams(robots))
    said = no_word(made, [Formula("F", (inner,))])
    assert not (said and possible), asked
    if _ANY in said:
        larger = [written_out(made.written.arguments[0], tuple("abcd"[:n])) for n in (2, 3, 4)]
        assert not any(holds(each, team) for n, each in zip((2, 3, 4), larger, strict=True) for team in teams(n)), asked
