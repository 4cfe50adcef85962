"""Actions in plans with counts: only those that the formula asks for are made."""

from __future__ import annotations

import pytest

from ltlplan.search.exact import assign
from tests.helpers.few import few_of
from tests.helpers.missions.worlds import world

PLACES = {"a": (-1.7, 0.7), "b": (1.7, 0.7), "home": (0.0, -1.5)}
RADII = dict.fromkeys(PLACES, 0.6)
TOOL = """robot:
  initial: empty
  states: {empty: [], loaded: [tool]}
  actions: [{from: empty, to: loaded, at: home}, {from: loaded, to: empty, at: b}]
"""


def places_of_actions(formula: str, *, robots: int) -> list[str]:
    """Return the regions in which robots act in a plan."""
    found = assign(world(formula, robots=robots, regions=PLACES, radii=RADII, team="joint", extra=TOOL))
    assert found.lower_bound is not None
    assert found.lower_bound <= found.cost
    return [action.at for robot in found.robots.values() for visit in robot.visits for action in visit.actions]


@pytest.mark.parametrize("robots", [2, 3])
@few_of(
    1,
    "formula",
    ["F all(home) & F(count(a) == 2)", "F(count(home) >= 2 & F(count(b) == 2))", "F all(b) & F(count(home) == 2 & F quad0.a)"],
)
def test_nobody_acts_where_nothing_asks_for_it(formula, robots):
    assert places_of_actions(formula, robots=robots) == []


@pytest.mark.parametrize(
    ("formula", "places"), [("F(count(tool) == 1 & F(count(a) == 2))", ["home"]), ("F all(tool)", ["home", "home"])]
)
def test_as_many_act_as_must(formula, places):
    assert places_of_actions(formula, robots=2) == places
