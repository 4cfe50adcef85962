"""Laws of plans: names and order of robots and places change no cost, and what is wished for more is not given up sooner."""

from __future__ import annotations

from functools import partial
from random import Random

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import ltlplan
from ltlplan.logic.budget import TooLarge
from ltlplan.replanning.soft_parts import kept_by_words
from ltlplan.search.exact import assign
from ltlplan.search.explanations.unsatisfiable_cores import NoPlan
from tests.helpers.few import few_of
from tests.helpers.missions.random_teams import random_formula
from tests.helpers.missions.worlds import STARTS, world
from tests.helpers.words.random_counts import random_counting_formula
from verify.data import BadInput, Formula, Mission, Unsatisfiable, parse_formula
from verify.testing import formulas

PLACES = {"a": (0.0, 0.0), "b": (3.0, 0.0)}
RADII = dict.fromkeys(PLACES, 0.9)
ROBOTS = ("quad0", "quad1")
laws = settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.too_slow])


def cost(mission: Mission) -> float | str | None:
    """Return what the exact method's plan costs; None where there is none, and why it is not planned."""
    try:
        return round(assign(mission, explained=False).cost, 6)
    except (NoPlan, Unsatisfiable):
        return None
    except (BadInput, TooLarge) as refusal:
        return type(refusal).__name__


@laws
@given(st.data(), st.sampled_from(["own", "joint"]))
def test_robots_and_places_may_change_their_names_and_order(data: st.DataObject, team: str) -> None:
    formula = data.draw(formulas(("a", "b"), robots=ROBOTS if team == "joint" else (), size=4))
    mission = world(str(formula), regions=PLACES, robots=2, team=team, radii=RADII)
    text = str(formula)
    for old, new in (("quad0.", "other."), ("quad1.", "quad0."), ("other.", "quad1.")):
        text = text.replace(old, new)
    swapped = world(text, regions=PLACES, robots=2, team=team, radii=RADII, starts=STARTS[1::-1])
    there = parse_formula(str(formula)).substitute({"a": _name("z"), "b": _name("y")})
    moved = {"y": PLACES["b"], "z": PLACES["a"]}
    elsewhere = world(str(there), regions=moved, robots=2, team=team, radii=dict.fromkeys(moved, 0.9))
    assert cost(mission) == cost(swapped) == cost(elsewhere)


def _name(name: str) -> Formula:
    return Formula("name", (), name)


@few_of(1, "formula", ["F PLACE", "G !b & F(PLACE)", "F(b & F PLACE)"])
@few_of(
    1,
    "same",
    [
        ("count(a) >= 2", "quad0.a & quad1.a", "all(a)", "!some(!a)"),
        ("some(a & !b)", "count(a & !b) >= 1", "quad0.a & !quad0.b | quad1.a & !quad1.b"),
        ("each(a)", "quad0.a & quad1.a"),
    ],
)
def test_counts_cost_what_they_cost_written_out(formula: str, same: tuple[str, ...]) -> None:
    found = {
        cost(world(formula.replace("PLACE", f"({text})"), regions=PLACES, robots=2, team="joint", radii=RADII)) for text in same
    }
    assert len(found) == 1, found


def wishing(formula: str, *soft: tuple[str, float]) -> Mission:
    mission = world(formula, regions=PLACES, radii=RADII)
    return mission.changed(spec={**mission.spec.model_dump(), "soft": [{"formula": f, "weight": w} for f, w in soft]})


WISHES = ("G !b", "F(b & F a)", "!a U b", "F b")


@few_of(1, ("hard", "raised"), [*(("!b U a", raised) for raised in range(4)), *(("F a", raised) for raised in range(4))])
def test_what_the_formula_implies_is_kept_and_more_weight_gives_up_no_more(hard: str, raised: int) -> None:
    weights = [1.0 + (3.5 if i == raised else 0.0) + i / 10 for i in range(len(WISHES))]
    mission = wishing(hard, *zip(WISHES, weights, strict=True), ("F(a | b)", 0.01))
    kept = kept_by_words(mission, ltlplan.plan(mission).words)
    assert len(WISHES) in kept, "the formula implies it"
    less = wishing(hard, *((f, 1.0 + i / 10) for i, f in enumerate(WISHES)), ("F(a | b)", 0.01))
    if raised in _kept(less):
        assert raised in kept


_KNOWN: dict[str, frozenset[int]] = {}


def _kept(mission: Mission) -> frozenset[int]:
    key = mission.digest()
    if key not in _KNOWN:
        _KNOWN[key] = frozenset(kept_by_words(mission, ltlplan.plan(mission).words))
    return _KNOWN[key]


def _unrelated(rng: Random, radius: float) -> dict[str, tuple[float, float]]:
    """Return a region of which no formula speaks: between the two places, where there is room, or beside them."""
    between = radius < 0.5 and rng.random() < 0.5
    return {"z": (1.5, round(rng.uniform(-0.3, 0.3), 2)) if between else rng.choice([(1.5, 1.9), (-1.0, 1.5), (4.5, 1.0)])}


@few_of(1, "first", range(60))
@pytest.mark.parametrize("kind", ["one", "own", "joint", "counts", "laps"])
def test_no_region_added_to_a_mission_makes_it_dearer(kind: str, first: int) -> None:
    for seed in range(first, 300, 60):
        assert_no_dearer_with_a_region(kind, seed)


def assert_no_dearer_with_a_region(kind: str, seed: int) -> None:
    rng = Random(seed)
    robots = {"one": 1, "laps": 1, "counts": rng.choice((2, 3))}.get(kind, 2)
    if kind == "counts":
        formula = str(random_counting_formula(rng, rng.randint(3, 8), tuple(f"quad{i}" for i in range(robots))))
    else:
        formula = str(random_formula(rng, rng.randint(3, 10))).replace("water", "a").replace("c", "b")
    radius = rng.choice((0.3, 0.9))
    made = partial(
        world, formula, robots=robots, team="joint" if kind in ("joint", "counts") else "own",
        trace="infinite" if kind == "laps" else "finite",
    )  # fmt: skip
    radii = dict.fromkeys(PLACES, radius)
    more = _unrelated(rng, radius)
    found, beside = cost(made(regions=PLACES, radii=radii)), cost(made(regions=PLACES | more, radii=radii | {"z": 0.25}))
    assert beside == found, seed
