"""Other words for a soft part that a flight does not keep: of one robot, of laps, and which legs they do without."""

from __future__ import annotations

import pytest

import ltlplan
from ltlplan.allocation import PlanningMethod
from ltlplan.pipeline import certified_team
from ltlplan.replanning.checked_plan import legs_of
from ltlplan.replanning.soft_alternatives import asked_again, words_without
from tests.helpers.missions.worlds import PLACES, world
from verify.data import Mission, Plan
from verify.data.witness import Witness

ONCE = "F c & G(c -> (c U G !c))"  # at the edge a robot may dither within its margin
NEAR_C = {**PLACES, "c": (2.0, 0.8), "d": (-4.0, 4.0)}


def wishing(formula: str, soft: str, *, robots: int = 1, near: bool = False, **more: str) -> Mission:
    """Return a mission with one soft part."""
    plain = world(formula, robots=robots, regions=NEAR_C if near else PLACES, **more)  # type: ignore[arg-type]
    return plain.changed(spec={**plain.spec.model_dump(), "soft": [{"formula": soft, "weight": 2.0}]})


def visited(made: Plan) -> set[str]:
    return {visit.region for does in made.robots.values() for visit in does.visits}


@pytest.mark.slow
@pytest.mark.parametrize(
    "mission",
    [
        wishing("F b", f"({ONCE}) | F d"),
        wishing("G F b", f"({ONCE}) & F a | F G !c & G F d", trace="infinite"),
        wishing("G F a & G F b", f"({ONCE}) | F d", robots=2, near=True, trace="infinite", team="joint"),
    ],
    ids=["one robot", "its laps", "a team's laps"],
)
def test_other_words_keep_a_soft_part_that_the_cheapest_cannot(mission: Mission) -> None:
    made = ltlplan.plan(mission)
    assert "c" in visited(made)
    done = certified_team(made)
    assert [part.outcome for part in done.certificate.soft] == ["holds"]
    assert "d" in visited(done.plan) - visited(made)
    assert done.plan.cost > made.cost
    assert done.plan.mission == made.mission
    assert done.plan.notes[-2:] == (
        "Planned words keep weight 2 of 2 of the soft parts.",
        "Cheaper words that keep these soft parts were given up for others, as no flight of theirs that was tried keeps them.",
    )


def test_other_words_do_without_a_leg() -> None:
    made = ltlplan.plan(wishing("F b", "F a"))
    parts = next(asked_again(made, ()))
    found = words_without(made, parts, frozenset())
    assert found is not None
    assert found.solution.words != made.words
    assert found.space & legs_of(made, "quad0")
    assert not found.space & legs_of(found.solution, "quad0")
    assert visited(found.solution) >= {"a", "b"}


def test_other_words_keep_out_of_what_is_entered_again(monkeypatch: pytest.MonkeyPatch) -> None:
    made = ltlplan.plan(wishing("F b", "F c | F d"))
    again = tuple(("quad0", frozenset(letter)) for letter in ("", "c", "", "c", ""))
    assert "c" in visited(made)
    seen: list[Plan] = []

    def planned(asked: Mission, *, method: PlanningMethod, known: object) -> Plan:
        del known
        seen.append(ltlplan.plan(asked, method=method))
        return seen[-1]

    monkeypatch.setattr("ltlplan.replanning.checked_plan.plan_or_none", planned)
    found = words_without(made, {0}, frozenset(), [Witness(claim="formula", sentence="", word=again)])  # type: ignore[arg-type]
    assert found is not None
    assert len(seen) == 1
    assert visited(found.solution) == {"b", "d"}


def test_there_are_no_other_words_where_each_needs_the_leg() -> None:
    plain = world("F b", regions={"b": (2.0, 0.0)})
    made = ltlplan.plan(plain.changed(spec={**plain.spec.model_dump(), "soft": [{"formula": "F G b"}]}))
    assert list(asked_again(made, {0})) == []
    assert words_without(made, {0}, frozenset()) is None
