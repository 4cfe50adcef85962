"""Of a thousand regions a formula speaks of a few: plans are the same as with those alone, and no stage looks at all pairs."""

from __future__ import annotations

import itertools
import time

import numpy as np
import pytest

import ltlplan
import refine
import verify
from ltlplan import parse_mission
from ltlplan.logic.budget import TooLarge
from ltlplan.search.exact import assign
from ltlplan.search.relevant_places import places_that_matter
from ltlplan.systems.region_labels import Layout, apart
from tests.helpers.few import few_of
from verify.data import Mission
from verify.motion.regions import Ellipsoid, are_disjoint, relations


def field(count: int, formula: str, *, only: tuple[str, ...] = (), more: str = "") -> Mission:
    """Regions on a square grid, 1 m apart; with `only`, those alone."""
    side = int(np.ceil(count**0.5))
    places = {f"r{i}": (i % side, i // side) for i in range(count)}
    regions = "".join(
        f"  {name}: {{center: [{x}, {y}, 1.0], radii: [0.2, 0.2, 0.2]}}\n"
        for name, (x, y) in places.items()
        if not only or name in only
    )
    return parse_mission(f"""
format: 1
name: field
spec: {{formula: "{formula}"}}
regions:
{regions}{more}
agents: {{q: {{start: [-0.5, -0.5, 1.0]}}, r: {{start: [1.5, 2.5, 1.0]}}}}
vehicle: crazyflie-2.1
workspace: {{min: [-2, -2, 0.2], max: [{side + 1}, {side + 1}, 2]}}
""")


@few_of(
    1,
    ("formula", "named"),
    [
        ("F r1 & F r7 & (!r7 U r20)", ("r1", "r7", "r20")),
        ("F(r1 & F(free & F r1)) & G(r5 -> free)", ("r1", "r5")),
        ("(!r14 U r1) & F r14 & G !r2", ("r1", "r2", "r14")),
    ],
)
def test_words_and_costs_are_those_of_the_named_regions_alone(formula: str, named: tuple[str, ...]) -> None:
    many, few = field(200, formula), field(200, formula, only=named)
    assert places_that_matter(many, Layout(many)) == frozenset(named)
    assert places_that_matter(few, Layout(few)) is None
    found, wanted = assign(many), assign(few)
    assert found.cost == pytest.approx(wanted.cost)
    assert {name: robot.word for name, robot in found.robots.items()} == {
        name: robot.word for name, robot in wanted.robots.items()
    }


@few_of(
    1,
    ("formula", "named"),
    [
        ("F(count(free) <= 1 & r1)", None),
        ("F(count(free) == 1 & r1)", None),
        ("F !(count(free) > 1)", None),
        ("F(count(free) >= 1 & r1)", {"r1"}),
        ("F r1 & !(count(free) < 1)", {"r1"}),
    ],
)
def test_where_few_may_be_free_any_region_makes_a_difference(formula: str, named: set[str] | None) -> None:
    many = field(160, "true")
    many = many.model_copy(update={"spec": many.spec.model_copy(update={"formula": formula, "team": "joint"})})
    assert places_that_matter(many, Layout(many)) == named


def test_regions_that_can_make_a_difference_are_kept() -> None:
    gains = field(60, "F(!free & !r1)")  # any region but r1 does: the nearest one to a robot
    assert places_that_matter(gains, Layout(gains)) is None
    assert sum(len(robot.visits) for robot in assign(gains).robots.values()) == 1
    overlapping = field(200, "F r1", more="  wide: {center: [1.3, 0.1, 1.0], radii: [0.3, 0.3, 0.3]}")
    assert places_that_matter(overlapping, Layout(overlapping)) == {"r1", "wide"}
    assert (
        places_that_matter(
            overlapping.model_copy(update={"spec": overlapping.spec.model_copy(update={"formula": None})}), Layout(overlapping)
        )
        is None
    )


def test_pairs_that_are_told_apart_at_a_glance_are_apart() -> None:
    rng = np.random.default_rng(2)
    text = "".join(
        f"  x{i}: {{center: {c.round(3).tolist()}, radii: {r.round(3).tolist()}, yaw_deg: {yaw:.0f}}}\n"
        for i, (c, r, yaw) in enumerate(
            zip(
                rng.uniform([-1.9, -1.9, 0.3], [1.9, 1.9, 1.9], (30, 3)),
                rng.uniform(0.03, 0.5, (30, 3)),
                rng.uniform(0, 90, 30),
                strict=True,
            )
        )
    )
    mission = field(9, "F r1", only=("r1",), more=text)
    mission = mission.model_copy(update={"regions": {n: r for n, r in mission.regions.items() if n != "r1"}})
    proved, neighbours = relations(mission).disjoint, Layout(mission).neighbours
    for a, b in itertools.combinations(sorted(mission.regions), 2):
        one, other = mission.regions[a], mission.regions[b]
        assert ((a, b) in proved) == are_disjoint(Ellipsoid.of(one), Ellipsoid.of(other))
        assert (b not in neighbours[a]) == apart(one, other)


@pytest.mark.slow
def test_a_thousand_regions_do_not_take_long() -> None:
    """Compared with a tenth of them: no more than time in proportion, and some (all pairs of them would be a hundred times)."""
    seconds = []
    for count in (100, 1000):
        started = time.process_time()
        plan = ltlplan.plan(field(count, "F(r1 & F(free & F r1)) & F r7"), seed=0)
        team = refine.refine(plan)
        assert verify.judge(plan, team, largest=False).holds
        seconds.append(time.process_time() - started)
    assert seconds[1] < 25 * seconds[0]


@pytest.mark.slow
def test_a_formula_that_speaks_of_too_many_regions_is_refused_in_words() -> None:
    mission = field(401, "F(!free & !r1)")
    alone = mission.model_copy(update={"agents": {"q": mission.agents["q"]}})  # robots' systems are made before it is known
    with pytest.raises(TooLarge, match=r"more than 400 regions and propositions.*`!free` speaks of all"):
        assign(alone)
